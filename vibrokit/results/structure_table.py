"""Structures in a dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import xarray

from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import Arrays
from vibrokit.results.attractor_table import (
    ATTRACTOR_FIELDS,
    attractor_variables,
    read_attractors,
)  # fmt: skip
from vibrokit.results.basins import NOT_FOLLOWED, Basins
from vibrokit.results.fields import PLANE, STATE, Flag, Length, Number, Series, Spectrum, Vectors, Whole, Word
from vibrokit.results.grid import grid_variables, read_grid
from vibrokit.results.manifold import Manifold, ManifoldEnd
from vibrokit.results.saddle import Saddle
from vibrokit.results.table import Single, Table

if TYPE_CHECKING:
    from vibrokit.results.structure import Structure

_ENDS = {end.value: end for end in ManifoldEnd}

ATTRACTORS = Table("attractor", ATTRACTOR_FIELDS, index="label")
SADDLES = Table(
    "saddle",
    {
        "kind": Word("kind of the unstable orbit", known=("saddle", "flip saddle", "repeller", "chaotic")),
        "period": Whole("period in forcing periods; 0 for a chaotic set"),
        "duration": Number("time after which the motion repeats; NaN for a chaotic set", "s"),
        "points": Vectors(Length("visit", "points on the section"), STATE),
        "multipliers": Spectrum(Length("multiplier", "multipliers"), "multiplier of the section map over one orbit"),
        "exponents": Spectrum(
            Length("exponent", "exponents"), "rate at which deviations grow", "s-1", finite=False
        ),
        "leads_to": Series(
            Length("side", "sides"), "label of the attractor that each unstable branch reaches; negative as in basin",
            whole=True, low=NOT_FOLLOWED,
        ),
        "residual": Number("distance between the first point and its image after one orbit"),
        "error": Number("change of the first point when the integration is tightened"),
    },
)  # fmt: skip
MANIFOLDS = Table(
    "manifold",
    {
        "saddle": Whole("place of the saddle that the branch belongs to"),
        "point": Whole("point of the saddle from which the branch starts"),
        "stable": Flag("whether the branch belongs to the stable manifold"),
        "side": Whole("along the eigenvector (1) or against it (-1)", low=-1, high=1),
        "curve": Vectors(Length("vertex", "vertices", ragged=True), PLANE, prefixed=False),
        "end": Word("why the branch ends", known=tuple(_ENDS)),
    },
)
SCALARS = Single(
    {
        "settling": Number("distance at which an attractor counts as reached", "1", 0.0, 1e300),
        "budget": Whole("largest number of forcing periods that a trajectory was followed"),
        "stepper": Word("stepper of the basin grid"),
    }
)


def structure_dataset(structure: Structure) -> xarray.Dataset:
    """Return the arrays of a structure."""
    return xarray.Dataset(
        {
            **grid_variables(structure.basins.labels, structure.basins.region, structure.names),
            **attractor_variables(ATTRACTORS, structure.attractors, structure.survival),
            **SADDLES.variables(structure.saddles),
            **MANIFOLDS.variables(structure.manifolds),
            **SCALARS.variables(structure),
        }
    ).set_coords("attractor_name")


def read_structure(dataset: xarray.Dataset) -> dict[str, Any]:
    """Return the attributes of a structure that arrays hold.

    Raises
    ------
    ResultFileError
        Something is missing, of another shape or kind, or contradicts the rest.
    """
    arrays = Arrays(dataset)
    attractors, survival = read_attractors(arrays, ATTRACTORS)
    for place, attractor in enumerate(attractors):
        if attractor.label != place:
            raise ResultFileError(f"attractor {place} has label {attractor.label}; the two must be the same")
    saddles = _saddles(arrays, len(attractors))
    return {
        "attractors": attractors,
        "saddles": saddles,
        "manifolds": _manifolds(arrays, saddles),
        "basins": Basins(*read_grid(arrays, len(attractors))),
        "survival": survival,
        **SCALARS.read(arrays),
    }


def _saddles(arrays: Arrays, attractors: int) -> tuple[Saddle, ...]:
    saddles = []
    for values in SADDLES.read(arrays):
        values["leads_to"] = tuple(values["leads_to"].tolist())
        saddles.append(Saddle(**values))
        if any(label >= attractors for label in values["leads_to"]):
            raise ResultFileError(f"a saddle leads to {values['leads_to']}, and there are {attractors} attractors")
        if len(values["points"]) == 0:
            raise ResultFileError(f"a {values['kind']} orbit has no points")
    return tuple(saddles)


def _manifolds(arrays: Arrays, saddles: tuple[Saddle, ...]) -> tuple[Manifold, ...]:
    manifolds = tuple(Manifold(**values | {"end": _ENDS[values["end"]]}) for values in MANIFOLDS.read(arrays))
    for one in manifolds:
        known = one.saddle < len(saddles) and one.point < len(saddles[one.saddle].points)
        if not known or one.side == 0:
            raise ResultFileError(
                f"a manifold starts on side {one.side} of point {one.point} of saddle {one.saddle}, which is missing"
            )
    return manifolds
