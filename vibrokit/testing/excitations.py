"""Checks of excitations."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar

import mpmath
import sympy

from vibrokit.oscillator import Oscillator
from vibrokit.parts.excitation import Excitation
from vibrokit.parts.noise import WhiteNoise
from vibrokit.parts.spring import CubicSpring
from vibrokit.registry import Group
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.testing.compiled import ENTRIES, Compiled, hamiltonian_start
from vibrokit.testing.forced import Forcing, motion_from_rest
from vibrokit.testing.motion import SAME, Motion, compare, numeric, reference_end
from vibrokit.testing.part_checks import PartChecks, Rng
from vibrokit.testing.precise import derivative
from vibrokit.testing.report import Check, ConformanceError

_FRACTIONS = (2, 3, 5, 7)
_PLACE = (0.6, -0.4)  # a state in which a force that depends on it is followed in time
_LONG = 20 * math.pi  # a motion under a force that never repeats: ten free oscillations
_SAME_OF_MANY = 1e-2  # of the size of the motion: fixed steps see a jump within one of them
_STATE = 2.0  # largest displacement and velocity of the states at which a force is compared


class ExcitationChecks(PartChecks[Excitation]):
    """The checks of one excitation."""

    kind: ClassVar[type[Excitation]] = Excitation
    group = Group.EXCITATIONS
    place = "excitations.0"
    reach, count = 50.0, 20

    def __init__(self, part: Excitation | type[Excitation], rng: Rng = 0) -> None:
        super().__init__(part, rng)
        self.arguments = tuple(sympy.Symbol(name, real=True) for name in self.cls.variables)
        self.moves_support = self.cls.support is not Excitation.support
        self.method = "support" if self.moves_support else "force"

    def points(self) -> list[tuple[float, ...]]:
        """Random times, and states of moderate size."""
        return [(time, *(_STATE / self.reach * q for q in state)) for time, *state in super().points()]

    def physics(self) -> tuple[Check, ...]:
        return (
            Check("finite force", self.finite),
            Check("period", self.period),
            Check("compiled", self.compiled),
            Check("motion", self.motion),
        )

    def scene(self, part: Excitation) -> Oscillator:
        return Oscillator(natural_frequency=1.0, damping_ratio=0.05, excitations=(part,))

    def period(self) -> str:
        """The force repeats after a finite `period`, and not before; a `period` of None means a constant force."""
        periods, shorter = [], []
        for part in self.samples:
            period = self._declared_period(part)
            periods.append("constant" if period is None else f"{period:.6g} s")
            if period == math.inf:
                continue
            change = self._change(part, math.pi if period is None else period)
            if change > 1e-12:
                raise ConformanceError(
                    f"{part!r} has the period {period}, but after it the force differs by {change:.6g} of its size; "
                    "return a period of the force, or None if it is constant."
                )
            if period is not None and (forcing := self._forcing(part)).varies(period):
                shorter.append({n for n in _FRACTIONS if forcing.repeats(period, period / n)})
        if shorter and (fractions := set.intersection(*shorter)):
            raise ConformanceError(
                f"{self.samples[0]!r} has the period {periods[0]}, but its force repeats after 1/{max(fractions)} of "
                "it; return the shortest period, in which the section map and the names of states count."
            )
        return ", ".join(dict.fromkeys(periods))

    def _forcing(self, part: Excitation) -> Forcing:
        """The force along time, in one state if it depends on the state."""
        place: dict[sympy.Symbol, float] = dict(zip(self.arguments[1:], _PLACE, strict=False))
        model = self.scene(part).model
        force = sympy.expand(model.excitations[0]) if self.moves_support else self.expression(part)
        return Forcing(force.subs(place), self.arguments[0], model.numbers if self.moves_support else self.values(part))

    def _change(self, part: Excitation, shift: float) -> float:
        """The largest change of the force after a shift in time, over its size, at times that seldom are of jumps."""
        exact, place = self.reference(part).exact, _PLACE[: len(self.arguments) - 1]
        times = [(mpmath.mpf(k) + 1 / mpmath.pi) * shift / 37 for k in range(-37, 370, 11)]  # ten shifts
        here = [exact(t, *place) for t in times]
        size = max(map(abs, here))
        changes = (abs(exact(t + shift, *place) - force) for t, force in zip(times, here, strict=True))
        return float(max(changes) / size) if size else 0.0

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

    def motion(self) -> str:
        """A linear oscillator moves as Duhamel's integral says, jumps and pulses included, or SciPy with the state.

        A single trajectory has to agree closely, and the section map, whose force is a table of times, more coarsely.
        """
        worst = 0.0
        for part in self.samples:
            period = self._declared_period(part) or 2 * math.pi
            duration = period if math.isfinite(period) else _LONG
            scene, start = self.scene(part), _PLACE if len(self.arguments) > 1 else (0.0, 0.0)
            ended = self._ended(part, start, duration)
            if ended is None or ended[1] == 0.0:
                continue
            end = scene.trajectory(start, duration=duration, samples=4).states[-1]
            worst = max(worst, compare(part, duration, end, ended, SAME))
            if math.isfinite(period) and self._resolved(scene, start, ended[1]):
                compare(part, duration, scene.section_map([start])[0], ended, _SAME_OF_MANY)
        return f"within {worst:.1g} of {'SciPy' if len(self.arguments) > 1 else 'an integral'}"

    def _resolved(self, scene: Oscillator, start: tuple[float, float], size: float) -> bool:
        """Whether the default steps of ensembles follow a motion; under a strong force of the state they may not."""
        return len(self.arguments) == 1 or float(scene.error_estimate([start])[0]) < _SAME_OF_MANY / 2 * size

    def _ended(self, part: Excitation, start: tuple[float, float], duration: float) -> tuple[Any, float] | None:
        """The end of a motion and its size; None if it runs away."""
        if len(self.arguments) == 1:
            return motion_from_rest(self._forcing(part), 0.05, duration)
        force = numeric(self.expression(part), self.arguments, self.values(part))

        def rates(t: float, state: Any) -> tuple[float, float]:
            x, v = map(float, state)
            return v, force(t, x, v) - 0.1 * v - x

        return reference_end(Motion(part, self.scene(part), start, duration, rates))

    def compiled_distances(self, part: Excitation) -> Iterator[float]:
        scene = Oscillator(
            natural_frequency=1.0,
            damping_ratio=0.0,
            spring=None if self.moves_support else CubicSpring(linear=0.0, cubic=0.0),
            noise=WhiteNoise(intensity=1.0),
            excitations=(part,),
        )
        code = Compiled(scene, Flow.HAMILTONIAN_VARIATIONAL)
        formula = self.expression(part)  # of a support the displacement, which is the force for ω_n = 1
        for orders, (index, momentum, factor) in ENTRIES.items():
            if sum(orders) and len(self.arguments) == 1:
                continue
            reference = self.reference(part, derivative(formula, self.arguments, (0, *orders)[: len(self.arguments)]))
            for time, *state in self.points():
                start = hamiltonian_start(tuple(state) or (0.0, 0.0), momentum)
                for rates in (code.derivative(start, code.forcing(time)), code.rhs(start, time=time)):
                    what = f"the derivative of orders {orders} of {part!r}" if sum(orders) else f"the force of {part!r}"
                    yield reference.check(what, (time, *state), rates[index], factor)
