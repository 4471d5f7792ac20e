"""Checks of excitations."""

from __future__ import annotations

import math
from typing import ClassVar

import mpmath
import sympy

from vibrokit.oscillator import Oscillator
from vibrokit.parts.excitation.excitation import Excitation
from vibrokit.parts.spring.cubic import CubicSpring
from vibrokit.registry import Group
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.testing.compiled import Compiled
from vibrokit.testing.derivatives import check_compiled
from vibrokit.testing.part_checks import PartChecks
from vibrokit.testing.precise import rounding
from vibrokit.testing.report import Check, ConformanceError

_PERIODS = 10
_SAME = 1e-12


class ExcitationChecks(PartChecks[Excitation]):
    """The checks of one excitation."""

    kind: ClassVar[type[Excitation]] = Excitation
    group = Group.EXCITATIONS
    arguments = (sympy.Symbol("t", real=True),)
    place = "excitations.0"

    def physics(self) -> tuple[Check, ...]:
        return (
            Check("finite force", self.finite),
            Check("period", self.period),
            Check("compiled", self.compiled),
        )

    def scene(self, part: Excitation) -> Oscillator:
        return Oscillator(natural_frequency=1.0, damping_ratio=0.05, excitations=(part,))

    def part_in(self, scene: Oscillator) -> Excitation:
        return scene.excitations[0]

    def points(self) -> list[tuple[float, ...]]:
        """Random times."""
        return [(float(time),) for time in self.rng.uniform(-50, 50, 20)]

    def finite(self) -> str:
        """The force is finite and real at all times, the start too."""
        for _, force in self.each():
            for point in [*self.points(), (0.0,)]:
                force(*point)
        return ""

    def period(self) -> str:
        """The force repeats after `period`; without one it is constant; after an infinite one, it need not."""
        told = []
        for part in self.samples:
            period = self._declared_period(part)
            told.append("constant" if period is None else f"{period:.6g} s")
            if period == math.inf:
                continue
            force = self.precise(part)
            shift = math.pi if period is None else period
            times = [mpmath.mpf(k) * shift / 37 for k in range(-37, 37 * _PERIODS, 11)]
            size = max(abs(force(t)) for t in times)
            for t in times:
                change = abs(force(t + shift) - force(t))
                if change > _SAME * size:
                    claim = "says that it is constant" if period is None else f"gives {period:.10g} as its period"
                    raise ConformanceError(
                        f"{part!r} {claim}, but its force changes by {mpmath.nstr(change, 6)} from t = "
                        f"{mpmath.nstr(t, 6)} to {mpmath.nstr(t + shift, 6)}; return a time after which it repeats, "
                        "or None if it never changes."
                    )
        return ", ".join(dict.fromkeys(told))

    @staticmethod
    def _declared_period(part: Excitation) -> float | None:
        try:
            period = part.period
        except Exception as error:
            raise ConformanceError(f"{part!r}.period raises {type(error).__name__}: {error}.") from error
        if period is not None and not (isinstance(period, (int, float)) and period > 0):
            raise ConformanceError(
                f"{part!r}.period is {period!r}; return a positive number of seconds, None for a constant force, or "
                "math.inf for one that never repeats."
            )
        return period

    def compiled(self) -> str:
        """The force as compiled agrees with the formula."""
        worst = 0.0
        for part, exact in self.each():
            scene = Oscillator(
                natural_frequency=1.0,
                damping_ratio=0.0,
                spring=CubicSpring(linear=0.0, cubic=0.0),
                excitations=(part,),
            )
            code = Compiled(scene, Flow.STATE)
            bound = self.precise(part, rounding(self.expression(part)))
            for (time,) in self.points():
                forcing = code.call("forcing", time) if code.offers("forcing") else 0.0
                start = (0.0, 0.0)
                for found in (code.derivative(start, forcing)[1], code.rhs(start, time=time)[1]):
                    distance = check_compiled(part, "the force", time, float(found), exact(time), bound(time))
                    worst = max(worst, distance)
        return f"within {worst:.1g}"
