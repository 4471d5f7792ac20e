"""Grids around known paths: they hold what costs less, and give the closed form of a tilted double well."""

import dataclasses
import functools
from types import SimpleNamespace

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.analyzers.graph.hierarchy import HierarchySearch
from vibrokit.analyzers.graph.known_paths import KnownPaths
from vibrokit.analyzers.graph.path_ends import exit_targets
from vibrokit.analyzers.graph.regions import AroundPaths
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.targets import StateTarget
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.energy import ActivationEnergy, Bound, ExitPath
from vibrokit.structure.scales import doublings_of

pytestmark = pytest.mark.slow

TILT, DAMPING, NODES = 0.36, 0.05, (60, 60)
STEPS = 8


def potential(x):
    return x**4 / 4 - x**2 / 2 - TILT * x


LEFT, TOP, _ = np.sort(np.roots([1, 0, -1, -TILT]).real)
EXACT = 4 * DAMPING * (potential(TOP) - potential(LEFT))  # ΔU = 4 ζ ω_n ΔE, the paper's equation for detailed balance


@functools.cache
def problem():
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=DAMPING, spring=vk.CubicSpring(-1.0, 1.0),
        excitations=(vk.Constant(TILT),), noise=vk.WhiteNoise(1e-4),
    )  # fmt: skip
    structure = vk.find_structure(osc, rng=0, manifolds=False)
    label = int(np.argmin([attractor.points[0, 0] for attractor in structure.attractors]))
    return ExitProblem(osc, structure, structure.attractors[label], vk.LeaveBasin())


@functools.cache
def branches():
    return vk.LeastAction(source=problem().source).run(problem().osc, problem().structure).branches


@functools.cache
def coverage(scale=1.0):
    """Around the paths that are known, or one of another action."""
    model = StepModel(problem().scene, vk.RK4(256))
    known = [dataclasses.replace(branch, value=scale * branch.value) for branch in branches()]
    return AroundPaths(problem(), model, tuple(exit_targets(problem(), model)), known)


def steps():
    return STEPS * 2 ** doublings_of(problem().scene)


def test_the_first_grids_hold_the_path_and_hardly_more():
    grids = coverage().first(steps(), NODES, 1)
    (path,) = {id(branch.path): branch.path for branch in branches()}.values()
    low, high = grids.boxes[0].T
    assert ((path.q[:, :2] > low) & (path.q[:, :2] < high)).all()
    assert grids.area < 0.1 * coverage().region(steps(), NODES, 1).area


def test_v_at_the_saddle_is_the_closed_form():
    whole, coarse = coverage().coarser(steps(), NODES, 1, 2 * EXACT)
    assert coverage().highest(coarse) == pytest.approx(EXACT, rel=0.02)
    assert coverage().highest(whole) > coverage().highest(coarse)  # half as many nodes: interpolation raises V
    assert coverage().steps_suffice(coarse, whole)


def test_grids_grow_until_they_hold_what_costs_less():
    """Begun around a straight line of no velocity, they grow to where V is as large as the action."""
    (branch,) = {branch.target: branch for branch in branches()}.values()
    ends = branch.path.q[[0, -1]] * [1.0, 0.0]
    straight = ExitPath(branch.path.t[[0, -1]], ends, 0 * ends, np.array([0.0, branch.value]), np.array([0]))
    around = dataclasses.replace(coverage(), branches=[dataclasses.replace(branch, path=straight)])
    begun = around.first(steps(), NODES, 1)
    _, coarse = around.coarser(steps(), NODES, 1, 2 * EXACT)
    assert coarse.potential.grids.area > begun.area
    assert around.highest(coarse) == pytest.approx(EXACT, rel=0.02)
    edge = np.ones(coarse.potential.grids.shape, dtype=bool)
    edge[3:-3, 3:-3] = False
    for needed in around.needed(coarse, around.scale):
        assert not (needed & edge).any()


def test_v_below_a_known_action_asks_for_shorter_steps():
    _, coarse = coverage(1.2).coarser(steps(), NODES, 1, 2 * EXACT)
    assert not coverage(1.2).steps_suffice(coarse, coarse)
    assert not coverage(1.2).lies_above(coarse)
    assert coverage(1.2).excess(coarse) == pytest.approx(1 - 1 / 1.2, abs=0.02)


def test_grids_that_would_be_too_coarse_on_all_nodes_are_given_up_early():
    with pytest.raises(StructureError, match="raise the number of nodes"):
        coverage(0.01).coarser(steps(), NODES, 1, 2 * EXACT)


ANY_PATH = ExitPath(np.arange(2.0), np.zeros((2, 2)), np.zeros((2, 2)), np.array([0.0, 1.0]), np.array([0]))


def to(label, value, saddle=-1, path=ANY_PATH):
    return ActivationEnergy(0, label, value, value, value, "", Bound.UPPER, path=path, saddle=saddle)


def over(saddle, *labels):
    return StateTarget(labels, saddle, 1.0, np.zeros((1, 2)))


