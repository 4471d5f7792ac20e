"""Continuations in a dataset."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import Arrays
from vibrokit.results.attractor_table import (
    ATTRACTOR_FIELDS,
    attractor_variables,
    read_attractors,
)  # fmt: skip
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.bifurcation import BIFURCATIONS, Bifurcation
from vibrokit.results.fields import LARGEST, STATE, Field, Length, Number, Variable, Vectors, Whole, Word
from vibrokit.results.grid import read_region, region_variables
from vibrokit.results.provenance import findings_data, findings_from, json_data, json_text
from vibrokit.results.steady_states import SteadyStates
from vibrokit.results.table import Single, Table

if TYPE_CHECKING:
    from vibrokit.results.continuation import Continuation


@dataclasses.dataclass(frozen=True)
class Findings(Field):
    """Findings as JSON."""

    def variables(self, record: str, name: str, values: Sequence[Any]) -> Iterator[tuple[str, Variable]]:
        texts = [json_text(findings_data(findings)) for findings in values]
        yield name, ((record,), np.array(texts, dtype=str), {"long_name": "findings at the value, as JSON"})

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        return [findings_from(json_data(text)) for text in arrays.words(name, (arrays.size(record),))]


STATES = Table(
    "value",
    {"value": Number("value of the parameter", "", -LARGEST, LARGEST), "findings": Findings()},
    index="value",
)
ATTRACTORS = Table(
    "attractor",
    {
        **ATTRACTOR_FIELDS,
        "label": Whole("label of the attractor at its value; negative if none was given", low=UNSETTLED),
        "basin_fraction": Number("share of the region's cells that lead to the attractor; NaN if it is not known"),
        "basin_fraction_error": Number("standard error of the share"),
    },
)
OWNERS = Table(
    "attractor", {"at": Whole("place of the value at which it exists"), "branch": Whole("number of its branch")}
)
BRANCHES = Table("branch", {"name": Word("name of the branch")})
MARKS = Table(
    "bifurcation",
    {
        "kind": Word("kind of the bifurcation", known=BIFURCATIONS),
        "value": Number("value of the parameter at the bifurcation", "", -LARGEST, LARGEST),
        "error": Number("error of the value", "", 0.0, LARGEST),
        "branch": Whole("number of the branch"),
        "period": Whole("period of the orbit in forcing periods", low=1),
        "point": Vectors(Length("point", "points"), STATE),
        "side": Word("side of the stop that is grazed", known=("", "left", "right")),
    },
)
SCALARS = Single(
    {
        "parameter": Word("path of the parameter"),
        "symbol": Word("symbol of the parameter"),
        "unit": Word("unit of the parameter"),
    }
)


def continuation_dataset(continuation: Continuation) -> xarray.Dataset:
    """Return the arrays of a continuation."""
    states, marks = continuation.states, continuation.bifurcations
    attractors = [attractor for at in states for attractor in at.attractors]
    places = [place for place, at in enumerate(states) for _ in at.attractors]
    branches = [branch for at in states for branch in at.branches]
    found = {
        **STATES.variables(states),
        **attractor_variables(ATTRACTORS, attractors),
        **OWNERS.variables(attractors, at=places, branch=branches),
        **BRANCHES.variables(continuation.branch_names, name=continuation.branch_names),
        **MARKS.variables(marks, point=[mark.point[None] for mark in marks]),
        **SCALARS.variables(dataclasses.replace(continuation, unit=continuation.unit or "")),
        **({} if continuation.region is None else region_variables(continuation.region)),
    }
    for name in ("value", "bifurcation_value", "bifurcation_error"):
        found[name][2]["units"] = continuation.unit or "1"
    return xarray.Dataset(found)


def read_continuation(dataset: xarray.Dataset) -> dict[str, Any]:
    """Return the attributes of a continuation that arrays hold.

    Raises
    ------
    ResultFileError
        Something is missing, of another shape or kind, or contradicts the rest.
    """
    arrays = Arrays(dataset)
    scalars, names = SCALARS.read(arrays), tuple(row["name"] for row in BRANCHES.read(arrays))
    return {
        **scalars,
        "unit": scalars["unit"] or None,
        "region": read_region(arrays) if "region_x" in arrays else None,
        "branch_names": names,
        "states": _states(arrays, len(names)),
        "bifurcations": tuple(_bifurcations(arrays, len(names))),
    }


def _bifurcations(arrays: Arrays, branches: int) -> Iterator[Bifurcation]:
    for values in MARKS.read(arrays):
        if values["branch"] >= branches:
            raise ResultFileError(f"a bifurcation is on branch {values['branch']}, and there are {branches}")
        if len(values["point"]) != 1:
            raise ResultFileError(f"a bifurcation has {len(values['point'])} points, and one is needed")
        yield Bifurcation(**{**values, "point": values["point"][0]})


def _states(arrays: Arrays, branches: int) -> tuple[SteadyStates, ...]:
    rows = STATES.read(arrays)
    attractors, others = read_attractors(arrays, ATTRACTORS)
    if others:
        raise ResultFileError(f"{len(others)} of its survivals belong to no attractor")
    owners = OWNERS.read(arrays)
    if any(owner["at"] >= len(rows) or owner["branch"] >= branches for owner in owners):
        raise ResultFileError(f"an attractor belongs to a value or a branch that does not exist; there are {len(rows)}")
    own: list[list[int]] = [[] for _ in rows]
    for place, owner in enumerate(owners):
        own[owner["at"]].append(place)
    return tuple(
        SteadyStates(
            **row,
            attractors=tuple(attractors[place] for place in places),
            branches=tuple(owners[place]["branch"] for place in places),
        )
        for row, places in zip(rows, own, strict=True)
    )
