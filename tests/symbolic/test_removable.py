"""Divisions that cancel leave no hole in a force; what is 0/0 otherwise is named with its place."""

import numpy as np
import pytest
import sympy

import vibrokit as vk
from tests.scenes import scene
from vibrokit.errors import IntegrationError, StructureError
from vibrokit.symbolic.removable import without_removable

x, v = sympy.symbols("x v", real=True)
a, b = sympy.symbols("a b", real=True)


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ((x**4 - x**2) / x, x**3 - x),
        ((x**2 - b**2) / (x - b), x + b),
        (a * (v**3 - v) / v + x, a * (v**2 - 1) + x),
        (x / sympy.sqrt(sympy.Abs(x)), sympy.sqrt(sympy.Abs(x)) * sympy.sign(x)),
        (x**2 / sympy.Abs(x), sympy.Abs(x)),
        (x + a * x**3 / sympy.sqrt(sympy.Abs(x)), x + a * sympy.Abs(x) ** sympy.Rational(5, 2) * sympy.sign(x)),
        ((x**3 - x) / (x * (x - 2)), (x**2 - 1) / (x - 2)),
    ],
)
def test_divisions_that_cancel(written, meant):
    found = without_removable(written, (x, v))
    assert sympy.simplify(found - meant) == 0
    assert found.subs({x: 0, v: 0}).is_finite


@pytest.mark.parametrize("written", [x - a / (b - x) ** 2, 1 / x, sympy.sin(x) / x, x / (1 + x**2), x**3 - x + a * v])
def test_others_stay_as_they_were_written(written):
    assert without_removable(written, (x, v)) == written


def test_a_double_well_with_a_division_is_the_double_well():
    wells, divided = (scene(damping_ratio=0.2, spring=vk.CustomSpring(f)) for f in ("x**3 - x", "(x**4 - x**2)/x"))
    states = [[0.0, 0.0], [0.0, 0.3], [0.5, 0.0]]
    np.testing.assert_allclose(divided.section_map(states), wells.section_map(states), rtol=1e-12)


@pytest.mark.parametrize("formula", ["(1 - cos(x))/x + x", "x*log(x**2) + x"])
def test_what_remains_is_named_with_its_place(formula):
    osc = scene(damping_ratio=0.2, spring=vk.CustomSpring(formula))
    with pytest.raises(IntegrationError, match=r"\(0\.0, 0\.0\), where a force has no value"):
        osc.trajectory((0.0, 0.0), 1)
    with pytest.raises(StructureError):
        vk.find_structure(osc, region=((-1, 1), (-1, 1)), cells=(10, 10), starts=(4, 4))
