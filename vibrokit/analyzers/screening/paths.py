"""Paths: followed back from where they leave, step by step, to the attractor."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.screening.potential import Potential
from vibrokit.analyzers.screening.tables import in_cells, step_cost, steps_into, uphill
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.sweeps import descend_all
from vibrokit.oscillator import Oscillator

_LONGEST = 250  # section intervals
_HASTE = 1.1  # V against the cost of a step: a path that lingers for nothing by an unstable orbit is not wanted
_MORE_HASTE, _MOST_HASTE = 2.0, 1e4  # where V, interpolated, has a hollow there that a path would never leave
_PROGRESS = 1e-3  # of V, that a path has to lose in a section interval
_CORNERS = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Followed:
    """A path, in the order of time.

    Attributes
    ----------
    states : array (count, 2)
        At equal steps of time, the first on the section.
    action : float
        What its steps cost, and V at its start.
    level : array (count,)
        Action up to each state.
    """

    states: Array
    action: float
    level: Array


def follow_back(osc: Oscillator, stepper: Stepper, potential: Potential, end: Array, phase: int = 0) -> Followed | None:
    """Follow the cheapest path to a state of a phase back to where V is given, or to the orbit itself.

    The costs of steps are found for each state anew, not taken from the grid. None for a path that comes nowhere.
    """
    grids, phases = potential.grids, potential.grids.phases
    states, costs = [end], [0.0]
    steps = round(osc.section_interval / grids.step)
    haste, level = _HASTE, np.inf
    for count in range(1, _LONGEST * steps):
        before = (phase - count) % phases
        time = grids.time(before) + grids.step
        into = steps_into(osc, stepper, states[-1][None], time, grids.step, grids.boxes[before])
        centres, roots = in_cells(grids, before, into)
        anchors = grids.places(before, uphill(osc, stepper, states[-1][None], time, grids.step, grids.boxes[before]))
        starts = np.concatenate([_starts(potential, before, states[-1][None], centres), anchors[:, None]], axis=1)
        totals, places = descend_all(potential.values[before], starts, centres, roots, haste)
        left = _from_orbit(potential, before, centres[0], roots[0], float(totals[0]))
        if left is not None:
            visit, off = left
            orbit = potential.orbit[visit - before : visit + 1]
            return _path(0.0, [*orbit, *states[::-1]], [*np.zeros(before), off, *costs[:0:-1]])
        states.append(grids.states(before, places[0]))
        costs.append(float(step_cost(places - centres, roots)[0]))
        if not np.isfinite(costs[-1]):
            return None
        if count % steps == 0:
            haste = _HASTE if totals[0] < (1 - _PROGRESS) * level else min(haste * _MORE_HASTE, _MOST_HASTE)
            level = float(totals[0])
        if before == 0:
            nearest = tuple(np.clip(np.rint(places[0]), 0, np.array(grids.cells) - 1).astype(int))
            if potential.given[0][nearest]:
                first = float(potential.at(0, states[-1][None])[0])
                return _path(first, states[::-1], costs[:0:-1])
    return None


def _path(first: float, states: list[Array], costs: list[float]) -> Followed:
    level = first + np.concatenate([[0.0], np.cumsum(costs)])
    return Followed(np.array(states), float(level[-1]), level)


def _starts(potential: Potential, before: int, states: Array, centres: Array) -> Array:
    """Where descents begin: b itself, and from where the nodes round a state are reached."""
    grids = potential.grids
    after = (before + 1) % grids.phases
    corner = np.floor(grids.places(after, states)).astype(int)[:, None] + _CORNERS
    corner = np.clip(corner, 0, np.array(grids.cells) - 1)
    return np.concatenate([centres[:, None], potential.places[before][corner[..., 0], corner[..., 1]]], axis=1)


def _from_orbit(
    potential: Potential, before: int, centre: Array, root: Array, total: float
) -> tuple[int, float] | None:
    """Where along the orbit a step leaves it for less than coming by any other state costs, and for how much."""
    visits = np.arange(before, len(potential.orbit), potential.grids.phases)
    costs = step_cost(potential.grids.places(before, potential.orbit[visits]) - centre, root)
    if not len(visits) or not costs.min() <= total:
        return None
    best = int(np.argmin(costs))
    return int(visits[best]), float(costs[best])
