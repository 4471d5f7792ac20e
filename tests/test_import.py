"""The front door: what `import vibrokit` costs and what it offers."""

import ast
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import vibrokit

HEAVY = {"numpy", "sympy", "numba", "scipy", "matplotlib", "xarray"}


def loaded_heavy(statement: str) -> set[str]:
    """Heavy packages that a fresh Python has imported after a statement."""
    code = f"import sys\n{statement}\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return HEAVY & set(process.stdout.splitlines()[-1].split())


def test_import_loads_nothing_heavy():
    assert loaded_heavy("import vibrokit") == set()


def test_help_loads_nothing_heavy():
    help_only = "import vibrokit.cli\ntry:\n    vibrokit.cli.main(['--help'])\nexcept SystemExit:\n    pass"
    assert loaded_heavy(help_only) == set()


def test_results_and_plots_open_without_numba():
    assert "numba" not in loaded_heavy("import vibrokit\nvibrokit.load_result, vibrokit.Transitions")


@pytest.mark.parametrize("name", vibrokit.__all__)
def test_public_name_resolves(name):
    assert getattr(vibrokit, name) is not None
    assert name in dir(vibrokit)


@pytest.mark.parametrize("name", ["errors", "testing"])
def test_public_module_resolves(name):
    assert inspect.ismodule(getattr(vibrokit, name))


def test_type_checkers_see_what_exists():
    """The stub has the public names, from where they are at run time."""
    stub = ast.parse(Path(vibrokit.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom) and node.module != "typing"]
    assert sorted(alias.asname for node in imports for alias in node.names) == sorted(vibrokit.__all__)
    for node in imports:
        for alias in node.names:
            assert getattr(importlib.import_module(node.module), alias.name) is getattr(vibrokit, alias.asname)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"no attribute 'Hert'.*Hertz"):
        _ = vibrokit.Hert
