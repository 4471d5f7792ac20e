"""Quantities of the exits in one result: energies, mean times, slopes, barriers."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from scipy.special import logsumexp

from vibrokit.comparison.mean_times import log_sum
from vibrokit.comparison.quantities import Kind, Quantity
from vibrokit.errors import StructureError
from vibrokit.results.arrhenius import ArrheniusFit
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.rated import RatedResult
from vibrokit.results.result import Result
from vibrokit.results.sgcm import SGCMResult


def exit_quantities(result: Result, method: str) -> list[Quantity]:
    """Return the quantities of the exits in one result: for each target, and for all targets of a source together."""
    found = list(_energies(result, method))
    if isinstance(result, RatedResult) and result.rates:
        for one in _exits(result):
            times = _log_times(result, *one, method)
            found += [*times, *_slopes(times), *_fit(times)]
    if isinstance(result, SGCMResult):
        found += _barriers(result, method)
    return found


def with_prefactors(quantities: Sequence[Quantity]) -> list[Quantity]:
    """Return the prefactors τ exp(−ΔU/D) of all mean times, with the energy of the narrowest interval of each exit."""
    best: dict[tuple[int, int | None], Quantity] = {}
    for one in quantities:
        key = one.source, one.target
        if one.kind is Kind.ENERGY and one.resolved and (key not in best or one.error < best[key].error):
            best[key] = one
    found = []
    for one in quantities:
        energy = best.get((one.source, one.target))
        if one.kind is Kind.LOG_TIME and energy is not None:
            value = one.value - energy.value / one.intensity
            below = math.hypot(one.below, energy.above / one.intensity)
            above = math.hypot(one.above, energy.below / one.intensity)
            changes: dict[str, Any] = {"value": value, "lower": value - below, "upper": value + above}
            found.append(dataclasses.replace(one, kind=Kind.LOG_PREFACTOR, **changes))
    return found


def _energies(result: Result, method: str) -> Iterator[Quantity]:
    """The energy of each exit; for leaving a state at all, the least energy of its exits."""
    for source in dict.fromkeys(energy.source for energy in result.energies):
        own = [energy for energy in result.energies if energy.source == source]
        for target in dict.fromkeys(energy.target for energy in own):
            yield _energy([energy for energy in own if energy.target == target], target, method)
        if len({energy.target for energy in own}) > 1:
            yield _energy(own, None, method)


def _energy(energies: Sequence[ActivationEnergy], target: int | None, method: str) -> Quantity:
    value, lower, upper = np.min([(one.value, one.lower, one.upper) for one in energies], axis=0).tolist()
    return Quantity(Kind.ENERGY, energies[0].source, target, method, math.nan, value, lower, upper)


def _exits(result: RatedResult) -> list[tuple[int, int | None]]:
    """Source and target of each exit with rates; target None for all exits together, where there are several."""
    pairs = dict.fromkeys((rate.source, rate.target) for rate in result.rates)
    found: list[tuple[int, int | None]] = []
    for source, same in itertools.groupby(sorted(pairs), key=lambda pair: pair[0]):
        own = list(same)
        found += own if len(own) == 1 else [*own, (source, None)]
    return found


def _log_times(result: RatedResult, source: int, target: int | None, method: str) -> list[Quantity]:
    """ln τ of one exit at each intensity, descending."""
    relaxation = float(result.relaxations[source])
    own = [rate for rate in result.rates if rate.source == source]
    found = []
    for intensity in sorted({rate.intensity for rate in own}, reverse=True):
        here = [rate for rate in own if rate.intensity == intensity]
        chosen = [rate for rate in here if target in (None, rate.target)]
        if chosen:
            log_rate, lower, upper = log_sum(chosen)
            left = float(logsumexp([rate.log_value for rate in here]))
            found.append(
                Quantity(
                    Kind.LOG_TIME, source, target, method, intensity, -log_rate, -upper, -lower, chosen[0].event,
                    math.exp(min(700.0, -left)) / relaxation, _core_share(result, source, target, intensity),
                )
            )  # fmt: skip
    return found


def _core_share(result: RatedResult, source: int, target: int | None, intensity: float) -> float:
    """Smaller share of the cores of source and target in their own basins; NaN where neither is known."""
    own = np.diagonal(result.core_shares(intensity))
    both = [own[label] for label in (source, target) if label is not None and label >= 0]
    return float(np.nanmin(both)) if np.isfinite(both).any() else math.nan


def _slopes(times: Sequence[Quantity]) -> list[Quantity]:
    found = []
    for strong, weak in itertools.pairwise(times):
        step = 1.0 / weak.intensity - 1.0 / strong.intensity
        slope = (weak.value - strong.value) / step
        below = math.hypot(weak.below, strong.above) / step
        above = math.hypot(weak.above, strong.below) / step
        middle = 2.0 / (1.0 / weak.intensity + 1.0 / strong.intensity)
        changes: dict[str, Any] = {"intensity": middle, "value": slope, "lower": slope - below, "upper": slope + above}
        found.append(dataclasses.replace(weak, kind=Kind.SLOPE, **changes))
    return found


def fit_of(times: Sequence[Quantity]) -> ArrheniusFit | None:
    """Return the Arrhenius law through mean times of one exit; None with fewer than two intensities."""
    if len(times) < 2:
        return None
    return ArrheniusFit.of(
        [ExitRate(one.source, -1, one.intensity, -one.value, one.error, one.event, one.method) for one in times]
    )


def _fit(times: Sequence[Quantity]) -> list[Quantity]:
    fit = fit_of(times)
    if fit is None:
        return []
    lower, upper = fit.interval
    changes: dict[str, Any] = {"intensity": math.nan, "value": fit.slope, "lower": lower, "upper": upper}
    return [dataclasses.replace(times[-1], kind=Kind.ARRHENIUS, **changes)]


def _barriers(result: SGCMResult, method: str) -> Iterator[Quantity]:
    """The barrier of each state at each intensity; it is that of the lowest saddle, wherever that leads."""
    for source in dict.fromkeys(rate.source for rate in result.rates):
        targets = {rate.target for rate in result.rates if rate.source == source}
        try:
            barrier = result.barrier(source)
        except StructureError:  # no saddle: nothing to say
            continue
        for intensity, value in zip(barrier["intensity"].values.tolist(), barrier.values.tolist(), strict=True):
            if math.isfinite(value):
                target = min(targets) if len(targets) == 1 else None
                ends = value, value - intensity, value + intensity
                yield Quantity(Kind.BARRIER, source, target, method, intensity, *ends)
