"""Checks of contact laws."""

from __future__ import annotations

from typing import Any, ClassVar

import mpmath

from vibrokit.oscillator import Oscillator
from vibrokit.parts.barrier import Barrier
from vibrokit.parts.contact.contact_law import ContactLaw
from vibrokit.parts.excitation.harmonic import Harmonic
from vibrokit.parts.noise.white import WhiteNoise
from vibrokit.parts.spring.cubic import CubicSpring
from vibrokit.registry import Group
from vibrokit.symbolic.contact import DEPTH, RATE, DerivedContact
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.testing.compiled import ENTRIES, Compiled, hamiltonian_start
from vibrokit.testing.derivatives import ORDERS, check_compiled, check_derivatives, derivative
from vibrokit.testing.part_checks import PartChecks
from vibrokit.testing.precise import Function, function, rounding
from vibrokit.testing.report import Check, ConformanceError

_NEAREST = mpmath.mpf(10) ** -4000  # a depth at which even the 200th root of it is next to nothing
_ORDERS_AT_TOUCH = range(1, 9)
_TOUCH_DIGITS = 250
_NEAR, _NEARER = mpmath.mpf("1e-6"), mpmath.mpf("1e-12")


class ContactLawChecks(PartChecks[ContactLaw]):
    """The checks of one contact law."""

    kind: ClassVar[type[ContactLaw]] = ContactLaw
    group = Group.CONTACT_LAWS
    arguments = (DEPTH, RATE)
    place = "barriers.0.law"

    def physics(self) -> tuple[Check, ...]:
        return (
            Check("no force at rest at the stop", self.no_force_at_rest),
            Check("pushes back", self.pushes_back),
            Check("never pulls", self.never_pulls),
            Check("derivatives", self.derivatives),
            Check("jump at first touch", self.jump),
            Check("leading power", self.leading_power),
            Check("smoothness at first touch", self.smoothness),
            Check("compiled", self.compiled),
        )

    def scene(self, part: ContactLaw) -> Oscillator:
        return Oscillator(
            natural_frequency=1.0,
            damping_ratio=0.01,
            barriers=(Barrier(part, 0.1, "right"),),
            excitations=(Harmonic(0.2, 0.9),),
        )

    def part_in(self, scene: Oscillator) -> ContactLaw:
        return scene.barriers[0].law

    def points(self) -> list[tuple[float, ...]]:
        """Depths from 1e-9 to 1, the ends included, at random rates."""
        powers = [-9.0, *self.rng.uniform(-9, 0, 7), 0.0]
        return [(float(10**power), float(rate)) for power in powers for rate in self._rates()]

    def _rates(self) -> list[float]:
        return [float(sign * 10**power) for sign, power in zip((1, -1), self.rng.uniform(-3, 1, 2), strict=True)]

    def contact(self, part: ContactLaw) -> DerivedContact:
        """What the model derives of a law."""
        self.expression(part)
        return self.scene(part).model.contacts[0]

    # -- force ----------------------------------------------------------------------------------------------------

    def no_force_at_rest(self) -> str:
        """No force at zero depth and zero rate: the limit from inside."""
        for part, force in self.each():
            least = force(_NEAREST, 0)
            if abs(least) > 1e-12 * abs(force(1, 0)):
                raise ConformanceError(
                    f"{part!r} pushes with {mpmath.nstr(least, 6)} at rest at the stop; a law must begin at 0."
                )
        return ""

    def pushes_back(self) -> str:
        """The force is not negative while going deeper."""
        for part, force in self.each():
            for depth, rate in self.points():
                for deeper in (0.0, abs(rate)):
                    push = force(depth, deeper)
                    if push < 0:
                        raise ConformanceError(
                            f"{part!r} pulls with {mpmath.nstr(push, 6)} at depth {depth:g} while going deeper at rate "
                            f"{deeper:g}; positive is a push back."
                        )
        return ""

    def never_pulls(self) -> str:
        """As compiled for a barrier that is not adhesive, the force never pulls, and is 0 where nothing touches."""
        for part in self.samples:
            self.expression(part)
            for side, sign in (("right", 1.0), ("left", -1.0)):
                code = Compiled(_bare(part, side), Flow.STATE)
                for depth, rate in self.points():
                    for faster in (rate, -abs(rate), -100.0 * abs(rate)):
                        push = -sign * code.derivative((sign * depth, sign * faster))[1]
                        if not push >= 0:
                            raise ConformanceError(
                                f"{part!r} on the {side} side pulls with {-push:g} at depth {depth:g} and rate "
                                f"{faster:g}, though its barrier is not adhesive: the model does not see that it can "
                                "pull. Declare the ranges of its parameters truly."
                            )
                        if (apart := code.derivative((-sign * depth, sign * faster))[1]) != 0:
                            raise ConformanceError(f"{part!r} pushes with {apart:g}, {depth:g} away from the stop.")
        return ""

    def derivatives(self) -> str:
        """Derivatives agree with differences of the force."""
        worst = 0.0
        for part, force in self.each():
            formula = self.expression(part)
            derived = [(orders, self.precise(part, derivative(formula, self.arguments, orders))) for orders in ORDERS]
            worst = max(worst, check_derivatives(part, force, derived, self.points()))
        return f"within {worst:.1g} of differences at 60 digits"

    # -- first touch ----------------------------------------------------------------------------------------------

    def jump(self) -> str:
        """The force does not jump at first touch, unless the model says so."""
        told = []
        for part, force in self.each():
            may_jump = self.contact(part).jumps
            told.append("jumps" if may_jump else "continuous")
            for rate in () if may_jump else self._rates():
                at_touch = force(_NEAREST, rate)
                if abs(at_touch) > 1e-12 * abs(force(1, rate)):
                    raise ConformanceError(
                        f"The force of {part!r} jumps to {mpmath.nstr(at_touch, 6)} at first touch at rate {rate:g}, "
                        "but the model says that it is continuous there."
                    )
        return ", ".join(dict.fromkeys(told))

    @staticmethod
    def _may_vanish(part: ContactLaw) -> bool:
        """Whether a parameter is 0 and may be, so that a term of the formula is absent from this instance."""
        numbers = [d for d in part.declared() if not d.structural and part.parameters[d.name] == 0]
        return any(d.above is None or d.above < 0 for d in numbers)

    def leading_power(self) -> str:
        """Near the stop the force goes like the derived power of depth."""
        told = []
        for part, force in self.each():
            exponent = self.contact(part).exponent
            if exponent is None or self._may_vanish(part):
                continue
            rate = self._rates()[0]
            ratio = abs(force(_NEAREST, rate) / force(_NEAREST / 10, rate)) if force(_NEAREST, rate) else mpmath.inf
            found = float(mpmath.log10(ratio))
            told.append(f"{float(exponent):g}")
            if abs(found - float(exponent)) > 1e-6:
                raise ConformanceError(
                    f"The force of {part!r} goes like depth^{found:g} at first touch, but the model says "
                    f"depth^{float(exponent):g}."
                )
        return ", ".join(dict.fromkeys(told)) or "none is claimed"

    def smoothness(self) -> str:
        """Near the stop the force has a power series in depth, or in its root, if the model says so."""
        told = []
        for part, force in self.each():
            contact = self.contact(part)
            told.append("none is claimed" if not contact.smooth else "√depth" if contact.rooted else "depth")
            if not contact.smooth:
                continue
            for order in _ORDERS_AT_TOUCH:
                slopes = [self._slope(force, order, size, rooted=contact.rooted) for size in (_NEARER, _NEAR)]
                if abs(slopes[0]) > 30 * abs(slopes[1]) + 1e-9 * abs(force(1, 1)):
                    raise ConformanceError(
                        f"The model says that the force of {part!r} is smooth in {told[-1]} at first touch, but its "
                        f"derivative of order {order} grows without bound there."
                    )
        return ", ".join(dict.fromkeys(told))

    @staticmethod
    def _slope(force: Function, order: int, size: Any, *, rooted: bool) -> Any:
        """Divided difference of the force over points 1, 2, … times `size`, in depth or in its root."""
        with mpmath.workdps(_TOUCH_DIGITS):
            total = mpmath.mpf(0)
            for k in range(order + 1):
                root = size * (k + 1)
                value = force(root**2 if rooted else root, mpmath.mpf(1) / 3, digits=_TOUCH_DIGITS)
                total += (-1) ** (order - k) * mpmath.binomial(order, k) * value
            return total / size**order

    # -- compiled code --------------------------------------------------------------------------------------------

    def compiled(self) -> str:
        """Force and derivatives as compiled agree with the formula, on both sides."""
        worst = 0.0
        for part in self.samples:
            for side in ("right", "left"):
                worst = max(worst, _CompiledSide(self, part, side).check())
        return f"within {worst:.1g}"


