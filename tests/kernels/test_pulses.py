"""Pulses, jumps and high frequencies of excitations are not stepped over.

Against SciPy, which starts anew at each jump, and closed forms.
"""

import itertools
import math

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

import vibrokit as vk
from vibrokit.kernels.choice import CoarseStepsWarning, ensemble_stepper
from vibrokit.kernels.time_scales import changes_of
from vibrokit.symbolic.flow_kind import Flow

PERIOD, START = 7.0, (0.4, 0.2)


class Blows(vk.Excitation):
    """Rectangular blows of one impulse."""

    impulse: float = vk.parameter("J", "m s^-1")
    width: float = vk.parameter("w", "s", above=0)
    repeat: float = vk.parameter("T", "s", above=0)

    def force(self, t):
        return self.impulse / self.width * sympy.Piecewise((1, sympy.Mod(t, self.repeat) < self.width), (0, True))

    @property
    def period(self):
        return self.repeat


class Bump(vk.Excitation):
    """One smooth blow."""

    impulse: float = vk.parameter("J", "m s^-1")
    width: float = vk.parameter("w", "s", above=0)
    when: float = vk.parameter("t_0", "s")

    def force(self, t):
        shape = sympy.exp(-(((t - self.when) / self.width) ** 2) / 2)
        return self.impulse / self.width / sympy.sqrt(2 * sympy.pi) * shape

    @property
    def period(self):
        return math.inf


def beam(excitation, unit=1.0, **more):
    """A stiffening beam of frequency 1, in a unit of time (s)."""
    spring = vk.CubicSpring(1.0 / unit**2, 0.3 / unit**2)
    rate = 1.0 / unit
    return vk.Oscillator(natural_frequency=rate, damping_ratio=0.05, excitations=(excitation,), spring=spring, **more)


def by_pieces(force, cuts, state=START, cubic=0.3):
    """The end of the motion of the beam under a force of (time, number of the piece)."""
    for piece, (begin, end) in enumerate(itertools.pairwise(cuts)):
        solution = solve_ivp(
            lambda t, y, piece=piece: [y[1], force(t, piece) - y[0] - cubic * y[0] ** 3 - 0.1 * y[1]],
            (begin, end), state, method="DOP853", rtol=1e-12, atol=1e-13, max_step=(end - begin) / 20,
        )  # fmt: skip
        state = solution.y[:, -1]
    return state


def blown(width, periods):
    cuts = [PERIOD * number + part for number in range(periods) for part in (0.0, width)]
    return by_pieces(lambda _, piece: 0.5 / width if piece % 2 == 0 else 0.0, [*cuts, PERIOD * periods])


@pytest.mark.parametrize("unit", [1.0, 1e-3])
@pytest.mark.parametrize("width", [1.0, 0.01, 1e-3, 2e-4])
def test_no_blow_is_missed(width, unit):
    scene = beam(Blows(0.5 / unit, width * unit, PERIOD * unit), unit)
    path = scene.trajectory((START[0], START[1] / unit), periods=3, samples=3)
    assert np.allclose([path.x[-1], path.v[-1] * unit], blown(width, 3), rtol=0, atol=1e-7)


def test_many_at_once_see_blows_and_jumps():
    scene = beam(Blows(0.5, 0.01, PERIOD))
    assert np.allclose(scene.section_map([START], 3)[0], blown(0.01, 3), rtol=0, atol=1e-4)
    assert isinstance(ensemble_stepper(scene, Flow.STATE), vk.Order8)


