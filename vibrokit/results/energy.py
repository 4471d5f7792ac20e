"""ActivationEnergy: the least action of an exit, with bounds, path and evidence; and how files hold it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.construction import Constructed
from vibrokit.documented import documented
from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import Arrays
from vibrokit.results.basins import ESCAPED
from vibrokit.results.fields import STATE, ByName, Column, Columns, Length, Series, Variable, Vectors, Whole
from vibrokit.results.labels import exit_between
from vibrokit.results.table import Part, Table, fields_of

Array = NDArray[np.float64]
Slopes = Mapping[str, float]


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


_ACTION = "m2 s-3"
_PER_UNIT = f"{_ACTION} per unit of the parameter"
_SAMPLES = Length("sample", "samples of the path")
_MOMENTA = Columns(
    (Column("p1", "momentum p1", "m s-3"), Column("p2", "momentum p2", "m s-2")), Column("p", "momentum p")
)
_SECTION = Series("samples on the section", length=Length("crossing", "samples on the section"), low=0)


@documented
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ExitPath:
    """A path of least action, from an attractor to where it leaves the basin."""

    t: Annotated[Array, Series("time", "s", length=_SAMPLES)]
    q: Annotated[Array, Vectors("state", length=_SAMPLES, columns=STATE, prefixed=False)]
    p: Annotated[Array, Vectors("momenta", length=_SAMPLES, columns=_MOMENTA, prefixed=False)]
    action: Annotated[Array, Series("action S", _ACTION, length=_SAMPLES)]
    section: Annotated[NDArray[np.int64], _SECTION]

    def __repr__(self) -> str:
        return f"ExitPath: {len(self.t)} samples over {np.ptp(self.t):g} s, action {self.action[-1]:.6g} m² s⁻³"


@documented
@dataclasses.dataclass(frozen=True)
class Certificate:
    """Evidence for a polished exit path: how well it solves its equations, and how the action depends on the settings.

    For a path of several legs, each is the worst value of all legs; changes and lengths are summed.
    """

    residual: Annotated[float, "largest misfit of the pieces and of both ends, relative to what is matched"]
    start_distance: Annotated[float, "distance in (x, v) from the attractor to the first point, at the linear end"]
    end_distance: Annotated[float, "distance in (x, v) to the saddle on its stable manifold; 0 at first contact"]
    periods: Annotated[float, "length of the path between its two ends, in forcing periods; 2π/ω_n without forcing"]
    by_start: Annotated[float, "change of the action when the path starts ten times as far from the attractor", _ACTION]
    by_length: Annotated[float, "change of the action when two periods are added at either end", _ACTION]
    by_stepper: Annotated[float, "change of the action when the integration is tightened", _ACTION]
    transversality: Annotated[float, "sine of the angle at which the manifolds meet along the path; 0 in a flat valley"]

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


_TARGET = Whole("label of the attractor that is reached; -1 for another exit, -2 for escape", low=ESCAPED)
_SLOPES = ByName("derivatives of a polished path's action in the parameters", _PER_UNIT, "parameter")
_SLOPE_ERRORS = ByName("errors of the derivatives, from differences of two sizes", _PER_UNIT, "parameter")
_EVIDENCE = Part("evidence, where the path was polished", kind=Certificate, flag="certified")


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class ActivationEnergy(metaclass=Constructed):
    """Activation energy ΔU of one exit; the mean exit time grows like exp(ΔU/D) as D → 0.

    The bounds are those of ΔU itself: a cheaper path that was not excluded lies within them. The numerical error says
    nothing of cheaper paths.
    """

    source: Annotated[int, "label of the attractor that is left"]
    target: Annotated[int, _TARGET]
    value: Annotated[float, "activation energy ΔU", _ACTION]
    lower: Annotated[float, "lower bound of the activation energy; 0 where nothing is known", _ACTION]
    upper: Annotated[float, "upper bound of the activation energy; infinite where nothing is known", _ACTION]
    method: Annotated[str, "method"]
    bound: Annotated[Bound, "what the bounds rest on"]
    numerical_error: Annotated[float, "error of the value as the action of its path or on its grid", _ACTION] = math.nan
    residual: Annotated[float, "largest misfit of the path's equations, relative; NaN if not polished"] = math.nan
    path: Annotated[ExitPath | None, "its path"] = dataclasses.field(default=None, repr=False)
    saddle: Annotated[int, Whole("place of the saddle that the path ends on; -1 for none", low=-1)] = -1
    certificate: Annotated[Certificate | None, _EVIDENCE] = None
    proposed_by: Annotated[str, "source that proposed the polished path; empty without one"] = ""
    sensitivity: Annotated[Slopes, _SLOPES] = dataclasses.field(default_factory=dict, repr=False)
    sensitivity_error: Annotated[Slopes, _SLOPE_ERRORS] = dataclasses.field(default_factory=dict, repr=False)

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


_PATHS = Table("path", fields_of(ExitPath))
_FIELDS = fields_of(ActivationEnergy) | {"path": Whole("place of the path; -1 for none", low=-1)}
_ENERGIES, _BRANCHES = Table("energy", _FIELDS), Table("branch", _FIELDS)


def energy_variables(energies: Sequence[ActivationEnergy], branches: Sequence[ActivationEnergy]) -> dict[str, Variable]:
    """Return the arrays that hold energies, branches and their paths, each path once."""
    paths = {id(one.path): one.path for one in (*energies, *branches) if one.path is not None}
    place = {key: index for index, key in enumerate(paths)} | {id(None): -1}
    found = _PATHS.variables(list(paths.values()))
    for table, some in ((_ENERGIES, energies), (_BRANCHES, branches)):
        found |= table.variables(some, path=[place[id(e.path)] for e in some])
    return found


def read_energies(arrays: Arrays, attractors: int) -> tuple[tuple[ActivationEnergy, ...], tuple[ActivationEnergy, ...]]:
    """Return the energies and the branches of some arrays; raises ResultFileError."""
    paths = [ExitPath(**values) for values in _PATHS.read(arrays)]
    for path in paths:
        if len(path.t) == 0 or (len(path.section) and path.section.max() >= len(path.t)):
            raise ResultFileError(f"one of its paths has {len(path.t)} samples, fewer than its points on the section")
    energies, branches = (
        tuple(_energy(values, paths, attractors) for values in table.read(arrays)) for table in (_ENERGIES, _BRANCHES)
    )
    return energies, branches


def _energy(values: dict[str, Any], paths: Sequence[ExitPath], attractors: int) -> ActivationEnergy:
    path = values.pop("path")
    if path >= len(paths):
        raise ResultFileError(f"an energy has path {path}, and there are {len(paths)} paths")
    energy = ActivationEnergy(**values, path=paths[path] if path >= 0 else None)
    if max(energy.source, energy.target) >= attractors:
        raise ResultFileError(
            f"an energy leads from attractor {energy.source} to {energy.target}, and there are {attractors}"
        )
    return energy
