"""Cells that classify trajectories: of a finished grid, around an extended attractor, and in a potential well."""

from __future__ import annotations

import concurrent.futures
import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import UNSETTLED, Basins
from vibrokit.results.region import Region
from vibrokit.structure.along_x import states_at, wrapped
from vibrokit.structure.basins.landings import Landings
from vibrokit.structure.rest import SteadyForce
from vibrokit.symbolic.flow_kind import Flow

MARGIN = 2
"""Cells on every side that must lead to the same attractor for a cell to classify trajectories, by default."""
FINEST = 2048
"""Cells along one side of a grid, at most."""
_SQUARE = np.ones((3, 3), dtype=bool)

Whole = NDArray[np.int64]
Labels = NDArray[np.int16]
Mask = NDArray[np.bool_]
Array = NDArray[np.float64]


def core_of(
    osc: Oscillator,
    stepper: Stepper,
    basins: Basins,
    margin: int,
    executor: concurrent.futures.Executor | None = None,
    *,
    circle: bool = False,
) -> Basins:
    """Return the cells whose neighbourhood leads to one attractor, as far as the grid resolves; UNSETTLED for others.

    All cells up to `margin` away must have the cell's label, and the same must hold for the cells that it and its
    neighbours are mapped to in the next two sections. The second test detects tongues of another basin too thin for
    the grid: the flow widens them. Without it the small basin of ``hertz-0.570`` lost 13% of its area on a grid of
    400 × 400 over [−1, 1]²; with it, not one cell. On the circle of one turn, motion is moved back to the region.
    """
    certain = agreeing(basins.labels, margin)
    cells, shape, labels = np.flatnonzero(certain), certain.shape, basins.labels.flat
    states = states_at(osc, basins.region.cell_centres(shape)[cells])
    ended = run_ensemble(osc, Flow.STATE, stepper, states, executor=executor)
    ends = wrapped(osc, ended.states, float(np.mean(basins.region.x))) if circle else ended.states
    reached, inside = basins.region.cells_at(ends, shape)
    targets = np.ravel_multi_index(tuple(reached.T), shape)
    held = inside & (ended.status == COMPLETED) & (labels[targets] == labels[cells])
    for _ in range(2):
        lost = np.zeros_like(certain)
        lost.flat[cells[~(held & certain.flat[targets])]] = True
        certain &= ~ndimage.binary_dilation(lost, _SQUARE)
    return Basins(basins.region, np.where(certain, basins.labels, UNSETTLED).astype(np.int16))


def agreeing(labels: Labels, margin: int) -> Mask:
    """Return which cells lead to the same attractor as all cells up to `margin` away on every side."""
    size = 2 * margin + 1
    least = ndimage.minimum_filter(labels, size=size, mode="nearest")
    return (least >= 0) & (least == ndimage.maximum_filter(labels, size=size, mode="nearest"))


@dataclasses.dataclass(frozen=True, eq=False)
class AttractorMask:
    """The cells that contain extended attractors, and those around them."""

    frame: Region  # the region of the basins, and all of the attractors
    places: Whole  # their labels, as of `Landings.samples`
    entered: Mask  # (attractors, nx, nv): cells that contain points of the attractor's sample, and their neighbours
    near: Mask  # (attractors, nx, nv): these, and a border as wide as the gaps of the sample


def is_extended(attractor: Attractor) -> bool:
    """Whether it meets the section in more than a few points."""
    return attractor.kind == "limit cycle" or not attractor.repeats


def mask_of(landings: Landings, region: Region, spacing: Array) -> AttractorMask | None:
    """Mark the extended attractors on a grid whose cells are about as wide as `spacing`; None if there are none."""
    none = np.empty((0, 2))
    own = [_sample(each, spacing) if is_extended(each) else none for each in landings.attractors]
    samples = {place: sample for place, sample in landings.samples(own) if len(sample)}
    if not samples:
        return None
    frame = Region.around(np.concatenate([region.bounds.T, *samples.values()]), margin=0.01)
    nx, nv = np.clip(np.ceil(np.ptp(frame.bounds, axis=1) / spacing), 1, FINEST).astype(int)
    cells = (int(nx), int(nv))
    entered, near = [], []
    for place, sample in samples.items():
        cycle = landings.attractor(place).kind == "limit cycle"
        width = 1 if cycle else _gaps(sample, frame, cells)
        entered.append(ndimage.binary_dilation(_cells_with(sample, frame, cells), _SQUARE))
        near.append(ndimage.binary_dilation(entered[-1], _SQUARE, width))
    return AttractorMask(frame, np.array(list(samples)), np.array(entered), np.array(near))


