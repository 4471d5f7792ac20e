"""Mirror: exit paths that are known, mirrored in a scene whose forces and noise are odd.

Such a scene has the symmetry (x, v) → (−x, −v), with forcing after half of the time after which it repeats.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.agreement import cost_the_same
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.leg import samples_of
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.vector_field import VectorField
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy, ExitPath

FINDER = "mirror images"
_ALIKE = 1e-2  # of the region's widths: largest distance between samples of an orbit and those of its mirror image
_COMPARED = 32  # samples of an orbit or of a path that are compared with their mirror images
_ODD = 1e-9  # of the largest rate: difference of the two sides, from rounding

Array = NDArray[np.float64]


class Mirror:
    """What paths that are known say of an attractor whose mirror image they leave."""

    def __init__(self, problem: ExitProblem) -> None:
        self._problem, scene = problem, problem.scene
        self._spacing = scene.section_interval / samples_of(scene)
        self._half = 0 if scene.autonomous else samples_of(scene) // 2  # samples after which the scene is mirrored

    def candidates(self, own: Sequence[ActivationEnergy]) -> list[Candidate]:
        """Return the mirror images of known paths, and of the attractor's own, that leave the attractor and are new."""
        found = list[Candidate]()
        for one in (*self._problem.known, *own):
            target = self._image(one)
            alike = (each for each in own if each.target == target)
            if target is not None and not any(cost_the_same(one, each) for each in alike):
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
        return self._labels.get(exit_.target, exit_.target) if self._is_odd(exit_.path) else None

    @cached_property
    def _labels(self) -> dict[int, int | None]:
        """Labels of the mirror images of all attractors; None where there is none."""
        attractors = self._problem.structure.attractors
        widths = np.ptp(self._problem.structure.basins.region.bounds, axis=1)[:2]
        return {each.label: _mirror_image(each, attractors, widths) for each in attractors}

    def _is_odd(self, path: ExitPath) -> bool:
        """Whether the mirror image of a path solves Hamilton's equations as well as the path does."""
        field, later = VectorField(self._problem.scene), self._half * self._spacing
        rates = np.array(
            [
                (
                    field.hamiltonian_rate(path.q[place], path.p[place], path.t[place]),
                    -field.hamiltonian_rate(-path.q[place], -path.p[place], path.t[place] + later),
                )
                for place in _some(len(path.t))
            ]
        )
        differences = np.abs(rates[:, 1] - rates[:, 0]).max(axis=0)
        return bool((differences <= _ODD * np.abs(rates).max(axis=(0, 1))).all())

    def _mirrored(self, target: int, path: ExitPath, action: float) -> Candidate:
        """The mirror image from where it is first on the section; without momenta if it has several legs."""
        times = self._spacing * (np.arange(self._half, len(path.t), dtype=np.float64) + self._half)
        momenta = None if (path.p == 0).all(axis=1).any() else -path.p[self._half :]
        return Candidate(self._problem.source, target, times, -path.q[self._half :], action, FINDER, momenta)


def _mirror_image(attractor: Attractor, attractors: Iterable[Attractor], widths: Array) -> int | None:
    """Label of the attractor that is the mirror image of one; None if there is none."""
    some = attractor.orbit[_some(len(attractor.orbit)), None]
    for other in attractors:
        if attractor.repeats and (other.kind, other.period) == (attractor.kind, attractor.period):
            offsets = np.linalg.norm((some + other.orbit) / widths, axis=2)
            if offsets.min(axis=1).max() < _ALIKE:
                return other.label
    return None


def _some(count: int) -> NDArray[np.int64]:
    """Places of samples to compare, of a number of them."""
    return np.unique(np.linspace(0, count - 1, _COMPARED).astype(np.int64))
