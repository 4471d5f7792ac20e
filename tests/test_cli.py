import dataclasses
import json
import math
import subprocess
import sys
import time
from pathlib import Path

import pytest

import vibrokit as vk
from vibrokit.analyzers.action_plot import ActionPlot
from vibrokit.analyzers.settings import configured, setting
from vibrokit.cli import main, parsed

PLOT = ["--analyzer", "action-plot"]
QUICK = ["--cells", "50", "--set", "points=200", *PLOT]


def test_run_prints_a_table_and_saves_a_figure(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "double-well", *QUICK, "-o", "r.nc"]) == 0
    out = capsys.readouterr().out
    assert "equilibrium" in out
    assert "ΔU" in out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["double-well-action-plot.png", "r.nc"]
    assert main(["plot", "r.nc"]) == 0
    assert (tmp_path / "r.png").stat().st_size > 5000


def test_json_is_one_object_of_the_promised_shape(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "double-well", *QUICK, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert list(record) == ["scene", "attractors", "saddles", "energies", "versions", "seed", "seconds"]
    assert list(record["attractors"][0]) == ["label", "kind", "period", "impacts", "points", "basin_fraction"]
    assert list(record["energies"][0]) == ["source", "target", "method", "value", "lower", "upper", "residual"]
    assert not list(tmp_path.iterdir())


def test_a_structure_is_kept_and_drawn(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "double-well", "--cells", "40", "-o", "s.nc", "--analyzer"]) == 0
    out = capsys.readouterr().out
    assert "between" in out
    assert "saddle" in out
    assert "ΔU" not in out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["double-well-structure.png", "s.nc"]
    assert main(["plot", "s.nc"]) == 0
    assert (tmp_path / "s.png").stat().st_size > 5000


def test_saddles_are_in_the_json(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "double-well", "--cells", "40", "--json", "--analyzer"]) == 0
    (saddle,) = json.loads(capsys.readouterr().out)["saddles"]
    assert list(saddle) == ["period", "points", "multipliers"]
    assert saddle["points"][0] == pytest.approx([0.0, 0.0], abs=1e-9)
    zeta = 0.05
    rates = -zeta + (1 + zeta**2) ** 0.5, -zeta - (1 + zeta**2) ** 0.5
    exact = [[math.exp(2 * math.pi * rate), 0.0] for rate in rates]
    assert saddle["multipliers"] == [pytest.approx(pair, rel=1e-8, abs=1e-12) for pair in exact]


def test_one_attractor_is_a_finding_and_a_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one.toml").write_text(
        'natural_frequency = 1.0\ndamping_ratio = 0.1\nnoise = { name = "white", intensity = 1e-3 }\n'
    )
    assert main(["run", "one.toml", *QUICK, "--json"]) == 0
    out, err = capsys.readouterr()
    record = json.loads(out)
    assert len(record["attractors"]) == 1
    assert record["energies"] == []
    assert "one attractor only" in err


def test_a_stop_that_is_not_there_is_a_sentence_beside_the_structure(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "double-well", *QUICK, "--exit", "first-contact:right"]) == 0
    out, err = capsys.readouterr()
    assert "equilibrium" in out
    assert "no right stop" in err
    assert not list(tmp_path.iterdir())


