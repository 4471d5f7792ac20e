"""Constants with names shape a formula like numbers in their places: exponents, and limits at first touch."""

import pytest

import vibrokit as vk
from tests.scenes import scene
from vibrokit.errors import DerivationError, ParameterError
from vibrokit.kernels.kernel import kernel_for, write_sources
from vibrokit.parts.functions import Max, sqrt
from vibrokit.symbolic.flow_kind import Flow


def stopped(law, **more):
    return scene(vk.Barrier(law, 0.5, "right"), **more)


def contact(law):
    return stopped(law).model.contacts[0]


def properties(law):
    derived = contact(law)
    return derived.jumps, derived.clamped, derived.exponent, derived.root, derived.smooth, derived.bends


def code(osc, flow=Flow.STATE):
    return write_sources(osc, flow, vk.RK4())


LAWS = {
    "plain": ("k*depth**n", "k*depth**1.5", {"n": 1.5}),
    "half": ("k*depth**(n/2)", "k*depth**1.5", {"n": 3.0}),
    "inverse": ("k*depth**(1/n)", "k*depth**2.5", {"n": 0.4}),
    "sum": ("k*depth**(n + 1)", "k*depth**2.5", {"n": 1.5}),
    "two": ("k*depth**(n*m)", "k*depth**1.5", {"n": 3.0, "m": 0.5}),
    "whole": ("k*depth**n", "k*depth**2", {"n": 2.0}),
    "one": ("k*depth**n", "k*depth", {"n": 1.0}),
    "not exact": ("k*depth**n", "k*depth**1.1", {"n": 1.1}),
    "of a root": ("k*sqrt(depth)**n", "k*depth**1.5", {"n": 3.0}),
    "of a sum": ("k*(depth + depth**2)**n", "k*(depth + depth**2)**1.5", {"n": 1.5}),
    "of the rate": ("k*depth*(1 + 0.1*abs(rate)**n)", "k*depth*(1 + 0.1*abs(rate)**1.5)", {"n": 1.5}),
    "exponential": ("k*exp(n*log(depth))", "k*depth**1.5", {"n": 1.5}),
    "in a minimum": ("k*min(depth**n, 1)", "k*min(depth**1.5, 1)", {"n": 1.5}),
    "damped": ("k*depth**n*(1 + 0.1*rate)", "k*depth**1.5*(1 + 0.1*rate)", {"n": 1.5}),
    "zero": ("k*depth + c*rate", "k*depth", {"c": 0.0}),
}


@pytest.mark.parametrize(("formula", "literal", "constants"), LAWS.values(), ids=LAWS)
def test_a_name_is_like_its_number(formula, literal, constants):
    named, plain = vk.CustomLaw(formula, k=50.0, **constants), vk.CustomLaw(literal, k=50.0)
    assert properties(named) == properties(plain)
    unused = "\n    theta[4] = barriers.0.law.c (u_c)" if "c" in constants else ""
    one, other = code(stopped(named)), code(stopped(plain))
    assert (one.scene.replace(unused, ""), one.driver) == other


@pytest.mark.parametrize("flow", list(Flow), ids=lambda flow: flow.value)
def test_siblings_of_a_law(flow):
    """Springs and noise; an exponent of constants only remains a number that changes without compilation."""
    named = scene(
        spring=vk.CustomSpring("x + r**n*abs(x)**n*sign(x)", n=2.5, r=0.5),
        noise=vk.StateDependentNoise(1e-3, "(1 + x**2)**(m/2)", m=3.0),
    )
    plain = scene(
        spring=vk.CustomSpring("x + r**2.5*abs(x)**2.5*sign(x)", r=0.5),
        noise=vk.StateDependentNoise(1e-3, "(1 + x**2)**1.5"),
    )
    assert code(named, flow) == code(plain, flow)
    free = stopped(vk.CustomLaw("k*r**n*depth", k=1.0, r=2.0, n=1.5))
    assert not free.entry("n").declared.structural
    assert kernel_for(free, Flow.STATE, vk.RK4()) is kernel_for(free.replace(n=1.7), Flow.STATE, vk.RK4())


class Power(vk.ContactLaw):
    """A user's law that does not say that its exponent shapes it."""

    stiffness: float = vk.parameter("k", "")
    exponent: float = vk.parameter("n", "")

    def force(self, depth, rate):
        return self.stiffness * depth**self.exponent


class Root(vk.ContactLaw):
    stiffness: float
    order: float

    def force(self, depth, rate):
        return self.stiffness * depth * sqrt(depth) ** self.order


class Stiffening(vk.Spring):
    exponent: float

    def force(self, x, v):
        return x * (1 + x**2) ** self.exponent


