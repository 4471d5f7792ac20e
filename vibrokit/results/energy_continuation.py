"""EnergyContinuation: activation energies along values of a parameter, path by path."""

from __future__ import annotations

import dataclasses
import itertools
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.documented import documented
from vibrokit.errors import ResultFileError, StructureError, counted, shown
from vibrokit.results.along_parameter import AlongParameter
from vibrokit.results.arrays import Arrays
from vibrokit.results.fields import LARGEST
from vibrokit.results.record import Summary
from vibrokit.results.table import Table, fields_of

if TYPE_CHECKING:
    from vibrokit.plots.bifurcation import EnergyCurveArtists

Array = NDArray[np.float64]


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class EnergyBranch:
    """An exit path followed along a parameter; NaN in its arrays, of a number for each value, where it is not known."""

    source: Annotated[str, "name of the attractor that is left"]
    target: Annotated[str, 'name of the attractor that is reached; "exit" or "escape" if it is none']
    action: Annotated[Array, "action of the path (m² s⁻³)"]
    error: Annotated[Array, "numerical error of the action, by the certificate of the path"]
    derivative: Annotated[Array, "derivative of the action in the parameter"]


@documented
@dataclasses.dataclass(frozen=True)
class LeastPathChange:
    """A value of the parameter at which another path becomes the cheapest."""

    value: Annotated[float, "of the parameter"]
    before: Annotated[int, "number of the branch that has the least action below it"]
    after: Annotated[int, "number of the branch that has the least action above it"]


_BRANCHES = Table("branch", fields_of(EnergyBranch))
_ARRAYS = {"action": "action of the path", "error": "numerical error", "derivative": "derivative in the parameter"}


