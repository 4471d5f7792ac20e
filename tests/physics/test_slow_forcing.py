"""A double well under slow forcing, as in stochastic resonance: its saddle orbit has multipliers of up to 1e48."""

import functools
import math

import numpy as np
import pytest
import scipy.sparse
from scipy.integrate import quad, solve_bvp
from scipy.interpolate import CubicSpline
from scipy.sparse.linalg import spsolve

import vibrokit as vk
from tests.layers import long, slow
from tests.scenes import double_well
from vibrokit.analyzers.paths import slow_relaxation
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ends import pieces_of
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.energy import Bound
from vibrokit.symbolic.flow_kind import Flow

ZETA, TILT = 0.1, 0.15
SLOW = (0.3, 0.1, 0.05)


@functools.cache
def scene(frequency):
    forces = (vk.Harmonic(amplitude=TILT, frequency=frequency),)
    return double_well(damping_ratio=ZETA, excitations=forces, noise=vk.WhiteNoise(intensity=1e-4))


@functools.cache
def structure(frequency):
    return vk.find_structure(scene(frequency), rng=0)


@functools.cache
def energies(frequency):
    return vk.LeastAction(graph=None).run(scene(frequency), structure(frequency)).energies


def rests(tilt):
    """The well, the hilltop and the other well under a constant force, from left to right."""
    return np.sort(np.roots([1.0, 0.0, -1.0, -tilt]).real)


@pytest.mark.parametrize("frequency", [0.3, slow(0.1), long(0.05)])
def test_the_saddle_is_the_periodic_solution_of_a_boundary_value_problem(frequency):
    (saddle,) = structure(frequency).saddles
    period = 2 * math.pi / frequency

    def rate(t, z):
        return np.array([z[1], z[0] - z[0] ** 3 - 2 * ZETA * z[1] + TILT * np.cos(frequency * t)])

    times = np.linspace(0.0, period, 400)
    hilltop = np.array([rests(TILT * math.cos(frequency * t))[1] for t in times])
    exact = solve_bvp(
        rate, lambda a, b: a - b, times, np.array([hilltop, np.gradient(hilltop, times)]), tol=1e-9, max_nodes=100_000
    )
    assert exact.success
    at = period * np.arange(len(saddle.nodes)) / len(saddle.nodes)
    np.testing.assert_allclose(saddle.nodes, exact.sol(at).T, atol=1e-8)
    assert len(saddle.nodes) > 1
    assert saddle.residual <= 1e-10


@pytest.mark.parametrize("frequency", SLOW)
def test_exponents_of_the_saddle(frequency):
    """Their sum is the divergence of the flow; each is about the mean of that at the hilltop of the moment."""
    (saddle,) = structure(frequency).saddles
    growth, decay = saddle.exponents.real
    assert growth + decay == pytest.approx(-2 * ZETA, abs=1e-9)  # ten times the tolerance of the stepper

    def of_the_moment(phase):
        return -ZETA + math.sqrt(ZETA**2 + 1 - 3 * rests(TILT * math.cos(phase))[1] ** 2)

    mean = quad(of_the_moment, 0, 2 * math.pi)[0] / (2 * math.pi)
    assert growth == pytest.approx(mean, abs=0.1 * frequency**2)
    assert saddle.multipliers[0].real == pytest.approx(math.exp(growth * saddle.duration), rel=1e-9)


def relaxations():
    slow = structure(0.3)
    problem = ExitProblem(scene(0.3), slow, slow.attractors[0], vk.LeaveBasin())
    stepper = problem.single_stepper(Flow.STATE)
    return slow_relaxation.slow_relaxations(problem, SegmentPropagator(scene(0.3), stepper, max(pieces_of(scene(0.3)))))


