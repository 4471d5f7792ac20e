"""What `vibrokit trade` measures of analyzers, on double wells whose energy is known."""

import dataclasses
import math

import pytest

import vibrokit as vk
from tests.scenes import double_well, scene
from vibrokit.errors import SceneError, StructureError
from vibrokit.trade.methods import SEARCHES, measure_densities, measure_energies, measure_exit_times

EXACT = 4 * 0.05 * 1.0 * 0.25  # 4 ζ ω_n times the barrier
FEW = (
    vk.ActionPlot(points=200, rounds=6),
    vk.ActionGraph(nodes=(40, 40)),
    vk.ActionGraph(nodes=(80, 80), max_memory_gib=1e-6),
)


@pytest.fixture(scope="module")
def well():
    osc = vk.load_scene("double-well")
    return osc, vk.find_structure(osc, cells=(60, 60), manifolds=False)


@pytest.fixture(scope="module")
def energies(well):
    updates = []
    return measure_energies(*well, analyzers=FEW, progress=updates.append), updates


@pytest.mark.slow
def test_energies_are_compared_with_the_certified_one(energies):
    trade, _ = energies
    assert trade.exit == "left-rest → right-rest"
    assert (trade.reference.setting, trade.reference.default) == ("LeastAction()", True)
    assert trade.reference.value == pytest.approx(EXACT, rel=1e-8)
    assert math.isnan(trade.reference.error)
    plot, graph, refused = trade.rows
    for row in (plot, graph):
        assert row.error == pytest.approx(abs(row.value - EXACT) / EXACT, rel=1e-3, abs=1e-8)
        assert 0 < row.seconds < math.inf
        assert not row.default
    assert graph.estimated >= graph.error
    assert math.isnan(refused.value)
    assert "GiB" in refused.failure


@pytest.mark.slow
def test_the_table_names_every_setting_as_it_is_typed(energies):
    trade, updates = energies
    assert [eval(row.setting, vars(vk) | {"ActionPlot": vk.ActionPlot, "ActionGraph": vk.ActionGraph})
            for row in trade.rows] == list(FEW)  # fmt: skip
    assert all(row.setting in str(trade) for row in (*trade.rows, trade.reference))
    own = [update for update in updates if update.stage == "ΔU"]
    assert (own[0].done, own[0].total, own[0].subject) == (0, 4, "left-rest")
    assert own[-1].done == 4


def test_the_searches_of_the_command_hold_the_defaults():
    assert [one for one in SEARCHES if one == type(one)()] == [vk.ActionPlot(), vk.ActionGraph()]


@pytest.mark.long
def test_densities_on_more_nodes_take_more_memory_and_err_less():
    osc = double_well(noise=vk.WhiteNoise(intensity=1e-2))  # a fifth of ΔU: the cores hardly matter
    structure = vk.find_structure(osc, cells=(40, 40), manifolds=False, rng=0)
    trade = measure_densities(osc, structure, source=0, nodes=(0.6,), steps=())
    coarse, plain = trade.rows
    assert plain.error < coarse.error
    assert plain.memory > coarse.memory
    assert (coarse.default, plain.default, trade.reference.default) == (False, True, False)
    assert trade.reference.estimated < 0.1


@pytest.mark.long
def test_exit_times_err_by_what_is_estimated():
    """The chance of more than four standard errors is 6e-5."""
    osc = scene(damping_ratio=0.2, spring=vk.CubicSpring(linear=-1.0, cubic=1.0), noise=vk.WhiteNoise(intensity=0.04))
    structure = vk.find_structure(osc, cells=(40, 40), manifolds=False, rng=0)
    trade = measure_exit_times(osc, structure, source=0, errors=(0.4, 0.3))
    assert len(trade.rows) == 4
    for row in trade.rows:
        assert row.error <= 4 * math.hypot(row.estimated, trade.reference.estimated)
    direct = [row for row in trade.rows if "splitting=False" in row.setting]
    assert [row.estimated for row in direct] == pytest.approx([0.4, 0.3], rel=0.1)


@pytest.mark.parametrize("measure", [measure_energies, measure_densities, measure_exit_times])
def test_what_cannot_be_measured_is_refused(measure):
    with pytest.raises(SceneError, match="the scene has no noise"):
        measure(double_well(noise=None))


@pytest.mark.slow
def test_one_attractor_is_refused_in_a_sentence(well):
    osc, structure = well
    with pytest.raises(StructureError, match="only one attractor"):
        measure_energies(osc, dataclasses.replace(structure, attractors=structure.attractors[:1]))
