"""Sensitivity: how the action of an extremal path changes with each parameter of the scene."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import ParameterError, SceneError
from vibrokit.oscillator import Oscillator
from vibrokit.parts.parameter import Entry

Array = NDArray[np.float64]

# Places, and the weights of the changes there in the derivative from the nearer and from the farther ones.
_BOTH_SIDES = (-2, -1, 1, 2), np.array([0, -1, 1, 0]) / 2, np.array([-1, 0, 0, 1]) / 4
_ABOVE = (0, 1, 2, 4), np.array([-3, 4, -1, 0]) / 2, np.array([-3, 0, 4, -1]) / 4
_BELOW = (0, -1, -2, -4), -_ABOVE[1], -_ABOVE[2]


@dataclasses.dataclass(frozen=True)
class Sensitivity:
    """Derivative of an action in one parameter, and its error."""

    value: float
    error: float


def sensitivities(
    problem: ExitProblem,
    end: PathEnd,
    propagator: SegmentPropagator,
    found: ExtremalPath,
    names: Collection[str] | None = None,
) -> dict[str, Sensitivity]:
    """Return dS/dθ by the name of each parameter that does not shape the equations, or of those in `names`.

    The action is stationary on an extremal path, so that only the explicit dependence on the parameter counts,
    dS/dθ = −∫ ∂H/∂θ dt along the path from the attractor to its end, at fixed phase of the forcing. (The first
    variation with a parameter; see Goldstein, "Classical Mechanics", 8.6.) Over one piece, the integral is ∂S/∂θ −
    p·∂q/∂θ at its end with the start fixed, which central differences of the flow give, located contacts included.
    Before the first point and after the last one, where the equations are linear, it is p·dq/dθ of the orbit that is
    left or approached. No search and no solution of the equations is repeated.

    A frequency whose ratio to another one must stay the same has none.
    """
    change = _ActionChange(problem, end, propagator, found)
    given = {}
    for entry in problem.osc.entries:
        if not entry.declared.structural and (names is None or entry.path in names):
            derivative = _derivative(change, entry)
            if derivative is not None:
                given[entry.path] = derivative
    return given


class _ActionChange:
    """Change of the action of a path, to first order, in a scene that differs from its own."""

    def __init__(self, problem: ExitProblem, end: PathEnd, propagator: SegmentPropagator, found: ExtremalPath) -> None:
        self.problem, self.propagator, self.found = problem, propagator, found
        self.place = problem.path_ends.index(end)
        n = propagator.size
        self.orbits = [found.source.displacement(found.first, -found.points[0, n:])]
        self.orbits += [orbit.displacement(phase, found.points[-1, n:]) for orbit, phase in found.ending.approached]

    def at(self, osc: Oscillator) -> tuple[float, float]:
        """Return the change of the action, and the largest change of a piece relative to the path's size."""
        found, n = self.found, self.propagator.size
        points, scale = found.points, found.scale[: self.propagator.size]
        moved = dataclasses.replace(self.propagator, osc=self.problem.exit.scene(osc))
        shorter = None if found.last == self.propagator.piece else found.last * moved.piece / self.propagator.piece
        carried = moved.extremal(points[:-1], found.first, shorter)
        offsets = carried.images[:, :n] - points[1:, :n]
        change = float(np.sum(carried.actions - found.actions) - np.sum(points[1:, n:] * offsets))
        largest = float(np.abs(offsets / scale).max())
        for orbit in self.orbits:
            offsets = orbit.offsets(moved)
            change += float(np.sum(orbit.weights * offsets))
            largest = max(largest, float(np.abs(offsets / scale).max()))
        end = dataclasses.replace(self.problem, osc=osc).path_ends[self.place]
        change += found.ending.displaced(points[-1], end)
        return change, largest


def _derivative(change: _ActionChange, entry: Entry) -> Sensitivity | None:
    """By differences on both sides, or on one where the other is not allowed; None if neither is.

    A first change of 1e-6 shows for which one, at most 1e-2 of the parameter, pieces move by 3e-5 of the path's size:
    its square and the error of the integration over it are alike.
    """
    osc, value = change.problem.osc, float(entry.value)
    interval = osc.section_interval

    def at(offsets: Sequence[float]) -> list[tuple[float, float]] | None:
        found = []
        for offset in offsets:
            try:
                there = osc.replace({entry.path: value + offset})
                if abs(there.section_interval / interval - 1) > 0.1:  # two frequencies lost their common period
                    return None
            except (ParameterError, SceneError):
                return None
            found.append(change.at(there))
        return found

    step = 1e-6 * (abs(value) or 1.0)
    probe = at([step]) or at([-step])
    if probe is None:
        return None
    (_, moved), *_ = probe
    if not math.isfinite(moved):
        return None
    step *= 3e-5 / moved if moved else 1.0
    step = min(step, 1e-2 * abs(value)) if value else step
    for places, nearer, farther in (_BOTH_SIDES, _ABOVE, _BELOW):
        found = at([place * step for place in places])
        if found is not None:
            changes = np.array([each for each, _ in found])
            near, far = float(nearer @ changes) / step, float(farther @ changes) / step
            return Sensitivity((4 * near - far) / 3, abs(near - far))
    return None
