"""Touch: paths that end at a stop, touched for the first time."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.course import Course
from vibrokit.analyzers.polishing.destinations import Cut, Destination, Goal
from vibrokit.analyzers.polishing.endings import Touches
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ExitPath

_ROUNDING = 1e-9  # of a path's extent: how far beyond a stop its samples may be and count as inside

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class TouchGoal(Goal):
    """The first touch of a stop.

    Attributes
    ----------
    side : str
    position : float
        Of the stop (m).
    """

    side: str
    position: float

    def scene(self, osc: Oscillator) -> Oscillator:
        """The scene without that stop, which a path before its first touch knows nothing of."""
        return dataclasses.replace(osc, barriers=tuple(b for b in osc.barriers if b.side != self.side))

    def reached(self, attractor: Attractor) -> bool:
        """Whether the orbit touches the stop."""
        return bool(np.any(self._sign * (attractor.orbit[:, 0] - self.position) >= 0)) or bool(
            attractor.hits.get(self.side, 0.0)
        )

    def destination(self, carrier: Carrier) -> Destination:
        """Nothing to prepare."""
        return _AtStop(carrier, self.position, self._sign)

    @property
    def _sign(self) -> int:
        return 1 if self.side == "right" else -1


class _AtStop(Destination):
    def __init__(self, carrier: Carrier, position: float, sign: int) -> None:
        self.carrier, self.position, self.sign = carrier, position, sign

    def distance(self, course: Course) -> float:
        return max(0.0, float(self._inside(course.candidate.states).min()))

    def cuts(self, course: Course) -> list[Cut]:
        """End at rest at the stop, at the time of the first state beyond it, or next to it, or half a period from that.

        With forcing the time of the touch matters, and a shot that comes too fast has it wrong.
        """
        candidate = course.candidate
        times, gaps = candidate.times - candidate.times[0], self._inside(candidate.states)
        beyond = bool(np.any(gaps <= 0))
        first = int(np.argmax(gaps <= 0) if beyond else np.argmin(gaps))
        before = max(first - 1, 0)
        share = gaps[before] / (gaps[before] - gaps[first]) if first and beyond else 1.0
        touch = max(times[before] + share * (times[first] - times[before]), 0.5 * self.carrier.piece)
        if self.carrier.osc.autonomous:
            return [self._ended(course, max(1, round(touch / self.carrier.piece)), 0, None)]
        count = max(1, round(touch / self.carrier.piece))
        last = touch - (count - 1) * self.carrier.piece
        half = self.carrier.pieces // 2
        return [self._ended(course, count, shift, last) for shift in range(max(-half, 1 - count), half)]

    def _ended(self, course: Course, count: int, shift: int, last: float | None) -> Cut:
        """The first `count` nodes less or more some, and the end; more of them go straight to it."""
        states = course.states[: count + min(shift, 0)]
        end = states[-1].copy()
        end[:2] = self.position, 0.0
        shares = (1 + np.arange(max(shift, 0)))[:, None] / (1 + max(shift, 0))
        straight = states[-1] + shares * (end - states[-1])
        ending = Touches(self.position, self.carrier.size, timed=last is not None)
        return Cut(np.concatenate([states, straight, end[None]]), ending, last)

    def earlier(self, path: ExitPath) -> int | None:
        gaps = self._inside(path.q[:-1])
        outside = np.flatnonzero(gaps < -_ROUNDING * float(np.ptp(path.q[:, 0])))
        return int(outside[0]) if outside.size else None

    def _inside(self, states: Array) -> Array:
        """How far states are from the stop, negative beyond it."""
        return self.sign * (self.position - states[:, 0])
