"""At a saddle: paths that end on an unstable orbit of the basin's boundary."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.course import Course
from vibrokit.analyzers.polishing.destinations import Cut, Destination, Goal
from vibrokit.analyzers.polishing.endings import ComesTo
from vibrokit.analyzers.polishing.ends import End, linear_end
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ExitPath
from vibrokit.results.saddle import Saddle

_SETTLING = 4.0  # e-foldings on the saddle that are added to a cut candidate
_MOST_ADDED = 40  # section intervals


@dataclasses.dataclass(frozen=True, eq=False)
class SaddleGoal(Goal):
    """An unstable orbit, or equilibrium, on the boundary of the basin.

    Attributes
    ----------
    orbit : Saddle
    """

    orbit: Saddle

    def scene(self, osc: Oscillator) -> Oscillator:
        """The scene as it is."""
        return osc

    def reached(self, attractor: Attractor) -> bool:
        """Never: an attractor is inside its basin."""
        return False

    def destination(self, carrier: Carrier) -> Destination:
        """Linearise Hamilton's equations along the orbit."""
        return _AtSaddle(carrier, linear_end(carrier, self.orbit.points[0], max(1, self.orbit.period)))


class _AtSaddle(Destination):
    def __init__(self, carrier: Carrier, end: End) -> None:
        self.carrier, self.end = carrier, end
        self.each = 1 if carrier.osc.autonomous else carrier.pieces

    def distance(self, course: Course) -> float:
        return self._closest(course)[0]

    def cuts(self, course: Course) -> list[Cut]:
        """Cut where the course, on the section, comes closest to a point of the orbit, and stay on that from there."""
        _, node, phase = self._closest(course)
        periods = math.ceil(_SETTLING / (self.end.rate() * self.carrier.pieces))
        added = min(max(2, periods), _MOST_ADDED) * self.carrier.pieces
        orbit = self.end.states[(phase + np.arange(added + 1)) % len(self.end.states)]
        states = np.concatenate([course.states, course.beyond[1:]])[: node + 1]
        return [Cut(np.concatenate([states, orbit[1:]]), ComesTo(self.end, phase + added))]

    def earlier(self, path: ExitPath) -> int | None:
        return None

    def _closest(self, course: Course) -> tuple[float, int, int]:
        """Distance, node of the course, and phase of the orbit."""
        states = np.concatenate([course.states, course.beyond[1:]])
        nodes = np.arange(self.each, len(states), self.each)
        phases = np.arange(0, len(self.end.states), self.carrier.pieces)
        size = np.ones(states.shape[1])
        size[1] = self.carrier.osc.natural_frequency
        apart = np.linalg.norm((states[nodes][:, None] - self.end.states[phases]) / size, axis=2)
        apart = np.where(np.isfinite(apart), apart, np.inf)
        node, phase = np.unravel_index(int(np.argmin(apart)), apart.shape)
        return float(apart[node, phase]), int(nodes[node]), int(phases[phase])
