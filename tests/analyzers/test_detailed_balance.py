"""What exits cost at least where detailed balance holds, by closed forms."""

import dataclasses
import math

import mpmath
import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long, slow
from vibrokit.analyzers.agreement import compared
from vibrokit.analyzers.paths.detailed_balance import least_actions, with_paths
from vibrokit.analyzers.paths.reversed_relaxation import reversed_relaxations
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Code
from vibrokit.results.energy import Bound
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.model import Model

ZETA = 0.05
WELLS = vk.CubicSpring(-1.0, 1.0)


def scene(spring=None, noise=None, **more):
    parts = {"damping_ratio": ZETA, "noise": noise or vk.WhiteNoise(1e-4)} | more
    return vk.Oscillator(natural_frequency=1.0, **({} if spring is None else {"spring": spring}), **parts)


def stopped(law, position=0.9):
    return scene(WELLS, barriers=(vk.Barrier(law, position, "right"), vk.Barrier(law, -position, "left")))


def least(osc, source=0, exit_=None):
    structure = vk.find_structure(osc, cells=(60, 60), rng=0, manifolds=False)
    found = least_actions(ExitProblem(osc, structure, structure.attractors[source], exit_ or vk.LeaveBasin()))
    assert all(each.lower <= each.value <= each.upper for each in found)
    return structure, {each.target: each.value for each in found}


@pytest.mark.parametrize(
    ("osc", "ratio"),
    [
        (scene(), 4 * ZETA),
        (scene(WELLS, damping_ratio=2.0), 8.0),
        (scene(vk.CustomSpring("x + c*v", c=0.3)), 4 * ZETA + 0.6),  # friction that is constant
        (stopped(vk.Hertz(100.0)), 4 * ZETA),
        (scene(excitations=(vk.Constant(0.3),)), 4 * ZETA),
        (stopped(vk.CustomLaw("k*depth*(1 + c*rate)", k=5.0, c=0.0)), 4 * ZETA),
        (scene(noise=vk.StateDependentNoise(1e-4, "2 + c*x**2", c=0.0)), ZETA),
        (scene(noise=vk.StateDependentNoise(1e-4, "1 + c*x**2", c=0.3)), None),
        (scene(vk.CustomSpring("x + c*x**2*v", c=0.3)), None),
        (stopped(vk.CustomLaw("k*depth*(1 + c*rate)", k=5.0, c=0.1)), None),
        (scene(excitations=(vk.Harmonic(0.1, 0.7),)), None),
        (vk.Oscillator(natural_frequency=1.0, damping_ratio=ZETA), None),
    ],
)  # fmt: skip
def test_where_it_holds(osc, ratio):
    balance = Model(osc).balance
    assert balance is None if ratio is None else float(balance) == pytest.approx(ratio, rel=1e-15)


LEFT, TOP, RIGHT = (x**4 / 4 - x**2 / 2 - 0.1 * x for x in np.sort(np.roots([1.0, 0.0, -1.0, -0.1]).real))
TILTED = scene(WELLS, excitations=(vk.Constant(0.1),))
STOPS = (vk.Barrier(vk.Hertz(50.0), 0.5, "right"), vk.Barrier(vk.Hertz(50.0), -0.8, "left"))
CLOSED = {
    "two wells": (scene(WELLS), 0, None, {1: 1 / 4}),
    "tilted, from the left": (TILTED, 0, None, {1: TOP - LEFT}),
    "tilted, from the right": (TILTED, 1, None, {0: TOP - RIGHT}),
    "escape on one side": (scene(vk.CustomSpring("x - x**2")), 0, None, {ESCAPED: 1 / 6}),
    "first contact": (scene(barriers=STOPS), 0, vk.FirstContact(), {-1: 0.5**3}),
    "a well behind another": (  # the highest barrier on the way
        scene(vk.CustomSpring("x*(x**2 - 1)*(x**2 - 4)/4")), 0, None, {1: 0.5625, 2: 0.5625},
    ),
    "forced": (scene(WELLS, damping_ratio=0.1, excitations=(vk.Harmonic(0.1, 0.8),)), 0, None, {}),
    "nonlinear damping": (scene(vk.CustomSpring("x**3 - x + c*x**2*v", c=0.3)), 0, None, {}),
}  # fmt: skip
OTHERS = ("tilted, from the left", "a well behind another", "forced", "nonlinear damping")