def test_what_is_known_is_the_cheapest_path_to_each_attractor():
    (one, *_), label = exit_targets(problem(), coverage().model), problem().targets[0].label
    known = KnownPaths([to(label, 2.0), to(label, 1.0), to(7, 0.1), to(label, 0.5, path=None)])
    assert [found.value for found in known.to([one])] == [1.0]
    assert known.cost(one) == 1.0
    assert KnownPaths().cost(one) == np.inf


def test_a_saddle_is_left_out_if_known_paths_to_its_attractors_cost_far_less_or_need_no_graph():
    """A saddle that leads to two attractors; one of them is reached far cheaper by another saddle."""
    target = over(0, 1, 2)
    paths = [to(1, 1.0, 0), to(2, 1.0, 0)]
    cheaper = [*paths, to(1, 0.1, 3)]
    assert KnownPaths(paths, {2}).needs(target)
    assert KnownPaths(cheaper).needs(target)
    assert not KnownPaths(cheaper, {2}).needs(target)
    assert not KnownPaths((), {1, 2}).needs(target)
    assert KnownPaths([to(1, 0.1, 3)], {2}).needs(target)  # no path over this saddle is known


NEAR, FAR, UNKNOWN = over(0, 1), over(1, 2), over(2, 3)
PATHS = KnownPaths([to(1, 1.0, 0), to(2, 10.0, 1)])


def searched(targets, values):
    """A search that has solved these targets together, with these V; without targets, one that has solved nothing."""
    search = HierarchySearch(problem(), coverage().model, {NODES: (STEPS,)})
    fine = SimpleNamespace(arrival=lambda target: SimpleNamespace(value=values[target]))
    if targets:
        search._solved_before[NODES, frozenset(targets)] = SimpleNamespace(fine=fine)
    return search


@pytest.fixture
def areas(monkeypatch):
    """Grids around a path that are as large as its action."""
    monkeypatch.setattr(HierarchySearch, "_area", lambda _, paths: max(path.value for path in paths))


@pytest.mark.usefixtures("areas")
def test_cheap_exits_that_the_grids_for_all_do_not_resolve_come_first_on_their_own():
    together = [FAR, NEAR, UNKNOWN]
    (first, known), (rest, others) = searched(together, {NEAR: 5.0}).groups(together, PATHS)
    assert (first, rest) == ([NEAR], [FAR, UNKNOWN])
    assert [path.value for path in known.to(first)] == [1.0]
    assert [path.target for path in others.to([over(1, 1, 2)])] == [2]  # what leads to both is there for the other


@pytest.mark.usefixtures("areas")
@pytest.mark.parametrize(
    ("solved", "values"), [((), {}), ((NEAR, FAR), {NEAR: 1.2})], ids=["nothing is solved yet", "V is near the action"]
)
def test_exits_stay_together_otherwise(solved, values):
    (group,) = searched(solved, values).groups([NEAR, FAR], PATHS)
    assert group == ([NEAR, FAR], PATHS)


@pytest.mark.usefixtures("areas")
def test_exits_solved_apart_stay_apart_even_if_their_group_has_changed():
    more = over(3, 4)
    search = searched([NEAR, FAR, more], {NEAR: 5.0})
    search._solved_before.update(searched([NEAR, more], {NEAR: 1.0})._solved_before)
    assert [group for group, _ in search.groups([NEAR, FAR], PATHS)] == [[NEAR], [FAR]]


@pytest.mark.parametrize(("value", "goes_on"), [(3.0, True), (np.inf, False)])
def test_a_saddle_inside_a_chaotic_set_goes_on_from_grids_that_reach_it(value, goes_on):
    inside = over(7, 1)
    search = searched([NEAR], {inside: value})
    search._embedded[7] = inside
    assert (search._before(frozenset([inside]), None) is not None) == goes_on
    assert search._before(frozenset([FAR, inside]), None) is None  # the other target is not on those grids


@pytest.mark.usefixtures("areas")
def test_exits_of_about_one_cost_share_their_grids():
    alike = over(3, 4)
    known = KnownPaths([*PATHS.branches, to(4, 1.5, 3)])
    groups = searched([NEAR, FAR, alike], {NEAR: 5.0, alike: 5.0}).groups([NEAR, FAR, alike], known)
    assert [group for group, _ in groups] == [[NEAR, alike], [FAR]]


@pytest.mark.long
@pytest.mark.parametrize("leaves", [vk.LeaveBasin(), vk.LeaveBasin(to=0)], ids=["to any", "to one"])
def test_small_islands_in_a_wide_region_are_resolved(leaves):
    """An orbit of period 2 in a forced double well is left for 9.129e-5, and other exits cost up to 30 times as much.

    The cheapest path ends at a saddle inside the chaotic basin boundary.
    """
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.03, spring=vk.CubicSpring(-1.0, 1.0),
        excitations=(vk.Harmonic(0.3, 2.4),), noise=vk.WhiteNoise(1e-4),
    )  # fmt: skip
    structure = vk.find_structure(osc, rng=0)
    (source,) = (each.label for each in structure.attractors if each.name == "right-oscillation-period-2")
    result = vk.LeastAction(source=source, exit=leaves).run(osc, structure)
    first = min(result.energies, key=lambda energy: energy.value)
    assert first.value == pytest.approx(9.129105167e-5, rel=1e-6)
    assert first.lower > 0.8 * first.value
