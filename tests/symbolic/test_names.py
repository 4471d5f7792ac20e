"""Names that users choose have a namespace of their own in generated code, and decide nothing else."""

import ast
import math
import re
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
import sympy

import vibrokit as vk
from tests.scenes import scene
from vibrokit.errors import DerivationError, FormulaError, SceneError
from vibrokit.kernels import kernel
from vibrokit.kernels.kernel import kernel_for, write_sources
from vibrokit.symbolic.flow_kind import Flow

# Locals and functions of generated code, builtins, modules, Greek letters, names that SymPy keeps for itself.
WORDS = """
h k1_x k2_u_h z lane t f f0 S p_1 m_00 W00 C0 C0_x d0_1 _c0 on0 theta out steps forces room rates derivative amplitude
touching side depth rate np njit max abs range float sqrt exp pi nan lambda class E I N O Q beta gamma zeta lamda
omega_n u u_ u_y x v b k
"""
NAMES = (*WORDS.split(), "ω", "δ′", "x y", 'a"""b', "a\nb", "a\\", "0", "½", "𝑥")

_SHOWN = ("t", "S", "depth")  # by equations; a user's name like these gets another one there


def coloured(name, symbol="r"):
    """Ornstein–Uhlenbeck noise whose state has a name, and whose rate has a symbol."""

    class Coloured(vk.NoiseModel):
        extra_states: ClassVar = (name,)
        rate: float = vk.parameter(symbol, "s^-1", above=0)

        def amplitude(self, x, v):
            return self.rate

        def force(self, y):
            return y

        def drift(self, x, v, y):
            return (-self.rate * y,)

    return Coloured(intensity=0.02, rate=1.0)


def law(symbol):
    class Mine(vk.ContactLaw):
        stiffness: float = vk.parameter(symbol, "", above=0)

        def force(self, depth, rate):
            return self.stiffness * depth * (1 + depth + rate**2)

    return Mine(50.0)


def everything(name, symbol):
    """A scene with a state of this name, and a parameter with this symbol in the noise and in each law."""
    stops = (vk.Barrier(law(symbol), 0.5, "right"), vk.Barrier(law(symbol), -0.5, "left"))
    return scene(*stops, excitations=(vk.Harmonic(0.1, 0.5),), noise=coloured(name, symbol))


def words(text):
    """The names of users in the code, and all others; those of common subexpressions apart, whose number varies."""
    nodes = list(ast.walk(ast.parse(text)))
    found = {node.id for node in nodes if isinstance(node, ast.Name)} | {n.arg for n in nodes if isinstance(n, ast.arg)}
    users = {word for word in found if re.match(r"(k\d_)?u_", word)}
    return users, {word for word in found - users if not re.fullmatch(r"_[cd]\d*_?\d+", word)}