@pytest.mark.parametrize(
    ("osc", "source", "exit_", "climbs"),
    [pytest.param(*case, id=name, marks=[pytest.mark.slow] * (name in OTHERS)) for name, case in CLOSED.items()],
)
def test_closed_forms(osc, source, exit_, climbs):
    _, found = least(osc, source, exit_)
    assert found == {target: pytest.approx(4 * ZETA * climb, rel=1e-9) for target, climb in climbs.items()}


@pytest.mark.parametrize("stiffness", [20.0, 1e6, long(1e12)])
def test_wells_that_end_in_stiff_stops(stiffness):
    """Pressed against a stop at 0.9 by the force x − x³; the depth d solves k d^1.5 = x − x³ there."""
    _, found = least(stopped(vk.Hertz(stiffness)))
    depth = 0.0
    for _ in range(100):
        x = 0.9 + depth
        depth = ((x - x**3) / stiffness) ** (2 / 3)
    x = 0.9 + depth
    well = x**4 / 4 - x**2 / 2 + 0.4 * stiffness * depth**2.5
    assert found == {1: pytest.approx(-4 * ZETA * well, rel=1e-8)}


@pytest.mark.slow
def test_least_action_needs_no_other_search():
    osc = stopped(vk.Hertz(1e4))
    structure = vk.find_structure(osc, rng=0, manifolds=False)
    result = vk.LeastAction().run(osc, structure)
    assert [finding.source for finding in result.found(Code.DETAILED_BALANCE)] == [0, 1]
    assert not {Code.GRAPH, Code.SHOTS} & {finding.code for finding in result.findings}
    for energy in result.energies:
        assert energy.bound is Bound.CERTIFIED
        assert energy.certificate is not None
        assert energy.lower <= energy.value <= energy.upper
        assert math.isclose(energy.lower, energy.value, rel_tol=1e-6)


@pytest.mark.long
def test_a_path_that_cannot_be_polished():
    """A stop of 1e7: reversed relaxation from the saddle has too many impacts to be polished, and is the path."""
    osc = stopped(vk.Hertz(1e7))
    structure = vk.find_structure(osc, rng=0, manifolds=False)
    result = vk.LeastAction(source=0).run(osc, structure)
    (energy,) = result.energies
    assert energy.saddle == 0
    assert energy.value == pytest.approx(-4 * ZETA * (0.9**4 / 4 - 0.9**2 / 2), rel=1e-3)  # depth neglected
    assert energy.upper - energy.lower < 1e-6 * energy.value
    assert result.found(Code.BARRIER_ENERGY)
    assert energy.bound is Bound.EXACT
    assert energy.path.action[-1] == pytest.approx(energy.value, rel=1e-2)
    climbed = energy.path.q[:, 1] ** 2 / 2 + energy.path.q[:, 0] ** 4 / 4 - energy.path.q[:, 0] ** 2 / 2
    free = np.abs(energy.path.q[:, 0]) < 0.9
    expected = energy.value + 4 * ZETA * climbed[free]  # along a path of least action: 4ζ times the energy
    np.testing.assert_allclose(energy.path.action[free], expected, atol=1e-2 * energy.value)
    velocities = energy.path.q[:, 1]
    np.testing.assert_allclose(energy.path.p[:, 1], 4 * ZETA * velocities, atol=1e-9)  # of H at detailed balance


