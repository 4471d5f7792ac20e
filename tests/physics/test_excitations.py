"""Excitations that depend on time, against closed forms, published values and SciPy."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq, fsolve

import vibrokit as vk
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
