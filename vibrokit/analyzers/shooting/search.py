"""The search: paths from all over a family of starts, more of them where the action is small or jumps."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.analyzer import part_of
from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.shooting.boxes import Boxes
from vibrokit.analyzers.shooting.branches import Branch, branches_of
from vibrokit.analyzers.shooting.outcomes import Outcomes, Shooter
from vibrokit.analyzers.shooting.starts import Starts
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stopping import LEFT_BASIN, LEFT_REGION

_PART = 4  # of the first grid, that each round adds
_TRIED = 64  # local minima that are looked at, the cheapest
_WORTH = 3.0  # times the least action: dearer ways are not kept
_CERTAIN = 1.5  # times the least action, up to which all exits are confirmed
_WINDOW = (200, 25, 7)  # boxes along each side of a box of the first grid and its neighbours, by dimension
_WINDOW_ROUNDS = 12
_WINDOW_TOLERANCE = 1e-5

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Search:
    """What was found round one attractor.

    Attributes
    ----------
    starts : Starts
    shooter : Shooter
    boxes : Boxes
        Around each start.
    outcomes : Outcomes
    branches : tuple of Branch
        The distinct ways out, the cheapest first.
    change : float
        By how much the least action of any target fell in the last rounds, relative; infinite where there were too few
        to tell.
    rounds : int
        Of refinement.
    """

    starts: Starts
    shooter: Shooter
    boxes: Boxes
    outcomes: Outcomes
    branches: tuple[Branch, ...]
    change: float
    rounds: int

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The ways out as guesses for a polisher, the cheapest first."""
        return tuple(branch.candidate for branch in self.branches)

    @property
    def cheapest(self) -> tuple[Branch, ...]:
        """The cheapest way to each target."""
        targets = dict.fromkeys(branch.candidate.target for branch in self.branches)
        return tuple(next(b for b in self.branches if b.candidate.target == target) for target in targets)

    def summary(self) -> str:
        """What was found, as sentences."""
        ways = len(self.branches)
        words = f"{self.outcomes.summary()} {ways} distinct way{'s' if ways != 1 else ''} out."
        if self.rounds and self.branches:
            fell = "is new" if math.isinf(self.change) else f"fell by {self.change:.1e} of itself"
            last = min(self.starts.patience, self.rounds)
            words += f" Over the last {last} of {self.rounds} rounds of refinement the least action {fell}."
        return words


def search(
    starts: Starts, shooter: Shooter, points: int, rounds: int, tolerance: float, progress: Progress | None = None
) -> Search:
    """Carry a first grid of paths to their exits, then refine.

    Parameters
    ----------
    starts : Starts
    shooter : Shooter
    points : int
        Of the first grid; each round adds about a quarter of it.
    rounds : int
        Of refinement at most; none leaves the grid as it is.
    tolerance : float
        Relative change of the least actions, below which the search ends when some rounds have not brought more.
    progress : callable, optional

    Returns
    -------
    Search
    """
    boxes, outcomes, history = _refined(
        starts, shooter, Boxes.grid(starts.grid(points)), points, rounds, tolerance, progress
    )
    minima = boxes.minima(np.where(outcomes.confirmed, outcomes.states[:, -1], np.inf))[:_TRIED]
    found = branches_of(shooter, outcomes, minima, _WORTH)
    change = _change(history, starts.patience)
    return Search(starts, shooter, boxes, outcomes, found, change, len(history) - 1)


def least_near(found: Search, branch: Branch, starts: Starts, shooter: Shooter) -> float:
    """Search again round a branch, with other starts or another shooter; return its target's least action.

    NaN if no exit to that target is found. Near is within one box of the first grid to each side: where paths are
    sensitive, another integration finds the same path elsewhere.
    """
    boxes = found.boxes.around(branch.index, _WINDOW)
    points = len(boxes.centres)
    _, outcomes, _ = _refined(starts, shooter, boxes, points, _WINDOW_ROUNDS, _WINDOW_TOLERANCE)
    return _least(outcomes).get(branch.candidate.target, math.nan)


def _refined(
    starts: Starts,
    shooter: Shooter,
    boxes: Boxes,
    points: int,
    rounds: int,
    tolerance: float,
    progress: Progress | None = None,
) -> tuple[Boxes, Outcomes, list[dict[int, float]]]:
    outcomes = shooter.shoot(*starts.states(boxes.centres), part_of(progress, 0, rounds + 1))
    shooter.confirm(outcomes)
    history = [_least(outcomes)]
    each = max(1, points // _PART // (3**starts.dimension - 1))
    for number in range(1, rounds + 1):
        which = boxes.promising(_relative(outcomes), _kinds(shooter, outcomes), each)
        if not len(which):
            break
        known = len(boxes.centres)
        boxes = boxes.split(which)
        places = boxes.centres[known:]
        outcomes = outcomes.joined(shooter.shoot(*starts.states(places), part_of(progress, number, rounds + 1)))
        shooter.confirm(outcomes, _CERTAIN)
        history.append(_least(outcomes))
        if number >= starts.depth(boxes.first) and _change(history, starts.patience) <= tolerance:
            break
    if progress is not None:
        progress(1, 1)
    return boxes, outcomes, history


def _relative(outcomes: Outcomes) -> Array:
    """Actions as multiples of the least one of their target; infinite without an exit.

    Of unknown target are those that left the region, and cost more than the best exit so far.
    """
    out = np.isin(outcomes.status, (LEFT_BASIN, LEFT_REGION))
    actions = outcomes.states[:, -1]
    values = np.full(len(actions), np.inf)
    for target in np.unique(outcomes.targets[out]):
        here = out & (outcomes.targets == target)
        values[here] = actions[here] / actions[here if target >= 0 else out].min()
    return values


def _kinds(shooter: Shooter, outcomes: Outcomes) -> NDArray[np.int64]:
    """How paths ended, as numbers: by target, by the edge over which they left the region, or not at all."""
    edges = shooter.structure.basins.region.bounds
    over = np.concatenate([outcomes.states[:, :2] < edges[:, 0], outcomes.states[:, :2] > edges[:, 1]], axis=1)
    return outcomes.targets + len(shooter.structure.attractors) * 2 * (over @ 2 ** np.arange(4))


def _least(outcomes: Outcomes) -> dict[int, float]:
    """The least confirmed action of each target."""
    least: dict[int, float] = {}
    for target in np.unique(outcomes.targets[outcomes.confirmed]):
        least[int(target)] = float(outcomes.states[outcomes.confirmed & (outcomes.targets == target), -1].min())
    return least


def _change(history: list[dict[int, float]], rounds: int) -> float:
    """By how much the least actions fell in the last rounds, relative; infinite if one is new, or there are none."""
    if len(history) <= rounds or not history[-1]:
        return math.inf
    before = history[-1 - rounds]
    return max((before.get(target, math.inf) / action - 1 for target, action in history[-1].items()), default=math.inf)
