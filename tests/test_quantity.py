"""Numbers with units: what they are in SI base units, and what is refused."""

import copy
import json
import math
import pickle
from fractions import Fraction

import numba
import numpy as np
import pint
import pytest
import sympy

from vibrokit.errors import ParameterError
from vibrokit.quantity import Quantity, is_quantity, number_in, read, size_of

UNITS = pint.UnitRegistry()


@pytest.mark.parametrize(
    ("text", "unit", "value", "mass_power"),
    [
        ("22 kN/m", "s^-2", 22e3, 1),
        ("5 GN/m^1.5", "m^(-1/2) s^-2", 5e9, 1),
        ("5 GN/m^(3/2)", "m^(-1/2) s^-2", 5e9, 1),
        ("3e9 s^-2", "s^-2", 3e9, 0),
        ("2 N/mm^3", "m^-2 s^-2", 2e9, 1),
        ("6 N", "m s^-2", 6.0, 1),
        ("-1.5 lbf", "m s^-2", -1.5 * 4.4482216152605, 1),
        ("0.5 g_n", "m s^-2", 0.5 * 9.80665, 0),
        ("0.3 mm", "m", 3e-4, 0),
        ("-1.5e2 µm", "m", -1.5e-4, 0),
        ("0.7 nm", "m", 7e-10, 0),
        ("42Hz", "rad s^-1", 84 * math.pi, 0),
        (" 0.2 kHz ", "rad s^-1", 400 * math.pi, 0),
        ("60 rpm", "rad s^-1", 2 * math.pi, 0),
        ("3 rad/s", "rad s^-1", 3.0, 0),
        ("3 1/s", "rad s^-1", 3.0, 0),
        ("3 s⁻¹", "s^-1", 3.0, 0),
        ("90 deg", "rad", math.pi / 2, 0),
        ("90°", "rad", math.pi / 2, 0),
        ("4 (m/s²)²/Hz", "m^2 s^-3", 2.0, 0),  # D is half the one-sided spectral density
        ("0.04 g_n^2/Hz", "m^2 s^-3", 0.02 * 9.80665**2, 0),
        ("1e-3 N^2/Hz", "m^2 s^-3", 5e-4, 2),
        ("2 m^2/s^3", "m^2 s^-3", 2.0, 0),
        ("2 N²·s", "m^2 s^-3", 2.0, 2),
        ("0.8 %", "", 0.008, 0),
        ("350 g", "kg", 0.35, 0),
        ("8 h", "s", 28800.0, 0),
        ("4 (m/s²)²/Hz", "m^2 s^-4 Hz^-1", 4.0, 0),  # a density as such
        ("4 N^2/Hz", "kg^2 m^2 s^-4 Hz^-1", 4.0, 0),
    ],
)
def test_values(text, unit, value, mass_power):
    found = read("x", text, unit)
    assert float(found) == pytest.approx(value, rel=1e-15)
    assert (found.text, found.mass_power, found.pending) == (text.strip(), mass_power, mass_power > 0)


def test_decimal_units_are_exact():
    """0.3 × 0.001 is not the float nearest to 0.0003."""
    for number in ("0.3", "0.7", "1.1", "2.3e-7"):
        assert read("x", f"{number} mm", "m") == float(Fraction(number) / 1000)


def test_damping_takes_the_mass_where_it_is_declared():
    assert read("x", "4 N s/m", "s^-1", 1).of_mass(2.0) == 2.0
    with pytest.raises(ParameterError, match=r"^x must be in s\^-1, got '4 N s/m', which is in kg s\^-1;"):
        read("x", "4 N s/m", "s^-1")
    with pytest.raises(ParameterError, match=r"^x must be in m s\^-2, got '6 N', which is in kg m s\^-2;"):
        read("x", "6 N", "m s^-2", 0)


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("6 kN/m", "m s^-2", r"must be in m s\^-2, or kg m s\^-2 with .*, got '6 kN/m', which is in kg s\^-2; allowed"),
        ("2 g", "m s^-2", r"which is in kg; g is the gram, and g_n the standard gravity; allowed are units of m s\^-2"),
        ("1e-3 g^2/Hz", "m^2 s^-3", r"which is in kg\^2 s; g is the gram, and g_n the standard gravity"),
        ("1 N^2", "m s^-2", r"which is in kg\^2 m\^2 s\^-4"),
        ("1 kg^2 m/s^2", "m s^-2", r"which is in kg\^2 m s\^-2"),
        ("2 kg m", "m", r"must be in m, got '2 kg m', which is in kg m;"),
        ("2 kg/s", "rad s^-1", r"must be in rad s\^-1, got '2 kg/s', which is in kg s\^-1; .* such as Hz or rad/s"),
        ("0.1 kg", "", "must be without a dimension, got '0.1 kg', which is in kg"),
        ("5 hz", "rad s^-1", r"has the unknown unit 'hz'; allowed are units of rad s\^-1, such as Hz or rad/s\.$"),
        ("5 Hz", "s^-1", "is '5 Hz', and hertz and radians have no meaning in a parameter in s.-1 that is no angular"),
        ("3 rad/s", "s^-1", "hertz and radians have no meaning"),
        ("12 turn/s", "s^-1", "hertz and radians have no meaning"),  # nor in a damping
        ("5 deg", "", "hertz and radians have no meaning"),
        ("1 m^2/s^4/(rad/s)", "m^2 s^-3", "hertz and radians have no meaning"),
        ("1 m^2/s^3", "m^2 s^-4 Hz^-1", "hertz and radians have no meaning"),
        ("3 degC", "", "has the unknown unit 'degC'"),  # its zero is another
        ("3 dB", "", "has the unknown unit 'dB'"),
        ("1 mm", None, "declares no unit; give a number without one, got '1 mm'"),
        ("1 mm", "m^(1-n) s^-2", r"has the unit m\^\(1-n\) s\^-2, which no other is compared with"),
        ("1 s^9^9^9", "s", "unknown unit"),  # Pint would compute these powers
        ("1 s^(9)^(9)^9", "s", "unknown unit"),
        ("6 ((((min^99)^99)^99)^99)", "m s^-2", "unknown unit"),
        ("1 (9)^9 s", "s", "unknown unit"),
        ("1 9**9**9", "s", "unknown unit"),
        ("1 s" + " s" * 60, "s", "must be a number, or a number with a unit"),
        ("1 aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa!", "m", "unknown unit"),
    ],
)
def test_what_is_refused(text, unit, words):
    with pytest.raises(ParameterError, match=words) as refusal:
        read("x", text, unit)
    assert str(refusal.value).endswith(".")


