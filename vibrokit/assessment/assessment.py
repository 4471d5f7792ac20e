"""Assessment: steady states and results of one scene, and the answers that follow from them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
import xarray

from vibrokit.assessment.answers import AllowedIntensity, Answer, MeanTime, exponential
from vibrokit.assessment.durations import seconds_in
from vibrokit.assessment.plausibility import Measure, Plausibility, plausibility
from vibrokit.comparison.mean_times import LogTime, MeanTimes, intensity_for, most_certain
from vibrokit.comparison.occupancies import Balance, check_returns, shares_over
from vibrokit.comparison.reconcile import reconcile
from vibrokit.comparison.reconciliation import Reconciliation
from vibrokit.comparison.sensitivities import Sensitivity, sensitivities
from vibrokit.construction import called
from vibrokit.errors import ResultFileError, StructureError, shown
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.labels import goal_name, goal_of, label_of
from vibrokit.results.merging import part_of
from vibrokit.results.nested import nested, records_in
from vibrokit.results.rated import METASTABLE, RatedResult
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.results.summary import Summary

STRUCTURE = "structure"
"""Name of the structure among the records of an assessment."""

_TRUST = (Bound.EXACT, Bound.CERTIFIED, Bound.UPPER, Bound.BRACKET, Bound.ESTIMATE, Bound.CONFIDENCE)


class Assessment(Record):
    """Steady states of a scene, the results of every method on their exits, and the answers that follow from these.

    Attributes
    ----------
    structure : Structure
    results : dict of str to Result
        By the name of the analyzer; each has all states that were analyzed.
    """

    kind: ClassVar[str] = "assessment"

    structure: Structure
    results: Mapping[str, Result]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the attractors, in the order of their labels."""
        return self.structure.names

    @property
    def intensity(self) -> float:
        """Noise intensity D of the scene (m² s⁻³)."""
        return float(self.scene["noise"]["intensity"])

    @property
    def period(self) -> float:
        """Forcing period, or 2π/ω_n without forcing (s)."""
        return self.oscillator.section_interval

    @cached_property
    def plausibility(self) -> Plausibility:
        """Closed forms of the scene, and which of them are unusual; see `vibrokit.plausibility`."""
        return plausibility(self.oscillator)

    @property
    def psd_ratio(self) -> float:
        """One-sided power spectral density of the acceleration at rest over D; NaN for coloured noise."""
        return self.plausibility.value(Measure.PSD) / self.intensity

    @cached_property
    def reconciliation(self) -> Reconciliation:
        """The numbers of all methods for each exit, and whether they agree; see `vibrokit.reconcile`.

        Raises
        ------
        StructureError
            There are fewer than two results, or they have no exit in common.
        """
        return reconcile(*self.results.values())

    @called
    def energy(self, source: int | str, target: int | str | None = None) -> ActivationEnergy:
        """Return the activation energy of one exit by the method with the strongest bounds.

        Without a target it is that of the exit with the least energy.

        Raises
        ------
        StructureError
            There is no such attractor, or no energy of this exit is known.
        """
        start, end = self._labels(source, target)
        found = self._energy(start, end)
        if found is None:
            raise StructureError(f"no activation energy of {self._leaving(start, end)} is known; give more time.")
        return found

    @called
    def mean_time(
        self, source: int | str, target: int | str | None = None, *, intensity: float | None = None
    ) -> MeanTime:
        """Return the mean time until a state is left.

        Parameters
        ----------
        source : int or str
        target : int or str, optional
            The inverse of the rate to this target; by default the time until it is left at all.
        intensity : float, optional
            D (m² s⁻³); by default that of the scene. Between computed intensities ln τ is interpolated in 1/D; beyond
            them it is continued by C exp(ΔU/D), see `vibrokit.comparison.mean_times.MeanTimes.at`.

        Raises
        ------
        StructureError
            There is no such attractor, no rate of the exit is known, or the intensity is not positive.
        """
        start, end = self._labels(source, target)
        found = self._log_time(start, end, self._checked(intensity))
        relaxation = self._relaxation(start)
        return MeanTime(
            question=f"mean time until {self._leaving(start, end)}",
            value=exponential(found.value),
            lower=exponential(found.lower),
            upper=exponential(found.upper),
            unit="s",
            intensity=found.intensity,
            methods=found.methods,
            extrapolated=found.extrapolated,
            log_value=found.value,
            log_lower=found.lower,
            log_upper=found.upper,
            period=self.period,
            metastable=not found.value < math.log(METASTABLE * relaxation) if relaxation > 0 else True,
        )

    @called
    def probability_of_leaving(
        self,
        source: int | str,
        within: float | str,
        target: int | str | None = None,
        *,
        intensity: float | None = None,
    ) -> Answer:
        """Return the probability that a state is left within a time, 1 − exp(−t/τ).

        Parameters
        ----------
        source : int or str
        within : float or str
            The time, in s or as text such as ``"8 h"``.
        target : int or str, optional
        intensity : float, optional

        Raises
        ------
        ParameterError
            The time is not positive.
        StructureError
            As for `mean_time`.
        """
        time = seconds_in(within, period=self.period)
        mean = self.mean_time(source, target, intensity=intensity)
        logs = mean.log_value, mean.log_upper, mean.log_lower
        value, lower, upper = (-math.expm1(-exponential(math.log(time) - log)) for log in logs)
        start, end = self._labels(source, target)
        return Answer(
            question=f"probability that {self._leaving(start, end)} within {time:g} s",
            value=value, lower=lower, upper=upper, unit="", intensity=mean.intensity, methods=mean.methods,
            extrapolated=mean.extrapolated,
        )  # fmt: skip

    @called
    def allowed_intensity(
        self, source: int | str, mean_time: float | str, target: int | str | None = None
    ) -> AllowedIntensity:
        """Return the largest noise intensity at which a state lasts a given mean time.

        Its bounds are the intensities at which the ends of the interval of the mean time equal the given one.

        Parameters
        ----------
        source : int or str
        mean_time : float or str
            In s, or as text such as ``"1 yr"``.
        target : int or str, optional

        Raises
        ------
        ParameterError
            The time is not positive.
        StructureError
            As for `mean_time`; the time is shorter than a period, or no intensity gives it within what is known.
        """
        time, (start, end) = required_time(mean_time, self.period), self._labels(source, target)
        solved = intensity_for(self._mean_times(start, end), math.log(time), self._energy(start, end))
        if solved is None:
            raise StructureError(
                f"no noise intensity is known at which {self._leaving(start, end)} after {time:g} s on average; give "
                "more time, or a time nearer to those that were computed."
            )
        found, lower, upper = solved
        return AllowedIntensity(
            question=f"largest noise intensity at which {self._leaving(start, end)} after {mean_time} on average",
            value=found.intensity, lower=lower, upper=upper, unit="m² s⁻³", intensity=found.intensity,
            methods=found.methods, extrapolated=found.extrapolated, psd_ratio=self.psd_ratio,
        )  # fmt: skip

    @called
    def occupancy(self, *, intensity: float | None = None) -> xarray.DataArray:
        """Return the share of time spent in each metastable state, over attractors, with bounds; see `occupancies`.

        Raises
        ------
        StructureError
            The rates of some state are not known, or motion leaves some state for good: then no state has a share of
            time in the long run.
        """
        at = self._checked(intensity)
        count = len(self.names)
        if not count:
            raise StructureError("no steady state is known, so that nothing has a share of time; give more time.")
        check_returns((rate for one in self.rated.values() for rate in one.rates), self.names)
        logs, lower, upper = (np.full((count, count), end) for end in (-np.inf, -np.inf, np.inf))
        for start in range(count):
            self._mean_times(start, None)  # raises where nothing is known
            for end in (label for label in range(count) if label != start):
                known = self._found_times(start, end)
                found = most_certain(known, at, self._energy(start, end)) if known else None
                if found is not None:
                    logs[start, end], lower[start, end], upper[start, end] = -found.value, -found.upper, -found.lower
        relaxations = np.array([self._relaxation(label) for label in range(count)])
        balance = Balance(self.names, logs, lower, upper, relaxations, self._core_shares(at))
        return shares_over([at], [balance])[0]

    @called
    def sensitivities(
        self,
        source: int | str,
        target: int | str | None = None,
        *,
        tied: Mapping[str, Sequence[str]] | None = None,
    ) -> tuple[Sensitivity, ...]:
        """Return by how many per cent 1 % of each parameter changes ΔU and the mean time at the scene's noise.

        Parameters and errors as of `vibrokit.comparison.sensitivities.sensitivities`.
        """
        return sensitivities(self.energy(source, target), self.oscillator.parameters, self.intensity, tied)

    @property
    def summary(self) -> Summary:
        """How long each state lasts at the noise of the scene."""
        rows = []
        for name in self.names:
            try:
                rows.append((name, f"is left after {self.mean_time(name).number}"))
            except StructureError:
                rows.append((name, "is left after a time that is not known"))
        return Summary(f"Assessment at D = {self.intensity:g} m² s⁻³", tuple(rows))

    @called
    def plot(self, ax: Any = None) -> Any:
        """Draw ln τ against 1/D by all methods; see `Reconciliation.plot`."""
        return self.reconciliation.plot(ax)

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays of the structure and of all results."""
        return nested({STRUCTURE: self.structure, **self.results})

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make an assessment of its arrays; raises ResultFileError."""
        records = records_in(dataset)
        structure = records.pop(STRUCTURE, None)
        if not isinstance(structure, Structure):
            raise ResultFileError("it holds no structure")
        results = {name: one for name, one in records.items() if isinstance(one, Result)}
        return cls(structure=structure, results=results, **provenance)

    @property
    def rated(self) -> dict[str, RatedResult]:
        """Results with rates, by name."""
        return {name: one for name, one in self.results.items() if isinstance(one, RatedResult)}

    def parts(self, name: str) -> list[Result]:
        """What one result says of each attractor that was analyzed; complete where its analysis came to its end."""
        whole = self.results[name]
        finished = self.settings.get("finished", {}).get(name, [])
        source = whole.settings.get("source")
        labels = range(len(self.names)) if source is None else [label_of(source, self.names)]
        return [
            dataclasses.replace(part_of(whole, label), complete=whole.complete or label in finished) for label in labels
        ]

    def _labels(self, source: int | str, target: int | str | None) -> tuple[int, int | None]:
        return label_of(source, self.names), None if target is None else goal_of(target, self.names)

    def _leaving(self, start: int, end: int | None) -> str:
        goal = "" if end is None else f" for {goal_name(self.names, end)}"
        return f"{self.names[start]} is left{goal}"

    def _checked(self, intensity: float | None) -> float:
        if intensity is None:
            return self.intensity
        if isinstance(intensity, bool) or not isinstance(intensity, int | float) or not 0 < intensity < math.inf:
            raise StructureError(f"intensity must be a positive number (m² s⁻³), got {shown(intensity)}.")
        return float(intensity)

    def _energy(self, start: int, end: int | None) -> ActivationEnergy | None:
        """The energy of an exit with the strongest kind of bounds; without an end, the least such energy."""
        known = [
            e for one in self.results.values() for e in one.energies if e.source == start and end in (None, e.target)
        ]
        return min(known, key=lambda e: (_TRUST.index(e.bound), e.value)) if known else None

    def _found_times(self, start: int, end: int | None) -> list[MeanTimes]:
        found = []
        for one in self.rated.values():
            rates = [rate for rate in one.rates if rate.source == start and end in (None, rate.target)]
            if rates:
                found.append(MeanTimes.of(rates, str(one.settings.get("analyzer") or one.kind)))
        return found

    def _mean_times(self, start: int, end: int | None) -> list[MeanTimes]:
        found = self._found_times(start, end)
        if not found:
            raise StructureError(
                f"no exit rate of {self._leaving(start, end)} is known; see the findings, or give more time."
            )
        return found

    def _log_time(self, start: int, end: int | None, intensity: float) -> LogTime:
        found = most_certain(self._mean_times(start, end), intensity, self._energy(start, end))
        if found is None:
            raise StructureError(
                f"no rate is known near D = {intensity:g}, and no activation energy from which to continue; give more "
                "time."
            )
        return found

    def _relaxation(self, label: int) -> float:
        """Relaxation time of an attractor (s); NaN where no result has it."""
        for one in self.rated.values():
            if "relaxation_time" in one.data:
                own = one.data.transpose("source", "core_source", ...)
                return float(own["relaxation_time"].values.reshape(-1, len(self.names))[0, label])
        return math.nan

    def _core_shares(self, intensity: float) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Share of each core in each basin, at the computed intensity nearest to one; NaN where none has it."""
        count = len(self.names)
        shares, distance = np.full((count, count), np.nan), math.inf
        for one in self.rated.values():
            if "core_share" not in one.data:
                continue
            own = one.data.transpose("source", "intensity_index", "core_source", "core_label", ...)
            places, values = own["rate_intensity"].values, own["core_share"].values
            for place in zip(*np.nonzero(np.isfinite(places)), strict=True):
                apart = abs(math.log(places[place] / intensity))
                if apart < distance:
                    shares, distance = values[place], apart
        return shares


def required_time(mean_time: float | str, period: float) -> float:
    """Return a mean time that a state has to last (s); raises StructureError if it is shorter than a period."""
    time = seconds_in(mean_time, period=period)
    if time < period:
        raise StructureError(
            f"mean_time must be a period at least ({period:g} s), for exits are counted once in a period, got "
            f"{shown(mean_time)}."
        )
    return time
