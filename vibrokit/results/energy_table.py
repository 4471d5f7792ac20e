"""Activation energies in a dataset, with their paths and certificates."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import Arrays
from vibrokit.results.basins import NOT_FOLLOWED
from vibrokit.results.certificate import Certificate
from vibrokit.results.energy import ActivationEnergy, Bound, ExitPath
from vibrokit.results.fields import (
    STATE,
    Column,
    Columns,
    Field,
    Flag,
    Length,
    Number,
    Series,
    Variable,
    Vectors,
    Whole,
    Word,
)
from vibrokit.results.table import Table

_ACTION = "m2 s-3"

_SAMPLES = Length("sample", "samples of the path")
_MOMENTA = Columns(
    (Column("p1", "momentum p1", "m s-3"), Column("p2", "momentum p2", "m s-2")), Column("p", "momentum p", "1")
)

PATHS = Table(
    "path",
    {
        "t": Series(_SAMPLES, "time", "s"),
        "q": Vectors(_SAMPLES, STATE, prefixed=False),
        "p": Vectors(_SAMPLES, _MOMENTA, prefixed=False),
        "action": Series(_SAMPLES, "action", _ACTION),
        "section": Series(Length("crossing", "samples on the section"), "sample on the section", whole=True, low=0),
    },
)
_EVIDENCE: dict[str, Field] = {
    "residual": Number("largest misfit of the path's equations, relative"),
    "start_distance": Number("distance in (x, v) between the first point and the attractor"),
    "end_distance": Number("distance in (x, v) between the last point and the saddle"),
    "periods": Number("length of the path in forcing periods"),
    "by_start": Number("change of the action when the path starts ten times as far from the attractor", _ACTION),
    "by_length": Number("change of the action when two periods are added at either end", _ACTION),
    "by_stepper": Number("change of the action when the integration is tightened", _ACTION),
    "transversality": Number("sine of the angle between the manifolds that meet along the path"),
}
_FIELDS: dict[str, Field] = {
    "source": Whole("label of the attractor that is left"),
    "target": Whole("label of the attractor that is reached; -1 for an exit that is no attractor", low=NOT_FOLLOWED),
    "value": Number("activation energy", _ACTION),
    "lower": Number("lower bound of the activation energy", _ACTION),
    "upper": Number("upper bound of the activation energy", _ACTION),
    "method": Word("method"),
    "bound": Word("what the bounds rest on", known=tuple(Bound)),
    "numerical_error": Number("error of the value as the action of its own path or on its own grid", _ACTION),
    "residual": Number("largest misfit of the path's equations, relative"),
    "saddle": Whole("place of the saddle that the path ends on; -1 for none", low=-1),
    "path": Whole("place of the path; -1 for none", low=-1),
    "certified": Flag("whether there is a certificate"),
    **{f"certificate_{name}": field for name, field in _EVIDENCE.items()},
}
ENERGIES, BRANCHES = Table("energy", _FIELDS), Table("branch", _FIELDS)


def energy_variables(energies: Sequence[ActivationEnergy], branches: Sequence[ActivationEnergy]) -> dict[str, Variable]:
    """Return the arrays that hold energies, branches and their paths, each path once."""
    paths = {id(one.path): one.path for one in (*energies, *branches) if one.path is not None}
    place = {key: index for index, key in enumerate(paths)} | {id(None): -1}
    found = PATHS.variables(list(paths.values()))
    for table, some in ((ENERGIES, energies), (BRANCHES, branches)):
        evidence = {
            f"certificate_{name}": [np.nan if e.certificate is None else getattr(e.certificate, name) for e in some]
            for name in _EVIDENCE
        }
        certified = [e.certificate is not None for e in some]
        found |= table.variables(some, path=[place[id(e.path)] for e in some], certified=certified, **evidence)
    return found


def read_energies(arrays: Arrays, attractors: int) -> tuple[tuple[ActivationEnergy, ...], tuple[ActivationEnergy, ...]]:
    """Return the energies and the branches of some arrays.

    Raises
    ------
    ResultFileError
        Something is missing, of another shape or kind, or contradicts the rest.
    """
    paths = [ExitPath(**values) for values in PATHS.read(arrays)]
    for path in paths:
        if len(path.t) == 0 or (len(path.section) and path.section.max() >= len(path.t)):
            raise ResultFileError(f"one of its paths has {len(path.t)} samples, fewer than its points on the section")
    energies, branches = (
        tuple(_energy(values, paths, attractors) for values in table.read(arrays)) for table in (ENERGIES, BRANCHES)
    )
    return energies, branches


def _energy(values: dict[str, Any], paths: Sequence[ExitPath], attractors: int) -> ActivationEnergy:
    evidence = {name: values.pop(f"certificate_{name}") for name in _EVIDENCE}
    certificate = Certificate(**evidence) if values.pop("certified") else None
    path = values.pop("path")
    if path >= len(paths):
        raise ResultFileError(f"an energy has path {path}, and there are {len(paths)} paths")
    energy = ActivationEnergy(**values, certificate=certificate, path=paths[path] if path >= 0 else None)
    if max(energy.source, energy.target) >= attractors:
        raise ResultFileError(
            f"an energy leads from attractor {energy.source} to {energy.target}, and there are {attractors}"
        )
    return dataclasses.replace(energy, bound=Bound(energy.bound))
