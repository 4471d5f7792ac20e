"""Checks of springs and friction: of forces that depend on the state."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, ClassVar

import sympy

from vibrokit.oscillator import Oscillator
from vibrokit.parts.excitation import Harmonic
from vibrokit.parts.friction import Friction
from vibrokit.parts.noise import WhiteNoise
from vibrokit.parts.spring import CubicSpring, Spring
from vibrokit.registry import Group
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.testing.compiled import ENTRIES, Compiled, hamiltonian_start
from vibrokit.testing.motion import Motion, follow, numeric
from vibrokit.testing.part_checks import PartChecks
from vibrokit.testing.precise import derivative
from vibrokit.testing.report import Check


class StateForceChecks(PartChecks[Spring | Friction]):
    """The checks of a force that depends on the state: of a spring, or of friction."""

    arguments = (sympy.Symbol("x", real=True), sympy.Symbol("v", real=True))

    def physics(self) -> tuple[Check, ...]:
        return (
            Check("finite force", self.finite),
            Check("derivatives", self.derivatives),
            Check("compiled", self.compiled),
            Check("motion", self.motion),
        )

    def scene(self, part: Spring | Friction) -> Oscillator:
        scene = Oscillator(natural_frequency=1.0, damping_ratio=0.05, excitations=(Harmonic(0.2, 0.9),))
        parts: dict[str, Any] = {self.place: part}
        return dataclasses.replace(scene, **parts)

    def motion(self) -> str:
        """A short motion, the forcing and the damping of the scene included, agrees with SciPy's."""
        return follow(map(self._motion, self.samples))

    def _motion(self, part: Spring | Friction) -> Motion:
        scene, force = self.scene(part), numeric(self.expression(part), self.arguments, self.values(part))
        linear = 1.0 if scene.spring is None else 0.0

        def rates(t: float, state: Any) -> tuple[float, float]:
            x, v = map(float, state)
            return v, 0.2 * math.cos(0.9 * t) - 0.1 * v - linear * x - force(x, v)

        return Motion(part, scene, (0.3, 0.4), 1.0, rates)

    def compiled_distances(self, part: Spring | Friction) -> Iterator[float]:
        scene = Oscillator(
            natural_frequency=1.0,
            damping_ratio=0.0,
            spring=CubicSpring(linear=0.0, cubic=0.0),
            noise=WhiteNoise(intensity=1.0),
        )
        parts: dict[str, Any] = {self.place: part}
        scene = dataclasses.replace(scene, **parts)
        code = Compiled(scene, Flow.HAMILTONIAN_VARIATIONAL)
        formula = self.expression(part)
        for orders, (index, momentum, factor) in ENTRIES.items():
            reference = self.reference(part, derivative(formula, self.arguments, orders))
            for point in self.points():
                for rates in (code.derivative, code.rhs):  # the force on the mass is minus that of the part
                    found = rates(hamiltonian_start(point, momentum))[index]
                    yield reference.check(f"the derivative of orders {orders} of {part!r}", point, found, -factor)


class SpringChecks(StateForceChecks):
    """The checks of one spring."""

    kind: ClassVar[type[Spring]] = Spring
    group = Group.SPRINGS
    place = "spring"


class FrictionChecks(StateForceChecks):
    """The checks of one friction."""

    kind: ClassVar[type[Friction]] = Friction
    group = Group.FRICTIONS
    place = "friction"
