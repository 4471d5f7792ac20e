"""Branches: which of many exits are the same path, distinguished by the states they pass."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.shooting.outcomes import Outcomes, Shooter
from vibrokit.kernels.single import record
from vibrokit.symbolic.flow_kind import Flow

FINDER = "action plot"
_PER_INTERVAL = 8  # states of a candidate
_PER_TURN = 64  # without forcing: states close enough to stand for a curve
_MIDDLE = (0.2, 0.8)  # of the action: outside, paths share the attractor's or the saddle's neighbourhood
_APART = 0.03  # of the extent of the path's middle
_MOST = 8  # of each target
_COSTLY = 3.0  # times the least action of a target, above which paths are not kept
_TINY = 1e-300

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Branch:
    """One exit path."""

    index: int  # its place among the outcomes
    candidate: Candidate
    curve: tuple[Array, ...]  # for each phase, the path's (x, v) (count, 2)
    middle: tuple[Array, ...]  # those of them where most of the action accumulates

    def same(self, other: Branch) -> bool:
        """Whether this path passes states of the other at the same phases."""
        extent = np.max([np.ptp(here, axis=0) for here in self.middle if len(here)], axis=0, initial=_TINY)
        gaps = [
            cKDTree(there / extent).query(here / extent)[0]
            for here, there in zip(self.middle, other.curve, strict=True)
            if len(there)
        ]
        near = np.concatenate(gaps) if gaps else np.empty(0)
        return bool(near.size and np.median(near) <= _APART)


def branches_of(shooter: Shooter, outcomes: Outcomes, ranked: Iterable[int]) -> tuple[Branch, ...]:
    """Return the distinct paths among some confirmed exits, given in the order of their actions.

    Of each target, at most 8 that cost at most three times the least action are kept.
    """
    found: list[Branch] = []
    for index in ranked:
        target, action = int(outcomes.targets[index]), float(outcomes.actions[index])
        known = [branch for branch in found if branch.candidate.target == target]
        if len(known) == _MOST or (known and action > _COSTLY * known[0].candidate.action):
            continue
        branch = _branch(shooter, outcomes, int(index))
        if not any(branch.same(other) for other in known):
            found.append(branch)
    return tuple(found)


def sampled(shooter: Shooter, outcomes: Outcomes, index: int, per_interval: int) -> tuple[Array, Array]:
    """Return times (s) and (q, p, S) of a path from its first section to the exit test at which it was out."""
    osc = shooter.problem.scene
    count = math.ceil(int(outcomes.checks[index]) * per_interval / shooter.problem.checks)
    spacing = osc.section_interval / per_interval
    path = record(osc, Flow.HAMILTONIAN, shooter.stepper, outcomes.begun[index], 0.0, spacing, count)
    return osc.section_interval * (int(outcomes.section[index]) + np.arange(len(path)) / per_interval), path


def _branch(shooter: Shooter, outcomes: Outcomes, index: int) -> Branch:
    autonomous = shooter.problem.scene.autonomous
    fine = _PER_TURN if autonomous else _PER_INTERVAL
    times, path = sampled(shooter, outcomes, index, fine)
    part = path[:, -1] / path[-1, -1]
    inside = (part >= _MIDDLE[0]) & (part <= _MIDDLE[1])
    inside[np.argmin(np.abs(part - 0.5))] = True  # behind strong damping all action accumulates between two states
    phase = np.zeros(len(path)) if autonomous else np.arange(len(path)) % fine
    phases = range(1 if autonomous else fine)
    kept = slice(None, None, fine // _PER_INTERVAL)
    candidate = Candidate(
        source=shooter.problem.source,
        target=int(outcomes.targets[index]),
        times=times[kept],
        states=path[kept, : (path.shape[1] - 1) // 2].copy(),
        action=float(outcomes.actions[index]),
        finder=FINDER,
    )
    return Branch(
        index,
        candidate,
        tuple(path[phase == number, :2] for number in phases),
        tuple(path[inside & (phase == number), :2] for number in phases),
    )