def test_what_is_not_finite_is_null_in_json(tmp_path, monkeypatch, capsys):
    """An energy without a lower bound is still one object that other programs read."""
    monkeypatch.chdir(tmp_path)
    original = ActionPlot.run

    def unbounded(self, osc, structure, *, progress=None):
        result = original(self, osc, structure, progress=progress)
        energies = tuple(dataclasses.replace(energy, upper=math.inf) for energy in result.energies)
        return dataclasses.replace(result, energies=energies)

    monkeypatch.setattr(ActionPlot, "run", unbounded)
    assert main(["run", "double-well", *QUICK, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["energies"]
    assert {energy["upper"] for energy in record["energies"]} == {None}


def test_equations(capsys):
    assert main(["equations", "hertz-0.570"]) == 0
    assert "p_2" in capsys.readouterr().out
    assert main(["equations", "hertz-0.570", "--latex"]) == 0
    assert r"\dot{x}" in capsys.readouterr().out


def test_list(capsys):
    assert main(["list"]) == 0
    out = capsys.readouterr().out
    for name in ("hertz", "linear", "custom", "cubic", "harmonic", "white", "action-plot", "hertz-0.525"):
        assert name in out


def test_settings_reach_the_parts_of_an_analyzer():
    given = dict(setting(text) for text in ("graph.cells=48,64", "plot=none", "orbits=2", "source=1"))
    made = configured(vk.LeastAction, given)
    assert made == vk.LeastAction(graph=vk.ActionGraph(cells=(48, 64)), plot=None, orbits=2, source=1)


@pytest.mark.parametrize("place", [1, 3])
def test_the_scene_may_come_after_the_analyzers(place):
    words = ["run", "--analyzer", "action-plot"]
    words.insert(place, "double-well")
    options = parsed(words)
    assert (options.scene, options.analyzer) == ("double-well", ["action-plot"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "herz-0.570"], "hertz-0.570"),
        (["run", "double-well", *PLOT, "--set", "ponts=3"], "points"),
        (["run", "double-well", *PLOT, "--set", "points"], "FIELD=NUMBER"),
        (["run", "double-well", *PLOT, "--set", "points=many"], "FIELD=NUMBER"),
        (["run", "double-well", "--set", "points=300"], "write plot.points"),
        (["run", "double-well", "--set", "exits=3"], "the nearest is 'exit'"),
        (["run", "double-well", "--set", "graph.cell=3"], "the nearest is 'cells'"),
        (["run", "double-well", "--set", "grph.cells=3,3"], "the nearest is 'graph'"),
        (["run", "double-well", "--set", "orbits.cells=3"], "no part 'orbits'"),
        (["run", "double-well", "--set", "graph.cells=3"], "two whole numbers"),
        (["run", "double-well", *PLOT, "--cells", "1"], "--cells"),
        (["run", "double-well", *PLOT, "--stepper", "rk5:3"], "rk4"),
        (["run", "double-well", *PLOT, "--stepper", "rk4:few"], "rk4:few"),
        (["run", "double-well", *PLOT, "--stepper", "order8:7"], "tolerance"),
        (["run", "double-well", *PLOT, "--exit", "leave-basins"], "the nearest is 'leave-basin'"),
        (["run", "double-well", *PLOT, "--exit", "leave-basin:left"], "first-contact:left"),
        (["run", "double-well", *PLOT, "--exit", "first-contact:top"], "'top'"),
        (["run", "double-well", "--analyzer", "actionplot"], "action-plot"),
        (["plot", "nothing.nc"], "nothing.nc"),
        (["check", "herz"], "hertz"),
        (["run", "double-well", "-o", "nowhere/r.nc"], "nowhere"),
    ],
)
def test_mistakes_are_one_sentence_and_status_two(arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    error = capsys.readouterr().err.strip()
    assert error.startswith("vibrokit: ")
    assert words in error
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())


def test_help_is_quick_and_light():
    # Half a second is generous for a busy machine; alone it takes a tenth of that.
    times = []
    for _ in range(3):
        began = time.perf_counter()
        subprocess.run([sys.executable, "-m", "vibrokit.cli", "--help"], check=True, capture_output=True)
        times.append(time.perf_counter() - began)
    assert min(times) < 0.5


def test_interrupting_leaves_nothing_half_written(tmp_path, monkeypatch, capsys):
    def interrupt(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("vibrokit.structure.search.run_ensemble", interrupt)
    assert main(["run", "double-well", *QUICK, "-o", "r.nc"]) == 130
    assert not list(Path(tmp_path).iterdir())
