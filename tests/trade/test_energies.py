"""What `vibrokit trade` measures of the stages of least action, on the double well, whose energy is known."""

import dataclasses
import math

import pytest

import vibrokit as vk
from vibrokit.cli import main
from vibrokit.errors import SceneError, StructureError
from vibrokit.trade.energies import GRAPHS, PLOTS, measure_energies
from vibrokit.trade.table import Trade, TradeRow

EXACT = 4 * 0.05 * 1.0 * 0.25  # 4 ζ ω_n times the barrier
LADDERS = {
    "plots": (vk.ActionPlot(radius=1e-3, points=200), vk.ActionPlot(points=200, rounds=6)),
    "graphs": (vk.ActionGraph(cells=(40, 40), fraction=8), vk.ActionGraph(cells=(80, 80), fraction=4)),
    "steppers": (vk.Order8(1e-4), vk.Order8(1e-10)),
}


@pytest.fixture(scope="module")
def well():
    osc = vk.load_scene("double-well")
    return osc, vk.find_structure(osc, cells=(60, 60), manifolds=False)


@pytest.fixture(scope="module")
def calls():
    return []


@pytest.fixture(scope="module")
def trade(well, calls):
    return measure_energies(*well, **LADDERS, progress=lambda *call: calls.append(call))


def all_rows(trade):
    return (*trade.plots, *trade.graphs, *trade.polishes)


def test_the_reference_is_the_energy(trade):
    assert trade.reference == pytest.approx(EXACT, rel=1e-8)
    assert (trade.source, trade.target) == (0, 1)
    assert trade.residual < 1e-9
    assert trade.reference_from == "Order8(tolerance=1e-13)"


def test_errors_are_distances_from_the_known_energy(trade):
    for row in all_rows(trade):
        assert row.error == pytest.approx(abs(row.value - EXACT) / EXACT, rel=1e-3, abs=1e-8)


def test_values_are_those_of_the_analyzers(trade, well):
    """Asked through their public face, each by itself."""
    for row, analyzer in zip(
        (*trade.plots, *trade.graphs), (*LADDERS["plots"], *LADDERS["graphs"]), strict=True
    ):  # fmt: skip
        kind = type(analyzer)
        alone = kind(**{**analyzer.__dict__, "source": 0}).run(*well)
        least = min(alone.energies, key=lambda energy: energy.value)
        assert row.value == pytest.approx(least.value, rel=1e-12)
        assert eval(row.setting, vars(vk)) == analyzer


def test_every_setting_took_time(trade):
    assert all(0 < row.seconds < math.inf for row in all_rows(trade))


def test_a_graph_tells_of_more_error_than_it_has(trade):
    assert all(row.told >= row.error for row in trade.graphs)


def test_a_finer_polish_is_nearer(trade):
    coarse, fine = (next(row for row in trade.polishes if row.setting == repr(each)) for each in LADDERS["steppers"])
    assert fine.error < coarse.error


def test_defaults_are_marked(trade):
    assert [row.default for row in (*trade.plots, *trade.graphs)] == [False] * 4
    assert next(row.setting for row in trade.polishes if row.default) == "Order8(tolerance=1e-10)"
    assert "candidates" in trade.polishes[-1].setting
    assert str(trade).count("← default") == 2


def test_the_ladders_of_the_command_hold_the_defaults():
    assert PLOTS.count(vk.ActionPlot()) == GRAPHS.count(vk.ActionGraph()) == 1


def test_the_table_names_every_setting(trade):
    text = str(trade)
    assert all(row.setting in text for row in all_rows(trade))
    assert "from 0.05" in text


def test_progress_reaches_its_total(trade, calls):
    assert calls[0][0] == 0
    assert calls[-1][0] == calls[-1][1]
    assert all(0 <= done <= total for done, total in calls)


def test_a_setting_that_fails_says_so(well):
    """A graph that is not allowed its memory; the rest is measured all the same."""
    graphs = (vk.ActionGraph(cells=(80, 80), memory=1e-6),)
    found = measure_energies(*well, plots=LADDERS["plots"][1:], graphs=graphs, steppers=())
    assert math.isnan(found.graphs[0].value)
    assert "GiB" in found.graphs[0].failure
    assert "GiB" in str(found)
    assert found.reference == pytest.approx(EXACT, rel=1e-8)


def test_no_noise_is_refused_in_a_sentence():
    with pytest.raises(SceneError, match="the scene has no noise"):
        measure_energies(vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05))


def test_one_attractor_is_refused_in_a_sentence(well):
    osc, structure = well
    with pytest.raises(StructureError, match="one attractor only"):
        measure_energies(osc, dataclasses.replace(structure, attractors=structure.attractors[:1]))


@pytest.fixture
def one_table(monkeypatch, tmp_path):
    """The command with small tables in place of the long ones."""
    row = TradeRow("RK4", "RK4(steps=32)", 32.0, 1e-3, 1e-3, 1e-6, 1e-5, 40.0)
    steppers = Trade((row,), (), {}, {}, {}, checked=0.0, starts=1, periods=1, threads=1)
    monkeypatch.setattr("vibrokit.trade.steppers.measure_steppers", lambda osc, progress: steppers)
    monkeypatch.setattr("vibrokit.trade.basins.measure_basins", lambda osc, progress: "basins")
    return ["-o", str(tmp_path / "trade.png")]


def test_the_command_prints_the_table(one_table, trade, monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(
        "vibrokit.trade.energies.measure_energies", lambda osc, source, progress: asked.append(source) or trade
    )
    assert main(["trade", "double-well", "--source", "0", *one_table]) == 0
    assert str(trade) in capsys.readouterr().out
    assert asked == [0]


def test_the_command_says_why_there_is_no_table(one_table, tmp_path, capsys):
    scene = tmp_path / "quiet.toml"
    scene.write_text("natural_frequency = 1.0\ndamping_ratio = 0.05\n")
    assert main(["trade", str(scene), *one_table]) == 0
    assert "energies: the scene has no noise" in capsys.readouterr().err
