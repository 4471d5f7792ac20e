"""Branches: which of many exits are the same path, told apart by where they pass."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.shooting.outcomes import Outcomes, Shooter
from vibrokit.kernels.single import record
from vibrokit.symbolic.flow_kind import Flow

FINDER = "action plot"
_PER_INTERVAL = 8  # states of a candidate
_ON_ONE_TURN = 64  # where time does not matter: states close enough to stand for a curve
_MIDDLE = (0.2, 0.8)  # of the action: where branches are told apart
_APART = 0.03  # of how far the path reaches there
_MOST = 8
_TINY = 1e-300

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Branch:
    """One way out.

    Attributes
    ----------
    index : int
        Which of the paths it is.
    candidate : Candidate
    whole : tuple of array (count, 2)
        For each phase, the path's (x, v).
    middle : tuple of array (count, 2)
        Those of them where most of the action is paid.
    """

    index: int
    candidate: Candidate
    whole: tuple[Array, ...]
    middle: tuple[Array, ...]

    def same(self, other: Branch) -> bool:
        """Whether this path passes by places of the other at the same phases, on the way to the same attractor."""
        reach = np.max([np.ptp(here, axis=0) for here in self.middle if len(here)], axis=0, initial=_TINY)
        gaps = [
            cKDTree(there / reach).query(here / reach)[0]
            for here, there in zip(self.middle, other.whole, strict=True)
            if len(there)
        ]
        near = np.concatenate(gaps) if gaps else np.empty(0)
        return bool(near.size and np.median(near) <= _APART)


def branches_of(shooter: Shooter, outcomes: Outcomes, ranked: Iterable[int], worth: float) -> tuple[Branch, ...]:
    """Return the distinct ways among some confirmed exits, given in the order of their actions.

    Parameters
    ----------
    shooter : Shooter
    outcomes : Outcomes
    ranked : iterable of int
        The exits to look at.
    worth : float
        Times the least action of a target, up to which its branches are kept.

    Returns
    -------
    tuple of Branch
        At most 8 of each target.
    """
    found: list[Branch] = []
    for index in ranked:
        target, action = int(outcomes.targets[index]), float(outcomes.states[index, -1])
        known = [branch for branch in found if branch.candidate.target == target]
        if len(known) == _MOST or (known and action > worth * known[0].candidate.action):
            continue
        branch = _branch(shooter, outcomes, int(index))
        if not any(branch.same(other) for other in known):
            found.append(branch)
    return tuple(found)


def sampled(shooter: Shooter, outcomes: Outcomes, index: int, per_interval: int) -> Array:
    """Return (q, p, S) from the first section to the look at which the path was out, or just after."""
    osc = shooter.osc
    looks = shooter.exit.looks(osc)
    count = math.ceil(int(outcomes.intervals[index]) * per_interval / looks)
    spacing = osc.section_interval / per_interval
    return record(osc, Flow.HAMILTONIAN, shooter.stepper, outcomes.begun[index], 0.0, spacing, count)


def _branch(shooter: Shooter, outcomes: Outcomes, index: int) -> Branch:
    osc = shooter.osc
    fine = _ON_ONE_TURN if osc.autonomous else _PER_INTERVAL
    path = sampled(shooter, outcomes, index, fine)
    share = path[:, -1] / path[-1, -1]
    inside = (share >= _MIDDLE[0]) & (share <= _MIDDLE[1])
    inside[np.argmin(np.abs(share - 0.5))] = True  # behind strong damping all is paid between two states
    phase = np.zeros(len(path)) if osc.autonomous else np.arange(len(path)) % fine
    phases = range(1 if osc.autonomous else fine)
    whole = tuple(path[phase == number, :2] for number in phases)
    middle = tuple(path[inside & (phase == number), :2] for number in phases)
    path = path[:: fine // _PER_INTERVAL]
    unit = osc.section_interval
    times = unit * (int(outcomes.section[index]) + np.arange(len(path)) / _PER_INTERVAL)
    size = (path.shape[1] - 1) // 2
    candidate = Candidate(
        source=shooter.home,
        target=int(outcomes.targets[index]),
        times=times,
        states=path[:, :size].copy(),
        action=float(outcomes.states[index, -1]),
        finder=FINDER,
    )
    return Branch(index, candidate, whole, middle)
