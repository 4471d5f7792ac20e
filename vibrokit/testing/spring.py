"""Checks of springs."""

from __future__ import annotations

from typing import ClassVar

import sympy

from vibrokit.oscillator import Oscillator
from vibrokit.parts.excitation.harmonic import Harmonic
from vibrokit.parts.noise.white import WhiteNoise
from vibrokit.parts.spring.spring import Spring
from vibrokit.registry import Group
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.testing.compiled import ENTRIES, Compiled, hamiltonian_start
from vibrokit.testing.derivatives import ORDERS, check_compiled, check_derivatives, derivative
from vibrokit.testing.part_checks import PartChecks
from vibrokit.testing.precise import rounding
from vibrokit.testing.report import Check

_REACH = 2.0


class SpringChecks(PartChecks[Spring]):
    """The checks of one spring."""

    kind: ClassVar[type[Spring]] = Spring
    group = Group.SPRINGS
    arguments = (sympy.Symbol("x", real=True), sympy.Symbol("v", real=True))
    place = "spring"

    def physics(self) -> tuple[Check, ...]:
        return (
            Check("finite force", self.finite),
            Check("derivatives", self.derivatives),
            Check("compiled", self.compiled),
        )

    def scene(self, part: Spring) -> Oscillator:
        return Oscillator(natural_frequency=1.0, damping_ratio=0.05, spring=part, excitations=(Harmonic(0.2, 0.9),))

    def part_in(self, scene: Oscillator) -> Spring:
        assert scene.spring is not None
        return scene.spring

    def points(self) -> list[tuple[float, ...]]:
        """Random displacements and velocities."""
        return [(float(x), float(v)) for x, v in self.rng.uniform(-_REACH, _REACH, (12, 2))]

    def finite(self) -> str:
        """The force is finite and real wherever the mass may be, at rest in the middle too."""
        for _, force in self.each():
            for point in [*self.points(), (0.0, 0.0)]:
                force(*point)
        return ""

    def derivatives(self) -> str:
        """Derivatives agree with differences of the force."""
        worst = 0.0
        for part, force in self.each():
            formula = self.expression(part)
            derived = [(orders, self.precise(part, derivative(formula, self.arguments, orders))) for orders in ORDERS]
            worst = max(worst, check_derivatives(part, force, derived, self.points()))
        return f"within {worst:.1g} of differences at 60 digits"

    def compiled(self) -> str:
        """Force and derivatives as compiled agree with the formula."""
        worst = 0.0
        for part in self.samples:
            scene = Oscillator(natural_frequency=1.0, damping_ratio=0.0, spring=part, noise=WhiteNoise(intensity=1.0))
            code = Compiled(scene, Flow.HAMILTONIAN_VARIATIONAL)
            formula = self.expression(part)
            for orders in ((0, 0), *ORDERS):
                derived = derivative(formula, self.arguments, orders)
                exact, bound = self.precise(part, derived), self.precise(part, rounding(derived))
                index, sign, momentum = (1, -1.0, 0.0) if orders == (0, 0) else (ENTRIES[orders], 1.0, 1.0)
                what = f"the derivative of orders {orders}"
                for point in self.points():
                    for rates in (code.derivative, code.rhs):
                        found = sign * float(rates(hamiltonian_start(point, momentum))[index])
                        distance = check_compiled(part, what, point, found, exact(*point), bound(*point))
                        worst = max(worst, distance)
        return f"within {worst:.1g}"
