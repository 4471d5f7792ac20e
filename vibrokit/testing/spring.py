"""Checks of springs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import sympy

from vibrokit.oscillator import Oscillator
from vibrokit.parts.excitation.harmonic import Harmonic
from vibrokit.parts.noise.white import WhiteNoise
from vibrokit.parts.spring.spring import Spring
from vibrokit.registry import Group
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.testing.compiled import ENTRIES, Compiled, hamiltonian_start
from vibrokit.testing.part_checks import PartChecks
from vibrokit.testing.precise import derivative
from vibrokit.testing.report import Check


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

    def compiled_distances(self, part: Spring) -> Iterator[float]:
        scene = Oscillator(natural_frequency=1.0, damping_ratio=0.0, spring=part, noise=WhiteNoise(intensity=1.0))
        code = Compiled(scene, Flow.HAMILTONIAN_VARIATIONAL)
        formula = self.expression(part)
        for orders, (index, momentum, factor) in ENTRIES.items():
            reference = self.reference(part, derivative(formula, self.arguments, orders))
            for point in self.points():
                for rates in (code.derivative, code.rhs):  # the force on the mass is minus that of the spring
                    found = rates(hamiltonian_start(point, momentum))[index]
                    yield reference.check(f"the derivative of orders {orders} of {part!r}", point, found, -factor)
