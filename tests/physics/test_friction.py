"""Friction as a part: closed forms of motion under dry friction, and a self-excited mass on a belt."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from vibrokit.errors import ParameterError, SceneError

WIDTH = 1e-4


def test_each_swing_loses_twice_the_same_length():
    """Under x″ + x = −f sign(x′) each half swing ends 2f nearer to 0 (Den Hartog, *Mechanical Vibrations*, § 2)."""
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, friction=vk.DryFriction(0.05, WIDTH))
    swings = osc.trajectory([1.0, 0.0], duration=3 * math.pi, samples=2).states
    ends = np.abs(np.interp(math.pi * np.arange(4), np.linspace(0, 3 * math.pi, len(swings)), swings[:, 0]))
    # The smooth form is late in changing the force by a time in which the mass moves by about w.
    np.testing.assert_allclose(ends, 1.0 - 0.1 * np.arange(4), atol=10 * WIDTH)


def test_sliding_without_stop_has_the_amplitude_of_den_hartog():
    """Source: Den Hartog, *Trans. ASME* 53 (1931) APM-107-9, for motion without sticking, r = ω/ω_n."""
    amplitude, friction, ratio = 1.0, 0.2, 0.6
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.0,
        friction=vk.DryFriction(friction, WIDTH),
        excitations=[vk.Harmonic(amplitude, ratio)],
    )
    settled = osc.section_map([[0.0, 0.0]], 60)
    motion = osc.trajectory(settled[0], periods=1, samples=4096).states[:, 0]
    gain = 1.0 / (1.0 - ratio**2)
    drift = math.sin(math.pi / ratio) / (ratio * (1.0 + math.cos(math.pi / ratio)))
    exact = math.sqrt((gain * amplitude) ** 2 - (drift * friction) ** 2)
    assert np.abs(motion).max() == pytest.approx(exact, rel=1e-3)


def test_a_mass_on_a_belt_sticks_and_slips_as_an_independent_integration():
    stribeck = {"magnitude": 0.5, "static": 1.0, "decay": 0.3, "width": 0.02, "belt": 0.2}
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.01, friction=vk.StribeckFriction(**stribeck))

    def rate(_, state):
        sliding = state[1] - 0.2
        friction = (0.5 + 0.5 * math.exp(-((sliding / 0.3) ** 2))) * math.tanh(sliding / 0.02)
        return state[1], -state[0] - 0.02 * state[1] - friction

    theirs = solve_ivp(rate, (0.0, 12.0), [0.0, 0.0], method="LSODA", rtol=1e-11, atol=1e-13).y[:, -1]
    ours = osc.trajectory([0.0, 0.0], duration=12.0, samples=8).states[-1]
    np.testing.assert_allclose(ours, theirs, atol=1e-8)


def test_friction_in_a_scene_file_is_the_same_scene(tmp_path):
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, friction=vk.DryFriction(0.1, 1e-3, belt=0.2))
    vk.save_scene(osc, tmp_path / "belt.toml")
    assert vk.load_scene(tmp_path / "belt.toml") == osc
    assert osc.replace(width=2e-3).friction.width == 2e-3


@pytest.mark.parametrize(
    ("make", "error"),
    [
        (lambda: vk.DryFriction(0.1, 0.0), ParameterError),
        (lambda: vk.DryFriction(-0.1, 1e-3), ParameterError),
        (lambda: vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, friction=0.1), SceneError),
        (lambda: vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, friction=vk.LinearSpring(1.0)), SceneError),
    ],
)
def test_what_is_no_friction_is_refused(make, error):
    with pytest.raises(error, match=r"friction|Friction"):
        make()
