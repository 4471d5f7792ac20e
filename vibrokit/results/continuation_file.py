"""Saves and opens continuations."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vibrokit.results.attractor import Attractor
from vibrokit.results.attractor_file import ATTRACTOR_COLUMNS, read_attractors, write_attractors
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.columns import Draft, Number, Rows, Table, Whole, Word
from vibrokit.results.content import Content, ResultFileError, region_of, seed_of, taken, versions_of
from vibrokit.results.continuation import BIFURCATIONS, Bifurcation, Continuation, SteadyStates
from vibrokit.results.writing import write_content

KIND = "continuation"

_STATES = Table("states", {"value": Number(-np.finfo(float).max, np.finfo(float).max), "status": Word()})
_ATTRACTORS = Table(
    "attractor",
    {
        **ATTRACTOR_COLUMNS,
        "label": Whole(UNSETTLED),  # if the work was stopped before they were labelled
        "basin_fraction": Number(),  # NaN if the work was stopped before it
        "basin_fraction_error": Number(),
    },
)
_BIFURCATIONS = Table(
    "bifurcation",
    {
        "kind": Word(BIFURCATIONS),
        "value": Number(-np.finfo(float).max, np.finfo(float).max),
        "error": Number(0.0, np.finfo(float).max),
        "branch": Whole(),
        "period": Whole(1),
        "point": Rows(),
        "side": Word(("", "left", "right")),
    },
)
_OWNERS = "attractor_states"  # which value each attractor belongs to, in ascending order
_BRANCHES = "attractor_branch"


def save_continuation(continuation: Continuation, path: str | os.PathLike[str]) -> None:
    """Write a continuation to a netCDF file, whole or not at all; `vibrokit.load_result` opens it."""
    draft = Draft()
    states = continuation.states
    attractors = [attractor for at in states for attractor in at.attractors]
    _STATES.write(draft, states)
    write_attractors(draft, _ATTRACTORS, attractors)
    _BIFURCATIONS.write(draft, [_as_row(bifurcation) for bifurcation in continuation.bifurcations])
    owners = np.repeat(np.arange(len(states)), [len(at.attractors) for at in states])
    draft.put(_OWNERS, ("attractor",), owners)
    draft.put(_BRANCHES, ("attractor",), np.array([b for at in states for b in at.branches], dtype=np.int64))
    region = continuation.region
    if region is not None:
        draft.put("region", ("axis", "bound"), region.bounds)
    draft.header.update(
        kind=KIND,
        parameter=continuation.parameter,
        symbol=continuation.symbol,
        unit=continuation.unit,
        common=region is not None,
        complete=bool(continuation.complete),
        status=continuation.status,
        scene=dict(continuation.scene),
        seed=None if continuation.seed is None else str(continuation.seed),
        seconds=float(continuation.seconds),
        versions=dict(continuation.versions),
    )
    write_content(Path(path), draft.arrays, draft.header)


def read_continuation(content: Content) -> Continuation:
    """Make a continuation of the content of a file.

    Raises
    ------
    ResultFileError
        Something is missing, of another shape or kind, or contradicts the rest.
    """
    header = content.header
    return Continuation(
        parameter=taken(header, "parameter", str),
        symbol=taken(header, "symbol", str),
        unit=None if header.get("unit", "") is None else taken(header, "unit", str),
        region=region_of(content) if taken(header, "common", bool) else None,
        states=_states(content),
        bifurcations=tuple(_bifurcations(content)),
        complete=taken(header, "complete", bool),
        status=taken(header, "status", str),
        scene=taken(header, "scene", dict),
        seed=seed_of(header),
        seconds=taken(header, "seconds", float),
        versions=versions_of(header),
    )


def _as_row(bifurcation: Bifurcation) -> Bifurcation:
    """The same, with its point as an array of one row, as the columns have them."""
    return dataclasses.replace(bifurcation, point=bifurcation.point[None])


def _bifurcations(content: Content) -> Iterator[Bifurcation]:
    for values in _BIFURCATIONS.read(content):
        if len(values["point"]) != 1:
            raise ResultFileError(f"a bifurcation has {len(values['point'])} points; it has one")
        yield Bifurcation(**{**values, "point": values["point"][0]})


def _states(content: Content) -> tuple[SteadyStates, ...]:
    rows = list(_STATES.read(content))
    attractors = _attractors(content)
    owners = branches = np.empty(0, dtype=np.int64)
    if attractors:
        owners = content.wholes(_OWNERS, (len(attractors),), 0, len(rows) - 1)
        branches = content.wholes(_BRANCHES, (len(attractors),), 0, len(attractors) - 1)
    return tuple(
        SteadyStates(
            **row,
            attractors=tuple(attractors[own] for own in np.flatnonzero(owners == index)),
            branches=tuple(branches[owners == index].tolist()),
        )
        for index, row in enumerate(rows)
    )


def _attractors(content: Content) -> tuple[Attractor, ...]:
    attractors, others = read_attractors(content, _ATTRACTORS)
    if others:
        raise ResultFileError(f"{len(others)} of its survivals belong to no attractor")
    for attractor in attractors:
        if attractor.points.ndim != 2 or len(attractor.points) == 0:
            raise ResultFileError(f"a {attractor.kind} state has no points")
    return attractors