@pytest.mark.parametrize("flow", list(Flow), ids=lambda flow: flow.value)
def test_code_has_the_same_words_for_all_names(flow):
    """Only users' names begin with the prefix, so code that has all of them, and no other word more, has no clash."""

    def found(name, symbol):
        return words(write_sources(everything(name, symbol), flow, vk.RK4()).scene)

    users, ours = found("y", "r")
    assert {"u_r_xi", "u_omega_n", "u_r_l", "u_r_r", "u_b_r", "u_b_l"} <= users
    for name in NAMES if flow is Flow.STATE else NAMES[:: len(NAMES) // 3]:
        others, same = found(name, name)
        assert (len(others), same) == (len(users), ours), name


def test_no_name_of_ours_begins_with_the_prefix():
    for path in (Path(kernel.__file__).parent / "templates").glob("*.py"):
        assert not re.search(r"\bu_", path.read_text(encoding="utf-8")), path
    text = write_sources(scene(vk.Barrier(vk.Hertz(50.0), 0.5, "right")), Flow.STATE, vk.RK4()).scene
    assert words(text)[0] == {"u_omega_n", "u_zeta", "u_b", "u_k"}


@pytest.mark.parametrize("name", ["h", "k1_x"])
def test_a_state_may_have_the_name_of_a_local(name):
    """Damped free motion, which the state at rest does not disturb; then its decay pushes the mass."""
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, noise=coloured(name))
    end = osc.trajectory((1.0, 0.0, 0.0), periods=1, stepper=vk.RK4(steps=64)).x[-1]
    turned, angle = math.sqrt(1 - 0.05**2), 2 * math.pi * math.sqrt(1 - 0.05**2)
    free = math.exp(-0.1 * math.pi) * (math.cos(angle) + 0.05 / turned * math.sin(angle))
    assert end == pytest.approx(0.730093, abs=1e-6)
    assert end == pytest.approx(free, abs=2e-6)
    pushed = osc.trajectory((0.0, 0.0, 1.0), periods=1, stepper=vk.RK4(steps=64)).x[-1]
    matrix = np.array([[0, 1, 0], [-1, -0.1, 1], [0, 0, -1.0]])
    assert pushed == pytest.approx(_power_series(2 * math.pi * matrix)[0, 2], abs=2e-6)


def _power_series(matrix):
    return np.linalg.matrix_power(np.eye(3) + matrix / 2**24, 2**24)  # to about 1e-6


@pytest.mark.parametrize(
    "name", ["h", "z", "theta", "E", "lamda", "t", "S", "k1_x", "np", "depth", "f", "range", "u_a"]
)
def test_constants_of_a_formula_may_have_any_name(name):
    def code(word):
        osc = scene(spring=vk.CustomSpring(f"{word}*x**3", **{word: 2.0}))
        return write_sources(osc, Flow.STATE, vk.RK4()).scene

    assert words(code(name))[1] == words(code("a"))[1]
    assert words(code(name))[0] - words(code("a"))[0] == {f"u_{name}_s" if name in _SHOWN else f"u_{name}"}


@pytest.mark.parametrize("name", ["lambda", "class", "x", "sqrt", "max", "pi", "nan", "ω", "a b", "_a", "", "name"])
def test_names_that_a_formula_cannot_have_are_refused(name):
    with pytest.raises(FormulaError, match="is not allowed"):
        vk.CustomSpring("x", **{name: 2.0})


@pytest.mark.parametrize("names", [("y", "y"), "y", ["y"], ("",), (1,)])
def test_states_without_names_are_refused(names):
    noise = coloured("y")
    type(noise).extra_states = names
    with pytest.raises(SceneError, match=r"Coloured\.extra_states must be a tuple of distinct names"):
        scene(noise=noise)


RATES = {
    "too few": lambda self, x, v, y: (),
    "a number": lambda self, x, v, y: -y,
    "a symbol of its own": lambda self, x, v, y: (-sympy.Symbol("h") * y,),
    "text": lambda self, x, v, y: ("-y",),
    "unknown function": lambda self, x, v, y: (sympy.Function("h")(y),),
    "not real": lambda self, x, v, y: (sympy.I * y,),
    "fails": lambda self, x, v, y: (1 / 0,),
}


@pytest.mark.parametrize("drift", RATES.values(), ids=RATES)
def test_rates_are_checked_like_formulas(drift):
    noise = coloured("y")
    type(noise).drift = drift
    with pytest.raises(DerivationError, match=r"Coloured\.drift"):
        kernel_for(scene(noise=noise), Flow.STATE, vk.RK4())


@pytest.mark.parametrize("function", [sympy.erf, sympy.asinh, sympy.sec, lambda x: sympy.atan2(x, 2 - x)])
def test_functions_that_compiled_code_has(function):
    class Odd(vk.Spring):
        def force(self, x, v):
            return function(x)

    osc = scene(spring=Odd())
    assert osc.trajectory((0.3, 0.0), periods=0.01, stepper=vk.RK4(steps=64)).x.size
