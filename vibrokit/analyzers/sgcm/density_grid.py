"""DensityGrid: the nodes on which a density is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d, map_coordinates
from scipy.special import logsumexp

from vibrokit.arguments import pair
from vibrokit.kernels.ensemble import UNBOUNDED
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.region import Region

_REPEATED = 4  # nodes beyond one turn on each side: a quintic reaches 3

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class DensityGrid:
    """Nodes in x and at equal distances in v, the outermost ones on the bounds of a region.

    Attributes
    ----------
    x, v : array (nx,), (nv,)
    turn : float
        Distance along x after which states are the same, as on a circle; 0 if they are not. Beyond one turn there are
        some more nodes on both sides. Each repeats a node a turn away, and its cell has no area.
    """

    x: Array
    v: Array
    turn: float = 0.0

    @classmethod
    def of(
        cls, osc: Oscillator, region: Region, shape: tuple[int, int], faces: Array = UNBOUNDED, turn: float = 0.0
    ) -> DensityGrid:
        """Return a grid whose nodes in x are closer where the oscillator is stiffer.

        In a contact of natural frequency ω a density is as wide in v as outside, and narrower in x by r = ω_n/ω. So its
        second derivative is larger by 1/r², and distances ∝ r^(2/3) make the sum of errors of second order least, for
        any number of nodes. They are up to 7.4 times closer than elsewhere, and change over 1 % of the region. Faces of
        an exit, array (2, 2), are halfway between nodes, so that each cell is on one side of them; those that are
        outside the region do not count. With a turn along x the region is one turn, and nodes are at equal distances.
        """
        if turn:
            places = np.arange(-_REPEATED, shape[0] + _REPEATED)
            return cls(region.x[0] + turn * (places + 0.5) / shape[0], np.linspace(*region.v, shape[1]), turn)
        widened = 2.0 * np.ptp(region.x) / shape[0]
        places = np.linspace(region.x[0] - widened, region.x[1] + widened, 4001)
        stiffness = -VectorField(osc).jacobian(np.stack([places, np.zeros_like(places)], axis=-1))[:, 1, 0]
        # Where a mass without a spring is free, the median is 0.
        outside = float(np.median(np.abs(stiffness))) or osc.reference_frequency**2
        relative = np.sqrt(np.abs(stiffness) / outside)
        density = gaussian_filter1d(np.clip(relative, 1.0, 20.0) ** (2 / 3), 0.01 * len(places), mode="nearest")
        count = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
        counted = CubicSpline(places, count)
        low, high = counted(region.x).tolist()
        wanted = _aligned(low, high, shape[0], counted(_inside(region.x, faces[0])))
        return cls(CubicSpline(count, places)(wanted), _aligned(*region.v, shape[1], _inside(region.v, faces[1])))

    @property
    def shape(self) -> tuple[int, int]:
        """Nodes in x and in v."""
        return len(self.x), len(self.v)

    @property
    def region(self) -> Region:
        """What the nodes cover."""
        return Region.of([self._turn if self.turn else (self.x[0], self.x[-1]), (self.v[0], self.v[-1])])

    @property
    def _turn(self) -> tuple[float, float]:
        """One turn along x, from halfway between two nodes on."""
        low = 0.5 * (self.x[_REPEATED - 1] + self.x[_REPEATED])
        return low, low + self.turn

    @cached_property
    def areas(self) -> Array:
        """Area that belongs to each node, shape (nx, 1)."""
        areas = np.gradient(self.x) * self.v_spacing
        if self.turn:
            areas[:_REPEATED] = areas[-_REPEATED:] = 1e-300  # its logarithm is finite
        return areas[:, None]

    @property
    def v_spacing(self) -> float:
        """Distance of neighbouring nodes in v."""
        return float(self.v[1] - self.v[0])

    @property
    def nodes(self) -> Array:
        """States at the nodes, shape (nx, nv, 2)."""
        return np.stack(np.meshgrid(self.x, self.v, indexing="ij"), axis=-1)

    @cached_property
    def _place(self) -> CubicSpline:
        return CubicSpline(self.x, np.arange(len(self.x), dtype=float))

    def places(self, states: Array) -> Array:
        """Return states (…, 2) in units of nodes; outside the grid they are outside its range of nodes."""
        x, v = states[..., 0], states[..., 1]
        if self.turn:
            x = x - self.turn * np.floor((x - self._turn[0]) / self.turn)
        inside = self._place(np.clip(x, self.x[0], self.x[-1]))
        beyond = np.where(x < self.x[0], -1.0, np.where(x > self.x[-1], float(len(self.x)), inside))
        return np.stack([np.where(np.isnan(x), np.nan, beyond), (v - self.v[0]) / self.v_spacing], axis=-1)

    def share(self, beyond: Array) -> Array:
        """Return how much of the cell around each node is where a function, known at the nodes, is positive.

        The function is taken as linear within a cell; its values may be −∞ or very different away from 0.
        """
        values = beyond.reshape(self.shape)
        finite = np.where(np.isfinite(values), values, np.min(values, where=np.isfinite(values), initial=-1.0))
        slope = np.hypot(*np.gradient(finite))
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.clip(0.5 + finite / slope, 0.0, 1.0)
        return np.where(slope > 0, share, finite > 0)

    def holds(self, places: Array) -> NDArray[np.bool_]:
        """Return which places (…, 2), in units of nodes, are on the grid."""
        return np.asarray(((places >= 0) & (places <= np.array(self.shape) - 1)).all(axis=-1))

    def mass(self, phi: Array, where: NDArray[np.bool_] | None = None) -> float:
        """Return the logarithm of the probability of a density e^φ on the grid, or on some of its nodes."""
        weighted = phi + np.log(self.areas)
        return float(logsumexp(weighted if where is None else weighted[where]))

    def local_spacing(self, points: Array) -> Array:
        """Distances of neighbouring nodes in x and in v at some points (count, 2), shape (count, 2)."""
        widths = np.interp(points[:, 0], self.x, np.gradient(self.x))
        return np.stack([widths, np.full_like(widths, self.v_spacing)], axis=-1)

    def covered(self, inside: Callable[[Array], NDArray[np.bool_]]) -> Array:
        """Return how much of the cell around each node belongs to a set, from 0 to 1.

        `inside` returns which of some states (nx, nv, 2) belong to it. 5 × 5 points of a cell decide.
        """
        covered, nodes = np.zeros(self.shape), self.nodes
        inner = (np.arange(5) + 0.5) / 5 - 0.5
        widths = np.gradient(self.x)[:, None]
        for x in inner:
            for v in inner:
                moved = np.stack(np.broadcast_arrays(x * widths, v * self.v_spacing), axis=-1)
                covered += inside(nodes + moved)
        return covered / len(inner) ** 2

    def resampled(self, phi: Array, other: DensityGrid) -> Array:
        """Return φ, known on another grid, on these nodes; outside it goes on with the values at its edge."""
        places = np.moveaxis(other.places(self.nodes), -1, 0)
        resampled: Array = map_coordinates(phi, places, order=1, mode="nearest")
        return resampled

    def around(self, wanted: NDArray[np.bool_], margin: int) -> Region:
        """Return a region around the wanted nodes and `margin` nodes more on each side."""
        bounds = [self._turn] if self.turn else []
        for axis, places in enumerate((self.x, self.v)):
            if axis < len(bounds):
                continue
            found = np.flatnonzero(wanted.any(axis=1 - axis))
            first, last = max(found[0] - margin, 0), min(found[-1] + margin, len(places) - 1)
            bounds.append((places[first], places[last]))
        return Region.of(bounds)


def _inside(bounds: tuple[float, float], faces: Array) -> Array:
    """Those faces that are between the bounds."""
    return faces[(faces > bounds[0]) & (faces < bounds[1])]


def _aligned(low: float, high: float, nodes: int, faces: Array) -> Array:
    """Nodes at equal distances from `low` to `high` at least; faces, at most two, are halfway between them."""
    if len(faces) == 0:
        return np.linspace(low, high, nodes)
    spacing = (high - low) / (nodes - 2)
    if len(faces) == 2 and np.ptp(faces) > spacing:
        spacing = np.ptp(faces) / np.floor(np.ptp(faces) / spacing)
    first = faces[0] - (np.ceil((faces[0] - low) / spacing - 0.5) + 0.5) * spacing
    return first + spacing * np.arange(nodes)


def resolved(phi: Array) -> Array:
    """Return ln ρ, NaN where it is not resolved, because it is at the floor or up to 2 above it.

    What is cut at 1 above the floor leaves an edge that is a little higher.
    """
    return np.where(phi > phi.min() + 2.0, phi, np.nan)


def checked_nodes(caller: str, nodes: object) -> tuple[int, int]:
    """Return numbers of nodes in x and in v; raises StructureError if they are too few, or no such numbers."""
    return pair(f"{caller}: nodes", nodes, least=32)