def test_exponents_of_a_users_class_are_found():
    assert properties(Power(50.0, 1.5)) == properties(vk.Hertz(50.0)) == properties(Root(50.0, 1.0))
    assert [d.structural for d in Power(50.0, 1.5).declared()] == [False, True]
    assert "sqrt(x**2" not in code(scene(spring=Stiffening(0.5))).scene
    assert "sqrt(" in code(scene(spring=Stiffening(0.5))).scene
    first, second = (kernel_for(stopped(Power(50.0, n)), Flow.STATE, vk.RK4()) for n in (1.5, 2.5))
    assert first != second
    with pytest.raises(ParameterError, match="exponent shapes the equations"):
        vk.continuation(stopped(Power(50.0, 1.5)), "exponent", [1.5, 1.6])


LIMITS = {  # formula, then values with which the force is continuous at touch, and with which it jumps
    "second stage": ("k*depth + k*max(depth - g, 0)", {"g": 0.1}, {"g": -0.1}),
    "difference": ("k*max(depth + a - b, 0)", {"a": 0.1, "b": 0.2}, {"a": 0.2, "b": 0.1}),
    "preload": ("k*depth + p", {"p": 0.0}, {"p": 0.1}),
    "dash-pot": ("k*depth + c*rate", {"c": 0.0}, {"c": 0.1}),
    "faded dash-pot": ("k*depth + c*rate*min(abs(depth + a - b), 1)", {"a": 1, "b": 1}, {"a": 1, "b": 2}),
    "saturated": ("min(k*depth, max(a, b))", {"a": -0.1, "b": 0.1}, {"a": -0.2, "b": -0.1}),
}  # fmt: skip


@pytest.mark.parametrize(("formula", "continuous", "jumping"), LIMITS.values(), ids=LIMITS)
def test_limits_at_touch_are_those_of_the_values(formula, continuous, jumping):
    more = {"k": 1.0} | ({"c": 0.5} if "c*" in formula and "c" not in continuous else {})
    smooth, jump = vk.CustomLaw(formula, **more | continuous), vk.CustomLaw(formula, **more | jumping)
    assert not contact(smooth).jumps
    assert contact(jump).jumps
    jumps = [kernel_for(stopped(law), Flow.STATE, vk.RK4()).module.JUMPS for law in (smooth, jump, smooth)]
    assert jumps == [(False,), (True,), (False,)]


class Gapped(vk.ContactLaw):
    stiffness: float
    first: float
    second: float

    def force(self, depth, rate):
        return self.stiffness * Max(0, depth + self.first - self.second)


def test_limits_of_a_users_class_are_those_of_its_values():
    for law, jumps in ((Gapped(1.0, 0.1, 0.2), False), (Gapped(1.0, 0.2, 0.1), True), (Gapped(3.0, 0.2, 0.3), False)):
        assert (jumps,) == kernel_for(stopped(law), Flow.STATE, vk.RK4()).module.JUMPS


def test_numbers_that_decide_nothing_share_the_code():
    one = stopped(vk.CustomLaw("k*depth**n + c*depth*rate", k=50.0, n=1.5, c=0.1))
    other = one.replace({"barriers.0.law.k": 7.0, "barriers.0.law.c": 2.0})
    assert kernel_for(one, Flow.STATE, vk.RK4()) is kernel_for(other, Flow.STATE, vk.RK4())
    damped = one.replace({"barriers.0.law.c": -0.1})
    assert kernel_for(one, Flow.STATE, vk.RK4()) is not kernel_for(damped, Flow.STATE, vk.RK4())


def test_an_exponent_out_of_range_is_refused_like_a_number():
    with pytest.raises(DerivationError, match="exponent evaluates to 100"):
        contact(vk.CustomLaw("k*depth**n", k=1.0, n=100.0))
    with pytest.raises(DerivationError, match="unbounded at first touch"):
        contact(vk.CustomLaw("k*depth**n", k=1.0, n=-0.5))


def test_impact_function_of_another_program():
    """The IMPACT function of ADAMS (virtualbow, issue 112); its rebound by an independent integration."""
    formula = "k*depth**e + c*rate*(3 - 2*min(depth/d, 1))*min(depth/d, 1)**2"
    law = vk.CustomLaw(formula, k=1.0, c=0.5, d=0.1, e=1.5)
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.0, spring=vk.LinearSpring(0.0), barriers=[vk.Barrier(law, 0.0, "right")]
    )
    path = osc.trajectory((0.0, 1.0), duration=4.0, samples=4001, stepper=vk.Order8(1e-11))
    free = -path.v[-1]
    assert free == pytest.approx(0.48134, abs=1e-5)
    assert path.x.max() == pytest.approx(0.80820, abs=1e-5)
    assert 4.0 + path.x[-1] / free == pytest.approx(3.5747, abs=1e-4)
