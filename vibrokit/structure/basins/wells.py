"""Wells: where motion without noise has too little energy to leave the well of a potential that it is in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import UNSETTLED, Basins
from vibrokit.results.region import Region
from vibrokit.structure.autonomous import equilibria
from vibrokit.structure.scales import states_at

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_BELOW = 1e-3  # of the depth of a well: motion so far below its barriers stays, whatever errors its integration makes
_SAME = 1e-6  # of the region's width: distance of an attractor from the equilibrium that it is

Array = NDArray[np.float64]


def wells(
    osc: Oscillator, attractors: Sequence[Attractor], region: Region, cells: tuple[int, int] = (512, 512)
) -> Basins | None:
    """Return the cells of a grid from which motion comes to rest in the well that it is in; UNSETTLED for others.

    All states of such a cell have less energy V + ½v² than both barriers around the only minimum of V between them.
    None for scenes in which motion may gain energy.
    """
    if not osc.model.relaxes:
        return None
    low, high = region.x
    edges, speeds = np.linspace(low, high, cells[0] + 1), np.linspace(*region.v, num=cells[1] + 1, dtype=np.float64)
    rests = equilibria(osc, low, high)
    bounds = [low, *sorted([*osc.model.domain.borders(low, high), *(float(rest.point[0]) for rest in rests)]), high]
    stops = [barrier.position for barrier in osc.barriers if low < barrier.position < high]
    places = np.unique([*edges, *stops, *bounds])
    inside, work = _work(osc, places)
    halved = _work(osc, np.sort([*places, *(0.5 * (places[:-1] + places[1:]))]))[1].reshape(-1, 2).sum(axis=1)
    potential = np.concatenate([[0.0], -np.cumsum(work)])
    highest = np.maximum.reduceat(potential, np.searchsorted(places, edges[:-1]))  # V in each column of cells
    highest = np.maximum(highest, potential[np.searchsorted(places, edges[1:])])
    kinetic, labels = 0.5 * np.maximum(speeds[:-1] ** 2, speeds[1:] ** 2), np.full(cells, UNSETTLED, dtype=np.int16)
    for left, x, right in zip(bounds, bounds[1:], bounds[2:], strict=False):
        label = _label(attractors, x, _SAME * (high - low))
        first, middle, last = np.searchsorted(places, [left, x, right])
        before, bottom, after = potential[[first, middle, last]]
        falls = bool(np.all(inside[first:middle] > 0) and np.all(inside[middle:last] < 0))
        with np.errstate(invalid="ignore"):  # beyond a pole nothing is known
            depth = min(before, after) - bottom
            error = float(np.abs(halved - work)[first:last].sum())  # large where a force is singular
        if label is None or not falls or not error <= 0.1 * _BELOW * depth:
            continue
        limit = bottom + (1 - _BELOW) * depth
        between = (edges[:-1] >= left) & (edges[1:] <= right)
        labels[between[:, None] & (highest[:, None] + kinetic < limit)] = label
    return Basins(region, labels)


def _work(osc: Oscillator, places: Array) -> tuple[Array, Array]:
    """The force at rest inside the intervals between places, in ascending order, and its integral over each."""
    halves = 0.5 * np.diff(places)[:, None]
    inside = places[:-1, None] + halves * (1 + _NODES)
    states = states_at(osc, np.stack([inside, np.zeros_like(inside)], axis=-1))
    forces = VectorField(osc).rate(states)[..., 1]
    return forces, np.sum(halves * _WEIGHTS * forces, axis=1)


def _label(attractors: Sequence[Attractor], x: float, distance: float) -> int | None:
    """Which of the attractors the equilibrium at a place is."""
    for label, attractor in enumerate(attractors):
        if attractor.kind == "equilibrium" and abs(float(attractor.points[0, 0]) - x) <= distance:
            return label
    return None
