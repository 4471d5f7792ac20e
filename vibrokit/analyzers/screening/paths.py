"""Paths: followed back from where they leave, step by step, to the attractor."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.screening.potential import Potential
from vibrokit.analyzers.screening.tables import in_cells, steps_into
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.sweeps import descend_all
from vibrokit.oscillator import Oscillator

_LONGEST = 250  # section intervals
_HASTE = 1.1  # V against the cost of a step: a path that lingers for nothing by an unstable orbit is not wanted
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


def follow_back(
    osc: Oscillator, stepper: Stepper, potential: Potential, ends: Array, phase: int = 0
) -> list[Followed | None]:
    """Follow the cheapest paths to some states (count, 2) of a phase back to where V is given.

    The costs of steps are found for each state anew, not taken from the grid.

    Returns
    -------
    list of Followed or None
        None for a path that came nowhere.
    """
    grids, phases = potential.grids, potential.grids.phases
    states, open_ = ends.copy(), np.arange(len(ends))
    visited, paid = [states.copy()], [np.zeros(len(ends))]
    found: list[Followed | None] = [None] * len(ends)
    steps = round(osc.section_interval / grids.step)
    for count in range(1, _LONGEST * steps):
        before = (phase - count) % phases
        into = steps_into(
            osc, stepper, states[open_], grids.time(before) + grids.step, grids.step, grids.boxes[before]
        )  # fmt: skip
        centres, forms = in_cells(grids, before, into)
        starts = _starts(potential, before, states[open_], centres)
        _, places = descend_all(potential.values[before], starts, centres, forms, _HASTE)
        miss = places - centres
        cost = 0.5 * (forms[:, 0] * miss[:, 0] ** 2 + forms[:, 2] * miss[:, 1] ** 2) + forms[:, 1] * miss.prod(axis=1)
        states[open_] = grids.states(before, places)
        price = np.zeros(len(ends))
        price[open_] = cost
        visited.append(states.copy())
        paid.append(price)
        good = np.isfinite(cost)
        if before == 0:
            nearest = np.clip(np.rint(np.where(good[:, None], places, 0)), 0, np.array(grids.cells) - 1).astype(int)
            home = good & potential.given[0][nearest[:, 0], nearest[:, 1]]
            for index in open_[home]:
                found[index] = _joined(potential, visited, paid, index)
            good &= ~home
        open_ = open_[good]
        if not len(open_):
            break
    return found


def _starts(potential: Potential, before: int, states: Array, centres: Array) -> Array:
    """Where descents begin: b itself, and from where the nodes round a state are reached."""
    grids = potential.grids
    after = (before + 1) % grids.phases
    corner = np.floor(grids.places(after, states)).astype(int)[:, None] + _CORNERS
    corner = np.clip(corner, 0, np.array(grids.cells) - 1)
    return np.concatenate([centres[:, None], potential.places[before][corner[..., 0], corner[..., 1]]], axis=1)


def _joined(potential: Potential, visited: list[Array], paid: list[Array], index: int) -> Followed:
    states = np.array([some[index] for some in visited[::-1]])
    costs = np.array([some[index] for some in paid[::-1]])
    first = float(potential.at(0, states[:1])[0])
    level = first + np.concatenate([[0.0], np.cumsum(costs[:-1])])
    return Followed(states, float(level[-1]), level)
