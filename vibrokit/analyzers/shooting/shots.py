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
from vibrokit.analyzers.shooting.tolerances import TOLERANCES
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, GRAZED, LEFT_BASIN, LEFT_REGION, STALLED

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
        """Yield the shots after each round, at most `rounds`, until the least actions change by at most `tolerance`.

        A round adds about a quarter of the first starts.
        """
        shots, depth = self, self.starts.depth(self.boxes.first)
        count = max(1, len(self.boxes.centres) // 4 // (3 ** len(self.boxes.first) - 1))
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

    def dataset(self) -> xarray.Dataset:
        """Return the arrays of `ActionPlotResult.data`."""
        places, outcomes = self.boxes.centres, self.outcomes
        extra_states = (outcomes.states.shape[1] - 1) // 2 - 2
        polar, across = np.split(places[:, 1:], [extra_states], axis=1)
        radius = across[:, 0].copy() if across.size else np.zeros(len(places))
        flags = (COMPLETED, LEFT_REGION, LEFT_BASIN, DIVERGED, STALLED, GRAZED)
        columns: tuple[tuple[str, NDArray[Any], str, dict[str, Any]], ...] = (
            ("angle", 2 * np.pi * (places[:, 0] % 1.0), "angle of the start", {"units": "rad"}),
            ("radius", radius, "fraction of the logarithmic distance between the domain's edges", {"units": "1"}),
            ("action", self.exit_actions, "action at the exit", {"units": "m2 s-3"}),
            (
                "exit_status", outcomes.status.astype(np.int32), "how the path ended",
                {"flag_values": flags, "flag_meanings": "remaining left_region left_basin diverged stalled grazed"},
            ),
            ("target", outcomes.targets.astype(np.int32), "label of the attractor reached, -1 if unknown", {}),
            ("exit_x", outcomes.states[:, 0], "position at the path's end", {"units": "m"}),
            ("exit_v", outcomes.states[:, 1], "velocity at the path's end", {"units": "m s-1"}),
        )  # fmt: skip
        arrays: dict[str, Any] = {
            name: ("start", values, {"long_name": text, **more}) for name, values, text, more in columns
        }
        if polar.size:
            attributes = {"units": "rad", "long_name": "polar angles of the start in the noise's extra states"}
            arrays["polar"] = (("start", "polar_number"), np.pi * polar, attributes)
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
        self.shooter.confirm(outcomes, factor=TOLERANCES.jump)
        least = outcomes.least(len(self.shooter.problem.structure.attractors))
        return dataclasses.replace(self, boxes=boxes, outcomes=outcomes, history=(*self.history, least))
