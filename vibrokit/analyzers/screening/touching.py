"""Touching: the way out that ends where a stop is first touched, at whatever time."""

from __future__ import annotations

import dataclasses
import weakref
from collections.abc import Iterable

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from vibrokit.analyzers.screening.potential import Potential
from vibrokit.analyzers.screening.tables import in_cells, steps_into, uphill
from vibrokit.analyzers.screening.ways_out import Tip, Way
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.sweeps import descend_all
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor

_LOOKS = 8  # between two phases
_SPEEDS = 2  # for each node in v
_ITERATIONS = 60  # in search of the cheapest among them
_SHORTEST = 0.01  # of a step: what is shorter is no step

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Touching(Way):
    """The first touch of one stop.

    The mass may touch between two phases and between two nodes: V is carried on from each phase by parts of a step, to
    states at the stop.

    Attributes
    ----------
    osc : Oscillator
    stepper : Stepper
    wall : float
        Position of the stop (m).
    """

    osc: Oscillator
    stepper: Stepper
    wall: float
    _known: weakref.WeakKeyDictionary[Potential, tuple[float, int, Array, Array]] = dataclasses.field(
        default_factory=weakref.WeakKeyDictionary, repr=False
    )

    def cost(self, potential: Potential) -> float:
        """The least cost over all times and speeds."""
        return self._best(potential)[0]

    def tips(self, potential: Potential) -> list[Tip]:
        """The state at the phase before, and the touch, which comes up to a step of time later."""
        _, phase, place, touch = self._best(potential)
        return [Tip(potential.grids.states(phase, place), phase, touch[None])]

    def _best(self, potential: Potential) -> tuple[float, int, Array, Array]:
        """Least cost, phase of the step that it takes, place where that begins, and state at the touch."""
        if potential not in self._known:
            self._known[potential] = self._searched(potential)
        return self._known[potential]

    def _searched(self, potential: Potential) -> tuple[float, int, Array, Array]:
        grids = potential.grids
        best = (np.inf, 0, grids.step, 0.0)
        for phase in range(grids.phases):
            speeds = np.linspace(grids.boxes[phase, 1, 0], grids.boxes[phase, 1, 1], _SPEEDS * grids.cells[1])
            for look in range(1, _LOOKS + 1):
                step = grids.step * look / _LOOKS
                costs, _ = self._costs(potential, phase, step, speeds)
                index = int(np.argmin(costs))
                if costs[index] < best[0]:
                    best = (float(costs[index]), phase, step, float(speeds[index]))
        cost, phase, step, speed = best
        if np.isfinite(cost):
            cost, step, speed = self._refined(potential, phase, step, speed)
        _, places = self._costs(potential, phase, step, np.array([speed]))
        return cost, phase, places[0], np.array([self.wall, speed])

    def _refined(self, potential: Potential, phase: int, step: float, speed: float) -> tuple[float, float, float]:
        """Return cost, time and speed of the cheapest touch near one."""
        grids = potential.grids
        apart = np.array([grids.step / _LOOKS, grids.spacing(phase)[1] / _SPEEDS])

        def cost(shifts: Array) -> float:
            when, fast = np.array([step, speed]) + shifts * apart
            inside = _SHORTEST * grids.step <= when <= grids.step
            return float(self._costs(potential, phase, when, np.array([fast]))[0][0]) if inside else np.inf

        begin = np.array([(0.0, 0.0), (-0.5, 0.5), (0.5, 0.5)])
        options = {"initial_simplex": begin, "maxiter": _ITERATIONS, "xatol": 1e-3, "fatol": 0.0}
        found = scipy.optimize.minimize(cost, begin[0], method="Nelder-Mead", options=options)
        step, speed = np.array([step, speed]) + found.x * apart
        return float(found.fun), float(step), float(speed)

    def _costs(self, potential: Potential, phase: int, step: float, speeds: Array) -> tuple[Array, Array]:
        """What it costs to be at the stop some time after a phase, by speed, and from which places."""
        grids = potential.grids
        states = np.column_stack([np.full(len(speeds), self.wall), speeds])
        ended = (states, grids.time(phase) + step, step, grids.boxes[phase])
        centres, roots = in_cells(grids, phase, steps_into(self.osc, self.stepper, *ended))
        against = grids.places(phase, uphill(self.osc, self.stepper, *ended))
        return descend_all(potential.values[phase], np.stack([centres, against], axis=1), centres, roots, 1.0)


def ways_to_touch(osc: Oscillator, attractor: Attractor, walls: Iterable[float], stepper: Stepper) -> list[Way]:
    """Return a way out for each stop that counts."""
    point = attractor.points[0, :2]
    unit = 1 / osc.natural_frequency
    scale = 0.5 / max(unit, osc.section_interval) / unit**2  # of the cost of going a distance of 1 m
    return [Touching(-1, -1, 10 * scale * (wall - float(point[0])) ** 2, osc, stepper, wall) for wall in walls]
