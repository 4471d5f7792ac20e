"""The ring: extremal paths that start on a small circle round an attractor, and where they leave."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.quasi_potential import LocalPotential
from vibrokit.kernels.ensemble import Ensemble, Progress, Stop, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import LEFT_BASIN, LEFT_REGION, NOT_FINITE, RAN_OUT
from vibrokit.oscillator import Oscillator
from vibrokit.results.structure import Structure
from vibrokit.structure.settle import Settler
from vibrokit.symbolic.flow_kind import Flow

_BATCH = 256
_ROUNDS = 40
_LOOKS = 16  # exit tests per unit of time where no section sets them
_PATIENCE = 4.0
_LEAST_BUDGET = 100

Array = NDArray[np.float64]


def ring_starts(point: Array, potential: LocalPotential, radius: float, angles: Array) -> Array:
    """Return starts (q, p, S) on a circle: p = Σ⁻¹ δq and S = ½ δqᵀ Σ⁻¹ δq, shape (angles, 2n + 1)."""
    offset = np.zeros((len(angles), len(point)))
    offset[:, 0], offset[:, 1] = radius * np.cos(angles), radius * np.sin(angles)
    momentum = offset @ potential.stiffness
    action = 0.5 * np.einsum("ij,ij->i", offset, momentum)
    return np.column_stack([point + offset, momentum, action])


@dataclasses.dataclass(frozen=True, eq=False)
class Exits:
    """How the paths of a ring ended.

    Attributes
    ----------
    actions : array (count,)
        Action of each exit seen, NaN for paths without.
    targets : int array (count,)
        Label of the attractor that the exit state settles on; −1 where that was not asked or is none.
    status : int array (count,)
        Constants of `vibrokit.kernels.stopping`.
    states : array (count, 2n + 1)
        Last (q, p, S).
    intervals : int array (count,)
        Intervals taken.
    interval : float
        Length of one (s).
    best : int or None
        The confirmed exit of least action.
    """

    actions: Array
    targets: NDArray[np.int64]
    status: NDArray[np.int64]
    states: Array
    intervals: NDArray[np.int64]
    interval: float
    best: int | None

    def summary(self) -> str:
        """What became of the paths, as a sentence."""
        counts = {
            "left the basin": np.sum(self.status == LEFT_BASIN),
            "left the region, which counts as no exit": np.sum(self.status == LEFT_REGION),
            "were still inside at the end": np.sum(self.status == RAN_OUT),
            "ran out of range": np.sum(self.status == NOT_FINITE),
        }
        words = [f"{count} {what}" for what, count in counts.items() if count]
        found = "" if self.best is not None else " No exit was confirmed: raise the budget, or widen the region."
        return f"of {len(self.status)} paths " + ", ".join(words) + f".{found}"


def default_budget(multipliers: NDArray[np.complex128], period: int, radius: float) -> int:
    """Return a number of periods that lets deviations grow from the ring to the size of a basin, with patience."""
    decay = -math.log(max(float(np.abs(multipliers).max()), 1e-12)) / period
    return _LEAST_BUDGET + math.ceil(_PATIENCE * max(0.0, math.log(1.0 / radius)) / decay)


def confirmed_exits(
    osc: Oscillator,
    structure: Structure,
    home: int,
    starts: Array,
    stop: Stop,
    stepper: Stepper,
    budget: int,
    progress: Progress | None = None,
) -> Exits:
    """Carry paths until they leave, and confirm the cheapest exit by letting it flow on to another attractor.

    A path whose exit state falls back to its own attractor had only brushed the boundary, where cells are coarse: it
    is carried on from there.
    """
    looks = _LOOKS if osc.autonomous else 1
    interval = osc.section_interval / looks
    ended = run_ensemble(
        osc, Flow.HAMILTONIAN, stepper, starts, budget * looks, stop=stop, interval=interval, progress=progress
    )
    state, status, intervals = ended.states.copy(), ended.status.copy(), ended.intervals.copy()
    targets = np.full(len(starts), -1)
    best = None
    for _ in range(_ROUNDS):
        open_ones = np.flatnonzero((status == LEFT_BASIN) & (targets < 0))
        cheapest = open_ones[np.argsort(state[open_ones, -1])][:_BATCH]
        confirmed = np.flatnonzero(targets >= 0)
        best = None if not len(confirmed) else int(confirmed[np.argmin(state[confirmed, -1])])
        if not len(cheapest) or (best is not None and state[best, -1] <= state[cheapest[0], -1]):
            break
        reached = _settled(osc, structure, state[cheapest], stepper)
        targets[cheapest] = np.where(reached == home, -1, reached)
        again = cheapest[reached == home]
        more = _carried_on(osc, state[again], stop, stepper, budget * looks - intervals[again], interval)
        state[again], status[again] = more.states, more.status
        intervals[again] += more.intervals
        status[cheapest[reached < 0]] = RAN_OUT
    actions = np.where(status == LEFT_BASIN, state[:, -1], np.nan)
    return Exits(actions, targets, status, state, intervals, interval, best)


def _settled(osc: Oscillator, structure: Structure, states: Array, stepper: Stepper) -> NDArray[np.int64]:
    settler = Settler(osc, structure.attractors, structure.basins.region, structure.settling, structure.budget, stepper)
    return settler.labels(states[:, : structure.attractors[0].points.shape[1]])


def _carried_on(
    osc: Oscillator, states: Array, stop: Stop, stepper: Stepper, budget: NDArray[np.int64], interval: float
) -> Ensemble:
    return run_ensemble(osc, Flow.HAMILTONIAN, stepper, states, np.maximum(budget, 0), stop=stop, interval=interval)
