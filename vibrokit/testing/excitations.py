"""Checks of excitations."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

import mpmath
import sympy

from vibrokit.oscillator import Oscillator
from vibrokit.parts.excitation import Excitation
from vibrokit.parts.spring import CubicSpring
from vibrokit.registry import Group
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.testing.compiled import Compiled
from vibrokit.testing.part_checks import PartChecks
from vibrokit.testing.report import Check, ConformanceError


class ExcitationChecks(PartChecks[Excitation]):
    """The checks of one excitation."""

    kind: ClassVar[type[Excitation]] = Excitation
    group = Group.EXCITATIONS
    arguments = (sympy.Symbol("t", real=True),)
    place = "excitations.0"
    reach, count = 50.0, 20

    def physics(self) -> tuple[Check, ...]:
        return (
            Check("finite force", self.finite),
            Check("period", self.period),
            Check("compiled", self.compiled),
        )

    def scene(self, part: Excitation) -> Oscillator:
        return Oscillator(natural_frequency=1.0, damping_ratio=0.05, excitations=(part,))

    def period(self) -> str:
        """The force repeats after a finite `period`; a `period` of None means a constant force."""
        periods = []
        for part in self.samples:
            period = self._declared_period(part)
            periods.append("constant" if period is None else f"{period:.6g} s")
            if period == math.inf:
                continue
            force = self.reference(part).exact
            shift = math.pi if period is None else period
            times = [mpmath.mpf(k) * shift / 37 for k in range(-37, 370, 11)]  # ten periods
            size = max(abs(force(t)) for t in times)
            for t in times:
                change = abs(force(t + shift) - force(t))
                if change > 1e-12 * size:
                    raise ConformanceError(
                        f"{part!r} has the period {period}, but its force changes by {mpmath.nstr(change, 6)} from t = "
                        f"{mpmath.nstr(t, 6)} to {mpmath.nstr(t + shift, 6)}; return a period of the force, or None if "
                        "it is constant."
                    )
        return ", ".join(dict.fromkeys(periods))

    @staticmethod
    def _declared_period(part: Excitation) -> float | None:
        try:
            period = part.period
        except Exception as error:
            raise ConformanceError(f"{part!r}.period raises {type(error).__name__}: {error}.") from error
        if period is not None and not (isinstance(period, (int, float)) and period > 0):
            raise ConformanceError(
                f"{part!r}.period must be a positive number of seconds, None for a constant force, or math.inf for one "
                f"that never repeats, got {period!r}."
            )
        return period

    def compiled_distances(self, part: Excitation) -> Iterator[float]:
        scene = Oscillator(
            natural_frequency=1.0,
            damping_ratio=0.0,
            spring=CubicSpring(linear=0.0, cubic=0.0),
            excitations=(part,),
        )
        code, reference, start = Compiled(scene, Flow.STATE), self.reference(part), (0.0, 0.0)
        for (time,) in self.points():
            forcing = code.call("forcing", time) if code.has("forcing") else 0.0
            for found in (code.derivative(start, forcing)[1], code.rhs(start, time=time)[1]):
                yield reference.check(f"the force of {part!r}", (time,), found)
