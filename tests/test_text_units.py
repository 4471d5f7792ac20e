"""How parameters, units and numbers in units that read well are written."""

import math

import pytest

from vibrokit.text_units import familiar, length_unit, parameter_text


def test_familiar_units():
    given = [
        (80 * math.pi, "rad s^-1"),
        (4e3 * math.pi, "rad s^-1"),
        (0.5, "rad s^-1"),
        (80 * math.pi, "s^-1"),  # a rate has no cycles
        (-2.5e-5, "m"),
        (0.05, "m"),
        (2.0, "m"),
        (19.6133, "m s^-2"),
        (5.0, "s"),
    ]
    assert [familiar(*one) for one in given] == ["40 Hz", "2 kHz", "", "", "-25 µm", "50 mm", "", "2 g_n", ""]


@pytest.mark.parametrize(
    ("symbol", "unit", "text"),
    [
        ("omega_n", "rad s^-1", "a.b ω_n (rad s⁻¹)"),
        ("lambda", "m^(-1/2) s^-2", "a.b λ (m⁻¹ᐟ² s⁻²)"),
        ("k", "", "a.b k"),
        ("", None, "a.b"),
    ],
)
def test_parameters_as_text(symbol, unit, text):
    assert parameter_text("a.b", symbol, unit) == text


def test_lengths_that_are_read_easily():
    found = [length_unit(size) for size in (0.5, 3e-4, 2e-7, 1e-11, 0.0)]
    assert found == [("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9), ("m", 1.0)]
