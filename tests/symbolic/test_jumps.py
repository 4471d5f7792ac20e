"""Forces that jump in the state are refused, with a smooth form of the scene's own constants."""

import re

import pytest
import sympy

import vibrokit as vk
from tests.layers import long
from tests.scenes import scene
from vibrokit.errors import DerivationError

JUMPING = {
    "x + f*sign(v)": "f*tanh(v/0.0001) + x",  # a jump of 2 f: its half over ω_n, a thousandth of that
    "x + f*abs(v)/v": "f*tanh(v/0.0001) + x",
    "x + f*v/abs(v)": "f*tanh(v/0.0001) + x",
    "x + f*sign(v - x)": "f*tanh((v - x)/0.0001) + x",
    "x + f*(1 + abs(v - 1)/(v - 1))": "tanh((v - 1)/0.0001)",
    "x*(1 + f*sign(x*v))": "x*(f*tanh(v*x/0.001) + 1)",  # its size depends on x
    "x + f*max(x - 100, 0)*sign(v)": "tanh(v/0.001)",
    "x + f*max(v, 0)/v": "tanh(v/5e-05)",
    "x + f*atan(1/v)": "tanh(v/",
    "x + f*sign(v)*exp(-abs(v))": "f*exp(-Abs(v))*tanh(v/0.0001)",
    "x + f*abs(v)**n*sign(v)": "tanh(v/0.0001)",
}
JUMPING_IN_X = (
    "x + f*sign(x)",
    "x + f*sign(x - 3e7)",  # beyond the places that a grid has
    "x + f*v*sign(x)",
    "x + f*abs(x)/x",
    "x + f*sign(sin(x))",
    "x + f*atan(tan(x))",
)
CONTINUOUS = [
    "x + f*v*abs(v)", "x + f*tanh(v/1e-3)", "x + f*v*sign(v)", "x + f*max(v, 0)", "x + f*abs(v - x)",
    "x + f*(v - x)*sign(v - x)", "x + f*v/(1 + v**2)", "x + f*v/sqrt(v**2 + 1e-6)", "x + f*sqrt(abs(v))*sign(v)",
    "x + f*abs(x)*sign(x)", "x + f*abs(x/p)**p*sign(x/p)", "x + f*max(min(x, 1), -1)", long("x + f*atan(tan(v/9)**2)"),
    "x + f*max(abs(v) - 1, 0)*sign(v)", "x + f*sign(v**2 + 1)", "x + f*abs(v)**p*sign(v)",
]  # fmt: skip


def spring(formula, f=0.1):
    values = {"f": f, "n": 0.0, "p": 1.5}
    return vk.CustomSpring(formula, **{name: values[name] for name in re.findall(r"\b[fnp]\b", formula)})


def refusal_of(osc):
    with pytest.raises(DerivationError) as caught:
        _ = osc.model.drift
    return str(caught.value)


@pytest.mark.parametrize("formula", JUMPING)
@pytest.mark.parametrize("f", [0.1, 0.0])
def test_jump_in_v_is_refused(formula, f):
    """At f = 0 too, because the same compiled code serves other values."""
    message = refusal_of(scene(spring=spring(formula, f)))
    assert "dry friction" in message
    assert JUMPING[formula] in message or f == 0.0


@pytest.mark.parametrize("formula", JUMPING_IN_X)
def test_derivatives_across_a_jump_in_x_are_refused(formula):
    """No stepper maps derivatives and momenta across it; multipliers were those without the jump."""
    osc = scene(spring=spring(formula))
    _ = osc.model.drift  # motion itself can be followed
    with pytest.raises(DerivationError, match=r"jumps where .* multipliers"):
        osc.model.check_derivatives()


@pytest.mark.parametrize("formula", ["x + f*sign(v - 5e8)", "x + f*atan(tan(v))"])
def test_jump_at_any_velocity_is_refused(formula):
    assert "dry friction" in refusal_of(scene(spring=spring(formula)))


@pytest.mark.parametrize("formula", CONTINUOUS)
def test_continuous_force_is_accepted(formula):
    assert scene(spring=spring(formula)).model.drift[1].has(sympy.Symbol("x", real=True))


def test_trajectory_refuses_what_sticks():
    with pytest.raises(DerivationError, match="dry friction"):
        scene(spring=spring("x + f*sign(v)")).trajectory((5e-4, 0.0), periods=1)


class Ratchet(vk.Spring):
    """A step, written with SymPy."""

    level: float = vk.parameter("F", "m s^-2")

    def force(self, x, v):
        return x + self.level * sympy.Piecewise((1, v > 0), (-1, True))


class Terraced(vk.Spring):
    level: float = vk.parameter("F", "m s^-2")

    def force(self, x, v):
        return x + self.level * sympy.Mod(v, 1)


class Uneven(vk.ContactLaw):
    """Stiffer while the depth grows."""

    stiffness: float = vk.parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * depth * sympy.Piecewise((1, rate > 0), (0.5, True))


def test_parts_of_your_own_and_laws_are_refused():
    for part in (Ratchet(0.3), Terraced(0.3)):
        assert "dry friction" in refusal_of(scene(spring=part))
    for law in (Uneven(5.0), vk.CustomLaw("k*depth*(1 + c*sign(rate)/4)", k=20.0, c=1.0)):
        assert "rate = 0, as dry friction" in refusal_of(scene(vk.Barrier(law, 0.5, "right")))


def test_jump_within_a_stop_is_refused():
    law = vk.CustomLaw("k*depth*(2 + sign(depth - d))", k=20.0, d=0.1)
    assert "depth - d = 0" in refusal_of(scene(vk.Barrier(law, 0.5, "right")))
    assert scene(vk.Barrier(vk.CustomLaw("f", f=2.0), 0.5, "right")).model.contacts[0].jumps  # at first touch it may


class Telegraph(vk.NoiseModel):
    extra_states = ("h",)

    def amplitude(self, x, v):
        return 1

    def force(self, h):
        return sympy.sign(h)

    def drift(self, x, v, h):
        return (-h,)


class Fed(vk.NoiseModel):
    extra_states = ("h",)

    def amplitude(self, x, v):
        return 1

    def force(self, h):
        return h

    def drift(self, x, v, h):
        return (sympy.sign(v) - h,)


@pytest.mark.parametrize(
    "noise",
    [
        vk.StateDependentNoise(1e-3, "1 + c*sign(v)", c=0.5), vk.StateDependentNoise(1e-3, "1 + c*sign(x)", c=0.5),
        Telegraph(1e-3), Fed(1e-3),
    ],
    ids=["amplitude in v", "amplitude in x", "force", "drift"],
)  # fmt: skip
def test_jump_of_the_noise_is_refused(noise):
    """Momenta would miss it."""
    osc = scene(noise=noise)
    with pytest.raises(DerivationError, match=r"jumps by [12] where . = 0"):
        _ = osc.model.drift, osc.model.amplitude


def test_width_of_the_smooth_form_is_in_the_units_of_the_scene():
    """A valve in SI units: 2975.14 m s⁻² of friction at 2104.45 s⁻¹ change the velocity by 1.4 m/s in 1/ω_n."""
    valve = vk.CustomSpring("w2*x + f*sign(v)", w2=2104.45**2, f=2975.14)
    message = refusal_of(scene(natural_frequency=2104.45, damping_ratio=0.0, spring=valve))
    assert "f*tanh(v/0.001) + w2*x" in message
    assert "5950.28" in message
