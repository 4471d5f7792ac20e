"""SolvedPath: an exit path of one leg, or of several with the noise-free motion between them."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.candidate import same_action
from vibrokit.analyzers.polishing.leg import Departure, Leg, samples_of
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.energy import ExitPath
from vibrokit.results.saddle import Saddle
from vibrokit.structure.orbits import nodes_from, states_along, unstable_direction
from vibrokit.symbolic.flow_kind import Flow

_SAME = 0.05  # of a path's extent: distance between two paths that are one, one of them at its samples
_BESIDE = 1e-3  # of a leg's extent: distance from a saddle at which motion towards an attractor begins
_ARRIVED = 1e-2  # of a leg's extent: distance from that attractor at which it ends
_STRETCH, _MOST_STRETCHES = 64, 64  # section intervals of that motion that are run at once

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class SolvedPath:
    """A path to an end: one extremal path, or several, one after the other, with orbits between them."""

    legs: tuple[Leg, ...]
    path: ExitPath  # between two legs p = 0 and the action is constant

    @classmethod
    def of(cls, problem: ExitProblem, legs: Sequence[Leg]) -> SolvedPath:
        """Return the path of some legs.

        Raises StructureError if a leg begins at an attractor that the saddle before does not lead to.
        """
        path = legs[0].path
        for before, after in itertools.pairwise(legs):
            path = _appended(path, _between(problem, before, after), after.path, problem.scene)
        return cls(tuple(legs), path)

    @property
    def end(self) -> PathEnd:
        """Where it ends."""
        return self.legs[-1].end

    @property
    def targets(self) -> tuple[int, ...]:
        """Labels of the attractors that it leads to, without those that its first legs lead to."""
        before = {label for leg in self.legs[:-1] for label in leg.end.targets}
        return tuple(label for label in self.end.targets if label not in before)

    @property
    def action(self) -> float:
        """Of all legs; the motion between them costs nothing."""
        return sum(leg.found.action for leg in self.legs)

    @property
    def through(self) -> tuple[str, ...]:
        """The orbits between the legs, by name."""
        return tuple(leg.left.name for leg in self.legs[1:])

    def is_same(self, other: SolvedPath) -> bool:
        """Return whether two paths are one, shifted in time: of one action, and at one place where half is spent."""
        one, action = self.path, self.action
        if self.end is not other.end or not same_action(action, other.action):
            return False
        middle = min(int(np.searchsorted(one.action, 0.5 * action)), len(one.t) - 1)
        place = np.concatenate([one.q[middle], one.p[middle]])
        offsets = (np.hstack([other.path.q, other.path.p]) - place) / self.legs[0].found.scale
        return bool(np.abs(offsets).max(axis=1).min() < _SAME)


def _appended(path: ExitPath, between: Array, after: ExitPath, scene: Oscillator) -> ExitPath:
    """The path, the states between, and another path, whose first sample is one time step after the last of these.

    The last sample of the path gives way to the first of what follows: both are on the section at one time.
    """
    kept, count, n = len(path.t) - 1, len(between), path.q.shape[1]
    samples = samples_of(scene)
    step = scene.section_interval / samples
    times = path.t[-1] + step * np.arange(count)
    start = path.t[-1] + step * count
    last = kept + count
    sections = [path.section[path.section < kept], kept + np.arange(0, count, samples), last + after.section]
    return ExitPath(
        np.concatenate([path.t[:kept], times, start + after.t - after.t[0]]),
        np.concatenate([path.q[:kept], between, after.q]),
        np.concatenate([path.p[:kept], np.zeros((count, n)), after.p]),
        np.concatenate([path.action[:kept], np.full(count, path.action[-1]), path.action[-1] + after.action]),
        np.concatenate(sections),
    )


def _between(problem: ExitProblem, before: Leg, after: Leg) -> Array:
    """States (count, n) at equal steps from the end of a leg to the start of the next, that one not included."""
    saddle = problem.structure.saddles[before.end.saddle]
    here, there, extent = before.path.q[-1], after.path.q[0], np.ptp(after.path.q, axis=0)
    if after.left.saddle == before.end.saddle:
        return _along(problem.scene, saddle, problem.single_stepper(Flow.STATE), here, there)
    return _relaxation(problem, saddle, after.left, here, there, extent)


def _along(scene: Oscillator, saddle: Saddle, stepper: Stepper, here: Array, there: Array) -> Array:
    """The motion along the orbit of a saddle."""
    nothing, samples = np.empty((0, len(here))), samples_of(scene)
    if saddle.duration == 0:
        return nothing
    if scene.autonomous:
        spacing = scene.section_interval / samples
        count = math.ceil(saddle.duration / spacing)
        orbit = record(scene, Flow.STATE, stepper, saddle.points[0], 0.0, spacing, count)[:count]
        first, last = (_nearest(scene, orbit, state) for state in (here, there))
        return np.roll(orbit, -first, axis=0)[: (last - first) % count]
    first, last = (_nearest(scene, saddle.points, state) for state in (here, there))
    visited = (first + np.arange((last - first) % len(saddle.points))) % len(saddle.points)
    states = states_along(scene, saddle.at_equal_times, saddle.period, stepper, samples)
    return np.concatenate([nothing, *states.reshape(saddle.period, samples, -1)[visited]])


def _relaxation(
    problem: ExitProblem, saddle: Saddle, left: Departure, here: Array, there: Array, extent: Array
) -> Array:
    """The motion from a saddle to an attractor, until it is near the state `there` on the section."""
    scene, stepper = problem.scene, problem.single_stepper(Flow.STATE)
    visit, by = _nearest(scene, saddle.points, here), problem.single_stepper(Flow.STATE_VARIATIONAL)
    start, nodes = saddle.points[visit], nodes_from(visit, saddle.nodes, saddle.points)
    direction = unstable_direction(scene, nodes, max(1, saddle.period), by)
    if direction is None:
        raise StructureError(f"motion from the saddle at ({start[0]:.6g}, {start[1]:.6g}) diverges.")
    direction = direction / np.linalg.norm(direction / extent)
    samples = samples_of(scene)
    spacing, every = scene.section_interval / samples, 1 if scene.autonomous else samples
    motions = [start + side * _BESIDE * direction for side in (1, -1)]
    parts: list[list[Array]] = [[], []]
    for _ in range(_MOST_STRETCHES):
        for side, state in enumerate(motions):
            motion = record(scene, Flow.STATE, stepper, state, 0.0, spacing, _STRETCH * samples)
            if len(motion) <= _STRETCH * samples:  # it diverged
                continue
            near = np.linalg.norm((motion[::every] - there) / extent, axis=1)
            parts[side].append(motion[:-1])
            if near.min() <= _ARRIVED:
                parts[side][-1] = motion[: every * int(np.argmax(near <= _ARRIVED))]
                return np.concatenate(parts[side])
            motions[side] = motion[-1]
    raise StructureError(f"motion from the saddle at ({start[0]:.6g}, {start[1]:.6g}) does not come near {left.name}.")


def _nearest(scene: Oscillator, points: Array, state: Array) -> int:
    """Which of some points is nearest to a state in (x, v)."""
    return int(np.argmin(np.linalg.norm((points - state)[:, :2] / [1.0, scene.natural_frequency], axis=1)))
