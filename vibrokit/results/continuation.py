"""Continuation: what becomes of the steady states as one parameter changes."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.documented import documented
from vibrokit.errors import ResultFileError, counted
from vibrokit.results.along_parameter import AlongParameter
from vibrokit.results.arrays import Arrays
from vibrokit.results.attractor import Attractor, attractor_variables, read_attractors
from vibrokit.results.basins import UNSETTLED, read_region, region_variables
from vibrokit.results.fields import LARGEST, STATE, Field, Length, Number, Variable, Vectors, Whole, Word
from vibrokit.results.finding import Finding
from vibrokit.results.labels import label_of
from vibrokit.results.provenance import findings_data, findings_from, json_data, json_text
from vibrokit.results.record import Summary
from vibrokit.results.region import Region
from vibrokit.results.table import Table, fields_of

if TYPE_CHECKING:
    from vibrokit.plots.bifurcation import BifurcationArtists, FractionArtists


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class SteadyStates:
    """The steady states at one value of the parameter.

    Orbits are thinned to some 1000 samples; basin fractions are NaN if the work was stopped before them.
    """

    value: Annotated[float, "of the parameter"]
    attractors: Annotated[tuple[Attractor, ...], "labelled by their places"]
    branches: Annotated[tuple[int, ...], "the branch that each attractor belongs to"]
    findings: Annotated[tuple[Finding, ...], "what was found and what was not, or why nothing was found"] = ()


GRAZING = "grazing"
_KIND = Word(
    '"fold", where the branch turns back; "pitchfork or transcritical", where another branch crosses it; "period '
    'doubling", "Neimark–Sacker", "Hopf"; "grazing", where one more turn of the orbit touches a stop, leaves it or '
    "lets go of it, or an equilibrium does",
    known=("fold", "pitchfork or transcritical", "period doubling", "Neimark–Sacker", "Hopf", "grazing"),
)
_ERROR = Number(
    "change of the value when the integration is tightened; half the interval if it is only known to lie between two "
    "values; the distance of the nearest orbit if it can be approached from one side only",
    "", 0.0, LARGEST,
)  # fmt: skip
_POINT = Vectors("a point of the orbit there, on the section", length=Length("point", "points"), columns=STATE)
_SIDE = Word("side of the stop that is grazed; empty for other kinds", known=("", "left", "right"))


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class Bifurcation:
    """A value of the parameter at which a branch of steady states changes in kind."""

    kind: Annotated[str, _KIND]
    value: Annotated[float, Number("value of the parameter", "", -LARGEST, LARGEST)]
    error: Annotated[float, _ERROR]
    branch: Annotated[int, "number of the branch"]
    period: Annotated[int, Whole("period in forcing periods, 1 for motion without them; before it doubles", low=1)]
    point: Annotated[NDArray[np.float64], _POINT]
    side: Annotated[str, _SIDE] = ""

    def __str__(self) -> str:
        side = f" at the {self.side} stop" if self.side else ""
        return f"{self.kind}{side} of branch {self.branch} at {self.value:.8g} ± {self.error:.1g}"


@dataclasses.dataclass(frozen=True)
class _Findings(Field):
    """Findings as JSON."""

    def variables(self, record: str, name: str, values: Sequence[Any]) -> Iterator[tuple[str, Variable]]:
        texts = [json_text(findings_data(findings)) for findings in values]
        yield name, ((record,), np.array(texts, dtype=str), {"long_name": self.long_name})

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        return [findings_from(json_data(text)) for text in arrays.words(name, (arrays.size(record),))]


_STATES = Table(
    "value",
    {
        "value": Number("value of the parameter", "", -LARGEST, LARGEST),
        "findings": _Findings("findings at the value, as JSON"),
    },
    index="value",
)
_ATTRACTORS = Table(
    "attractor",
    {
        **fields_of(Attractor),
        "label": Whole("label of the attractor at its value; negative if none was given", low=UNSETTLED),
        "basin_fraction": Number("share of the region's cells that lead to the attractor; NaN if it is not known"),
        "basin_fraction_error": Number("standard error of the share"),
    },
)
_OWNERS = Table(
    "attractor", {"at": Whole("place of the value at which it exists"), "branch": Whole("number of its branch")}
)
_BRANCHES = Table("branch", {"name": Word("name of the branch")})
_MARKS = Table("bifurcation", fields_of(Bifurcation))


class Continuation(AlongParameter):
    """Steady states along values of a parameter, joined into branches, with the bifurcations between."""

    kind: ClassVar[str] = "continuation"

    region: Annotated[Region | None, "what basin fractions are shares of at all values; None if nothing was found"]
    states: Annotated[tuple[SteadyStates, ...], "one for each value, in ascending order"]
    branch_names: Annotated[
        tuple[str, ...], "name of each branch: that of its first attractor, or of all that differ in contact"
    ]
    bifurcations: Annotated[tuple[Bifurcation, ...], "in ascending order of the value"] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the branches, in the order of their numbers; attractors have other labels at each value."""
        return self.branch_names

    @property
    def values(self) -> NDArray[np.float64]:
        """Values of the parameter, ascending."""
        return np.array([at.value for at in self.states])

    @property
    def branches(self) -> tuple[int, ...]:
        """Numbers of the branches."""
        return tuple(range(len(self.branch_names)))

    def branch(self, which: int | str) -> tuple[tuple[float, Attractor], ...]:
        """Return the values at which a branch has an attractor, each with it.

        Parameters
        ----------
        which : int or str
            Number or name of the branch; the beginning of a name is enough if it is unique.

        Raises
        ------
        StructureError
            There is no such branch.
        """
        number = label_of(which, self.branch_names, "branch")
        return tuple(
            (at.value, attractor)
            for at in self.states
            for attractor, branch in zip(at.attractors, at.branches, strict=True)
            if branch == number
        )

    def fractions(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return basin fractions and their standard errors, each of shape (values, branches).

        0 where a branch has no attractor, NaN where nothing is known: the scene was refused, or the work stopped.
        """
        shares = np.zeros((len(self.states), len(self.branches)))
        errors = np.zeros_like(shares)
        column = {branch: index for index, branch in enumerate(self.branches)}
        for row, at in enumerate(self.states):
            if not at.attractors:
                shares[row] = errors[row] = np.nan
            for attractor, branch in zip(at.attractors, at.branches, strict=True):
                shares[row, column[branch]] = attractor.basin_fraction
                errors[row, column[branch]] = attractor.basin_fraction_error
        return shares, errors

    @property
    def summary(self) -> Summary:
        """The bifurcations."""
        values = f"{counted(len(self.states), 'value')} of {self.parameter}"
        values, scale = f"{values} in {self.shown_in}" if self.shown_in else values, self.axis()[1]
        return Summary(
            f"Continuation: {counted(len(self.branches), 'branch', 'branches')} at {values}",
            tuple(
                (
                    f"{b.kind} {b.side}".strip(),
                    self.branch_names[b.branch],
                    f"{b.value / scale:.8g} ± {b.error / scale:.1g}",
                )
                for b in self.bifurcations
            ),
        )

    @called
    def plot(self, ax: Any = None) -> BifurcationArtists:
        """Draw the bifurcation diagram; see `vibrokit.plots.bifurcation.bifurcation_diagram`."""
        from vibrokit.plots.bifurcation import bifurcation_diagram

        rows = [
            (at.value, x, branch)
            for at in self.states
            for attractor, branch in zip(at.attractors, at.branches, strict=True)
            for x in attractor.points[:, 0]
        ]
        values, x, branches = (np.array(column) for column in (zip(*rows, strict=True) if rows else ([], [], [])))
        label, scale = self.axis()
        marks = [(found.kind, found.value / scale, float(found.point[0])) for found in self.bifurcations]
        return bifurcation_diagram(values / scale, x, branches, marks, names=self.branch_names, label=label, ax=ax)

    @called
    def plot_fractions(self, ax: Any = None) -> FractionArtists:
        """Draw the basin fractions along the parameter; see `vibrokit.plots.bifurcation.basin_fractions`."""
        from vibrokit.plots.bifurcation import basin_fractions

        shares, (label, scale) = self.fractions()[0], self.axis()
        return basin_fractions(self.values / scale, shares.T, self.branch_names, label=label, ax=ax)

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays with dimensions, coordinates, units and long names."""
        attractors = [attractor for at in self.states for attractor in at.attractors]
        places = [place for place, at in enumerate(self.states) for _ in at.attractors]
        branches = [branch for at in self.states for branch in at.branches]
        found: dict[str, Variable] = {
            **_STATES.variables(self.states),
            **attractor_variables(_ATTRACTORS, attractors),
            **_OWNERS.variables(attractors, at=places, branch=branches),
            **_BRANCHES.variables(self.branch_names, name=self.branch_names),
            **_MARKS.variables(self.bifurcations, point=[mark.point[None] for mark in self.bifurcations]),
        }
        for name in ("value", "bifurcation_value", "bifurcation_error"):
            found[name][2]["units"] = self.unit or "1"
        return xarray.Dataset(
            found | self.parameter_variables() | ({} if self.region is None else region_variables(self.region))
        )

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a continuation of its arrays; raises ResultFileError."""
        arrays = Arrays(dataset)
        names = tuple(row["name"] for row in _BRANCHES.read(arrays))
        return cls(
            **cls.read_parameter(arrays),
            region=read_region(arrays) if "region_x" in arrays else None,
            branch_names=names,
            states=_states(arrays, len(names)),
            bifurcations=tuple(_bifurcations(arrays, len(names))),
            **provenance,
        )


def _bifurcations(arrays: Arrays, branches: int) -> Iterator[Bifurcation]:
    for values in _MARKS.read(arrays):
        if values["branch"] >= branches:
            raise ResultFileError(f"a bifurcation is on branch {values['branch']}, and there are {branches}")
        if len(values["point"]) != 1:
            raise ResultFileError(f"a bifurcation has {len(values['point'])} points, and one is needed")
        yield Bifurcation(**{**values, "point": values["point"][0]})


def _states(arrays: Arrays, branches: int) -> tuple[SteadyStates, ...]:
    rows = _STATES.read(arrays)
    attractors, others = read_attractors(arrays, _ATTRACTORS)
    if others:
        raise ResultFileError(f"{len(others)} of its survivals belong to no attractor")
    owners = _OWNERS.read(arrays)
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
