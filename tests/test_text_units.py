"""Units in which a user may give a parameter."""

import math

import pytest

from vibrokit.errors import ParameterError
from vibrokit.text_units import familiar, length_unit, number_in, parameter_text, size_of


@pytest.mark.parametrize(
    ("text", "base", "value", "unit"),
    [
        ("42Hz", "s^-1", 84 * math.pi, "Hz"),
        (" 0.2 kHz ", "s^-1", 400 * math.pi, "kHz"),
        ("3 rad/s", "s^-1", 3.0, "rad/s"),
        ("0.25mm", "m", 2.5e-4, "mm"),
        ("-1.5e2 µm", "m", -1.5e-4, "µm"),
        ("2 g", "m s^-2", 19.6133, "g"),
        ("4 (m/s²)²/Hz", "m^2 s^-3", 2.0, "(m/s²)²/Hz"),  # D is half the one-sided spectral density
        ("0.01 g^2/Hz", "m^2 s^-3", 0.01 * 9.80665**2 / 2, "g^2/Hz"),
        ("90 deg", "rad", math.pi / 2, "deg"),
        ("0.57", "s^-1", 0.57, None),
        ("1e-3", "", 1e-3, None),
    ],
)
def test_numbers(text, base, value, unit):
    number, given = number_in(text, base)
    assert number == pytest.approx(value, rel=1e-15)
    assert given == unit


@pytest.mark.parametrize(
    ("text", "base", "words"),
    [
        ("", "m", "no number"),
        ("mm", "m", "no number"),
        ("1 Hz", "m", "allowed are m, mm"),
        ("1 mm", "", "SI base units"),
    ],
)
def test_what_is_no_number(text, base, words):
    with pytest.raises(ParameterError, match=words):
        number_in(text, base)


def test_a_unit_that_is_unknown():
    with pytest.raises(ParameterError, match="rpm"):
        size_of("rpm", "s^-1")


def test_familiar_units():
    given = [
        (80 * math.pi, "s^-1"),
        (4e3 * math.pi, "s^-1"),
        (0.5, "s^-1"),
        (-2.5e-5, "m"),
        (0.05, "m"),
        (2.0, "m"),
        (5.0, "s"),
    ]
    assert [familiar(*one) for one in given] == ["40 Hz", "2 kHz", "", "-25 µm", "50 mm", "", ""]


@pytest.mark.parametrize(
    ("symbol", "unit", "text"),
    [
        ("omega_n", "s^-1", "a.b ω_n (s⁻¹)"),
        ("lambda", "m^(-1/2) s^-2", "a.b λ (m⁻¹ᐟ² s⁻²)"),
        ("k", "", "a.b k"),
        ("", None, "a.b"),
    ],
)
def test_parameters_as_text(symbol, unit, text):
    assert parameter_text("a.b", symbol, unit) == text


def test_lengths_that_are_read_easily():
    assert [length_unit(size) for size in (0.5, 3e-4, 2e-7, 1e-11, 0.0)] == ["m", "mm", "µm", "nm", "m"]
