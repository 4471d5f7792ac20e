"""Checks of contact laws."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import mpmath

from vibrokit.oscillator import Oscillator
from vibrokit.parts.barrier import Barrier
from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.excitation import Harmonic
from vibrokit.parts.noise import WhiteNoise
from vibrokit.parts.spring import CubicSpring
from vibrokit.registry import Group
from vibrokit.symbolic.contact import DEPTH, RATE, DerivedContact
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.testing.compiled import ENTRIES, Compiled, hamiltonian_start
from vibrokit.testing.motion import Motion, follow, numeric
from vibrokit.testing.part_checks import PartChecks
from vibrokit.testing.precise import Function, derivative
from vibrokit.testing.report import Check, ConformanceError

_SIDES = (("right", 1), ("left", -1))
_NEAREST = mpmath.mpf(10) ** -4000  # a depth whose 200th root is negligible


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
            Check("motion", self.motion),
        )

    def scene(self, part: ContactLaw) -> Oscillator:
        return Oscillator(
            natural_frequency=1.0,
            damping_ratio=0.01,
            barriers=(Barrier(part, 0.1, "right"),),
            excitations=(Harmonic(0.2, 0.9),),
        )

    def points(self) -> list[tuple[float, ...]]:
        """Depths from 1e-9 to 1 at random rates."""
        powers = [-9.0, *self.rng.uniform(-9, 0, 7), 0.0]
        return [(float(10**power), float(rate)) for power in powers for rate in self._rates()]

    def _rates(self) -> list[float]:
        return [float(sign * 10**power) for sign, power in zip((1, -1), self.rng.uniform(-3, 1, 2), strict=True)]

    def contact(self, part: ContactLaw) -> DerivedContact:
        """The contact that the model derives from a law."""
        self.expression(part)
        return self.scene(part).model.contacts[0]

    # -- force ----------------------------------------------------------------------------------------------------

    def no_force_at_rest(self) -> str:
        """The force at zero rate tends to 0 with depth."""
        for part, force in self.each():
            least = force(_NEAREST, 0)
            if abs(least) > 1e-12 * abs(force(1, 0)):
                raise ConformanceError(
                    f"The force of {part!r} at zero depth and rate must be 0, got {mpmath.nstr(least, 6)}."
                )
        return ""

    def pushes_back(self) -> str:
        """The force is not negative while depth increases."""
        for part, force in self.each():
            for depth, rate in self.points():
                for deeper in (0.0, abs(rate)):
                    push = force(depth, deeper)
                    if push < 0:
                        raise ConformanceError(
                            f"The force of {part!r} at depth {depth:g} and rate {deeper:g} must not be negative, got "
                            f"{mpmath.nstr(push, 6)}; a positive force pushes the mass back."
                        )
        return ""

    def never_pulls(self) -> str:
        """The compiled force at a barrier that is not adhesive never pulls, and is 0 without contact."""
        for part in self.samples:
            self.expression(part)
            for side, sign in _SIDES:
                code = Compiled(_bare(part, side), Flow.STATE)
                for depth, rate in self.points():
                    for faster in (rate, -abs(rate), -100.0 * abs(rate)):
                        push = -sign * code.derivative((sign * depth, sign * faster))[1]
                        if not push >= 0:
                            raise ConformanceError(
                                f"{part!r} on the {side} side pulls with {-push:g} at depth {depth:g} and rate "
                                f"{faster:g}, although its barrier is not adhesive: by the derivation it cannot pull. "
                                "Write its formula in a form that SymPy can judge."
                            )
                        if (remote := code.derivative((-sign * depth, sign * faster))[1]) != 0:
                            raise ConformanceError(
                                f"{part!r} pushes with {remote:g} at a distance of {depth:g} from the stop."
                            )
        return ""

    # -- first touch ----------------------------------------------------------------------------------------------

    def jump(self) -> str:
        """The force does not jump at first touch unless the model derives a jump."""
        results = []
        for part, force in self.each():
            may_jump = self.contact(part).jumps
            results.append("jumps" if may_jump else "continuous")
            for rate in () if may_jump else self._rates():
                at_touch = force(_NEAREST, rate)
                if abs(at_touch) > 1e-12 * abs(force(1, rate)):
                    raise ConformanceError(
                        f"The force of {part!r} jumps to {mpmath.nstr(at_touch, 6)} at first touch at rate {rate:g}, "
                        "but the model derives a continuous force. Write its formula in a form that SymPy can judge."
                    )
        return ", ".join(dict.fromkeys(results))

    @staticmethod
    def _may_vanish(part: ContactLaw) -> bool:
        """Whether a parameter has the allowed value 0, so that this instance may lack a term of the formula."""
        numbers = [d for d in part.declared() if not d.structural and part.parameters[d.name] == 0]
        return any(d.above is None or d.above < 0 for d in numbers)

    def leading_power(self) -> str:
        """Near the stop the force varies like the derived power of depth."""
        results = []
        for part, force in self.each():
            exponent = self.contact(part).exponent
            if exponent is None or self._may_vanish(part):
                continue
            rate = self._rates()[0]
            ratio = abs(force(_NEAREST, rate) / force(_NEAREST / 10, rate)) if force(_NEAREST, rate) else mpmath.inf
            found = float(mpmath.log10(ratio))
            results.append(f"{float(exponent):g}")
            if abs(found - float(exponent)) > 1e-6:
                raise ConformanceError(
                    f"The force of {part!r} varies like depth^{found:g} at first touch, but the model derives "
                    f"depth^{float(exponent):g}. Write its formula in a form that SymPy can judge."
                )
        return ", ".join(dict.fromkeys(results)) or "unknown"

    def smoothness(self) -> str:
        """Near the stop the force has the derived power series, in a root of the depth."""
        results, roots = [], {1: "depth", 2: "√depth", 4: "depth^(1/4)"}
        near, nearer = mpmath.mpf("1e-6"), mpmath.mpf("1e-12")
        for part, force in self.each():
            contact = self.contact(part)
            results.append(roots[contact.root] if contact.smooth else "not smooth")
            if not contact.smooth:
                continue
            for order in range(1, 9):
                slopes = [self._slope(force, order, size, contact.root) for size in (nearer, near)]
                if abs(slopes[0]) > 30 * abs(slopes[1]) + 1e-9 * abs(force(1, 1)):
                    raise ConformanceError(
                        f"The model derives a force smooth in {results[-1]} at first touch for {part!r}, but its "
                        f"derivative of order {order} is unbounded there. Write its formula in a form that SymPy can "
                        "judge."
                    )
        return ", ".join(dict.fromkeys(results))

    @staticmethod
    def _slope(force: Function, order: int, size: Any, root: int) -> Any:
        """Divided difference of the force over points 1, 2, … times `size`, in a root of the depth."""
        digits = 250  # a difference of order 8 loses 8 · 12 of them
        with mpmath.workdps(digits):
            total = mpmath.mpf(0)
            for k in range(order + 1):
                value = force((size * (k + 1)) ** root, mpmath.mpf(1) / 3, digits=digits)
                total += (-1) ** (order - k) * mpmath.binomial(order, k) * value
            return total / size**order

    def motion(self) -> str:
        """A touch of the stop agrees with SciPy, which takes the law where the mass is past the stop and is pushed."""
        return follow(map(self._motion, self.samples))

    def _motion(self, part: ContactLaw) -> Motion:
        law = numeric(self.expression(part), self.arguments, self.values(part))

        def rates(t: float, state: Any) -> tuple[float, float]:
            x, v = map(float, state)
            push = max(law(x - 0.1, v), 0.0) if x > 0.1 else 0.0
            return v, 0.2 * math.cos(0.9 * t) - 0.02 * v - x - push

        return Motion(part, self.scene(part), (0.0, 0.5), 1.5, rates)

    # -- compiled code --------------------------------------------------------------------------------------------

    def compiled_distances(self, part: ContactLaw) -> Iterator[float]:
        """Compare force and derivatives on both sides."""
        formula, clamped = self.expression(part), self.contact(part).clamped
        for side, sign in _SIDES:
            code, points = Compiled(_bare(part, side), Flow.HAMILTONIAN_VARIATIONAL), self.points()
            references = {
                orders: self.reference(part, derivative(formula, self.arguments, orders)) for orders in ENTRIES
            }
            law = references[0, 0]
            for point in points:
                yield law.check(f"the force of {part!r}", point, code.call("law", 0, *point))
                force, state = law.exact(*point), (sign * point[0], sign * point[1])
                variants: list[tuple[Callable[[Any], Any], bool]]
                variants = [(functools.partial(code.rhs, pushing=(on,)), on) for on in (True, False)]
                if not clamped or abs(force) > law.bound(*point):  # otherwise rounding decides whether it pushes
                    variants.append((code.derivative, not clamped or force > 0))
                for rates, pushing in variants:
                    found = {momentum: rates(hamiltonian_start(state, momentum)) for momentum in (0.0, 1.0)}
                    for orders, (index, momentum, minus) in ENTRIES.items():
                        # The force on the mass is −sign · law.
                        factor = -minus * sign ** (1 + sum(orders)) if pushing else 0
                        what = f"the derivative of orders {orders} of {part!r}"
                        yield references[orders].check(what, point, found[momentum][index], factor)


def _bare(part: ContactLaw, side: Any) -> Oscillator:
    """A scene with a stop at 0 and no other force."""
    return Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.0,
        spring=CubicSpring(linear=0.0, cubic=0.0),
        barriers=(Barrier(part, 0.0, side),),
        noise=WhiteNoise(intensity=1.0),
    )
