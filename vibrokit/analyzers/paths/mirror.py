"""Mirror: exit paths that are known, mirrored in a scene whose forces and noise are odd.

Such a scene has the symmetry (x, v) → (−x, −v): with forcing of odd harmonics after half of the time after which it
repeats, and where a force varies as a factor of an odd function of the state, as a stiffness does, at the same time.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.leg import samples_of
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.vector_field import VectorField
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy, ExitPath

FINDER = "mirror images"
_CLOSE = 1e-2  # of the region's widths
_COMPARED, _TIMES = 32, 4  # samples of an orbit, of the region and of each stop that are compared; at these many times

Array = NDArray[np.float64]


class Mirror:
    """The mirror image of one attractor, and of paths that leave it."""

    def __init__(self, problem: ExitProblem) -> None:
        self._problem, scene = problem, problem.scene
        self._spacing = scene.section_interval / samples_of(scene)

    @cached_property
    def image(self) -> int | None:
        """Label of the attractor's mirror image, which may be the attractor itself; None if there is none."""
        if not self._alike(self._problem.attractor) or self._later is None:
            return None
        return self._label_of(self._problem.attractor)

    @property
    def later(self) -> float:
        """After which part of a section interval the scene is mirrored, where an attractor has an image: 0 or ½."""
        return 0.5 if self._later else 0.0

    @cached_property
    def _later(self) -> int | None:
        """Samples after which the scene is mirrored; None if it is not."""
        half = samples_of(self._problem.scene) // 2
        shifts = (0,) if self._problem.scene.autonomous else (0, half)
        return next((shift for shift in shifts if self._is_odd_after(shift)), None)

    def target(self, exit_: ActivationEnergy) -> int | None:
        """Return the target of an exit's mirror image; None unless that is a path of the attractor to a saddle."""
        if exit_.path is None or exit_.saddle < 0 or self.image is None or exit_.source != self.image:
            return None
        attractors = self._problem.structure.attractors
        target = exit_.target if exit_.target < 0 else self._label_of(attractors[exit_.target])
        return target if any(target in end.targets for end in self._problem.path_ends) else None

    def candidates(self, exits: Iterable[ActivationEnergy]) -> list[Candidate]:
        """Return the mirror images of the paths of exits that have one."""
        pairs = ((one, self.target(one)) for one in exits)
        return [
            self._mirrored(target, one.path, one.value)
            for one, target in pairs
            if target is not None and one.path is not None
        ]

    def _label_of(self, attractor: Attractor) -> int | None:
        """The label of the mirror image of an attractor, at the right time; None if there is none."""
        return next((other.label for other in self._alike(attractor) if self._in_time(attractor, other)), None)

    def _in_time(self, attractor: Attractor, other: Attractor) -> bool:
        """Whether the mirror image of an attractor, whose orbit is that of another one, meets the section where it."""
        if self._problem.scene.autonomous:
            return True
        share = (np.arange(attractor.period) + self.later) / attractor.period
        places = share * (len(attractor.orbit) - 1)
        met = np.column_stack([np.interp(places, np.arange(len(attractor.orbit)), one) for one in attractor.orbit.T])
        offsets = np.linalg.norm((met[:, None] + other.points[None, :, :2]) / self._widths, axis=2)
        return bool(offsets.min(axis=1).max() < _CLOSE)

    @property
    def _widths(self) -> Array:
        return np.ptp(self._problem.structure.basins.region.bounds, axis=1)[:2]

    def _alike(self, attractor: Attractor) -> list[Attractor]:
        """The attractors on whose orbits the mirror image of an attractor lies, at whatever times."""
        found, some = [], attractor.orbit[np.linspace(0, len(attractor.orbit) - 1, _COMPARED).astype(np.int64), None]
        for other in self._problem.structure.attractors:
            if attractor.repeats and (other.kind, other.period) == (attractor.kind, attractor.period):
                offsets = np.linalg.norm((some + other.orbit) / self._widths, axis=2)
                if offsets.min(axis=1).max() < _CLOSE:
                    found.append(other)
        return found

    def _is_odd_after(self, samples: int) -> bool:
        """Whether Hamilton's equations are odd: anywhere in the region, and at small and large depths of each stop."""
        points, later = self._points(), samples * self._spacing
        field, n = VectorField(self._problem.scene), points.shape[1] // 2
        for time in self._problem.scene.section_interval * np.arange(_TIMES) / _TIMES:
            here = field.hamiltonian_rate(points[:, :n], points[:, n:], time)
            there = -field.hamiltonian_rate(-points[:, :n], -points[:, n:], time + later)
            if not (np.abs(there - here) <= 1e-9 * (np.abs(here) + np.median(np.abs(here), axis=0))).all():
                return False
        return True

    def _points(self) -> Array:
        """Points (count, 2n) at which both sides of the scene are compared."""
        scene, bounds = self._problem.scene, self._problem.structure.basins.region.bounds
        size = self._problem.attractor.points.shape[1]
        states = np.random.default_rng(0).normal(size=(_COMPARED * (1 + len(scene.barriers)), 2 * size))
        reach = np.abs(bounds).max(axis=1)
        states[:, :2] *= reach
        for number, barrier in enumerate(scene.barriers, start=1):
            depths = reach[0] * np.geomspace(1e-9, 1.0, _COMPARED)
            states[number * _COMPARED : (number + 1) * _COMPARED, 0] = barrier.position + barrier.sign * depths
        return states

    def _mirrored(self, target: int, path: ExitPath, action: float) -> Candidate:
        """The mirror image from where it is first on the section; without momenta if it has several legs."""
        later = self._later or 0
        times = self._spacing * (np.arange(later, len(path.t), dtype=np.float64) + later)
        momenta = None if (path.p == 0).all(axis=1).any() else -path.p[later:]
        return Candidate(self._problem.source, target, times, -path.q[later:], action, FINDER, momenta)
