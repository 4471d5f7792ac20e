"""Section: what lies on the section of a scene, as arrays that results carry along and pictures show."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.results.basins import NOT_FOLLOWED
from vibrokit.results.columns import Draft, Rows
from vibrokit.results.content import Content, ResultFileError
from vibrokit.results.region import Region
from vibrokit.results.structure import Structure

Array = NDArray[np.float64]

_CURVES = Rows()
_LISTS = {"saddles": "saddle", "chaotic": "chaotic_saddle", "stable": "stable_manifold"}


@dataclasses.dataclass(frozen=True, eq=False)
class Section:
    """Basins, attractors and what lies between them.

    Attributes
    ----------
    labels : int16 array (nx, nv)
        Label of the attractor that each cell leads to, or as in `Basins`.
    bounds : array (2, 2)
        Bounds of x and v.
    points : tuple of array (count, n)
        Points of each attractor, by label.
    saddles, chaotic : tuple of array (count, n)
        Points of each saddle orbit, and samples of chaotic sets on the boundary.
    stable : tuple of array (count, 2)
        Branches of the saddles' stable manifolds.
    """

    labels: NDArray[np.int16]
    bounds: Array
    points: tuple[Array, ...]
    saddles: tuple[Array, ...] = ()
    chaotic: tuple[Array, ...] = ()
    stable: tuple[Array, ...] = ()

    @classmethod
    def of(cls, structure: Structure) -> Section:
        """Take the section out of a structure."""
        return cls(
            labels=structure.basins.labels,
            bounds=structure.basins.region.bounds,
            points=tuple(attractor.points for attractor in structure.attractors),
            saddles=tuple(saddle.points for saddle in structure.saddles if saddle.kind != "chaotic"),
            chaotic=tuple(saddle.points for saddle in structure.saddles if saddle.kind == "chaotic"),
            stable=tuple(manifold.curve for manifold in structure.manifolds if manifold.stable),
        )

    @classmethod
    def in_data(cls, data: xarray.Dataset) -> Section:
        """Take it out of a result's data, where `data` put it.

        Raises
        ------
        ResultFileError
            Something is missing, of another shape or kind, or contradicts the rest.
        """
        content = Content(data, {})
        points: list[Array] = []
        while (name := f"points_{len(points)}") in data.variables:
            points.append(content.numbers(name, (None, None)))
        highest = min(len(points) - 1, np.iinfo(np.int16).max)
        labels = content.wholes("basin", (None, None), NOT_FOLLOWED, highest, dtype=np.int16)
        lists = {
            name: tuple(_CURVES.read(content, record, "points", _count(content, f"{record}_points_count")))
            for name, record in _LISTS.items()
        }
        narrow = [some.shape for some in (*points, *(array for some in lists.values() for array in some))]
        if any(shape[1] < 2 for shape in narrow):
            raise ResultFileError("it has points on the section of one number each, and x and v are needed")
        return cls(labels, _bounds(data), tuple(points), **lists)

    @property
    def data(self) -> xarray.Dataset:
        """The arrays by flat names: ``basin``, ``points_k``, ``saddle_points`` and so on, bounds as attribute."""
        draft = Draft()
        draft.put("basin", ("cell_x", "cell_v"), self.labels)
        for label, visits in enumerate(self.points):
            draft.put(f"points_{label}", (f"visit_{label}", "state"), visits)
        for name, record in _LISTS.items():
            _CURVES.write(draft, record, "points", getattr(self, name))
        return xarray.Dataset(draft.arrays, attrs={"region": self.bounds.ravel()})


def _count(content: Content, name: str) -> int:
    return content.dataset.variables[name].size if name in content.dataset.variables else 0


def _bounds(data: xarray.Dataset) -> Array:
    bounds = np.asarray(data.attrs.get("region", ()))
    if bounds.shape != (4,) or bounds.dtype.kind not in "fi":
        raise ResultFileError("it has no attribute 'region' of four numbers, the bounds of x and v")
    x_low, x_high, v_low, v_high = bounds.tolist()
    try:
        return Region((float(x_low), float(x_high)), (float(v_low), float(v_high))).bounds
    except StructureError as error:
        raise ResultFileError(f"its {str(error).rstrip('.')}") from error