def test_texts_that_are_no_quantities():
    assert [is_quantity(value) for value in ("50", "mm", "", "nan m", b"1 m", 1.0, None)] == [False] * 7
    assert is_quantity("50 m")


@pytest.mark.parametrize(
    ("quantity", "unit", "text", "value"),
    [
        (UNITS.Quantity(6, "N"), "m s^-2", "6 N", 6.0),
        (UNITS.Quantity(np.float64(22.5), "kN/m"), "s^-2", "22.5 kN/m", 22.5e3),
        (UNITS.Quantity(np.array(3), "kN/m**1.5"), "m^(-1/2) s^-2", "3 kN/m^1.5", 3e3),
        (pint.UnitRegistry(non_int_type=Fraction).Quantity(Fraction(1, 4), "mm"), "m", "0.25 mm", 2.5e-4),
        (UNITS.Quantity(65.0, "Hz"), "rad s^-1", "65 Hz", 130 * math.pi),
        (UNITS.Quantity(0.01), "", "0.01 dimensionless", 0.01),
    ],
)
def test_quantities_of_pint_of_any_registry(quantity, unit, text, value):
    found = read("x", quantity, unit)
    assert (found.text, float(found)) == (text, pytest.approx(value, rel=1e-15))


def test_a_unit_that_pint_has_under_two_names_is_written_in_full():
    found = read("x", UNITS.Quantity(3.0, "milliinch"), "m")
    assert (found.text, float(found)) == ("3 milliinch", pytest.approx(7.62e-5, rel=1e-15))


def test_a_unit_of_one_registry_alone():
    own = pint.UnitRegistry()
    own.define("kip = 2 newton")
    with pytest.raises(ParameterError, match="must be one real number with its unit"):
        read("x", own.Quantity(1.0, "kip"), "m s^-2")


@pytest.mark.parametrize("magnitude", [np.array([1.0, 2.0]), 1j])
def test_quantities_of_pint_that_are_no_number(magnitude):
    with pytest.raises(ParameterError, match=r"^x must be one real number with its unit, got <Quantity"):
        read("x", UNITS.Quantity(magnitude, "N"), "m s^-2")


class TestFloat:
    """A quantity is a float wherever one is taken, and keeps its text."""

    FORCE = read("x", "6 N", "m s^-2").of_mass(0.35)

    def test_value(self):
        assert self.FORCE == 6 / 0.35
        assert hash(self.FORCE) == hash(6 / 0.35)
        assert (repr(self.FORCE), str(self.FORCE), f"{self.FORCE:.3g}") == ("'6 N'", "6 N", "17.1")
        assert self.FORCE.unit == "N"

    def test_arithmetic_leaves_plain_floats(self):
        assert {type(one) for one in (2 * self.FORCE, self.FORCE / 3, -self.FORCE, abs(self.FORCE))} == {float}

    @pytest.mark.parametrize("copied", [lambda q: pickle.loads(pickle.dumps(q)), copy.copy, copy.deepcopy])
    def test_copies(self, copied):
        for quantity in (self.FORCE, read("x", "6 N", "m s^-2")):
            found = copied(quantity)
            assert type(found) is Quantity
            assert [getattr(found, name) for name in Quantity.__slots__] == [
                getattr(quantity, name) for name in Quantity.__slots__
            ]
            assert found == quantity

    def test_other_libraries(self):
        assert json.loads(json.dumps(self.FORCE)) == 6 / 0.35
        assert sympy.sympify(self.FORCE) == sympy.Float(6 / 0.35)
        assert numba.njit(lambda x: x)(self.FORCE) == 6 / 0.35
        assert np.array([self.FORCE, 1.0]).tolist() == [6 / 0.35, 1.0]

    def test_another_mass_divides_what_was_given(self):
        assert self.FORCE.of_mass(0.7) == 6 / 0.7
        assert self.FORCE.of_mass(None).pending
        assert read("x", "1e-3 N^2/Hz", "m^2 s^-3").of_mass(0.35) == 1e-3 / 0.35**2 / 2


def test_numbers_of_a_command_line():
    assert number_in("x", "0.57", "rad s^-1") == (0.57, None)
    assert number_in("x", " 0.25mm", "m") == (2.5e-4, "mm")
    assert number_in("x", "7 N", "m s^-2", 3.5) == (2.0, "N")
    assert number_in("x", "7 N s/m", "s^-1", 3.5, mass_power=1) == (2.0, "N s/m")
    with pytest.raises(ParameterError, match="must be in rad"):
        number_in("x", "7 N s/m", "rad s^-1", 3.5)
    assert size_of("Hz", "rad s^-1") == 2 * math.pi
    for text, words in (("", "must be a number"), ("mm", "must be a number"), ("1 N", "needs a mass")):
        with pytest.raises(ParameterError, match=f"^x .*{words}"):
            number_in("x", text, "m s^-2")
