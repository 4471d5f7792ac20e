from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from tests.layers import long
from tests.scenes import scene
from vibrokit.structure.attractors.describe import describe_orbit
from vibrokit.structure.autonomous import equilibrium_exponents, find_cycle, refine_cycle

VAN_DER_POL = vk.CustomSpring("x + mu*(x**2 - 1)*v", mu=1.0)
# Of the Van der Pol oscillator at μ = 1 (Amore, Boyd & Fernández, Appl. Math. Comput. 305, 2017, and others).
DURATION, AMPLITUDE = 6.6632868593231301896996820305, 2.00861986087484313650940188

DAMPING = 0.52  # where Genesio and Tesi's cycle has doubled its period once


def van_der_pol(**parts):
    return vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, spring=VAN_DER_POL, **parts)


class Jerk(vk.NoiseModel):
    """A third state that makes Genesio and Tesi's oscillator, x‴ + a x″ + 1.1 x′ + x = x²."""

    extra_states: ClassVar = ("y",)

    damping: float = vk.parameter("a", "s^-1", above=0)

    def amplitude(self, x, v):
        return 1

    def force(self, y):
        return y

    def drift(self, x, v, y):
        return (-self.damping * y - 1.1 * v - x + x**2,)


@pytest.mark.parametrize(
    ("stepper", "tolerance"), [(vk.RK4(256), 1e-6), (vk.RK4(1024), 4e-9), (vk.Order8(1e-12), 1e-11)]
)
def test_the_van_der_pol_cycle(stepper, tolerance):
    cycle = find_cycle(van_der_pol(), np.array([0.5, 0.0]), stepper, longest=20.0)
    assert cycle.duration == pytest.approx(DURATION, abs=tolerance)
    np.testing.assert_allclose(cycle.point, [AMPLITUDE, 0.0], rtol=0, atol=tolerance)
    assert cycle.residual < 1e-12


def test_multipliers_are_those_of_an_independent_integration():
    def rates(_, z):
        x, v = z[:2]
        linear = np.array([[0.0, 1.0], [-1.0 - 2.0 * x * v, 1.0 - x * x]])
        return np.concatenate([[v, (1.0 - x * x) * v - x], (linear @ z[2:].reshape(2, 2)).ravel()])

    start = np.array([AMPLITUDE, 0.0, 1.0, 0.0, 0.0, 1.0])
    end = solve_ivp(rates, (0.0, DURATION), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    expected = np.sort(np.linalg.eigvals(end[2:].reshape(2, 2)))
    assert expected[1] == pytest.approx(1.0, abs=1e-10)
    cycle = refine_cycle(van_der_pol(), np.array([2.0, 0.3]), 6.6, vk.Order8(1e-12))
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(cycle.monodromy)), expected, rtol=0, atol=1e-10)
    np.testing.assert_allclose(cycle.monodromy, end[2:].reshape(2, 2), rtol=0, atol=1e-9)


def test_a_weakly_nonlinear_cycle_has_the_multiplier_of_averaging():
    # x″ + μ(x² − 1)x′ + x = 0 for small μ: amplitude 2, and deviations from it decay like exp(−μt), up to O(μ²).
    osc = van_der_pol().replace({"spring.mu": 0.01})
    cycle = find_cycle(osc, np.array([2.1, 0.0]), vk.RK4(512), longest=10.0)
    assert cycle.point[0] == pytest.approx(2.0, abs=1e-4)
    least = np.abs(np.linalg.eigvals(cycle.monodromy)).min()
    assert least == pytest.approx(np.exp(-0.01 * 2 * np.pi), abs=1e-4)


