"""Shots: paths from all over a family of starts, refined where the action is small or jumps."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.analyzers.shooting.boxes import Boxes
from vibrokit.analyzers.shooting.outcomes import Outcomes, Shooter
from vibrokit.analyzers.shooting.starts import Starts
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, GRAZED, LEFT_BASIN, LEFT_REGION, STALLED

_PART = 4  # a round adds the points of the first grid divided by this
_CERTAIN = 1.5  # times the least action of a target, up to which all exits are confirmed

_STATUS = (COMPLETED, LEFT_REGION, LEFT_BASIN, DIVERGED, STALLED, GRAZED)
_MEANINGS = "remaining left_region left_basin diverged stalled grazed"
_ATTRIBUTES: dict[str, dict[str, object]] = {
    "angle": {"units": "rad", "long_name": "angle of the start"},
    "radius": {"units": "1", "long_name": "fraction of the logarithmic distance between the domain's edges"},
    "polar": {"units": "rad", "long_name": "polar angles of the start in the noise's extra states"},
    "action": {"units": "m2 s-3", "long_name": "action at the exit"},
    "exit_status": {"long_name": "how the path ended", "flag_values": _STATUS, "flag_meanings": _MEANINGS},
    "target": {"long_name": "label of the attractor reached, -1 if unknown"},
    "exit_x": {"units": "m", "long_name": "position at the path's end"},
    "exit_v": {"units": "m s-1", "long_name": "velocity at the path's end"},
}

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Shots:
    """Paths from one attractor."""

    starts: Starts
    shooter: Shooter
    boxes: Boxes  # around each start
    outcomes: Outcomes
    history: tuple[Array, ...]  # least confirmed actions by target, after the first grid and after each round

    @classmethod
    def over(cls, starts: Starts, shooter: Shooter, boxes: Boxes) -> Self:
        """Integrate a path from the centre of each box."""
        outcomes = shooter.shoot(*starts.states(boxes.centres))
        shooter.confirm(outcomes)
        return cls(starts, shooter, boxes, outcomes, (outcomes.least(len(shooter.problem.structure.attractors)),))

    @property
    def rounds(self) -> int:
        """Refinement rounds done."""
        return len(self.history) - 1

    @property
    def least(self) -> Array:
        """Least confirmed actions by target, as `Outcomes.least` returns them."""
        return self.history[-1]

    @property
    def change(self) -> float:
        """Relative change of the least actions over the last rounds; infinite if one is new, or none is known."""
        known = np.isfinite(self.least)
        if self.rounds < self.starts.patience or not known.any():
            return math.inf
        before = self.history[-1 - self.starts.patience]
        return float((before[known] / self.least[known] - 1).max())

    @property
    def exit_actions(self) -> Array:
        """Action of each exit; NaN for paths that did not exit."""
        return np.where(self.outcomes.status == self.shooter.problem.exit_status, self.outcomes.actions, np.nan)

    def refinements(self, rounds: int, tolerance: float) -> Iterator[Shots]:
        """Yield the shots after each round, at most `rounds`, until the least actions change by at most `tolerance`."""
        shots, depth = self, self.starts.depth(self.boxes.first)
        count = max(1, len(self.boxes.centres) // _PART // (3 ** len(self.boxes.first) - 1))
        for number in range(1, rounds + 1):
            which = shots.boxes.promising(shots._relative_actions(), shots._kinds(), count)
            if not len(which):
                return
            shots = shots._split(which)
            yield shots
            if number >= depth and shots.change <= tolerance:
                return

    def minima(self) -> NDArray[np.int64]:
        """Return confirmed exits with no cheaper one next to them, the cheapest first."""
        return self.boxes.minima(np.where(self.outcomes.confirmed, self.outcomes.actions, np.inf))

    def counts(self) -> dict[str, int]:
        """Return how many paths ended in which way."""
        status, exit_status = self.outcomes.status, self.shooter.problem.exit_status
        escaped = status == exit_status
        return {
            "paths": len(status),
            "escaped": int(np.sum(escaped)),
            "left_region": int(np.sum((status == LEFT_REGION) & ~escaped)),
            "remaining": int(np.sum(status == COMPLETED)),
            "diverged": int(np.sum(status == DIVERGED)),
        }

    @property
    def unfinished(self) -> int:
        """Paths that needed too many steps, or grazed a stop whose force jumps."""
        return int(np.sum(np.isin(self.outcomes.status, (STALLED, GRAZED))))

    def dataset(self) -> xarray.Dataset:
        """Return the arrays of `ActionPlotResult.data`."""
        places, outcomes = self.boxes.centres, self.outcomes
        columns = {
            "angle": 2 * np.pi * (places[:, 0] % 1.0),
            "radius": self.starts.fractions(places),
            "action": self.exit_actions,
            "exit_status": outcomes.status.astype(np.int32),
            "target": outcomes.targets.astype(np.int32),
            "exit_x": outcomes.states[:, 0],
            "exit_v": outcomes.states[:, 1],
        }
        arrays: dict[str, Any] = {name: ("start", column, _ATTRIBUTES[name]) for name, column in columns.items()}
        extra_states = (outcomes.states.shape[1] - 1) // 2 - 2
        polar = np.pi * places[:, 1 : 1 + extra_states]
        if polar.size:
            arrays["polar"] = (("start", "polar_number"), polar, _ATTRIBUTES["polar"])
        return xarray.Dataset(arrays)

    def _relative_actions(self) -> Array:
        """Actions as multiples of the least one of their target; infinite without an exit.

        Paths of unknown target left the region; they are compared with the best of all exits.
        """
        outcomes = self.outcomes
        out = np.isin(outcomes.status, (LEFT_BASIN, LEFT_REGION))
        values = np.full(len(out), np.inf)
        for target in np.unique(outcomes.targets[out]):
            here = out & (outcomes.targets == target)
            values[here] = outcomes.actions[here] / outcomes.actions[here if target >= 0 else out].min()
        return values

    def _kinds(self) -> NDArray[np.int64]:
        """How paths ended, as numbers: by target, and by the edges of the tested region that they are beyond."""
        problem, states = self.shooter.problem, self.outcomes.states[:, :2]
        low, high = problem.stop.region.T
        beyond = np.concatenate([states < low, states > high], axis=1)
        return self.outcomes.targets + (len(problem.structure.attractors) + 2) * (beyond @ 2 ** np.arange(4))

    def _split(self, which: NDArray[np.int64]) -> Shots:
        boxes = self.boxes.split(which)
        new = self.shooter.shoot(*self.starts.states(boxes.centres[len(self.boxes.centres) :]))
        outcomes = self.outcomes.joined(new)
        self.shooter.confirm(outcomes, _CERTAIN)
        least = outcomes.least(len(self.shooter.problem.structure.attractors))
        return dataclasses.replace(self, boxes=boxes, outcomes=outcomes, history=(*self.history, least))
