"""The plug-in of docs/how-to/analyzer.rst, installed as its page says: run, saved, opened and drawn."""

import json
import re
import shlex
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import vibrokit as vk
from tests.plugins.metadata import write_metadata
from vibrokit.analyzers.settings import analyzer_from, named_exit
from vibrokit.cli import main
from vibrokit.registry import Group, load

pytestmark = pytest.mark.slow

PAGE = (Path(__file__).parents[2] / "docs/how-to/analyzer.rst").read_text(encoding="utf-8")
OMEGA, ZETA = 1.3, 0.1


def snippets(language):
    """Snippets of one language in the page, in order."""
    blocks = re.findall(rf"^\.\. code-block:: {language}\n((?:\n|   .*\n)+)", PAGE, re.MULTILINE)
    return [re.sub(r"^   ", "", block, flags=re.MULTILINE).strip() + "\n" for block in blocks]


ANALYZER, _, EXIT = snippets("python")
RUN, PLOT, RUN_TO_BOX = [shlex.split(line)[2:] for line in snippets("console")[0].splitlines()]


@pytest.fixture(autouse=True)
def installed(tmp_path, monkeypatch):
    """The plug-in's module and metadata in a folder on the path, which is the current one."""
    project = tomllib.loads(snippets("toml")[0])["project"]
    exit_class = EXIT.partition("\n\n\nbox")[0]
    (tmp_path / "quadratic.py").write_text(f"{ANALYZER}\n\n{exit_class}\n")
    write_metadata(tmp_path, project)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "quadratic", raising=False)
    monkeypatch.chdir(tmp_path)
    yield
    sys.modules.pop("quadratic", None)


def test_the_example_is_short():
    assert sum(bool(line.strip()) for line in ANALYZER.splitlines()) <= 40


def test_the_command_line_runs_saves_and_draws_it(tmp_path, capsys):
    assert main([*RUN, "--verbose"]) == 0
    assert "The quadratic form holds near right-rest." in capsys.readouterr().out
    result = vk.load_result(tmp_path / "quadratic.nc")
    assert type(result) is load(Group.RECORDS, "quadratic")
    assert [(energy.source, energy.target) for energy in result.energies] == [(0, 1), (1, 0)]
    assert result.found(vk.Code.REMARK)
    assert result.data["psi"].attrs["units"] == "m2 s-3"
    assert result.data["psi"].sizes == {"source": 2, "x": 60, "v": 60}
    assert main(PLOT) == 0
    assert (tmp_path / "quadratic.png").stat().st_size > 1000


def test_the_command_line_takes_the_exit_by_name(capsys):
    assert main([*RUN_TO_BOX, "--json"]) == 0
    (printed,) = capsys.readouterr().out.splitlines()
    energies = json.loads(printed)["energies"]
    assert {energy["target"] for energy in energies} <= {-1, "exit", None}
    assert len(energies) == 2


def test_it_is_exact_for_a_linear_scene_to_within_a_cell():
    """Ψ = 2ζω³ x² + 2ζω v²; the nearest cell outside is centred at most one cell beyond the face."""
    osc = vk.Oscillator(natural_frequency=OMEGA, damping_ratio=ZETA, noise=vk.WhiteNoise(intensity=1e-4))
    structure = vk.find_structure(osc, region=((-1, 1), (-1, 1)), cells=(101, 101), starts=(4, 4), manifolds=False)
    result = load(Group.ANALYZERS, "quadratic")(exit=named_exit("leave-box:0.5")).run(osc, structure)
    (energy,) = result.energies
    assert 2 * ZETA * OMEGA**3 * 0.5**2 <= energy.value <= 2 * ZETA * OMEGA**3 * (0.5 + 2 / 101) ** 2
    x, v = (result.data[axis] for axis in "xv")
    expected = 2 * ZETA * OMEGA**3 * x**2 + 2 * ZETA * OMEGA * v**2
    np.testing.assert_allclose(result.data["psi"].sel(source=0), expected, rtol=1e-8, atol=1e-12)


def test_settings_build_the_analyzer_again():
    osc = vk.load_scene("double-well")
    structure = vk.find_structure(osc, cells=(20, 20), manifolds=False)
    analyzer = load(Group.ANALYZERS, "quadratic")(source="left-rest", exit=named_exit("leave-box:1.2,0.4"))
    assert analyzer_from(analyzer.run(osc, structure).settings) == analyzer