@pytest.mark.slow
def test_a_cycle_that_hits_a_stop():
    stop = vk.Barrier(vk.Hertz(stiffness=50.0), position=1.2, side="right")
    cycle = find_cycle(van_der_pol(barriers=(stop,)), np.array([0.5, 0.0]), vk.Order8(1e-12), longest=20.0)

    def rates(_, z):
        return [z[1], (1.0 - z[0] ** 2) * z[1] - z[0] - 50.0 * max(z[0] - 1.2, 0.0) ** 1.5]

    def turn(_, z):
        return z[1]

    turn.direction = -1
    path = solve_ivp(
        rates, (0.0, 60.0), [0.5, 0.1], method="DOP853", rtol=1e-11, atol=1e-12, max_step=0.01, events=turn
    )
    times, places = path.t_events[0], path.y_events[0]
    assert cycle.duration == pytest.approx(times[-1] - times[-2], abs=1e-8)
    assert cycle.point[0] == pytest.approx(places[-1, 0], abs=1e-8)
    assert cycle.point[0] > 1.2


@pytest.mark.slow
def test_a_cycle_of_three_states_with_two_turns():
    still = vk.CustomSpring("0*x")
    osc = scene(damping_ratio=0.0, spring=still, noise=Jerk(intensity=0.0, damping=DAMPING))
    cycle = find_cycle(osc, np.array([0.1, 0.0, 0.0]), vk.Order8(1e-11), longest=150.0)

    def rates(_, z):
        return [z[1], z[2], -DAMPING * z[2] - 1.1 * z[1] - z[0] + z[0] ** 2]

    def turn(_, z):
        return z[1]

    turn.direction = -1
    path = solve_ivp(rates, (0.0, 1500.0), [0.1, 0.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-12, events=turn)
    times, places = path.t_events[0], path.y_events[0][:, 0]
    assert abs(places[-1] - places[-2]) > 0.01  # the two turns differ
    assert cycle.duration == pytest.approx(times[-1] - times[-3], abs=1e-6)
    assert cycle.point[0] == pytest.approx(max(places[-2:]), abs=1e-7)
    multipliers = np.linalg.eigvals(cycle.monodromy)
    assert np.abs(multipliers - 1.0).min() < 1e-7
    # Liouville: the divergence is −a everywhere.
    assert np.prod(multipliers).real == pytest.approx(np.exp(-DAMPING * cycle.duration), abs=1e-10)


LINEAR = [(frequency, ratio) for frequency in (1.0, 300.0) for ratio in (0.01, 0.3, 2.0, 100.0)]
STIFF = scene(vk.Barrier(vk.Linear(1e12), 0.0, "right"), excitations=(vk.Constant(0.5),))
THREE_STATES = scene(damping_ratio=0.0, spring=vk.CustomSpring("0*x"), noise=Jerk(intensity=0.0, damping=0.5))
WELL = vk.load_scene("double-well")


def pair(damping, slope):
    """The roots of λ² + 2 · damping · λ − slope."""
    return -damping + np.array([1.0, -1.0]) * np.sqrt(complex(damping**2 + slope))


@pytest.mark.parametrize(
    ("osc", "point", "expected"),
    [
        *((scene(natural_frequency=f, damping_ratio=z), (0.0, 0.0), pair(z * f, -(f**2))) for f, z in LINEAR),
        (STIFF, (0.5 / (1.0 + 1e12), 0.0), pair(0.01, -(1.0 + 1e12))),
        (THREE_STATES, (0.0, 0.0, 0.0), np.roots([1.0, 0.5, 1.1, 1.0])),
        (WELL, (0.0, 0.0), pair(WELL.damping_ratio, 1.0)),
        (WELL, (1.0, 0.0), pair(WELL.damping_ratio, -2.0)),
    ],
)
def test_exponents_at_an_equilibrium(osc, point, expected):
    found = equilibrium_exponents(osc, np.array(point))
    error = 1e-11 * np.abs(expected).max()
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(expected), rtol=0, atol=error)


def test_exponents_at_critical_damping():
    # A double eigenvalue is known to the root of the rounding error; sum and product of both as well as ever.
    found = equilibrium_exponents(scene(natural_frequency=2.0, damping_ratio=1.0), np.zeros(2))
    np.testing.assert_allclose(found, [-2.0, -2.0], atol=1e-5)
    assert (found.sum(), found.prod()) == (pytest.approx(-4.0, rel=1e-11), pytest.approx(4.0, rel=1e-11))


