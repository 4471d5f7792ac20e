"""Exit paths that pass saddles and attractors on their way: three wells in a row, left from the outer one."""

import dataclasses
import functools

import numpy as np
import pytest
import scipy.optimize
import scipy.sparse

import vibrokit as vk
from vibrokit.analyzers.graph.search import GraphSearch
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.polish import polish
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.outcomes import Outcomes, Shooter
from vibrokit.kernels.stopping import LEFT_BASIN
from vibrokit.results.codes import Code
from vibrokit.results.energy import Bound
from vibrokit.symbolic.flow_kind import Flow

OVERDAMPED, UNDERDAMPED = 1.5, 0.3
STEP = 2 * np.pi / 8  # of a candidate; ω_n = 1


def triple_well(damping, **more):
    spring = vk.CustomSpring("x*(x**2 - 1)*(x**2 - 4)/4")
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping, spring=spring, noise=vk.WhiteNoise(intensity=1e-3), **more
    )


@functools.cache
def problem_of(damping):
    osc = triple_well(damping)
    structure = vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)
    return ExitProblem(osc, structure, structure.attractor("left-rest"), vk.LeaveBasin())


def potential(x):
    return x**6 / 24 - 5 * x**4 / 16 + x**2 / 2


def climb(begin, end, count=25):
    """From one place to another, fast in the middle."""
    x = begin + (end - begin) * (1 - np.cos(np.linspace(0, np.pi, count))) / 2
    return np.column_stack([x, np.gradient(x, STEP)])


def candidate(parts, action, target):
    states = np.concatenate(parts)
    return Candidate(0, target, STEP * np.arange(len(states)), states, action, "guess")


def jumps(path):
    """How far the displacement from sample to sample differs from what the velocities give."""
    mean = (path.q[1:, 1] + path.q[:-1, 1]) / 2
    return np.abs(np.diff(path.q[:, 0]) - mean * np.diff(path.t))


@functools.cache
def through_the_middle():
    """Polished from two guesses: over the first saddle, and over both."""
    first = candidate([climb(-2.0, -0.95)], 3.4, 1)
    both = candidate([climb(-2.0, -1.0), climb(-1.0, 0.0), climb(0.0, 1.05)], 4.8, 2)
    return polish(problem_of(OVERDAMPED), [first, both])


def test_the_action_is_the_sum_over_the_wells():
    found = through_the_middle()
    climbs = [4 * OVERDAMPED * (potential(1.0) - potential(x)) for x in (2.0, 0.0)]
    (direct,) = (branch for branch in found.branches if branch.target == 1)
    (farther,) = (branch for branch in found.branches if branch.target == 2)
    assert direct.value == pytest.approx(climbs[0], rel=1e-9)
    assert farther.value == pytest.approx(sum(climbs), rel=1e-9)
    assert farther.certificate.error <= 1e-8 * farther.value
    assert farther.bound is Bound.UPPER
    # Both climbs are proportional to the damping.
    assert farther.sensitivity["damping_ratio"] == pytest.approx(farther.value / OVERDAMPED, rel=1e-6)
    (finding,) = (one for one in found.findings if one.code is Code.PASSES_ORBITS)
    assert finding.target == 2
    assert finding.values["through"] == ["middle-rest"]


def test_the_path_is_whole():
    """Between the legs the motion runs down from the saddle at no cost, and no state jumps."""
    path = next(branch.path for branch in through_the_middle().branches if branch.target == 2)
    assert np.allclose(np.diff(path.t), 2 * np.pi / 128, rtol=1e-6)
    assert jumps(path).max() <= 5e-3
    assert np.all(np.diff(path.action) >= -1e-12)
    assert path.q[0, 0] == pytest.approx(-2, abs=1e-3)
    assert path.q[-1, 0] == pytest.approx(1, abs=1e-3)
    at_rest = np.flatnonzero(np.abs(path.p).max(axis=1) == 0)
    assert path.q[at_rest[0], 0] == pytest.approx(-1, abs=0.01)
    assert path.q[at_rest[-1], 0] == pytest.approx(0, abs=0.02)
    assert np.all(np.diff(path.section) >= 1)


