"""What `vibrokit trade` measures of the steps of least action, on the double well, whose energy is known."""

import dataclasses
import math

import pytest

import vibrokit as vk
from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.graph.search import GraphSearch
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.shooting import Shooting
from vibrokit.cli import main
from vibrokit.errors import SceneError, StructureError
from vibrokit.trade.energies import GRAPHS, SHOOTINGS, measure_energies
from vibrokit.trade.steppers import Trade, TradeRow

pytestmark = pytest.mark.slow

EXACT = 4 * 0.05 * 1.0 * 0.25  # 4 ζ ω_n times the barrier
LADDERS = {
    "shootings": (Shooting(radius=1e-3, points=200), Shooting(points=200, rounds=6)),
    "graphs": (GraphSearch(nodes=(40, 40), steps_per_period=8), GraphSearch(nodes=(80, 80), steps_per_period=4)),
    "steppers": (vk.Order8(1e-4), vk.Order8(1e-10)),
}
SEARCHES = (*LADDERS["shootings"], *LADDERS["graphs"])


@pytest.fixture(scope="module")
def well():
    osc = vk.load_scene("double-well")
    return osc, vk.find_structure(osc, cells=(60, 60), manifolds=False)


@pytest.fixture(scope="module")
def updates():
    return []


@pytest.fixture(scope="module")
def trade(well, updates):
    return measure_energies(*well, **LADDERS, progress=updates.append)


def all_rows(trade):
    return [row for rows in trade.steps.values() for row in rows]


def test_the_reference_is_the_energy(trade):
    assert trade.reference == pytest.approx(EXACT, rel=1e-8)
    assert trade.exit == "left-rest → right-rest"
    assert trade.residual < 1e-9
    assert trade.reference_from == "Order8(tolerance=1e-13)"


def test_errors_are_distances_from_the_known_energy(trade):
    for row in all_rows(trade):
        assert row.error == pytest.approx(abs(row.value - EXACT) / EXACT, rel=1e-3, abs=1e-8)


def test_values_are_those_of_the_searches(trade, well):
    """Each by itself."""
    osc, structure = well
    problem = ExitProblem(osc, structure, structure.attractors[0], LeaveBasin())
    for row, search in zip((*trade.steps["shooting"], *trade.steps["graph"]), SEARCHES, strict=True):
        least = min(search.search(problem).estimates, key=lambda energy: energy.value)
        assert row.value == pytest.approx(least.value, rel=1e-12)
        assert eval(row.setting, {"Shooting": Shooting, "GraphSearch": GraphSearch}) == search


def test_every_setting_took_time(trade):
    assert all(0 < row.seconds < math.inf for row in all_rows(trade))


def test_a_graph_estimates_more_error_than_it_has(trade):
    assert all(row.estimated >= row.error for row in trade.steps["graph"])


def test_a_finer_polish_is_nearer(trade):
    rows = {row.setting: row for row in trade.steps["polishing"]}
    coarse, fine = (rows[repr(stepper)] for stepper in LADDERS["steppers"])
    assert fine.error < coarse.error


def test_defaults_are_marked(trade):
    assert [row.default for row in (*trade.steps["shooting"], *trade.steps["graph"])] == [False] * 4
    polished = trade.steps["polishing"]
    assert next(row.setting for row in polished if row.default) == "Order8(tolerance=1e-10)"
    assert "candidates" in polished[-1].setting
    assert str(trade).count("← default") == 2


def test_the_ladders_of_the_command_hold_the_defaults():
    assert SHOOTINGS.count(Shooting()) == GRAPHS.count(GraphSearch()) == 1


def test_the_table_names_every_setting(trade):
    text = str(trade)
    assert all(row.setting in text for row in all_rows(trade))
    assert "from 0.05" in text


def test_progress_reaches_its_total(trade, updates):
    own = [update for update in updates if update.stage == "energies"]
    assert (own[0].done, own[0].total, own[0].subject) == (0, 7, "left-rest")
    assert own[-1].done == 7
    assert own[-1].finished


def test_a_setting_that_fails_says_so(well):
    """A graph that is not allowed its memory; the rest is measured all the same."""
    graphs = (GraphSearch(nodes=(80, 80), max_memory_gib=1e-6),)
    found = measure_energies(*well, shootings=LADDERS["shootings"][1:], graphs=graphs, steppers=())
    (graph,) = found.steps["graph"]
    assert math.isnan(graph.value)
    assert "GiB" in graph.failure
    assert "GiB" in str(found)
    assert found.reference == pytest.approx(EXACT, rel=1e-8)


def test_no_noise_is_refused_in_a_sentence():
    with pytest.raises(SceneError, match="the scene has no noise"):
        measure_energies(vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05))


def test_one_attractor_is_refused_in_a_sentence(well):
    osc, structure = well
    with pytest.raises(StructureError, match="only one attractor"):
        measure_energies(osc, dataclasses.replace(structure, attractors=structure.attractors[:1]))


@pytest.fixture
def one_table(monkeypatch, tmp_path):
    """The command with small tables in place of the long ones."""
    row = TradeRow("RK4", "RK4(steps=32)", 32.0, 1e-3, 1e-3, 1e-6, 1e-5, 40.0, in_steps=True)
    steppers = Trade((row,), (), {}, {}, {}, {}, checked=0.0, starts=1, periods=1, threads=1)
    monkeypatch.setattr("vibrokit.trade.steppers.measure_steppers", lambda osc: steppers)
    monkeypatch.setattr("vibrokit.trade.basins.measure_basins", lambda osc: "basins")
    return ["-o", str(tmp_path / "trade.png")]


def test_the_command_prints_the_tables(one_table, trade, monkeypatch, capsys):
    asked = []
    tables = {
        "energies": trade,
        "densities": "of densities",
        "exit_times": "of exit times",
        "assessments": "of assessments",
    }
    for name, table in tables.items():
        measure = f"vibrokit.trade.{name}.measure_{name}"
        monkeypatch.setattr(measure, lambda osc, source, table=table: asked.append(source) or table)
    assert main(["trade", "double-well", "--source", "left-rest", *one_table]) == 0
    printed = capsys.readouterr().out
    assert all(str(table) in printed for table in tables.values())
    assert asked == ["left-rest"] * len(tables)


def test_the_command_says_why_there_is_no_table(one_table, tmp_path, capsys):
    scene = tmp_path / "quiet.toml"
    scene.write_text("natural_frequency = 1.0\ndamping_ratio = 0.05\n")
    assert main(["trade", str(scene), *one_table]) == 0
    assert "vibrokit: the scene has no noise" in capsys.readouterr().err