@pytest.mark.parametrize("impulse", [0.5, 5e-9])
def test_a_mass_at_rest_is_met_by_a_pulse_that_begins_smoothly(impulse):
    """From exactly (0, 0), where no size is known, the displacement begins as the fourth power of time."""
    osc = beam(vk.PulseTrain(impulse, PERIOD, 0.1, 0.1, delay=3.0))
    edge = lambda u: u * u * (3 - 2 * u)  # noqa: E731
    pulse = lambda t, p: impulse / 0.1 * (0, edge((t - 3) / 0.1), edge((3.2 - t) / 0.1), 0)[p]  # noqa: E731
    cuts = [0.0, 3.0, 3.1, 3.2, PERIOD]
    path = osc.trajectory((0.0, 0.0), periods=1, samples=2)
    expected = by_pieces(lambda t, piece: pulse(t, piece) / impulse, cuts, (0.0, 0.0), 0.3 * impulse**2)
    assert np.allclose(path.states[-1] / impulse, expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize("width", [0.3, 0.1, 0.02])
def test_steps_with_noise_give_a_blow_its_impulse(width):
    """A free mass gains J in each period; the noise is far below the error of the steps."""
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.0, spring=vk.LinearSpring(0.0), noise=vk.WhiteNoise(1e-30),
        excitations=(Blows(0.5, width, PERIOD),),
    )  # fmt: skip
    assert osc.section_map([[0.0, 0.0]], 4, rng=0)[0, 1] == pytest.approx(2.0, rel=5e-3)


def test_blow_that_never_repeats():
    scene = beam(Bump(0.5, 2e-2, 40.0))
    bell = lambda t, _: 0.5 / 2e-2 / math.sqrt(2 * math.pi) * math.exp(-(((t - 40.0) / 2e-2) ** 2) / 2)  # noqa: E731
    path = scene.trajectory(START, duration=50.0, samples=2)
    assert np.allclose([path.x[-1], path.v[-1]], by_pieces(bell, [0.0, 39.8, 40.2, 50.0]), rtol=0, atol=1e-7)


def test_blow_is_seen_through_contact():
    """A mass that is at rest in a soft stop takes long steps there too."""
    stop = vk.Barrier(vk.Linear(1.0), -5.0, "right")  # the mass never leaves it
    scene = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=1.0, barriers=(stop,), excitations=(Blows(0.5, 0.01, PERIOD),),
        spring=vk.LinearSpring(0.0),
    )  # fmt: skip
    state = np.array([-5.0 + 0.2, 0.0])
    end = scene.trajectory(state, periods=3, samples=3)
    expected = np.array([0.2, 0.0])
    for span, force in ((0.01, 50.0), (PERIOD - 0.01, 0.0)) * 3:
        place = np.array([force, 0.0])  # where the mass would rest
        grow = math.exp(-span) * np.array([[1 + span, span], [-span, 1 - span]])
        expected = place + grow @ (expected - place)
    assert np.allclose([end.x[-1] + 5.0, end.v[-1]], expected, rtol=0, atol=1e-7)


def test_coarse_steps_are_warned_of():
    with pytest.warns(CoarseStepsWarning, match="pulse"):
        beam(Blows(0.5, 0.01, PERIOD)).trajectory(START, periods=1, stepper=vk.RK4(256))


def test_times_of_changes():
    found = changes_of(beam(Blows(0.5, 0.01, PERIOD)))
    assert 0.01 / 1.5 < found.pulse < 0.01 * 1.5
    assert found.rise < 1e-3
    assert changes_of(beam(vk.Harmonic(0.5, 200.0))) == (math.inf, math.inf, pytest.approx(2 * math.pi / 200.0), 0.0)


def test_frequencies_far_above_that_of_the_mass_are_resolved():
    """Two tones with 913 oscillations in a section of ten free ones: the response is a sum of two sinusoids."""
    tones = (65.0, 91.3)
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.5, excitations=[vk.Harmonic(100.0, w) for w in tones])
    responses = np.array([100.0 / (1 - w**2 + 1j * w) for w in tones])
    expected = [responses.sum().real, (1j * responses * tones).sum().real]
    assert osc.period == pytest.approx(20 * math.pi, rel=1e-12)
    np.testing.assert_allclose(osc.section_map([[0.0, 0.0]], 2)[0], expected, atol=1e-5)
