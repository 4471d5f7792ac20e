"""Sweep: steady states, activation energies and mean exit times along values of one parameter."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.errors import ResultFileError, StructureError
from vibrokit.results.along_parameter import AlongParameter
from vibrokit.results.arrays import Arrays
from vibrokit.results.codes import Code
from vibrokit.results.continuation import Continuation
from vibrokit.results.energy_continuation import EnergyContinuation
from vibrokit.results.existence import Existence, coexistence, touches_text
from vibrokit.results.fields import LARGEST, Number, Word
from vibrokit.results.files import nested, records_in
from vibrokit.results.labels import label_of
from vibrokit.results.record import Summary
from vibrokit.results.table import Table

if TYPE_CHECKING:
    from vibrokit.plots.sweeps import SweepArtists

Array = NDArray[np.float64]

_STATES, _ENERGIES = "states", "energies"
_TIMES = Table(
    "prefactor",
    {
        "source": Word("attractor that is left"),
        "value": Number("value of the parameter", "", -LARGEST, LARGEST),
        "logarithm": Number("ln of the prefactor of the mean time (s)", "", -LARGEST, LARGEST),
        "error": Number("its error", "", 0.0, LARGEST),
    },
)


@dataclasses.dataclass(frozen=True)
class Prefactor:
    """ln τ₀ of the mean time τ₀ exp(ΔU/D) until a state is left, at one value of the parameter; τ₀ in s."""

    source: str
    value: float
    logarithm: float
    error: float


class Sweep(AlongParameter):
    """What a parameter does to a scene: which states exist from where to where, and how long they last.

    Attributes
    ----------
    states : Continuation
    energies : EnergyContinuation or None
        None without noise, or where no exit path was found.
    prefactors : tuple of Prefactor
        At the values at which exits were simulated.
    """

    kind: ClassVar[str] = "sweep"

    states: Continuation
    energies: EnergyContinuation | None = None
    prefactors: tuple[Prefactor, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the branches of steady states."""
        return self.states.branch_names

    @property
    def values(self) -> Array:
        """Values of the parameter, ascending."""
        return self.states.values

    @property
    def intensity(self) -> Array:
        """Noise intensity D of the scene at each value (m² s⁻³); 0 without noise."""
        return self._along("noise.intensity", (self.scene.get("noise") or {}).get("intensity", 0.0))

    @property
    def stops(self) -> tuple[Array, ...]:
        """Position of each stop at each value (m)."""
        return tuple(
            self._along(f"barriers.{index}.position", stop["position"])
            for index, stop in enumerate(self.scene.get("barriers", ()))
        )

    def _along(self, path: str, own: float) -> Array:
        """A parameter of the scene at each value, given what it is in the scene."""
        factor = self.factors.get(path)
        return np.full(len(self.values), float(own)) if factor is None else factor * self.values

    @property
    def searched(self) -> Array:
        """The values at which exit paths were searched for; at the others ΔU is an upper bound."""
        return np.array([] if self.energies is None else self.energies.settings.get("search", ()), dtype=float)

    @property
    def gaps(self) -> tuple[tuple[float, str], ...]:
        """The values at which the scene is refused or has no steady state, each with the reason."""
        return tuple(
            (at.value, str(finding.values["reason"]))
            for at in self.states.states
            for finding in at.findings
            if finding.code is Code.NOTHING_AT
        )

    @property
    def coexistence(self) -> tuple[Existence, ...]:
        """From where to where each branch exists, in the order of the branches.

        A branch has more than one entry if it has gaps, or if it begins or ceases to touch a stop.
        """
        return tuple(coexistence(self.states, {value for value, _ in self.gaps}))

    @property
    def contact_changes(self) -> tuple[Existence, ...]:
        """Those of the entries at whose first value a branch begins or ceases to touch a stop."""
        return tuple(
            after
            for one, after in itertools.pairwise(self.coexistence)
            if (one.name, one.last) == (after.name, after.first) and one.touches != after.touches
        )

    def along(self, name: str) -> tuple[Array, Array, Array]:
        """Return the least and the largest x (m) and the largest push of a stop (m s⁻²) of a branch at each value.

        NaN where the branch has no steady state; the push also without stops.

        Raises
        ------
        StructureError
            There is no such branch.
        """
        found = np.full((3, len(self.values)), np.nan)
        for value, attractor in self.states.branch(name):
            place = int(np.flatnonzero(self.values == value)[0])
            push = max(attractor.peak_force.values(), default=np.nan)
            found[:, place] = (*attractor.extent[0], push)
        return found[0], found[1], found[2]

    @called
    def energy(self, source: str) -> Array:
        """Return the least action with which a state is left at each value (m² s⁻³), NaN where it is not known.

        `source` is the name of a branch; the beginning of a name is enough if it is unique.

        Raises
        ------
        StructureError
            There is no such branch, or no exit path of this state was found.
        """
        return self._exits.energy(self._named(source))

    @called
    def sensitivity(self, source: str) -> Array:
        """Return by how many per cent 1 % of the parameter changes ΔU at each value; errors as of `energy`.

        Parameters that are tied change together.
        """
        return self._exits.sensitivity(self._named(source))

    def _named(self, source: str) -> str:
        return self.names[label_of(source, self.names, "branch")]

    @property
    def _exits(self) -> EnergyContinuation:
        if self.energies is None:
            raise StructureError("the sweep has no exit paths; see its status.")
        return self.energies

    @called
    def log_mean_time(self, source: str, intensity: float | None = None) -> tuple[Array, Array]:
        """Return ln of the mean time (s) until a state is left, at each value, and its error; NaN where not known.

        The prefactor is interpolated between the values at which exits were simulated. The error contains the
        difference between the neighbouring prefactors.

        Raises
        ------
        StructureError
            There is no such branch, no exit path of this state was found, or no prefactor is known.
        """
        source = self._named(source)
        own = [one for one in self.prefactors if one.source == source]
        if not own:
            raise StructureError(f"the sweep has no prefactor of the mean time of {source}; see its status.")
        own = sorted(own, key=lambda one: one.value)
        places, logs, errors = (
            np.array([getattr(one, name) for one in own]) for name in ("value", "logarithm", "error")
        )
        strength = self.intensity if intensity is None else np.full(len(self.values), float(intensity))
        prefactor = np.interp(self.values, places, logs)
        nearest = np.abs(self.values[:, None] - places).argmin(axis=1)
        error = np.hypot(np.interp(self.values, places, errors), np.abs(prefactor - logs[nearest]))
        with np.errstate(divide="ignore"):  # without noise it never happens
            return prefactor + self.energy(source) / strength, error

    @property
    def summary(self) -> Summary:
        """From where to where each branch exists."""
        scale = self.axis()[1]
        rows = tuple(
            (
                one.name,
                f"{one.first / scale:.8g} ({one.begins}) to {one.last / scale:.8g} ({one.ends})",
                *([touches_text(one)] if self.stops else []),
            )
            for one in self.coexistence
        )
        return Summary(f"Sweep of {self.parameters_text}{f' in {self.shown_in}' if self.shown_in else ''}", rows)

    @called
    def plot(self, ax: Any = None, unit: str | None = None) -> SweepArtists:
        """Draw displacements, pushes, energies and mean times along the parameter; see `vibrokit.plots.sweeps.sweep`.

        `ax` are axes, one for each panel; `unit` is that of the parameter, by default that of the values as given.
        """
        from vibrokit.plots.sweeps import Branch, sweep

        shown_in, (label, scale) = unit or self.shown_in, self.axis(unit)
        branches = []
        for number, name in enumerate(self.names):
            energy = time = np.full(len(self.values), np.nan)
            with contextlib.suppress(StructureError):  # what is not known of a branch is not drawn
                energy = self.energy(name)
                time = self.log_mean_time(name)[0]
            branches.append(Branch(number, name, *self.along(name), energy=energy, log_time=time))
        marks = [(one.kind, one.value / scale, one.branch) for one in self.states.bifurcations]
        changes = [
            (one.first / scale, self.names.index(one.name),
             f"{one.name} from {one.first / scale:.5g}: {touches_text(one)}")
            for one in self.contact_changes
        ]  # fmt: skip
        lost = [(value / scale, energy, self.names.index(name)) for name, value, energy in self.lost]
        return sweep(
            self.values / scale, branches, stops=self.stops, marks=marks, changes=changes, lost=lost,
            intensity=self.intensity, searched=self.searched / scale, label=label, ax=ax,
            length=(shown_in, scale) if shown_in and self.unit == "m" else self.length_unit,
        )  # fmt: skip

    @property
    def lost(self) -> tuple[tuple[str, float, float], ...]:
        """Where exit paths were lost: the state that is left, the last value of the parameter, and the action there."""
        if self.energies is None:
            return ()
        values, found = self.energies.values, []
        for finding in self.energies.found(Code.PATH_LOST):
            branch = self.energies.branches[finding.source or 0]
            end = np.asarray(finding.values["value"], dtype=float)  # which may lie between two values
            place = int(np.where(np.isfinite(branch.action), np.abs(values - end), np.inf).argmin())
            found.append((branch.source, float(values[place]), float(branch.action[place])))
        return tuple(found)

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays of the parts."""
        parts = {_STATES: self.states} | ({} if self.energies is None else {_ENERGIES: self.energies})
        whole = nested(parts)
        return whole.assign(_TIMES.variables(self.prefactors) | self.parameter_variables())

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a sweep of its arrays; raises ResultFileError."""
        records, arrays = records_in(dataset), Arrays(dataset)
        states, energies = records.get(_STATES), records.get(_ENERGIES)
        if not isinstance(states, Continuation) or not isinstance(energies, EnergyContinuation | None):
            raise ResultFileError("its parts are not a continuation and an energy continuation")
        found = tuple(Prefactor(**row) for row in _TIMES.read(arrays))
        return cls(
            **cls.read_parameter(arrays), states=states, energies=energies, prefactors=found, **provenance
        )  # fmt: skip