class EnergyContinuation(AlongParameter):
    """Activation energies along values of a parameter."""

    kind: ClassVar[str] = "energy-continuation"

    values: Annotated[Array, "values of the parameter, ascending"]
    branches: Annotated[tuple[EnergyBranch, ...], "the exit paths"]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the branches; those of one exit are numbered."""
        exits = [f"{branch.source} → {branch.target}" for branch in self.branches]
        return tuple(
            name if exits.count(name) == 1 else f"{name} ({exits[: number + 1].count(name)})"
            for number, name in enumerate(exits)
        )

    @called
    def energy(self, source: str, target: str | None = None) -> Array:
        """Return the least action at each value (m² s⁻³), NaN where no path is known.

        Parameters
        ----------
        source : str
            Name of an attractor.
        target : str, optional
            By default any.

        Raises
        ------
        StructureError
            No path of this exit was found at any value.
        """
        return self._least(source, target)[0]

    @called
    def sensitivity(self, source: str, target: str | None = None) -> Array:
        """Return by how many per cent 1 % of the parameter changes the least action at each value, to first order.

        Parameters that are tied change together. Arguments and errors as of `energy`.
        """
        action, derivative = self._least(source, target)
        with np.errstate(divide="ignore", invalid="ignore"):  # at rest, an action is 0
            return self.values * derivative / action

    def _least(self, source: str, target: str | None) -> tuple[Array, Array]:
        """The least action of an exit at each value, and its derivative."""
        own = [self.branches[number] for number in self._of(source, target)]
        actions, slopes = (np.array([getattr(branch, name) for branch in own]) for name in ("action", "derivative"))
        best = np.where(np.isnan(actions), np.inf, actions).argmin(axis=0)[None]
        return np.take_along_axis(actions, best, axis=0)[0], np.take_along_axis(slopes, best, axis=0)[0]

    @called
    def changes(self, source: str, target: str | None = None) -> tuple[LeastPathChange, ...]:
        """Return where another path becomes the cheapest one of an exit; arguments and errors as of `energy`.

        Between two values, each action is the cubic through its values and derivatives there.
        """
        own, found = self._of(source, target), []
        actions = np.array([self.branches[number].action for number in own])
        best = [int(np.nanargmin(column)) if np.isfinite(column).any() else -1 for column in actions.T]
        for place, (before, after) in enumerate(itertools.pairwise(best)):
            pair = [before, after]
            if before != after and min(pair) >= 0 and np.isfinite(actions[pair, place : place + 2]).all():
                where = self._crossing(place, own[before], own[after])
                found.append(LeastPathChange(where, own[before], own[after]))
        return tuple(found)

    def _of(self, source: str, target: str | None) -> list[int]:
        own = [n for n, b in enumerate(self.branches) if b.source == source and target in (None, b.target)]
        if not own:
            goal = "" if target is None else f" → {target}"
            raise StructureError(
                f"there is no path {shown(source)}{goal}; there are {', '.join(self.names) or 'none'}."
            )
        return own

    def _crossing(self, place: int, one: int, other: int) -> float:
        """Where the actions of two branches are equal, between one value and the next."""
        from scipy.interpolate import CubicHermiteSpline

        both = slice(place, place + 2)
        action, slope = (
            getattr(self.branches[one], name)[both] - getattr(self.branches[other], name)[both]
            for name in ("action", "derivative")
        )
        roots = CubicHermiteSpline(self.values[both], action, slope).roots(extrapolate=False)
        return float(roots[0]) if len(roots) else float(self.values[both].mean())

    @property
    def summary(self) -> Summary:
        """The branches."""
        values = f"{counted(len(self.values), 'value')} of {self.parameter}"
        values, scale = f"{values} in {self.shown_in}" if self.shown_in else values, self.axis()[1]
        rows = []
        for name, branch in zip(self.names, self.branches, strict=True):
            known = np.isfinite(branch.action)
            at = self.values[known] / scale
            reach = f"{at.min():g} to {at.max():g}" if known.any() else "nowhere"
            span = f"{branch.action[known].min():.6g} to {branch.action[known].max():.6g} m² s⁻³" if known.any() else ""
            rows.append((name, reach, span))
        count = counted(len(self.branches), "path")
        return Summary(f"Energy continuation: {count} at {values}", tuple(rows))

    @called
    def plot(self, ax: Any = None) -> EnergyCurveArtists:
        """Draw the actions along the parameter; see `vibrokit.plots.bifurcation.energy_curves`."""
        from vibrokit.plots.bifurcation import energy_curves

        sources, (label, scale) = list(dict.fromkeys(branch.source for branch in self.branches)), self.axis()
        return energy_curves(
            self.values / scale, [branch.action for branch in self.branches], self.names,
            groups=[sources.index(branch.source) for branch in self.branches], label=label, ax=ax,
        )  # fmt: skip

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays with dimensions, coordinates, units and long names."""
        found = _BRANCHES.variables(self.branches)
        shape = (len(self.branches), len(self.values))
        per = f"m2 s-3 per {self.unit or '1'}"
        for name, long_name in _ARRAYS.items():
            rows = np.array([getattr(branch, name) for branch in self.branches], dtype=float).reshape(shape)
            units = per if name == "derivative" else "m2 s-3"
            found[name] = (("branch", "value"), rows, {"long_name": long_name, "units": units})
        about = {"long_name": "value of the parameter", "units": self.unit or "1"}
        found["value"] = (("value",), np.asarray(self.values, dtype=float), about)
        return xarray.Dataset(found | self.parameter_variables())

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a continuation of its arrays; raises ResultFileError."""
        arrays = Arrays(dataset)
        values = arrays.numbers("value", (arrays.size("value"),), -LARGEST, LARGEST)
        if (np.diff(values) <= 0).any():
            raise ResultFileError("its values of the parameter do not ascend")
        exits = _BRANCHES.read(arrays)
        rows = {name: arrays.numbers(name, (len(exits), len(values)), finite=False) for name in _ARRAYS}
        return cls(
            **cls.read_parameter(arrays),
            values=values,
            branches=tuple(
                EnergyBranch(**names, action=action, error=error, derivative=derivative)
                for names, action, error, derivative in zip(exits, *rows.values(), strict=True)
            ),
            **provenance,
        )
