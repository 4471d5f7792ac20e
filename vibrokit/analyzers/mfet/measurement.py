"""What simulations of exits at one noise intensity say: rates, their intervals, and what limits them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping

import numpy as np

from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.metastability import targets_at
from vibrokit.analyzers.mfet.direct import DirectRun, Escapes, Exits
from vibrokit.analyzers.mfet.estimates import (
    RateEstimate,
    exponential_p_value,
    mean_tests,
    rate_around,
    rate_of,
    rate_unseen,
)
from vibrokit.analyzers.mfet.splitting import SplittingRun
from vibrokit.analyzers.mfet.walk import Walk
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.rated import METASTABLE


@dataclasses.dataclass(frozen=True, eq=False)
class AtIntensity:
    """What was found at one intensity.

    Attributes
    ----------
    intensity : float
    method : str
        ``"direct"`` or ``"splitting"``.
    rates : mapping of int to RateEstimate
        By target; ln of rates in s⁻¹.
    exits : Exits or None
    interval : float
        Time between exit tests (s).
    p_value : float
        Of the test for an exponential law.
    step_change, step_change_error : float
        What half the steps change in ln of the rate of all exits, and its standard error.
    escapes : Escapes or None
    metastable : bool
        Whether the state lasts much longer than its relaxation: otherwise the rate says nothing about ΔU.
    findings : tuple of Finding
    """

    intensity: float
    method: str
    rates: Mapping[int, RateEstimate]
    exits: Exits | None
    interval: float
    p_value: float = math.nan
    step_change: float = math.nan
    step_change_error: float = math.nan
    escapes: Escapes | None = None
    metastable: bool = True
    findings: tuple[Finding, ...] = ()


def from_direct(run: DirectRun, coarser: DirectRun | None, escapes: int) -> AtIntensity:
    """Return what exits say; `coarser` has steps twice as long, and the last part of some walks is kept."""
    walk, exits, change = run.walk, run.exits(), (math.nan, math.nan)
    targets = {*np.unique(exits.targets).tolist(), *_awaited(walk)}
    rates = {t: _in_seconds(rate_of(exits, int((exits.targets == t).sum())), walk) for t in targets}
    p_value = exponential_p_value(exits, walk.key(12))
    if coarser is not None and len(exits) and coarser.left:
        other = coarser.exits()
        change = math.log(mean_tests(exits) / mean_tests(other)), math.hypot(len(exits) ** -0.5, len(other) ** -0.5)
    return AtIntensity(
        walk.intensity, "direct", rates, exits, walk.interval, p_value, *change,
        escapes=run.escapes(escapes) if escapes and run.left else None,
        metastable=not len(exits) or mean_tests(exits) >= METASTABLE * walk.relaxation * walk.checks,
        findings=tuple(_limits(walk, exits, p_value, *change)),
    )  # fmt: skip


def from_splitting(run: SplittingRun) -> AtIntensity:
    """Return what the batches of splitting say."""
    walk, estimates = run.walk, run.estimates
    source, intensity, error = walk.problem.source, walk.intensity, estimates.error
    count, rates, found = len(estimates.log_values), dict[int, RateEstimate](), list[Finding]()
    for target, (share, spread) in estimates.shares().items():
        if share > 0:
            both = math.hypot(error, spread / share)
            rates[target] = rate_around(estimates.log_mean + math.log(share), both, count)
    for target in _awaited(walk) if rates else ():
        rates.setdefault(target, rate_unseen(estimates.log_mean, count))
    if not rates:
        found.append(Finding.of(Code.NO_EXCURSION_LEFT, source, intensity=intensity, replicas=count))
    elif error > run.wanted:
        found.append(
            Finding.of(
                Code.SPLITTING_NOT_CONVERGED, source,
                intensity=intensity, error=error, wanted=run.wanted, replicas=count,
            )
        )  # fmt: skip
    in_seconds = {target: _in_seconds(rate, walk, walk.checks) for target, rate in rates.items()}
    return AtIntensity(walk.intensity, "splitting", in_seconds, None, walk.interval, findings=tuple(found))


def _limits(walk: Walk, exits: Exits, p_value: float, change: float, change_error: float) -> Iterator[Finding]:
    """What limits the rates: few exits, another law than an exponential one, the steps, or the targets."""
    source, intensity = walk.problem.source, walk.intensity
    if not len(exits):
        # Nobody leaves at once: while its start is not forgotten a walker is no evidence.
        idle = walk.memory * walk.checks * exits.censored
        seen = dataclasses.replace(exits, at_risk=max(exits.at_risk - idle, 1))
        bound = math.exp(-_in_seconds(rate_of(seen, 0), walk).log_upper)
        yield Finding.of(Code.NO_EXIT_SEEN, source, intensity=intensity, time=bound)
        return
    if p_value < 1e-3:
        yield Finding.of(Code.NOT_EXPONENTIAL, source, intensity=intensity, p_value=p_value)
    if abs(change) > 3.0 * change_error:
        yield Finding.of(Code.STEPS_CHANGE_RATE, source, intensity=intensity, change=change, error=change_error)
    for target in np.unique(exits.targets).tolist():
        share = _kept(walk, target) if target >= 0 and not walk.problem.exit.by_position else 1.0
        if share < 0.5:
            yield Finding.of(Code.TARGET_NOT_METASTABLE, source, target, intensity=intensity, share=share)


def _awaited(walk: Walk) -> tuple[int, ...]:
    """Labels of the targets for which something is said even if no exit leads there: a bound."""
    if walk.problem.exit.by_position:
        return ()
    targets = [target.label for target in targets_at(walk.problem, walk.intensity)]
    return (*targets, ESCAPED) if np.isfinite(walk.problem.faces).any() else tuple(targets)


def _kept(walk: Walk, target: int) -> float:
    """Share of walkers that stay at a target until they have forgotten their start."""
    attractor = walk.problem.structure.attractors[target]
    other = dataclasses.replace(walk, problem=dataclasses.replace(walk.problem, attractor=attractor, exit=LeaveBasin()))
    ended = other.advance(other.from_orbit(200, 13), other.memory, other.arrival)
    return float((ended.status == COMPLETED).mean())


def _in_seconds(rate: RateEstimate, walk: Walk, tests: int = 1) -> RateEstimate:
    """The rate in s⁻¹ of one that is per so many intervals between tests."""
    shift = math.log(walk.interval * tests)
    return RateEstimate(rate.log_value - shift, rate.log_error, rate.log_lower - shift, rate.log_upper - shift)
