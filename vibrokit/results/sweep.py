"""Sweep: steady states, activation energies and mean exit times along values of one parameter."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.errors import ResultFileError, StructureError
from vibrokit.results.along_parameter import AlongParameter
from vibrokit.results.arrays import Arrays
from vibrokit.results.codes import Code
from vibrokit.results.continuation import GRAZING, Continuation
from vibrokit.results.energy_continuation import EnergyContinuation
from vibrokit.results.fields import LARGEST, Number, Word
from vibrokit.results.files import nested, records_in
from vibrokit.results.record import Summary
from vibrokit.results.table import Table

if TYPE_CHECKING:
    from vibrokit.plots.sweeps import SweepArtists

Array = NDArray[np.float64]

_STATES, _ENERGIES = "states", "energies"
_NOT_LOCATED = "not located"
_NEAR = 1e-7  # of the span of the values, within which two stops are grazed at once
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


@dataclasses.dataclass(frozen=True)
class Existence:
    """From where to where a branch of steady states exists without a gap and touches the same stops.

    `first` and `last` are values of the parameter: located where the branch ends in a bifurcation, otherwise between
    the last value at which it was found and the next; the last value itself at an end of the sweep, and where there is
    no state at the next. `begins` and `ends` are the kind of the bifurcation; ``"goes on"`` at an end of the sweep,
    ``"nothing beyond"`` where the next value has no state or is refused, ``"not located"`` otherwise. Where the branch
    goes on and touches other stops, they are ``"grazing"``, or ``"not located"`` halfway between two values. `touches`
    has the sides of the stops.
    """

    name: str
    first: float
    last: float
    begins: str
    ends: str
    touches: tuple[str, ...] = ()


def touches_text(one: Existence) -> str:
    """Return which stops are touched, as text."""
    return f"touches {' and '.join(one.touches)}" if one.touches else "clear of stops"


def _changes(known: Sequence[tuple[float, bool | None]], grazed: Sequence[float]) -> Iterator[tuple[float, str]]:
    """Yield where a branch begins or ceases to touch a stop, and how it is known.

    It is known at some values whether the branch touches the stop, and where it grazes it; at other grazings one more
    turn of the orbit touches the stop, or leaves it.
    """
    for (low, before), (high, after) in itertools.pairwise(known):
        met = [value for value in grazed if low <= value <= high]
        if before is None or after is None:  # at an end of the branch
            if met and (before, after) in ((False, None), (None, False)):
                yield met[0] if after is None else met[-1], GRAZING
        elif before is not after:
            yield ((met[0] if after else met[-1]), GRAZING) if met else (0.5 * (low + high), _NOT_LOCATED)
        elif not before and len(met) > 1:  # it touches the stop only in between
            yield met[0], GRAZING
            yield met[-1], GRAZING


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
        return tuple(one for number in range(len(self.names)) for one in self._stretches(number))

    @property
    def contact_changes(self) -> tuple[Existence, ...]:
        """Those of the entries at whose first value a branch begins or ceases to touch a stop."""
        return tuple(
            after
            for one, after in itertools.pairwise(self.coexistence)
            if (one.name, one.last) == (after.name, after.first) and one.touches != after.touches
        )

    def _stretches(self, number: int) -> Iterator[Existence]:
        found = np.isin(self.values, [value for value, _ in self.states.branch(number)])
        places = np.flatnonzero(found)
        for stretch in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1):
            first, begins = self._end(number, int(stretch[0]), -1)
            last, ends = self._end(number, int(stretch[-1]), 1)
            for value, kind, touched in self._parts(number, stretch, first, last):
                yield Existence(self.names[number], first, value, begins, kind or ends, touched)
                first, begins = value, kind

    def _parts(
        self, number: int, stretch: NDArray[np.intp], first: float, last: float
    ) -> Iterator[tuple[float, str, tuple[str, ...]]]:
        """Yield the parts of a stretch of a branch in which it touches the same stops: end, its kind, and stops.

        The last part has no kind.
        """
        attractors, near = dict(self.states.branch(number)), _NEAR * float(np.ptp(self.values))
        values = self.values[stretch].tolist()
        touched = set(attractors[values[0]].touched)
        changes: list[tuple[float, str, str]] = []
        for side in ("left", "right"):
            known = [(value, side in attractors[value].touched) for value in values]
            met = [one for one in self._grazed(number, side) if first + near < one < last - near]
            found = list(_changes([(first, None), *known, (last, None)], met))
            changes += [(value, kind, side) for value, kind in found]
            if sum(value < values[0] for value, _ in found) % 2:
                touched ^= {side}
        changes.sort()
        while changes:
            together = [one for one in changes if one[0] <= changes[0][0] + near]  # a symmetric orbit grazes both stops
            changes = changes[len(together) :]
            kinds = {kind for _, kind, _ in together}
            yield together[0][0], _NOT_LOCATED if _NOT_LOCATED in kinds else GRAZING, tuple(sorted(touched))
            for _, _, side in together:
                touched ^= {side}
        yield last, "", tuple(sorted(touched))

    def _grazed(self, number: int, side: str) -> list[float]:
        """Where a branch grazes a stop, ascending."""
        marks = self.states.bifurcations
        return sorted(one.value for one in marks if (one.kind, one.branch, one.side) == (GRAZING, number, side))

    def _end(self, number: int, place: int, direction: int) -> tuple[float, str]:
        """Where a branch ends beyond a value, and how."""
        here, beyond = float(self.values[place]), place + direction
        if not 0 <= beyond < len(self.values):
            return here, "goes on"
        there = float(self.values[beyond])
        low, high = sorted((here, there))
        met = [one for one in self.states.bifurcations if one.branch == number and low <= one.value <= high]
        if met:
            last = max(met, key=lambda one: direction * one.value)
            return last.value, last.kind
        if any(value == there for value, _ in self.gaps):
            return here, "nothing beyond"
        return 0.5 * (here + there), _NOT_LOCATED

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

        Raises
        ------
        StructureError
            No exit path of this state was found.
        """
        return self._exits.energy(source)

    @called
    def sensitivity(self, source: str) -> Array:
        """Return by how many per cent 1 % of the parameter changes ΔU at each value; errors as of `energy`.

        Parameters that are tied change together.
        """
        return self._exits.sensitivity(source)

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
            No exit path of this state was found, or no prefactor is known.
        """
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
