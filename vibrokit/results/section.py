"""Section: what lies on the section of a scene, as arrays that results carry along and pictures show."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.documented import documented
from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import Arrays
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import grid_variables, read_grid
from vibrokit.results.fields import Variable
from vibrokit.results.region import Region, centres
from vibrokit.results.saddle import Manifold
from vibrokit.results.structure import Structure
from vibrokit.results.table import Table, fields_of

Array = NDArray[np.float64]

_OF_ATTRACTORS = {name: fields_of(Attractor)[name] for name in ("label", "name", "points")}
_ATTRACTORS = Table("attractor", _OF_ATTRACTORS, index="label")
_LISTS = {
    "saddles": Table("saddle", {"points": _OF_ATTRACTORS["points"]}),
    "chaotic": Table("chaotic_saddle", {"points": _OF_ATTRACTORS["points"]}),
    "stable": Table("stable_manifold", {"points": fields_of(Manifold)["curve"]}),
}


@documented
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Section:
    """Basins, attractors and what lies between them."""

    labels: Annotated[NDArray[np.int16], "label of the attractor that each cell leads to, or as in `Basins`, (nx, nv)"]
    bounds: Annotated[Array, "bounds of x and v, (2, 2)"]
    points: Annotated[tuple[Array, ...], "points of each attractor by label, (count, n)"]
    names: Annotated[tuple[str, ...], "names of the attractors, by label"]
    saddles: Annotated[tuple[Array, ...], "points of each saddle orbit"] = ()
    chaotic: Annotated[tuple[Array, ...], "samples of chaotic sets on the boundary"] = ()
    stable: Annotated[tuple[Array, ...], "branches of the saddles' stable manifolds, (count, 2)"] = ()

    @classmethod
    def of(cls, structure: Structure) -> Section:
        """Take the section out of a structure."""
        return cls(
            labels=structure.basins.labels,
            bounds=structure.basins.region.bounds,
            points=tuple(attractor.points for attractor in structure.attractors),
            names=structure.names,
            saddles=tuple(s.points for s in structure.saddles if s.kind != "chaotic" and not s.embedded),
            chaotic=tuple(saddle.points for saddle in structure.saddles if saddle.kind == "chaotic"),
            stable=tuple(manifold.curve for manifold in structure.manifolds if manifold.stable),
        )

    @classmethod
    def read(cls, arrays: Arrays) -> Section:
        """Take the section out of the arrays of a result; raises ResultFileError."""
        attractors = _ATTRACTORS.read(arrays)
        region, labels = read_grid(arrays, len(attractors))
        lists: dict[str, Any] = {
            name: tuple(values["points"] for values in table.read(arrays)) for name, table in _LISTS.items()
        }
        points = tuple(values["points"] for values in attractors)
        if not all(map(len, points)):
            raise ResultFileError("one of its attractors has no points")
        return cls(labels, region.bounds, points, tuple(values["name"] for values in attractors), **lists)

    @property
    def grid(self) -> dict[str, Array]:
        """Coordinates of the cells' centres: x and v."""
        return dict(zip("xv", centres(self.bounds, self.labels.shape), strict=True))

    @property
    def variables(self) -> dict[str, Variable]:
        """The arrays that hold the section, by name."""
        found = grid_variables(self.labels, Region.of(self.bounds), self.names)
        found |= _ATTRACTORS.variables(self.points, label=range(len(self.points)), name=self.names, points=self.points)
        for name, table in _LISTS.items():
            found |= table.variables(getattr(self, name), points=getattr(self, name))
        return found

    def __repr__(self) -> str:
        cells = " × ".join(map(str, self.labels.shape))
        return f"Section({cells} cells; attractors: {', '.join(self.names) or 'none'}; saddles: {len(self.saddles)})"