def test_guesses_cost_what_their_motion_costs():
    """½ ∫ (x″ + 2ζ x′ − x + x³ − f)² dt, by splines; they lead from the well at −1 to the hilltop.

    Samples are 0.65 apart, and the guess's action is that of the trapezoidal rule: h²/12 = 0.035 of the curvature.
    """
    guesses = relaxations()
    assert guesses
    for guess in guesses:
        t, (x, v) = guess.times, guess.states.T
        force = CubicSpline(t, v)(t, 1) + 2 * ZETA * v - x + x**3 - TILT * np.cos(0.3 * t)
        assert guess.action == pytest.approx(0.5 * CubicSpline(t, force**2).integrate(t[0], t[-1]), rel=0.02)
        np.testing.assert_allclose(CubicSpline(t, x)(t, 1)[1:-1], v[1:-1], atol=0.02)
        assert x[0] < -0.8 < -0.4 < x[-1] < 0.4


def test_where_they_take_too_many_steps_there_are_no_guesses(monkeypatch):
    monkeypatch.setattr(slow_relaxation, "_MOST_EVALUATIONS", 100)
    assert relaxations() == []


@pytest.mark.long
def test_slower_forcing_costs_as_much_as_the_lowest_barrier():
    """4 ζ ω_n ΔV, with the barrier of the greatest force; both wells are mirror images half a period apart."""
    well, hilltop, _ = rests(TILT)
    barrier = sum(sign * (x**4 / 4 - x**2 / 2 - TILT * x) for sign, x in ((1, hilltop), (-1, well)))
    excess = []
    for frequency in SLOW:
        one, other = energies(frequency)
        assert one.certificate.residual < 1e-9 > other.certificate.residual
        assert one.value == pytest.approx(other.value, rel=1e-9)
        excess.append(one.value / (4 * ZETA * barrier) - 1)
    assert excess[0] > excess[1] > 2 * excess[2] > 0
    assert excess[2] < 0.01


def minimized(frequency, path, step):
    """The least of ½ ∫ (x″ + 2ζ x′ − x + x³ − f)² dt with the ends of a path, by Newton's method on a grid."""
    count = round((path.t[-1] - path.t[0]) / step)
    t = np.linspace(path.t[0], path.t[-1], count + 1)
    x, h = np.interp(t, path.t, path.q[:, 0]), t[1] - t[0]
    # Ends: place and velocity, the velocity by a point beyond.
    before = x[1] - 2 * h * path.q[0, 1]
    after = x[-2] + 2 * h * path.q[-1, 1]
    force = TILT * np.cos(frequency * t)
    for _ in range(30):
        wide = np.concatenate([[before], x, [after]])
        before, after = x[1] - 2 * h * path.q[0, 1], x[-2] + 2 * h * path.q[-1, 1]
        wide[0], wide[-1] = before, after
        second, first = np.diff(wide, 2) / h**2, (wide[2:] - wide[:-2]) / (2 * h)
        residual = second + 2 * ZETA * first - x + x**3 - force
        weight = np.full(count + 1, h)
        weight[[0, -1]] = h / 2
        upper = np.full(count, 1 / h**2 + ZETA / h)
        lower = np.full(count, 1 / h**2 - ZETA / h)
        upper[0], lower[-1] = 2 / h**2, 2 / h**2
        jacobian = scipy.sparse.diags([lower, -2 / h**2 - 1 + 3 * x**2, upper], [-1, 0, 1]).tocsr()[:, 1:-1]
        weighted = scipy.sparse.diags(weight) @ residual
        bent = scipy.sparse.diags((6 * x * weighted)[1:-1])
        hessian = jacobian.T @ scipy.sparse.diags(weight) @ jacobian + bent
        change = spsolve(hessian.tocsc(), -jacobian.T @ weighted)
        x[1:-1] += change
        if np.abs(change).max() < 1e-10:
            return 0.5 * float(weight @ residual**2)
    raise AssertionError("no minimum")


@pytest.mark.long
@pytest.mark.parametrize("frequency", [0.3, 0.1, 0.05])
def test_minimized_directly_it_is_the_same(frequency):
    energy = energies(frequency)[0]
    coarse, fine = (minimized(frequency, energy.path, step) for step in (0.02, 0.01))
    assert energy.value == pytest.approx(fine + (fine - coarse) / 3, rel=2e-6)


@pytest.mark.long
def test_the_graph_certifies_it():
    (energy,) = vk.LeastAction(source="left").run(scene(0.05), structure(0.05)).energies
    assert energy.bound is Bound.CERTIFIED
    assert energy.lower > 0.9 * energy.value  # `accuracy` is 0.1
