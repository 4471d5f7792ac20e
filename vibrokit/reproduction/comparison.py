"""Our numbers beside the published ones."""

from __future__ import annotations

import numpy as np

from vibrokit.comparison.stationary import StationaryDensity
from vibrokit.errors import StructureError
from vibrokit.reproduction.published import STATES, Method, Published, paper, published_energies, target_of
from vibrokit.reproduction.steps import METHODS
from vibrokit.reproduction.verdicts import Verdict, of_action_plot, of_density, of_exit_times, unknown
from vibrokit.reproduction.work import Records
from vibrokit.results.arrhenius import ArrheniusFit
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.merging import merged
from vibrokit.results.rated import RatedResult
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.sgcm import SGCMResult

_DEVIATIONS = 1.96  # of the normal law, for intervals of 95 %


def verdicts(records: Records) -> list[Verdict]:
    """Return a verdict for each published number; it is unknown where its records are missing."""
    found: list[Verdict] = []
    for one in published_energies():
        try:
            found.append(_verdict(one, records.get(one.scene, {})) or unknown(one, "the work ended before."))
        except StructureError as error:
            found.append(unknown(one, str(error)))
    return found


def _verdict(one: Published, known: dict[str, Record]) -> Verdict | None:
    least, ring, _, times = (known.get(f"{name}-{one.state}") for name in METHODS)
    if not isinstance(least, Result):
        return None
    source, target = STATES[one.state], target_of(one.state)
    energy = least.energy(source, target)
    match one.method:
        case Method.ACTION_PLOT if isinstance(ring, Result):
            return of_action_plot(one, energy.lower, energy.upper, _value(ring, source, target))
        case Method.DENSITY if isinstance(density := of_both(known, "density"), SGCMResult):
            intensity = paper()["density"]["intensity"]
            value = float(StationaryDensity.of(density).barrier(energy.source).sel(intensity=intensity))
            error = intensity * max(rate.log_error for rate in density.rates)  # ln p is the sum of both states' parts
            return of_density(one, value, error, energy.value, intensity)
        case Method.EXIT_TIMES if isinstance(times, RatedResult):
            fit = total_fit(times, energy)
            return of_exit_times(one, fit.slope, _DEVIATIONS * fit.slope_error, energy.value)
    return None


def of_both(known: dict[str, Record], method: str) -> Result | None:
    """Return what a method found for both states, as one result; None if one is missing."""
    found = [one for state in STATES if isinstance(one := known.get(f"{method}-{state}"), Result)]
    return merged(found) if len(found) == len(STATES) else None


def total_fit(times: RatedResult, energy: ActivationEnergy) -> ArrheniusFit:
    """Return the Arrhenius law of leaving a state for any target: the paper counts every exit."""
    return ArrheniusFit.of([rate for rate in total_rates(times) if rate.source == energy.source])


def total_rates(times: RatedResult) -> list[ExitRate]:
    """Return the rates of leaving each state at all, at each intensity."""
    found = []
    for source, intensity in dict.fromkeys((rate.source, rate.intensity) for rate in times.rates):
        own = [rate for rate in times.rates if (rate.source, rate.intensity) == (source, intensity)]
        found.append(ExitRate.total(own))
    return found


def _value(result: Result, source: str, target: str | None) -> float:
    try:
        return result.energy(source, target).value
    except StructureError:
        return np.nan