@pytest.mark.parametrize("distance", [1e-4, 1e-6, 1e-8])
def test_close_to_a_fold(distance):
    """A saddle and a node 1e-2 to 1e-4 apart, in closed form with more digits."""
    push = 2 / math.sqrt(27) * (1 - distance)
    with mpmath.workdps(50):
        places = sorted(mpmath.polyroots([1, 0, -1, mpmath.mpf(push)], maxsteps=500, extraprec=400), key=mpmath.re)
        _, inner, outer = (mpmath.re(x) for x in places)  # of x³ − x = −push
        depth = [x**4 / 4 - x**2 / 2 + mpmath.mpf(push) * x for x in (inner, outer)]
        expected = float(4 * ZETA * (depth[0] - depth[1]))
    osc = scene(WELLS, excitations=(vk.Constant(-push),))
    structure, found = least(osc, 1)
    assert [saddle.leads_to for saddle in structure.saddles] == [(0, 1)]
    assert found == {0: pytest.approx(expected, rel=1e-5)}
    (energy,) = least_actions(ExitProblem(osc, structure, structure.attractors[1], vk.LeaveBasin()))
    assert abs(energy.value - expected) <= max(energy.numerical_error, 1e-12 * expected)


@pytest.mark.parametrize("region", [slow(None), ((-1.0, 1.75), (-1.0, 1.0))], ids=["default", "given"])
def test_the_cheaper_of_two_saddles_of_one_target(region):
    """Escape over −1.3 costs less than over 1.5, whether the region contains it or not."""
    spring = vk.CustomSpring("x*(1.3 + x)*(1.5 - x)/1.95")
    osc = scene(spring, barriers=(vk.Barrier(vk.Linear(0.01), 0.5, "right"),))
    structure = vk.find_structure(osc, rng=0, manifolds=False, region=region)
    result = vk.LeastAction(source=0).run(osc, structure)
    (energy,) = result.energies
    x = -1.3
    depth = (1.95 * x**2 / 2 + 0.2 * x**3 / 3 - x**4 / 4) / 1.95
    assert energy.target == ESCAPED
    assert energy.value == pytest.approx(4 * ZETA * depth, rel=1e-6)


def test_each_path_ends_at_its_own_saddle():
    osc = scene(vk.CustomSpring("x - x**3"))
    structure = vk.find_structure(osc, rng=0, manifolds=False)
    problem = ExitProblem(osc, structure, structure.attractors[0], vk.LeaveBasin())
    propagator = SegmentPropagator(osc, problem.single_stepper(Flow.STATE), 16)
    (energy,) = with_paths(problem, least_actions(problem), reversed_relaxations(problem, propagator))
    assert energy.bound is Bound.EXACT
    saddle = structure.saddles[energy.saddle].points[0, 0]
    assert abs(saddle) == pytest.approx(1.0)
    assert energy.path.q[-1, 0] == pytest.approx(saddle, abs=1e-3)
    assert energy.path.action[-1] == pytest.approx(ZETA, rel=1e-3)


def test_a_structure_without_its_saddles():
    """What is known of the equilibria bounds the energy all the same, and raises a graph's estimate below it."""
    osc = stopped(vk.Hertz(1e4))
    structure = vk.find_structure(osc, rng=0, saddles=False, manifolds=False)
    (bound,) = least_actions(ExitProblem(osc, structure, structure.attractors[0], vk.LeaveBasin()))
    assert bound.value == pytest.approx(4 * ZETA * (0.9**2 / 2 - 0.9**4 / 4), rel=1e-2)
    assert bound.bound is Bound.ESTIMATE
    low = dataclasses.replace(bound, value=0.5 * bound.value, lower=0.0, upper=0.6 * bound.value)
    (energy,) = (one.energy for one in compared(structure.attractors[0], (), [low], least=[bound]))
    assert bound.lower <= energy.lower <= energy.value <= energy.upper
    high = dataclasses.replace(bound, value=2 * bound.value, lower=bound.value, upper=3 * bound.value)
    assert compared(structure.attractors[0], (), [high], least=[bound])[0].energy.value == high.value
