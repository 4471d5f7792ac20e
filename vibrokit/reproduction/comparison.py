"""Our numbers beside the published ones."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vibrokit.errors import StructureError
from vibrokit.reproduction.published import STATES, Method, Published, paper, published_energies
from vibrokit.reproduction.verdicts import Verdict, of_action_plot, of_density, of_exit_times, unknown
from vibrokit.reproduction.work import Records
from vibrokit.results.arrhenius import ArrheniusFit
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.rated import RatedResult
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.sgcm import SGCMResult

_DEVIATIONS = 1.96  # of the normal law, for intervals of 95 %


def verdicts(records: Records) -> list[Verdict]:
    """Return a verdict for each published number whose records are there."""
    found: list[Verdict] = []
    for one in published_energies():
        try:
            found += _verdict(one, records.get(one.scene, {}))
        except StructureError as error:
            found.append(unknown(one, str(error)))
    return found


def target_of(state: str) -> str | None:
    """Return what a state is left for: from I the state N, from N whatever is nearest."""
    return STATES["N"] if state == "I" else None


def _verdict(one: Published, known: dict[str, Record]) -> Iterator[Verdict]:
    least = known.get("least-action")
    if not isinstance(least, Result):
        return
    source, target = STATES[one.state], target_of(one.state)
    energy = least.energy(source, target)
    match one.method:
        case Method.ACTION_PLOT if isinstance(ring := known.get("ring"), Result):
            yield of_action_plot(one, energy.lower, energy.upper, _value(ring, source, target))
        case Method.DENSITY if isinstance(density := known.get("density"), SGCMResult):
            intensity = paper()["density"]["intensity"]
            value = float(density.barrier(source).sel(intensity=intensity, method="nearest"))
            error = intensity * max((r.log_error for r in density.rates if r.source == energy.source), default=np.nan)
            yield of_density(one, value, error, energy.value, intensity)
        case Method.EXIT_TIMES if isinstance(times := known.get(f"exit-times-{one.state}"), RatedResult):
            fit = total_fit(times, energy)
            yield of_exit_times(one, fit.slope, _DEVIATIONS * fit.slope_error, energy.value)


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