def _sample(attractor: Attractor, spacing: Array) -> Array:
    """Points of an extended attractor; those of a limit cycle closer together than `spacing`."""
    if attractor.kind != "limit cycle":
        return attractor.points[:, :2]
    steps = np.linalg.norm(np.diff(attractor.orbit, axis=0) / spacing, axis=1)
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    even = np.linspace(0.0, lengths[-1], 2 + int(2 * lengths[-1]))
    return np.stack([np.interp(even, lengths, column) for column in attractor.orbit.T], axis=1)


def _cells_with(points: Array, frame: Region, cells: tuple[int, int]) -> Mask:
    low, high = frame.bounds.T
    places = np.clip((points - low) / (high - low) * np.array(cells), 0, np.array(cells) - 1).astype(np.int64)
    mask = np.zeros(cells, dtype=bool)
    mask[places[:, 0], places[:, 1]] = True
    return mask


def _gaps(sample: Array, frame: Region, cells: tuple[int, int]) -> int:
    """Number of cells, up to 32, by which one half of a sample must be widened to contain 97 % of the other."""
    early = _cells_with(sample[: len(sample) // 2], frame, cells)
    late = _cells_with(sample[len(sample) // 2 :], frame, cells)
    for width in range(1, 32):
        early = ndimage.binary_dilation(early, _SQUARE)
        if early[late].mean() >= 0.97:
            return width
    return 32


def wells(
    osc: Oscillator, attractors: Sequence[Attractor], region: Region, cells: tuple[int, int] = (512, 512)
) -> Basins | None:
    """Return the cells of a grid from which motion comes to rest in the well that it is in; UNSETTLED for others.

    All states of such a cell have less energy V + ½v² than both barriers around the only minimum of V between them.
    None for scenes in which motion may gain energy.
    """
    if not osc.model.relaxes:
        return None
    room = 1e-3  # of the depth of a well, for errors of the integration
    low, high = region.x
    edges, speeds = np.linspace(low, high, cells[0] + 1), np.linspace(*region.v, num=cells[1] + 1, dtype=np.float64)
    steady = SteadyForce(osc)
    bounds = [low, *sorted([*osc.model.domain.borders(low, high), *steady.zeros(low, high)]), high]
    stops = [barrier.position for barrier in osc.barriers if low < barrier.position < high]
    places = np.unique([*edges, *stops, *bounds])
    inside, work = steady.work(places)
    halved = steady.work(np.sort([*places, *(0.5 * (places[:-1] + places[1:]))]))[1].reshape(-1, 2).sum(axis=1)
    potential = np.concatenate([[0.0], -np.cumsum(work)])
    highest = np.maximum.reduceat(potential, np.searchsorted(places, edges[:-1]))  # V in each column of cells
    highest = np.maximum(highest, potential[np.searchsorted(places, edges[1:])])
    kinetic, labels = 0.5 * np.maximum(speeds[:-1] ** 2, speeds[1:] ** 2), np.full(cells, UNSETTLED, dtype=np.int16)
    for left, x, right in zip(bounds, bounds[1:], bounds[2:], strict=False):
        label = _label(attractors, x, 1e-6 * (high - low))
        first, middle, last = np.searchsorted(places, [left, x, right])
        before, bottom, after = potential[[first, middle, last]]
        falls = bool(np.all(inside[first:middle] > 0) and np.all(inside[middle:last] < 0))
        with np.errstate(invalid="ignore"):  # beyond a pole nothing is known
            depth = min(before, after) - bottom
            error = float(np.abs(halved - work)[first:last].sum())  # large where a force is singular
        if label is None or not falls or not error <= 0.1 * room * depth:
            continue
        limit = bottom + (1 - room) * depth
        between = (edges[:-1] >= left) & (edges[1:] <= right)
        labels[between[:, None] & (highest[:, None] + kinetic < limit)] = label
    return Basins(region, labels)


def _label(attractors: Sequence[Attractor], x: float, distance: float) -> int | None:
    """Which of the attractors the equilibrium at a place is."""
    for label, attractor in enumerate(attractors):
        if attractor.kind == "equilibrium" and abs(float(attractor.points[0, 0]) - x) <= distance:
            return label
    return None
