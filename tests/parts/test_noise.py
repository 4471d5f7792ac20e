"""Noise as engineers have it: power spectral densities."""

import math

import numpy as np
import pytest
import sympy
from scipy.integrate import quad
from scipy.linalg import solve_continuous_lyapunov

import vibrokit as vk
from vibrokit.errors import ParameterError
from vibrokit.parts.spectral_density import Measured


def test_a_density_of_an_acceleration_is_twice_the_intensity():
    """The variance of a unit oscillator under white noise of one-sided density S is S ω_n/(8ζ) (Crandall and Mark)."""
    noise, natural, zeta = vk.WhiteNoise.from_psd(0.3), 2.0, 0.1
    assert noise.psd == pytest.approx(0.3, rel=1e-15)
    flow = np.array([[0.0, 1.0], [-(natural**2), -2 * zeta * natural]])
    spread = solve_continuous_lyapunov(flow, -np.diag([0.0, noise.intensity]))
    assert natural**4 * spread[0, 0] == pytest.approx(0.3 * natural / (8 * zeta), rel=1e-12)


@pytest.mark.parametrize("of", ["base acceleration", Measured.BASE_ACCELERATION, "acceleration"])
def test_the_support_shakes_as_a_force_does(of):
    assert vk.WhiteNoise.from_psd(0.3, of) == vk.WhiteNoise(0.15)


def test_a_density_of_a_force_is_divided_by_the_square_of_the_mass():
    assert vk.WhiteNoise.from_psd(2.0, of="force", mass=0.5) == vk.WhiteNoise(4.0)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"level": -1.0}, "WhiteNoise.from_psd: level must be a finite number at least 0, got -1."),
        ({"level": "1"}, "WhiteNoise.from_psd: level must be a finite number at least 0, got '1'."),
        ({"level": 1.0, "of": "force"}, "needs the mass that it acts on; give mass= in kg."),
        ({"level": 1.0, "of": "force", "mass": 0.0}, "mass must be a finite number greater than 0, got 0."),
        ({"level": 1.0, "mass": 2.0}, "mass is for the density of a force, got 2.0 with of='acceleration'"),
        ({"level": 1.0, "of": "velocity"}, "of must be one of 'acceleration', 'force', 'base acceleration', got"),
        ({"level": 1.0, "of": 3}, "of must be one of 'acceleration', 'force', 'base acceleration', got 3."),
    ],
)
def test_what_is_no_density(arguments, said):
    with pytest.raises(ParameterError) as caught:
        vk.WhiteNoise.from_psd(**arguments)
    assert said in str(caught.value)
    assert str(caught.value).endswith(".")


FILTERS = [vk.ColouredNoise(0.2, 1.7), vk.FilteredNoise(0.2, 1.7, 0.05), vk.FilteredNoise(0.2, 1.7, 2.0)]


@pytest.mark.parametrize("noise", FILTERS, ids=repr)
def test_the_density_is_that_of_the_equations(noise):
    """By the transfer function of the extra states, and, integrated, by Lyapunov's equation for their variance."""
    model = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, noise=noise).model
    numbers, extra = model.numbers, list(model.state[2:])
    flow = np.array(model.drift[2:, :].jacobian(extra).subs(numbers), dtype=float)
    driven = np.array(model.amplitude[2:, 0].subs(numbers), dtype=float)
    push = np.array([sympy.diff(model.drift[1], state) for state in extra], dtype=float)
    for frequency in (0.0, 0.3, 1.7, 9.0):
        gain = push @ np.linalg.solve(1j * frequency * np.eye(len(extra)) - flow, driven)[:, 0]
        assert noise.density(frequency) == pytest.approx(2 * noise.intensity * abs(gain) ** 2, rel=1e-12)
    spread = solve_continuous_lyapunov(flow, -noise.intensity * driven @ driven.T)
    area = sum(quad(noise.density, *part, limit=200)[0] for part in ((0, 1.7), (1.7, 10.0), (10.0, math.inf)))
    assert area / (2 * math.pi) == pytest.approx(push @ spread @ push, rel=1e-6)


def test_the_peak_of_a_narrow_band():
    noise = vk.FilteredNoise(0.2, 1.7, 0.05)
    assert noise.density(1.7) == pytest.approx(0.4, rel=1e-14)
    low, high = (1.7 * (math.sqrt(1 + 0.05**2) + sign * 0.05) for sign in (-1, 1))  # |ω² − ν²| = 2ζων
    assert [noise.density(low), noise.density(high)] == pytest.approx([0.2, 0.2], rel=1e-12)


@pytest.mark.parametrize("noise", FILTERS, ids=repr)
def test_a_scene_file_keeps_it(noise, tmp_path):
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, noise=noise)
    vk.save_scene(osc, tmp_path / "scene.toml")
    assert vk.load_scene(tmp_path / "scene.toml") == osc


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: vk.ColouredNoise(0.1, 0.0), "ColouredNoise: rate must be a finite number greater than 0, got 0."),
        (lambda: vk.ColouredNoise(-0.1, 1.0), "ColouredNoise: intensity must be a finite number at least 0"),
        (lambda: vk.FilteredNoise(0.1, -1.0, 0.1), "FilteredNoise: frequency must be a finite number greater than 0"),
        (lambda: vk.FilteredNoise(0.1, 1.0, 0.0), "FilteredNoise: damping_ratio must be a finite number greater than"),
    ],
)
def test_parameters_out_of_range(make, said):
    with pytest.raises(ParameterError, match=said):
        make()