class _CompiledSide:
    """One law on one side: its compiled code, and the exact formulas that it is held against."""

    def __init__(self, checks: ContactLawChecks, part: ContactLaw, side: str) -> None:
        self.part, self.sign = part, 1 if side == "right" else -1
        self.points = checks.points()
        self.code = Compiled(_bare(part, side), Flow.HAMILTONIAN_VARIATIONAL)
        self.clamped = checks.contact(part).clamped
        formula, values = checks.expression(part), checks.values(part)
        self.exact: dict[tuple[int, int], tuple[Function, Function]] = {}
        for orders in ((0, 0), *ORDERS):
            derived = derivative(formula, checks.arguments, orders)
            bound = function(rounding(derived), checks.arguments, values)
            self.exact[orders] = (function(derived, checks.arguments, values), bound)

    def check(self) -> float:
        """Return the largest relative distance."""
        worst = 0.0
        for depth, rate in self.points:
            force, bound = (f(depth, rate) for f in self.exact[0, 0])
            found = self.code.call("law", 0, depth, rate)
            worst = max(worst, check_compiled(self.part, "the force", (depth, rate), found, force, bound))
            pushing = not self.clamped or force > 0
            if abs(force) > bound or not self.clamped:
                worst = max(worst, self._check_rates(depth, rate, self.code.derivative, pushing=pushing))
            for switch in (True, False):
                worst = max(worst, self._check_rates(depth, rate, self._switched(switch), pushing=switch))
        return worst

    def _switched(self, switch: bool) -> Any:
        return lambda z: self.code.rhs(z, (switch,))

    def _check_rates(self, depth: float, rate: float, rates: Any, *, pushing: bool) -> float:
        state = (self.sign * depth, self.sign * rate)
        without, with_momentum = (rates(hamiltonian_start(state, p)) for p in (0.0, 1.0))
        worst = 0.0
        for orders, (exact, bound) in self.exact.items():
            index, turned = (1, without) if orders == (0, 0) else (ENTRIES[orders], with_momentum)
            # The force on the mass is −sign · law; p′ and the lower half of the matrix hold minus its derivatives.
            sign = (-1 if orders == (0, 0) else 1) * self.sign ** (1 + sum(orders))
            expected = exact(depth, rate) if pushing else mpmath.mpf(0)
            what = f"the derivative of orders {orders}" if sum(orders) else "the guarded force"
            found = sign * float(turned[index])
            worst = max(worst, check_compiled(self.part, what, (depth, rate), found, expected, bound(depth, rate)))
        return worst


def _bare(part: ContactLaw, side: Any) -> Oscillator:
    """A scene in which nothing but a stop at 0 acts."""
    return Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.0,
        spring=CubicSpring(linear=0.0, cubic=0.0),
        barriers=(Barrier(part, 0.0, side),),
        noise=WhiteNoise(intensity=1.0),
    )