def test_a_cycle_that_finer_steps_do_not_have_is_described_with_an_infinite_error():
    """x″ + v(0.08 x² − 0.04 x⁴ − 2ζ) + x = 0 has cycles for ζ < 0.01; eight steps a turn damp by θ⁵/144 = 0.002."""
    spring = vk.CustomSpring("x + v*(0.08*x**2 - 0.04*x**4 - 2*z)", z=0.011)
    osc, coarse = scene(damping_ratio=0.0, spring=spring), vk.RK4(8)
    described = describe_orbit(osc, cycle := find_cycle(osc, np.array([1.2, 0.0]), coarse, longest=20.0), coarse)
    assert (described.kind, described.error, described.residual) == ("limit cycle", np.inf, cycle.residual)


# --- limit cycles that attract so weakly that motion nearly repeats long before it is on one


def averaged(al, be):
    """Amplitudes of the stable cycles to first order in mu: 1 − A²/4 + al A⁴/8 − 5 be A⁶/64 falls to 0."""
    squares = np.roots([-5 * be / 64, al / 8, -1 / 4, 1.0])
    found = sorted(square.real for square in squares if abs(square.imag) < 1e-12 and square.real > 0)
    slope = np.polyder([-5 * be / 64, al / 8, -1 / 4, 1.0])
    return [np.sqrt(square) for square in found if np.polyval(slope, square) < 0]


def amplitudes(formula, starts=(8, 8), frequency=1.0, **values):
    """Of all attractors that are found."""
    osc = scene(
        natural_frequency=frequency, damping_ratio=0.0, spring=vk.CustomSpring(formula, w2=frequency**2, **values)
    )
    found = vk.find_structure(osc, cells=(10, 10), starts=starts, saddles=False)
    assert {one.kind for one in found.attractors} == {"limit cycle"}
    return sorted(float(np.ptp(one.orbit[:, 0])) / 2 for one in found.attractors)


BIRHYTHMIC = "w2*x - mu*(1 - x**2 + al*x**4 - be*x**6)*v"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mu", "al", "be", "starts"),
    [
        # A turn takes 2π(1 + 2e-7), so that motion nearly repeats after 2π.
        long(0.002, 0.083, 0.0014, (24, 24)),
        long(0.002, 0.144, 0.005, (10, 10)),
        (0.0005, 0.144, 0.005, (10, 10)),  # the cycle between these has the multiplier 1.0013
    ],
)
def test_weak_cycles_count_once_each(mu, al, be, starts):
    assert amplitudes(BIRHYTHMIC, starts, mu=mu, al=al, be=be) == pytest.approx(averaged(al, be), rel=1e-4)


def test_a_weak_cycle_of_van_der_pol_counts_once():
    """Its amplitude is 2 + mu²/96; the units are those of a scene at 100 rad/s."""
    found = amplitudes("w2*x - mu*(1 - x**2)*v", starts=(6, 6), frequency=100.0, mu=0.5)
    assert found == pytest.approx([2.0], rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formula", "damping"),
    [
        ("x - mu*(1 - x**2)*v", 0.0),  # the multiplier of the cycle is exp(−2π mu)
        ("x - mu*(1 - x**2 + 0.01*x**4)*v", 0.0),
        ("mu*x/10 + mu*x**3", 0.05),  # x falls at the rate 0.1 mu/0.1, far more slowly than by the damping
    ],
)
def test_cells_are_followed_as_long_as_the_slowest_deviation_takes(formula, damping):
    osc = scene(damping_ratio=damping, spring=vk.CustomSpring(formula, mu=0.002))
    found = vk.find_structure(osc, region=((-3.0, 3.0), (-3.0, 3.0)), cells=(20, 20), starts=(6, 6), saddles=False)
    (only,) = found.attractors
    assert found.budget > 2000
    assert only.basin_fraction == 1.0
