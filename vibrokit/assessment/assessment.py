"""Assessment: steady states and results of one scene, and the answers that follow from them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.arguments import real
from vibrokit.assessment.answers import AllowedIntensity, Answer, MeanTime, probability_within
from vibrokit.assessment.durations import required_time, seconds_in
from vibrokit.assessment.evidence import Evidence
from vibrokit.assessment.plausibility import Measure, Plausibility, plausibility
from vibrokit.comparison.mean_times import intensity_for
from vibrokit.comparison.occupancies import shares_over
from vibrokit.comparison.reconcile import reconcile
from vibrokit.comparison.reconciliation import Reconciliation
from vibrokit.comparison.sensitivities import Sensitivity, sensitivities
from vibrokit.comparison.verdicts import exit_name
from vibrokit.construction import called
from vibrokit.errors import ResultFileError, StructureError, shown
from vibrokit.quantity import size_of, unit_in
from vibrokit.results.arrays import Arrays
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.files import nested, records_in
from vibrokit.results.labels import goal_of, label_of
from vibrokit.results.one_scene import analyzed_labels, part_of
from vibrokit.results.record import Record, Summary
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure

STRUCTURE = "structure"
"""Name of the structure among the records of an assessment."""


class Assessment(Record):
    """Steady states of a scene, the results of every method on their exits, and the answers that follow from these.

    Attributes
    ----------
    structure : Structure
    results : dict of str to Result
        By the name of the analyzer; each has all states that were analyzed.
    reached : dict of str to array (attractors,)
        By the name of the analyzer: for what accuracy the analysis of each state came to its end; infinite where it did
        not.
    """

    kind: ClassVar[str] = "assessment"

    structure: Structure
    results: Mapping[str, Result]
    reached: Mapping[str, NDArray[np.float64]] = dataclasses.field(default_factory=dict)

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

    @property
    def _given_unit(self) -> tuple[str, float] | None:
        """Unit in which the scene gives its noise intensity, and its size (m² s⁻³); None for a number without one."""
        text = self.scene.get("given", {}).get("noise.intensity")
        if text is None:
            return None
        unit = unit_in(text)
        return unit, size_of(unit, "m^2 s^-3", self.scene.get("mass"))

    @cached_property
    def evidence(self) -> Evidence:
        """Energies and mean times of each exit by all methods."""
        return Evidence(self.names, self.results)

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
        found = self.evidence.energy(start, end)
        if found is None:
            raise StructureError(
                f"no activation energy is known for {exit_name(self.names, start, end)}; give more time."
            )
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
        found = self.evidence.log_time(start, end, self._checked(intensity))
        question = f"mean time until {self.evidence.leaving(start, end)}"
        return MeanTime.of(question, found, self.period, self.evidence.relaxation(start))

    @called
    def probability_of_leaving(
        self, source: int | str, within: float | str, target: int | str | None = None, *, intensity: float | None = None
    ) -> Answer:
        """Return the probability that a state is left within a time, 1 − exp(−t/τ), times the share of the target.

        The law is exponential once the state has formed. Its interval contains a start at the attractor, from which
        nothing leaves at first: a delay of up to ten relaxation times, which the mean time τ includes.

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
        (start, end), at = self._labels(source, target), self._checked(intensity)
        goal = self.evidence.log_time(start, end, at)
        alone = end is None or self.evidence.targets(start) == {end}
        leaving = goal if alone else self.evidence.log_time(start, None, at)
        value, lower, upper = probability_within(time, leaving, goal, self.evidence.relaxation(start))
        return Answer(
            question=f"probability that {self.evidence.leaving(start, end)} within {time:g} s",
            value=value, lower=lower, upper=upper, unit="", intensity=at,
            methods=tuple(dict.fromkeys((*goal.methods, *leaving.methods))),
            extrapolated=goal.extrapolated or leaving.extrapolated,
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
        leaving = self.evidence.leaving(start, end)
        solved = intensity_for(self.evidence.mean_times(start, end), math.log(time), self.evidence.slope(start, end))
        if solved is None:
            raise StructureError(
                f"no noise intensity is known at which {leaving} after {time:g} s on average; give a larger time "
                "limit, or a mean time nearer to the computed ones."
            )
        found, lower, upper = solved
        return AllowedIntensity(
            question=f"largest noise intensity at which {leaving} after {mean_time} on average",
            value=found.intensity, lower=lower, upper=upper, unit="m² s⁻³", intensity=found.intensity,
            methods=found.methods, extrapolated=found.extrapolated, psd_ratio=self.psd_ratio,
            given_unit=self._given_unit,
        )  # fmt: skip

    @called
    def occupancy(self, *, intensity: float | None = None) -> xarray.DataArray:
        """Return the share of time spent in each metastable state, over attractors, with bounds; see `occupancies`.

        Raises
        ------
        StructureError
            The rates of some state are not known, or motion escapes before it has been in all states.
        """
        at = self._checked(intensity)
        if not self.names:
            raise StructureError("no steady state is known, so that nothing has a share of time; give more time.")
        return shares_over([at], [self.evidence.balance(at)])[0]

    @called
    def sensitivities(
        self, source: int | str, target: int | str | None = None, *, tied: Mapping[str, Sequence[str]] | None = None
    ) -> tuple[Sensitivity, ...]:
        """Return by how many per cent 1 % of each parameter changes ΔU and the mean time at the scene's noise.

        Parameters and errors as of `vibrokit.comparison.sensitivities.sensitivities`.
        """
        return sensitivities(self.energy(source, target), self.oscillator.parameters, self.intensity, tied)

    def lasting(self, label: int) -> tuple[str, str]:
        """Return how long a state lasts at the noise of the scene, and by what methods that is known, as text."""
        try:
            found = self.mean_time(label)
        except StructureError:
            formless = self.evidence.exceeds_basin(label, self.intensity)
            return "no time: noise makes it wider than its basin" if formless else "a time that is not known", "–"
        remarks = ["extrapolated"] * found.extrapolated + ["left before it has formed"] * (not found.metastable)
        return found.number, ", ".join([" and ".join(found.methods), *remarks])

    @property
    def summary(self) -> Summary:
        """How long each state lasts at the noise of the scene."""
        rows = [(name, f"is left after {self.lasting(label)[0]}") for label, name in enumerate(self.names)]
        return Summary(f"Assessment at D = {self.intensity:g} m² s⁻³", tuple(rows))

    @called
    def plot(self, ax: Any = None) -> Any:
        """Draw ln τ against 1/D by all methods; see `Reconciliation.plot`."""
        return self.reconciliation.plot(ax)

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays of the structure and of all results."""
        whole = nested({STRUCTURE: self.structure, **self.results})
        reached = np.array([self._reached(name) for name in self.results]).reshape(len(self.results), len(self.names))
        return whole.assign(reached=(("result", "state"), reached, {"long_name": "accuracy of a finished analysis"}))

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make an assessment of its arrays; raises ResultFileError."""
        records = records_in(dataset)
        structure = records.pop(STRUCTURE, None)
        if not isinstance(structure, Structure):
            raise ResultFileError("it holds no structure")
        results = {name: one for name, one in records.items() if isinstance(one, Result)}
        shape = len(results), len(structure.names)
        reached = dict(zip(results, Arrays(dataset).numbers("reached", shape, 0.0, finite=False), strict=True))
        return cls(structure=structure, results=results, reached=reached, **provenance)

    def parts(self, name: str) -> dict[int, tuple[Result, float]]:
        """What one result says of each attractor that was analyzed, by its label, and for what accuracy that is."""
        whole, reached = self.results[name], self._reached(name).tolist()
        parts = {label: part_of(whole, label) for label in analyzed_labels(whole)}
        return {
            label: (dataclasses.replace(part, complete=math.isfinite(reached[label])), reached[label])
            for label, part in parts.items()
        }

    def _reached(self, name: str) -> NDArray[np.float64]:
        return self.reached.get(name, np.full(len(self.names), np.inf))

    def _labels(self, source: int | str, target: int | str | None) -> tuple[int, int | None]:
        return label_of(source, self.names), None if target is None else goal_of(target, self.names)

    def _checked(self, intensity: float | None) -> float:
        if intensity is not None and not 0 < real(intensity) < math.inf:
            raise StructureError(f"intensity must be a positive finite number (m² s⁻³), got {shown(intensity)}.")
        return self.intensity if intensity is None else real(intensity)
