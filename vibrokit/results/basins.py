"""Basins on a grid: where each cell of the region leads, and how files hold it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.documented import documented
from vibrokit.errors import ResultFileError, StructureError
from vibrokit.results.arrays import Arrays
from vibrokit.results.fields import Variable
from vibrokit.results.region import Region, centres

if TYPE_CHECKING:
    from vibrokit.results.attractor import Attractor

Whole = TypeVar("Whole", bound=np.signedinteger[Any])

UNSETTLED = -1
"""Label of cells whose motion is in the region and had reached no attractor within the budget."""
ESCAPED = -2
"""Label of cells whose motion was outside the region at the end of the budget, or diverged."""
NOT_FOLLOWED = -3
"""Label of cells that were not followed, because the work was stopped."""
AT_COPY = -4
"""Label of cells whose motion came to a copy of an attractor, whole turns away, where x is not taken modulo a turn."""

_OTHERS = {AT_COPY: "at_copy", NOT_FOLLOWED: "not_followed", ESCAPED: "left_region", UNSETTLED: "unsettled"}
_LABELS = (
    "label of the attractor that each cell's centre leads to; UNSETTLED, ESCAPED, NOT_FOLLOWED or AT_COPY if it leads "
    "to none, shape (nx, nv)"
)
_AXES = {"x": ("displacement", "m"), "v": ("velocity", "m s-1")}


@documented
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Basins:
    """Labels of the cells of a region."""

    region: Annotated[Region, "the region"]
    labels: Annotated[NDArray[np.int16], _LABELS]

    def fraction(self, label: int) -> float:
        """Share of the cells with a label."""
        return float(np.mean(self.labels == label))

    @property
    def exits(self) -> NDArray[np.int16]:
        """The labels by which motion leaves a basin: ESCAPED too where it comes to a copy."""
        return exits_of(self.labels)

    def at(self, states: NDArray[np.float64], every: int = 1) -> NDArray[np.int16]:
        """Return the label of the cell in which each state (…, 2) is; UNSETTLED outside the region.

        With `every` cells made one, the labels are those of a coarser grid.
        """
        cells, inside = self.region.cells_at(states, self.labels.shape)
        i, v = np.moveaxis(cells - cells % every, -1, 0)
        return np.where(inside, self.labels[i, v], UNSETTLED).astype(np.int16)

    def lost(self, attractor: Attractor, label: int) -> bool:
        """Return whether an attractor lies in cells of another basin: one point of an orbit, or all points of a set.

        Points outside the region and cells that were not followed do not count.
        """
        points = attractor.points[self.region.contains(attractor.points)]
        foreign = ~np.isin(self.at(points), (label, UNSETTLED, NOT_FOLLOWED))
        return bool(foreign.any() if attractor.repeats else len(points) and foreign.all())

    def __repr__(self) -> str:
        return f"Basins: {' × '.join(map(str, self.labels.shape))} cells on {self.region}"


Array = NDArray[np.float64]


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class Shock:
    """The smallest sudden change of state that leaves a basin."""

    source: Annotated[int, "label of the attractor whose state changes"]
    target: Annotated[int, "label of the attractor that is reached"]
    size: Annotated[float, "√((ω_n Δx)² + Δv²); ``|Δv|`` for a change of velocity alone", "m s-1"]
    error: Annotated[float, "how much smaller the smallest one may be; the last step of the search", "m s-1"]
    kick: Annotated[Array, "Δx (m) and Δv (m s⁻¹)"]
    state: Annotated[Array, "the state before the change, shape (n,)"]
    time: Annotated[float, "time after the section", "s"]


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class ShapeStability:
    """Stability of an attractor by the shape of its basin, to compare with its activation energy."""

    label: Annotated[int, "label of the attractor"]
    basin_fraction: Annotated[float, "share of the region's cells that lead to it"]
    basin_fraction_error: Annotated[float, "standard error of the share"]
    velocity_kick: Annotated[
        Shock | None, "the smallest change of v alone; None if none up to the size of the region leaves the basin"
    ]
    any_kick: Annotated[Shock | None, "the smallest change of x and v"]


def exits_of(labels: NDArray[Whole]) -> NDArray[Whole]:
    """Return labels with ESCAPED in place of AT_COPY: what leaves a basin for a copy of an attractor has left it."""
    return np.where(labels == AT_COPY, ESCAPED, labels).astype(labels.dtype)


def region_variables(region: Region) -> dict[str, Variable]:
    """Return the arrays that hold a region."""
    return {
        f"region_{axis}": (
            ("bound",),
            np.array(bounds, dtype=float),
            {"long_name": f"least and largest {noun} of the region", "units": units},
        )
        for (axis, (noun, units)), bounds in zip(_AXES.items(), (region.x, region.v), strict=True)
    }


def read_region(arrays: Arrays) -> Region:
    """Return the region; raises ResultFileError."""
    x, v = (arrays.numbers(f"region_{axis}", (2,)).tolist() for axis in _AXES)
    try:
        return Region((x[0], x[1]), (v[0], v[1]))
    except StructureError as error:
        raise ResultFileError(f"its {str(error).rstrip('.')}") from error


def grid_variables(labels: NDArray[np.int16], region: Region, names: Sequence[str]) -> dict[str, Variable]:
    """Return the arrays that hold the labels of the cells of a region, and the coordinates of the cells."""
    values = np.array([*_OTHERS, *range(len(names))], dtype=np.int16)
    words = [*_OTHERS.values(), *(name.replace(" ", "_") or f"attractor_{label}" for label, name in enumerate(names))]
    found: dict[str, Variable] = {
        "basin": (
            ("v", "x"),  # so that xarray draws x to the right
            np.asarray(labels, dtype=np.int16).T,
            {
                "long_name": "label of the attractor that the cell leads to",
                "flag_values": values,
                "flag_meanings": " ".join(words),
            },
        )
    }
    for (axis, (noun, units)), places in zip(_AXES.items(), centres(region.bounds, np.shape(labels)), strict=True):
        found[axis] = ((axis,), places, {"long_name": noun, "units": units})
    return found | region_variables(region)


def read_grid(arrays: Arrays, attractors: int) -> tuple[Region, NDArray[np.int16]]:
    """Return the region and the labels of its cells; raises ResultFileError."""
    highest = min(attractors - 1, int(np.iinfo(np.int16).max))
    labels = arrays.wholes("basin", (None, None), min(_OTHERS), highest)
    if labels.size == 0:
        raise ResultFileError("its array 'basin' is empty")
    return read_region(arrays), np.ascontiguousarray(labels.T, dtype=np.int16)
