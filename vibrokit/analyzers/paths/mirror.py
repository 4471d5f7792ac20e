"""Mirror: exit paths that are known, mirrored in a scene whose forces and noise are odd.

Such a scene has the symmetry (x, v) → (−x, −v), with forcing after half of the time after which it repeats.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.same_action import same_action
from vibrokit.analyzers.polishing.leg import samples_of
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.vector_field import VectorField
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy, Bound, ExitPath

FINDER = "mirror images"
_ALIKE = 1e-2  # of the region's widths: largest distance between samples of an orbit and those of its mirror image
_COMPARED, _TIMES = 32, 4  # samples of an orbit, of the region and of each stop that are compared; at these many times
_SHALLOW = 1e-9  # of the region: least depth past a stop
_ODD = 1e-9  # of the rates: difference of the two sides, from rounding

Array = NDArray[np.float64]


class Mirror:
    """What paths that are known say of an attractor whose mirror image they leave."""

    def __init__(self, problem: ExitProblem) -> None:
        self._problem, scene = problem, problem.scene
        self._spacing = scene.section_interval / samples_of(scene)
        self._half = 0 if scene.autonomous else samples_of(scene) // 2  # samples after which the scene is mirrored

    def candidates(self, own: Sequence[ActivationEnergy], *, cheaper: bool = False) -> list[Candidate]:
        """Return the mirror images of known paths, and of the attractor's own, that leave the attractor and are new.

        On request, only those that cost less than the attractor's own paths to the same target.
        """
        found = list[Candidate]()
        polished = (one for one in self._problem.known if one.bound is not Bound.EXACT)
        for one in (*polished, *own):
            target = self._image(one)
            alike = [each for each in own if each.target == target]
            new = not any(same_action(one.value, each.value) for each in alike)
            least = min((each.value for each in alike), default=math.inf)
            if target is not None and new and (one.value < least or not cheaper):
                assert one.path is not None
                found.append(self._mirrored(target, one.path, one.value))
        return found

    @cached_property
    def energies(self) -> dict[int, ActivationEnergy]:
        """The known energies of which those of the attractor are mirror images, by the attractor's targets."""
        found = dict[int, ActivationEnergy]()
        for one in self._problem.known:
            target = self._image(one)
            if target is not None:
                found.setdefault(target, one)
        return found

    def _image(self, exit_: ActivationEnergy) -> int | None:
        """Target of the mirror image of an exit; None unless that leaves the attractor on a path to a saddle."""
        if exit_.path is None or exit_.saddle < 0 or self._labels[exit_.source] != self._problem.source:
            return None
        target = self._labels.get(exit_.target, exit_.target)
        wanted = any(target in end.targets for end in self._problem.path_ends)
        return target if wanted and self._is_odd else None

    @cached_property
    def _labels(self) -> dict[int, int | None]:
        """The label of the mirror image of each attractor; None for an attractor without one."""
        attractors = self._problem.structure.attractors
        widths = np.ptp(self._problem.structure.basins.region.bounds, axis=1)[:2]
        return {each.label: _mirror_image(each, attractors, widths) for each in attractors}

    @cached_property
    def _is_odd(self) -> bool:
        """Whether Hamilton's equations are odd: anywhere in the region, and at small and large depths of each stop."""
        points, later = self._points(), self._half * self._spacing
        field, n = VectorField(self._problem.scene), points.shape[1] // 2
        for time in self._problem.scene.section_interval * np.arange(_TIMES) / _TIMES:
            here = field.hamiltonian_rate(points[:, :n], points[:, n:], time)
            there = -field.hamiltonian_rate(-points[:, :n], -points[:, n:], time + later)
            if not (np.abs(there - here) <= _ODD * (np.abs(here) + np.median(np.abs(here), axis=0))).all():
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
            depths = reach[0] * np.geomspace(_SHALLOW, 1.0, _COMPARED)
            states[number * _COMPARED : (number + 1) * _COMPARED, 0] = barrier.position + barrier.sign * depths
        return states

    def _mirrored(self, target: int, path: ExitPath, action: float) -> Candidate:
        """The mirror image from where it is first on the section; without momenta if it has several legs."""
        times = self._spacing * (np.arange(self._half, len(path.t), dtype=np.float64) + self._half)
        momenta = None if (path.p == 0).all(axis=1).any() else -path.p[self._half :]
        return Candidate(self._problem.source, target, times, -path.q[self._half :], action, FINDER, momenta)


def _mirror_image(attractor: Attractor, attractors: Iterable[Attractor], widths: Array) -> int | None:
    """Find the mirror image of an attractor among others; return its label, or None."""
    some = attractor.orbit[np.linspace(0, len(attractor.orbit) - 1, _COMPARED).astype(np.int64), None]
    for other in attractors:
        if attractor.repeats and (other.kind, other.period) == (attractor.kind, attractor.period):
            offsets = np.linalg.norm((some + other.orbit) / widths, axis=2)
            if offsets.min(axis=1).max() < _ALIKE:
                return other.label
    return None
