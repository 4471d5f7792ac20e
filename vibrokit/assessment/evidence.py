"""Evidence: energies and mean times of each exit of a scene by all methods."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
from scipy.special import logsumexp

from vibrokit.comparison.mean_times import LogTime, MeanTimes, most_certain
from vibrokit.comparison.occupancies import Balance
from vibrokit.comparison.verdicts import exit_name
from vibrokit.errors import StructureError
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.labels import goal_name
from vibrokit.results.rated import RatedResult
from vibrokit.results.result import Result

_TRUST = (Bound.EXACT, Bound.CERTIFIED, Bound.UPPER, Bound.BRACKET, Bound.ESTIMATE, Bound.CONFIDENCE)


@dataclasses.dataclass(frozen=True, eq=False)
class Evidence:
    """Energies and mean times of each exit by all methods; an end that is None stands for all exits of a state."""

    names: tuple[str, ...]  # of the attractors
    results: Mapping[str, Result]

    @property
    def rated(self) -> list[RatedResult]:
        """Results with rates."""
        return [one for one in self.results.values() if isinstance(one, RatedResult) and one.rates]

    def leaving(self, start: int, end: int | None) -> str:
        """Return an exit in words."""
        goal = "" if end is None else f" for {goal_name(self.names, end)}"
        return f"{self.names[start]} is left{goal}"

    def targets(self, start: int) -> set[int]:
        """Return the labels to which a state is known to be left."""
        return {rate.target for one in self.rated for rate in one.rates if rate.source == start}

    def energy(self, start: int, end: int | None) -> ActivationEnergy | None:
        """Return the energy of an exit with the strongest kind of bounds; of several exits the least; None without."""
        best: dict[int, ActivationEnergy] = {}
        for e in (e for one in self.results.values() for e in one.energies if e.source == start):
            if end in (None, e.target):
                pair = (best.get(e.target, e), e)
                best[e.target] = min(pair, key=lambda one: (_TRUST.index(one.bound), one.value))
        return min(best.values(), key=lambda one: one.value, default=None)

    def slope(self, start: int, end: int | None) -> ActivationEnergy | None:
        """Return the energy with which the mean times of an exit go on; without an end, of those that have rates."""
        counted = [self.energy(start, one) for one in (self.targets(start) if end is None else {end})]
        return min((one for one in counted if one is not None), key=lambda one: one.value, default=None)

    def exceeds_basin(self, label: int, intensity: float) -> bool:
        """Whether noise makes the core of an attractor so wide, as methods found, that it is no state of its own."""
        found = (one for result in self.results.values() for one in result.found(Code.CORE_EXCEEDS_BASIN))
        return any(one.source == label and one.values["intensity"] <= intensity for one in found)  # type: ignore[operator]

    def mean_times(self, start: int, end: int | None) -> list[MeanTimes]:
        """Return the mean times of an exit by each method; raises StructureError if there are none."""
        found = []
        for one in self.rated:
            rates = [rate for rate in one.rates if rate.source == start and end in (None, rate.target)]
            if rates:
                found.append(MeanTimes.of(rates, one.made_by))
        if not found:
            leaving = exit_name(self.names, start, end)
            raise StructureError(f"no exit rate is known for {leaving}; see the findings, or give more time.")
        return found

    def log_time(self, start: int, end: int | None, intensity: float) -> LogTime:
        """Return ln of the mean time of an exit at a noise intensity; raises StructureError if it is not known."""
        found = most_certain(self.mean_times(start, end), intensity, self.slope(start, end))
        if found is None:
            raise StructureError(
                f"no rate is known near D = {intensity:g}, and no activation energy from which to continue; give more "
                "time."
            )
        return found

    def relaxation(self, label: int) -> float:
        """Return the relaxation time of an attractor (s); NaN where no result has it."""
        known = (float(one.relaxations[label]) for one in self.rated)
        return next((time for time in known if math.isfinite(time)), math.nan)

    def balance(self, intensity: float) -> Balance:
        """Return the balance of rates at a noise intensity; raises StructureError where a state has no known rate."""
        count = len(self.names)
        logs, lower, upper = (np.full((count, count), end) for end in (-np.inf, -np.inf, np.inf))
        escapes = np.full(count, -np.inf)
        for start in range(count):
            self.mean_times(start, None)  # raises where nothing is known
            for end in self.targets(start):
                known = most_certain(self.mean_times(start, end), intensity, self.energy(start, end))
                if known is None:
                    continue
                if end < 0:
                    escapes[start] = logsumexp([escapes[start], -known.value])
                else:
                    logs[start, end], lower[start, end], upper[start, end] = -known.value, -known.upper, -known.lower
        cores = [one for one in self.rated if np.isfinite(one.core_shares(intensity)).any()]
        nearest = min(cores or self.rated, key=lambda one: np.abs(np.log(np.array(one.intensities) / intensity)).min())
        relaxations = np.array([self.relaxation(label) for label in range(count)])
        return Balance(self.names, logs, lower, upper, relaxations, nearest.core_shares(intensity), escapes)
