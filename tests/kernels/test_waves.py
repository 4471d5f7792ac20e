"""Sine and cosine of kernels that locate contacts, against exact values."""

import mpmath
import numpy as np
import pytest

from vibrokit.kernels.waves import cos, sin

ARGUMENTS = np.concatenate(
    [
        np.pi / 4 * np.arange(-40, 41),
        np.random.default_rng(0).uniform(-1e3, 1e3, 300),
        np.random.default_rng(1).uniform(-1e8, 1e8, 300),
        [0.0, 1e-300, -1e-9],
    ]
)


@pytest.mark.parametrize(("found", "exact"), [(sin, mpmath.sin), (cos, mpmath.cos)], ids=["sin", "cos"])
def test_two_units_in_the_last_place_of_one(found, exact):
    with mpmath.workdps(40):
        errors = [abs(found(x) - exact(mpmath.mpf(x))) for x in ARGUMENTS.tolist()]
    assert max(errors) <= 2 * np.finfo(float).eps


def test_small_arguments_are_exact():
    assert sin(0.0) == 0.0
    assert sin(1e-300) == 1e-300
    assert cos(0.0) == 1.0


def test_what_is_not_finite_is_not_a_number():
    assert np.isnan(sin(np.inf))
    assert np.isnan(cos(np.nan))
