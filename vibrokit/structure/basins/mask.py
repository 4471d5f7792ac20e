"""Attractors that meet the section in a curve or a cloud, marked on a fine grid."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import UNSETTLED, Basins
from vibrokit.results.region import Region

_FINEST = 2048  # cells along one side of the grid
_COVERED = 0.97  # share of one half of a sample that the other half, widened, must contain
_WIDEST = 32  # largest number of cells by which a sample is widened
_SQUARE = np.ones((3, 3), dtype=bool)

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
Labels = NDArray[np.int16]
Mask = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class AttractorMask:
    """The cells that contain extended attractors, and those around them.

    Attributes
    ----------
    frame : Region
        What the grid covers: the region of the basins, and all of the attractors.
    cells : (int, int)
    entered : dict of int to bool array
        By the attractor's place: cells that contain points of its sample, and their neighbours.
    near : dict of int to bool array
        These, and a border as wide as the gaps of the sample.
    """

    frame: Region
    cells: tuple[int, int]
    entered: dict[int, Mask]
    near: dict[int, Mask]

    def labels(self, core: Basins | None, first: int) -> Labels:
        """Return labels that end a trajectory: those of the core, and `first` + place in marked cells."""
        labels = np.full(self.cells, UNSETTLED, dtype=np.int16)
        if core is not None:
            _embed(core, self.frame, labels)
        for place, mask in self.entered.items():
            labels[mask] = first + place
        return labels

    def away(self, place: int) -> Labels:
        """Return labels that end a trajectory which is not near an attractor."""
        return np.where(self.near[place], UNSETTLED, 0).astype(np.int16)


def is_extended(attractor: Attractor) -> bool:
    """Whether it meets the section in more than a few points."""
    return attractor.kind == "limit cycle" or not attractor.repeats


def mask_of(attractors: Sequence[Attractor], region: Region, spacing: float) -> AttractorMask | None:
    """Mark the extended attractors on a grid whose cells are about as wide as `spacing`; None if there are none."""
    samples = {place: _sample(a, spacing) for place, a in enumerate(attractors) if is_extended(a)}
    if not samples:
        return None
    frame = Region.around(np.concatenate([region.bounds.T, *samples.values()]), margin=0.01)
    nx, nv = np.clip(np.ceil(np.ptp(frame.bounds, axis=1) / spacing), 1, _FINEST).astype(int)
    cells = (int(nx), int(nv))
    entered, near = {}, {}
    for place, sample in samples.items():
        width = 1 if attractors[place].kind == "limit cycle" else _gaps(sample, frame, cells)
        entered[place] = ndimage.binary_dilation(_cells_with(sample, frame, cells), _SQUARE)
        near[place] = ndimage.binary_dilation(entered[place], _SQUARE, width)
    return AttractorMask(frame, cells, entered, near)


def _sample(attractor: Attractor, spacing: float) -> Array:
    """Points of an extended attractor; those of a limit cycle closer together than `spacing`."""
    if attractor.kind != "limit cycle":
        return attractor.points[:, :2]
    steps = np.linalg.norm(np.diff(attractor.orbit, axis=0), axis=1)
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    even = np.linspace(0.0, lengths[-1], 2 + int(lengths[-1] / (0.5 * spacing)))
    return np.stack([np.interp(even, lengths, column) for column in attractor.orbit.T], axis=1)


def _cells_with(points: Array, frame: Region, cells: tuple[int, int]) -> Mask:
    low, high = frame.bounds.T
    places = np.clip((points - low) / (high - low) * np.array(cells), 0, np.array(cells) - 1).astype(np.int64)
    mask = np.zeros(cells, dtype=bool)
    mask[places[:, 0], places[:, 1]] = True
    return mask


def _gaps(sample: Array, frame: Region, cells: tuple[int, int]) -> int:
    """Number of cells by which one half of a sample must be widened to contain the other."""
    early = _cells_with(sample[: len(sample) // 2], frame, cells)
    late = _cells_with(sample[len(sample) // 2 :], frame, cells)
    for width in range(1, _WIDEST):
        early = ndimage.binary_dilation(early, _SQUARE)
        if early[late].mean() >= _COVERED:
            return width
    return _WIDEST


def _embed(core: Basins, frame: Region, labels: Labels) -> None:
    """Copy the core's labels to the cells of a finer grid whose centres they contain."""
    axes = []
    for side, count in enumerate(labels.shape):
        (low, high), (first, last) = frame.bounds[side], core.region.bounds[side]
        centres = low + (high - low) * (np.arange(count) + 0.5) / count
        axes.append(np.floor((centres - first) / (last - first) * core.labels.shape[side]).astype(np.int64))
    inside = [(axis >= 0) & (axis < own) for axis, own in zip(axes, core.labels.shape, strict=True)]
    labels[np.ix_(*inside)] = core.labels[np.ix_(axes[0][inside[0]], axes[1][inside[1]])]
