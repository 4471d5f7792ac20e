"""Excitations that depend on time, against closed forms, published values and SciPy."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.signal import chirp

import vibrokit as vk
from vibrokit.errors import NoSectionError, ParameterError
from vibrokit.structure.linear_map import linear_map

RESTITUTION, DASHPOT = 0.5, 0.255276  # of a clipped Kelvin–Voigt stop
SLOWEST = math.pi * (1 - RESTITUTION) / (1 + RESTITUTION)
FASTEST = math.hypot(SLOWEST, 2 * (1 + RESTITUTION**2) / (1 + RESTITUTION) ** 2)
STIFFNESSES = (1e6, 4e6)


def test_support_motion_is_a_harmonic_force_of_minus_its_acceleration():
    """The steady state under y = a cos(ωt + φ) is Re[a ω² e^(iφ) e^(iωt) / (1 − ω² + 2iζω)]."""
    amplitude, frequency, phase = 0.3, 1.7, 0.4
    force = amplitude * frequency**2
    response = force * np.exp(1j * phase) / (1 - frequency**2 + 0.2j * frequency)
    expected = [response.real, (1j * frequency * response).real]
    for part in (
        vk.SupportMotion(amplitude, frequency, phase),
        vk.SupportAcceleration(-force, frequency, phase),
        vk.Harmonic(force, frequency, phase),
    ):
        osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=[part])
        np.testing.assert_allclose(osc.section_map([[0.0, 0.0]], 60)[0], expected, atol=1e-7)


class Table:
    """A ball on a vibrating table in units g = ω = 1, where one bounce takes one period and lands at t = π.

    Holmes, *J. Sound Vib.* 84 (1982) 173, without his approximation of a high bounce.
    """

    def __init__(self, stiffness):
        self.stiffness = stiffness
        self.phase = -math.asin(SLOWEST / FASTEST) - math.pi

    def scene(self, strength):
        law = vk.CustomLaw("k*depth + c*rate", k=self.stiffness, c=2 * DASHPOT * math.sqrt(self.stiffness))
        return vk.Oscillator(
            natural_frequency=1.0, damping_ratio=0.0, spring=vk.LinearSpring(0.0),
            barriers=[vk.Barrier(law, 0.0, "left")],
            excitations=[vk.Constant(-1.0), vk.SupportMotion(strength, 1.0, self.phase)],
        )  # fmt: skip

    def at_top(self, strength):
        """The state of a rigid ball half a period after its impact."""
        landing = self.phase + math.pi
        return [2 * strength * math.cos(landing) + math.pi**2 / 2, -strength * math.sin(landing)]

    def turn(self, state, strength):
        found = linear_map(self.scene(strength), np.array([state]), vk.FreeFlight(1e-12))
        return found.images[0] - state, found.derivatives[0]

    def bifurcation(self, multiplier, strength):
        """Γ at which the motion of one bounce per period has a multiplier, with the motion."""

        def equations(unknown):
            change, derivative = self.turn(unknown[:2], unknown[2])
            return [*change, np.linalg.det(derivative - multiplier * np.eye(2))]

        return fsolve(equations, [*self.at_top(strength), strength], xtol=1e-11)[2]

    def speed(self, strength):
        """Speed in space at which the ball lands."""
        x, v = fsolve(lambda state: self.turn(state, strength)[0], self.at_top(strength), xtol=1e-12)
        height, rise = x + strength * math.cos(self.phase), v - strength * math.sin(self.phase)
        above = lambda t: height + rise * t - t**2 / 2 - strength * math.cos(t + self.phase)  # noqa: E731
        return brentq(above, 0.5 * math.pi, 1.3 * math.pi) - rise


def rigid(find):
    """The limit of infinite stiffness: the duration of a contact, and with it the error, falls like k^(−1/2)."""
    soft, hard = (find(Table(stiffness)) for stiffness in STIFFNESSES)
    return 2 * hard - soft


@pytest.mark.slow
def test_one_bounce_per_period_begins_and_ends_at_the_published_strengths():
    begins = rigid(lambda table: table.bifurcation(1.0, SLOWEST))
    ends = rigid(lambda table: table.bifurcation(-1.0, FASTEST))
    assert begins == pytest.approx(1.047198, abs=1e-5)  # squares of the duration of a contact are 7e-6
    assert ends == pytest.approx(1.526824, abs=1e-5)


@pytest.mark.slow
def test_the_ball_lands_at_the_speed_at_which_it_leaves():
    assert rigid(lambda table: table.speed(1.4)) == pytest.approx(math.pi, abs=1e-5)


@pytest.mark.slow
def test_the_error_of_a_stop_of_finite_stiffness_falls_like_its_root():
    errors = [Table(stiffness).bifurcation(-1.0, FASTEST) - FASTEST for stiffness in STIFFNESSES]
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.02)


def test_parts_in_a_scene_file_are_the_same_scene(tmp_path):
    parts = [vk.SupportMotion(2.5e-4, 264.0), vk.SupportAcceleration(9.81, 264.0, phase=0.3)]
    osc = vk.Oscillator(natural_frequency=250.0, damping_ratio=0.02, excitations=parts)
    vk.save_scene(osc, tmp_path / "support.toml")
    assert vk.load_scene(tmp_path / "support.toml") == osc
    text = (tmp_path / "support.toml").read_text()
    assert '"support-motion"' in text
    assert '"support-acceleration"' in text


@pytest.mark.parametrize(("width", "rise"), [(0.1, 0.0), (0.1, 0.04), (0.1, 0.1), (2.4e-4, 0.0)])
def test_a_free_mass_gains_the_impulse_of_each_pulse(width, rise):
    train = vk.PulseTrain(0.5, 7.0, width, rise, delay=0.3)
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, spring=vk.LinearSpring(0.0), excitations=[train])
    assert osc.trajectory((0.0, 0.1), periods=3, samples=4).v[-1] == pytest.approx(1.6, abs=1e-7)
    assert osc.section_map([[0.0, 0.1]], 3)[0, 1] == pytest.approx(1.6, abs=1e-4)  # steps of tolerance 1e-6


def test_pulses_are_as_high_as_their_impulse_says():
    train = vk.PulseTrain.of_height(50.0, period=2.0, width=0.3, rise=0.1, delay=0.2)
    assert train == vk.PulseTrain(15.0, 2.0, 0.3, 0.1, 0.2)
    assert vk.PulseTrain.of_height("50 m/s^2", "2 s", "300 ms", 0.1, 0.2) == train
    times = [0.1, 0.25, 0.35, 0.45, 0.55, 0.7, 2.25, -1.75]  # before, half up, on top, half down, after, a period on
    assert [float(train.force(t)) for t in times] == pytest.approx([0, 25, 50, 50, 25, 0, 25, 25], abs=1e-9)


def test_an_impulse_in_newton_seconds_is_divided_by_the_mass():
    train = vk.PulseTrain("4 mN s", "20 ms", "1 ms")
    osc = vk.Oscillator(mass="0.5 kg", stiffness="200 N/m", damping_ratio=0.1, excitations=[train])
    assert osc.parameters["excitations.0.impulse"] == pytest.approx(0.008, rel=1e-14)
    assert osc.period == pytest.approx(0.02, rel=1e-14)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: vk.PulseTrain(0.5, 7.0, 2e-4), "PulseTrain: width must be from 1/30000 of the period .*got 0.0002"),
        (lambda: vk.PulseTrain(0.5, 1.0, 0.9, 0.2), "PulseTrain: width must be .* to 0.8, got 0.9"),
        (lambda: vk.PulseTrain(0.5, 1.0, 0.1, 0.2), "PulseTrain: rise must be at most the width, 0.1, got 0.2"),
        (lambda: vk.PulseTrain(0.5, 0.0, 0.1), "PulseTrain: period must be a finite number greater than 0, got 0"),
        (lambda: vk.PulseTrain(math.nan, 1.0, 0.1), "PulseTrain: impulse must be a finite number, got nan"),
        (lambda: vk.Chirp(1.0, -1.0, 2.0, 10.0), "Chirp: start_frequency must be a finite number at least 0, got -1"),
        (lambda: vk.Chirp(1.0, 1.0, 2.0, 0.0), "Chirp: duration must be a finite number greater than 0, got 0"),
    ],
)
def test_what_is_no_pulse_or_chirp(make, said):
    with pytest.raises(ParameterError, match=said):
        make()


def test_a_mass_under_a_chirp_moves_as_by_scipy():
    sweep = vk.Chirp(0.2, 0.3, 2.0, 60.0, phase=math.pi / 6)
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, excitations=[sweep])
    hertz = (0.3 / (2 * math.pi), 60.0, 2.0 / (2 * math.pi))
    rate = lambda t, y: [y[1], 0.2 * chirp(t, *hertz, phi=30) - y[0] - 0.1 * y[1]]  # noqa: E731
    swept = solve_ivp(rate, (0, 60), [0.1, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    after = solve_ivp(lambda t, y: [y[1], -y[0] - 0.1 * y[1]], (0, 10), swept, rtol=1e-12, atol=1e-13).y[:, -1]
    ends = [osc.trajectory((0.1, 0.0), duration=end, samples=2).states[-1] for end in (60.0, 70.0)]
    np.testing.assert_allclose(ends, [swept, after], atol=1e-7)


def test_a_chirp_has_no_section():
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, excitations=[vk.Chirp(0.2, 0.3, 2.0, 60.0)])
    for ask in (lambda: osc.period, lambda: osc.section_map([[0.0, 0.0]]), lambda: vk.find_structure(osc, rng=0)):
        with pytest.raises(NoSectionError, match=r"never repeats.*no section.*trajectory"):
            ask()
