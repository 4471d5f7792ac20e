"""The front door: what `import vibrokit` costs and what it offers."""

import inspect
import subprocess
import sys

import pytest

import vibrokit

HEAVY = {"numpy", "sympy", "numba", "scipy", "matplotlib", "xarray", "pint"}


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
    names = "load_result", "Transitions", "occupancies", "StationaryDensity", "reconcile", "Reconciliation"
    heavy = loaded_heavy("\n".join(["import vibrokit", *(f"vibrokit.{name}" for name in names)]))
    assert not {"numba", "sympy", "matplotlib"} & heavy


def test_public_names_resolve():
    assert len(vibrokit.__all__) >= 66
    assert "Hertz" in vibrokit.__all__
    for name in vibrokit.__all__:
        assert getattr(vibrokit, name) is not None
        assert name in dir(vibrokit)


@pytest.mark.parametrize("name", ["errors", "testing"])
def test_public_module_resolves(name):
    assert inspect.ismodule(getattr(vibrokit, name))


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"no attribute 'Hert'.*Hertz"):
        _ = vibrokit.Hert
