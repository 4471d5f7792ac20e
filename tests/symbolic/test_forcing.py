"""Forces that vary in time with the state: the functions of time that they need, and what is derived of them."""

import math
import re

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

import vibrokit as vk
from tests.scenes import scene
from vibrokit.errors import ArgumentError, DerivationError
from vibrokit.kernels.kernel import kernel_for
from vibrokit.parts.functions import cos, exp, sin
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.forcing import FORCING, forcing_of

T, X, V = sympy.symbols("t x v", real=True)
A, W = sympy.symbols("a w", positive=True)
WAVE = A * sympy.cos(W * T)


@pytest.mark.parametrize(
    ("force", "pure", "functions"),
    [
        (WAVE, WAVE, []),
        (WAVE * X, 0, [sympy.cos(W * T)]),
        (WAVE * (X + X**3), 0, [sympy.cos(W * T)]),
        ((1 + WAVE) * X, 0, [sympy.cos(W * T)]),
        (W**2 * (X - WAVE), -(W**2) * WAVE, []),
        (-((X - WAVE) ** 3), 0, [-WAVE]),
        (sympy.exp(X - WAVE**2) / 2 + sympy.sin(X - WAVE) + WAVE, WAVE, None),
        (sympy.cos(T * X), 0, [T]),
        (sympy.exp(-(X**2)) * (WAVE + WAVE**2), 0, [WAVE + WAVE**2]),
    ],
)
def test_functions_of_time(force, pure, functions):
    found = forcing_of([force], T, (X, V))
    own = dict(found.functions)
    assert sympy.expand(own.pop(FORCING, 0) - pure) == 0
    assert functions is None or list(own.values()) == functions
    assert T not in found.in_functions.free_symbols
    assert sympy.expand(found.in_functions.subs(found.functions) - found.varying) == 0
    assert sympy.expand(found.varying + found.steady - force) == 0


def test_forces_share_their_functions():
    found = forcing_of([WAVE * X, WAVE * V, WAVE, sympy.Integer(3), X], T, (X, V))
    assert found.functions == {FORCING: WAVE, sympy.Symbol("f1", real=True): sympy.cos(W * T)}
    assert found.steady == 3 + X


class Wave(vk.Excitation):
    """A force whose wave passes the mass: a cos(ωt − kx)."""

    amplitude: float = vk.parameter("a", "m s^-2")
    frequency: float = vk.parameter("omega", "s^-1", above=0)
    number: float = vk.parameter("k", "m^-1")

    def force(self, t, x, v):
        return self.amplitude * cos(self.frequency * t - self.number * x)

    @property
    def period(self):
        return 2 * math.pi / self.frequency


class Swung(vk.Excitation):
    """A pendulum on a support that moves up and down: −a cos(ωt) sin(x), and damping that varies."""

    amplitude: float = vk.parameter("a", "s^-2")
    damping: float = vk.parameter("c", "s^-1")
    frequency: float = vk.parameter("omega", "s^-1", above=0)

    def force(self, t, x, v):
        return -cos(self.frequency * t) * (self.amplitude * sin(x) + self.damping * v)

    @property
    def period(self):
        return 2 * math.pi / self.frequency


def test_hamilton_s_equations():
    """Differentiated by hand."""
    osc = scene(excitations=(Swung(0.3, 0.1, 1.3), vk.Harmonic(0.2, 1.3)), noise=vk.WhiteNoise(1e-3))
    model = osc.model
    t, (x, _v), (p, q) = model.time, model.state, model.momenta
    a, c, w = (model.symbols[f"excitations.0.{name}"] for name in ("amplitude", "damping", "frequency"))
    natural, zeta = model.symbols["natural_frequency"], model.symbols["damping_ratio"]
    wave = sympy.cos(w * t)
    wanted = {
        p: q * (natural**2 + a * wave * sympy.cos(x)),
        q: -p + q * (2 * zeta * natural + c * wave),
    }
    for momentum, rate in wanted.items():
        assert sympy.simplify(model.equations[momentum] - rate) == 0


@pytest.mark.parametrize("stepper", [vk.RK4(4096), vk.RK8(512), vk.Order8(1e-12)], ids=lambda one: one.name)
def test_any_smooth_force_is_integrated(stepper):
    osc = scene(excitations=(Wave(0.4, 1.3, 0.7), Swung(0.3, 0.1, 1.3)))

    def rate(t, state):
        x, v = state
        wave = math.cos(1.3 * t)
        return v, -0.02 * v - x + 0.4 * math.cos(1.3 * t - 0.7 * x) - wave * (0.3 * math.sin(x) + 0.1 * v)

    wanted = solve_ivp(rate, (0, 3 * osc.period), [0.5, 0.2], method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    found = osc.trajectory([0.5, 0.2], periods=3, stepper=stepper).states[-1]
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize("flow", list(Flow), ids=lambda flow: flow.value)
def test_a_scene_has_no_more_functions_of_time_than_it_needs(flow):
    def arguments(*excitations):
        kernel = kernel_for(scene(excitations=excitations, noise=vk.WhiteNoise(1e-3)), flow, vk.RK4())
        found = re.search(r"def derivative\((.*)\):", kernel.scene.source).group(1).split(", ")
        functions = [name for name in found if re.fullmatch(r"f\d*", name)]
        assert f"FACTS = (LANES, FORCED, {3 * len(functions)}" in kernel.scene.source
        return functions

    stiffness, force = vk.ParametricStiffness(0.1, 2.0), vk.Harmonic(0.1, 2.0)
    assert arguments(force, vk.Constant(0.1)) == ["f"]
    assert arguments(stiffness) == ["f1"]
    assert arguments(stiffness, force) == ["f", "f1"]


class Short(vk.Excitation):
    """Bad forces, by number."""

    kind: float = vk.parameter("n", "", structural=True)
    period = 2 * math.pi

    def force(self, t, x, v):
        wave = cos(t)
        return {
            1: wave * sympy.sign(v),
            2: wave * sympy.sign(x),
            3: wave / (1 + x),
            4: wave * abs(x) ** 0.3,
            5: x * exp(t),
        }[int(self.kind)]


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        (1.0, "jumps.* where v = 0"),
        (2.0, "jumps.* where x = 0"),
        (3.0, r"may have no value where x \+ 1 = 0; a force that varies in time must have values at all x and v"),
        (4.0, "infinite where x = 0; a force that varies in time must be smooth"),
        (5.0, r"period is 6\.283185307, but its force changes by"),
    ],
)
def test_forces_that_are_refused(kind, said):
    with pytest.raises(DerivationError, match=said):
        _ = scene(excitations=(Short(kind),)).model.equations


def test_arguments_of_a_force():
    with pytest.raises(ArgumentError, match=r"Odd\.force has the arguments \(t, x\); .*force\(self, t, x, v\)"):

        class Odd(vk.Excitation):
            period = 1.0

            def force(self, t, x):
                return t * x

    assert vk.Harmonic.variables == ("t",)
    assert vk.ParametricStiffness.variables == ("t", "x", "v")