def minimized(osc, path, count=1200):
    """The action of ½∫(x″ + 2ζx′ + f)² dt near a path, with both ends held, by SciPy's least squares."""
    damping = osc.damping_ratio
    t = np.linspace(path.t[0], path.t[-1], count)
    x, h = np.interp(t, path.t, path.q[:, 0]), t[1] - t[0]

    def noise(inner):
        x[2:-2] = inner
        middle = x[1:-1]
        force = middle * (middle**2 - 1) * (middle**2 - 4) / 4
        return ((x[2:] - 2 * middle + x[:-2]) / h**2 + damping * (x[2:] - x[:-2]) / h + force) * h**0.5

    band = scipy.sparse.diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(count - 2, count - 2))
    pattern = band.tocsr()[:, 1:-1]
    return scipy.optimize.least_squares(noise, x[2:-2].copy(), jac_sparsity=pattern, tr_solver="lsmr").cost


@pytest.mark.long
def test_passing_a_saddle_may_cost_less_than_passing_the_attractor():
    """Weakly damped motion that runs down from the first saddle is pushed over the second on its way."""
    problem = problem_of(UNDERDAMPED)
    result = vk.LeastAction(source="left-rest").run(problem.osc, problem.structure)
    energy, direct = result.energy("left-rest", "right-rest"), result.energy("left-rest", "middle-rest")
    assert energy.bound is Bound.CERTIFIED
    assert direct.value == pytest.approx(4 * UNDERDAMPED * (potential(1.0) - potential(2.0)), rel=1e-8)
    assert energy.value < direct.value + 4 * UNDERDAMPED * (potential(1.0) - potential(0.0))
    assert energy.value == pytest.approx(minimized(problem.osc, energy.path), rel=2e-3)
    assert [one.values["through"] for one in result.found(Code.PASSES_ORBITS)] == [["saddle 0"]]


@pytest.mark.slow
@pytest.mark.long
def test_with_forcing_too():
    osc = triple_well(0.2, excitations=(vk.Harmonic(0.05, 0.8),))
    structure = vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)
    result = vk.LeastAction(source="left-oscillation").run(osc, structure)
    energy = result.energy("left-oscillation", "right-oscillation")
    assert energy.bound is Bound.CERTIFIED
    assert energy.certificate.residual <= 1e-9
    assert jumps(energy.path).max() <= 5e-3


@pytest.mark.long
def test_the_graph_goes_through_other_basins():
    """The grids for a target that no saddle leads to cover the basins on the way; each climb is known exactly."""
    problem = problem_of(OVERDAMPED)
    found = GraphSearch(nodes=(120, 120)).search(problem)
    energies = {energy.target: energy for energy in found.estimates}
    exact = 4 * OVERDAMPED * (2 * potential(1.0) - potential(2.0) - potential(0.0))
    assert abs(energies[2].value - exact) <= energies[2].numerical_error
    assert energies[2].value == pytest.approx(exact, rel=0.1)


def test_legs_are_left_out_where_a_path_leads_there_directly():
    """From the middle well both exits are direct."""
    problem = problem_of(OVERDAMPED)
    problem = dataclasses.replace(problem, attractor=problem.structure.attractor("middle-rest"))
    states = climb(0.0, 1.05)
    guess = Candidate(1, 2, STEP * np.arange(len(states)), states, 1.4, "guess")
    found = polish(problem, [guess])
    assert [branch.value for branch in found.branches if branch.target == 2] == pytest.approx([1.375], rel=1e-9)
    assert not [one for one in found.findings if one.code is Code.PASSES_ORBITS]


def test_a_path_that_settles_between_source_and_target_has_not_left():
    """Cells of the basins are coarse: one of the target may hold states that settle in the middle well."""
    problem = dataclasses.replace(problem_of(UNDERDAMPED), exit=vk.LeaveBasin(to="right-rest"))
    shooter = Shooter(problem, problem.ensemble_stepper(Flow.HAMILTONIAN), budget=5)
    states = np.array([[0.1, 0.0, 0.0, 0.0, 1.0], [2.1, 0.0, 0.0, 0.0, 2.0]])  # (q, p, S), in the middle and at right
    none, goal = np.zeros(2, dtype=np.int64), problem.targets[0].label
    outcomes = Outcomes(states, none, states, none + LEFT_BASIN, none + 1, none + goal, none.astype(bool), none.copy())
    shooter.confirm(outcomes)
    assert outcomes.confirmed.tolist() == [False, True]
    assert outcomes.least(3)[goal] == 2.0
