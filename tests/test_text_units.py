"""Units in which a user may give a parameter."""

import math

import pytest

from vibrokit.errors import ParameterError
from vibrokit.text_units import familiar, number_in, size_of


@pytest.mark.parametrize(
    ("text", "base", "value", "unit"),
    [
        ("42Hz", "s^-1", 84 * math.pi, "Hz"),
        (" 0.2 kHz ", "s^-1", 400 * math.pi, "kHz"),
        ("3 rad/s", "s^-1", 3.0, "rad/s"),
        ("0.25mm", "m", 2.5e-4, "mm"),
        ("-1.5e2 µm", "m", -1.5e-4, "µm"),
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
        (3.0, "s^-1"),
        (-2.5e-4, "m"),
        (0.1, "m"),
        (2.0, "m"),
        (5.0, "s"),
    ]
    assert [familiar(*one) for one in given] == ["40 Hz", "2 kHz", "", "-250 µm", "100 mm", "", ""]
