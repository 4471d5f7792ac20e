"""ActivationEnergy: the least action of an exit, with bounds, path and evidence; and how files hold it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.construction import Constructed
from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import Arrays
from vibrokit.results.basins import ESCAPED
from vibrokit.results.fields import (
    STATE,
    ByName,
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
from vibrokit.results.labels import exit_between
from vibrokit.results.table import Table


class Bound(StrEnum):
    """What the bounds of an activation energy rest on."""

    EXACT = "exact"
    """Both: the potential energy of the barrier, where detailed balance holds; up to the error of a quadrature."""
    CERTIFIED = "certified"
    """Upper: a certified path. Lower: the graph search found no cheaper path within its error estimate."""
    UPPER = "upper"
    """Upper: a path. Lower: what no search has excluded or what is proven, 0 if there is neither."""
    ESTIMATE = "estimate"
    """Lower: an error estimate of a grid. Upper: another one, or the action of a path; infinite if none is known."""
    BRACKET = "bracket"
    """Upper: a path that begins or ends inside a set. Lower: an error estimate of a grid."""
    CONFIDENCE = "confidence"
    """A 95 % confidence interval."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ExitPath:
    """A path of least action, from an attractor to where it leaves the basin.

    Attributes
    ----------
    t : array (count,)
        Times (s).
    q : array (count, n)
        State.
    p : array (count, n)
        Momenta.
    action : array (count,)
        Action S (m² s⁻³).
    section : int array
        Which of the samples lie on the section.
    """

    t: NDArray[np.float64]
    q: NDArray[np.float64]
    p: NDArray[np.float64]
    action: NDArray[np.float64]
    section: NDArray[np.int64]

    def __repr__(self) -> str:
        return f"ExitPath: {len(self.t)} samples over {np.ptp(self.t):g} s, action {self.action[-1]:.6g} m² s⁻³"


@dataclasses.dataclass(frozen=True)
class Certificate:
    """Evidence for a polished exit path: how well it solves its equations, and how the action depends on the settings.

    For a path of several legs, each is the worst value of all legs; changes and lengths are summed.

    Attributes
    ----------
    residual : float
        Largest misfit of the pieces and of both ends, relative to the size of what is matched.
    start_distance : float
        Distance in (x, v) between the path's first point and the attractor, where the linear end is joined.
    end_distance : float
        Distance in (x, v) between its last point and the saddle, along the saddle's stable manifold; 0 for a path that
        ends at first contact with a stop.
    periods : float
        Length of the path between its two ends, in forcing periods (2π/ω_n without forcing).
    by_start : float
        Change of the action when the start is ten times as far from the attractor (m² s⁻³).
    by_length : float
        Change when two periods are added at each end.
    by_stepper : float
        Change when the integration is tightened.
    transversality : float
        Sine of the angle at which the two manifolds meet along the path, from 0 (tangent: a flat valley) to 1.
    """

    residual: float
    start_distance: float
    end_distance: float
    periods: float
    by_start: float
    by_length: float
    by_stepper: float
    transversality: float

    @classmethod
    def combined(cls, legs: Sequence[Certificate]) -> Certificate:
        """Return the evidence for a path of several legs: the worst values, and the sums of changes and lengths."""
        changes = {
            name: sum(abs(getattr(leg, name)) for leg in legs) for name in ("by_start", "by_length", "by_stepper")
        }
        return cls(
            residual=max(leg.residual for leg in legs),
            start_distance=max(leg.start_distance for leg in legs),
            end_distance=max(leg.end_distance for leg in legs),
            periods=sum(leg.periods for leg in legs),
            transversality=min(leg.transversality for leg in legs),
            **changes,
        )

    @property
    def error(self) -> float:
        """Estimated error of the action (m² s⁻³): the changes, added."""
        return abs(self.by_start) + abs(self.by_length) + abs(self.by_stepper)


@dataclasses.dataclass(frozen=True, eq=False)
class ActivationEnergy(metaclass=Constructed):
    """Activation energy ΔU of one exit; the mean exit time grows like exp(ΔU/D) as D → 0.

    Attributes
    ----------
    source, target : int
        Labels of the attractor that is left and of the one that is reached; −1 for another exit, −2 for escape.
    value : float
        ΔU, in units of action (m² s⁻³).
    lower, upper : float
        Bounds of ΔU itself: a cheaper path that was not excluded lies within them. Where nothing is known they are 0
        and infinite.
    method : str
    bound : Bound
        What the bounds rest on.
    numerical_error : float
        Error of `value` as the action of its own path or as the value on its own grid (m² s⁻³). It says nothing of
        cheaper paths.
    residual : float
        Largest misfit of the path's equations, relative to the size of what is matched; NaN for a path that was not
        polished.
    path : ExitPath or None
    saddle : int
        Which of the structure's saddles the path ends on; −1 if it ends on no saddle.
    certificate : Certificate or None
        Evidence, where the path was polished.
    sensitivity : dict of str to float
        Derivative of the path's action in each parameter of the scene, by the names of ``osc.parameters``, in m² s⁻³
        per unit of the parameter; empty for a path that was not polished.
    sensitivity_error : dict of str to float
        Error of each, from differences of two sizes.
    """

    source: int
    target: int
    value: float
    lower: float
    upper: float
    method: str
    bound: Bound
    numerical_error: float = float("nan")
    residual: float = float("nan")
    path: ExitPath | None = dataclasses.field(default=None, repr=False)
    saddle: int = -1
    certificate: Certificate | None = None
    sensitivity: Mapping[str, float] = dataclasses.field(default_factory=dict, repr=False)
    sensitivity_error: Mapping[str, float] = dataclasses.field(default_factory=dict, repr=False)

    def exit_between(self, names: Sequence[str]) -> str:
        """Return the names of the attractors between which the exit leads: ``"hammering → clear"``."""
        return exit_between(names, self.source, self.target)


def upper_bound(value: float, error: float) -> float:
    """Return the upper bound that a path of some action gives; infinite if its error exceeds the action.

    What changes by more than itself when its computation is tightened is no evidence of a path.
    """
    return value + error if error <= value else math.inf


def bounds_text(energy: ActivationEnergy) -> str:
    """Return the bounds of an energy as text: what is not known is not shown as a number."""
    if math.isinf(energy.upper):
        return f"{energy.lower:.6g} or more" if energy.lower > 0 else "not bounded"
    return f"{energy.lower:.6g} to {energy.upper:.6g}"


_ACTION = "m2 s-3"
_PER_UNIT = f"{_ACTION} per unit of the parameter"

_SAMPLES = Length("sample", "samples of the path")
_MOMENTA = Columns(
    (Column("p1", "momentum p1", "m s-3"), Column("p2", "momentum p2", "m s-2")), Column("p", "momentum p")
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
    "target": Whole("label of the attractor that is reached; -1 for another exit, -2 for escape", low=ESCAPED),
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
    "sensitivity": ByName("parameter", "derivative of the action in a parameter", _PER_UNIT),
    "sensitivity_error": ByName("parameter", "error of the derivative of the action in a parameter", _PER_UNIT),
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
    """Return the energies and the branches of some arrays; raises ResultFileError."""
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
