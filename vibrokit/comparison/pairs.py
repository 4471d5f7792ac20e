"""Two methods compared: differences of their numbers in combined errors, and the verdict that follows."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import stats

from vibrokit.comparison.of_exits import fit_of
from vibrokit.comparison.quantities import DEVIATIONS, Kind, Quantity
from vibrokit.comparison.verdicts import Agreement, Verdict
from vibrokit.results.arrhenius import ENOUGH
from vibrokit.results.rated import HELD, METASTABLE

_LEAST_ERROR = 1e-9  # relative: the effect of rounding


@dataclasses.dataclass(frozen=True)
class Side:
    """The numbers of one method for one exit or state."""

    method: str
    energy: Quantity | None
    series: tuple[Quantity, ...]  # mean times over D, or shares over D
    exit: tuple[str, str]  # what counts as leaving: energies need equal first entries, times need both equal
    remedy: str  # the setting that refines the method


Sides = tuple[Side, Side]


def verdict_of(sides: Sides, source: int, target: int | None, level: float) -> Verdict | None:
    """Compare two methods: mean times where they have common intensities, otherwise energies; None without both."""
    one, other = sides
    about: dict[str, Any] = {"source": source, "target": target, "one": one.method, "other": other.method}
    times = bool(one.series and other.series)
    kind = Kind.LOG_TIME if times else Kind.ENERGY
    if one.exit[0] != other.exit[0] or (times and one.exit != other.exit):
        differ = int(one.exit[0] == other.exit[0])
        events: dict[str, Any] = {"event_one": one.exit[differ], "event_other": other.exit[differ]}
        return Verdict(Agreement.EVENTS_DIFFER, kind, **about, **events)
    if times:
        pairs = common(one.series, other.series)
        if pairs:
            return _of_series(Kind.LOG_TIME, pairs, sides, about, level)
    return _of_energies(sides, about, level)


def verdict_of_shares(sides: Sides, source: int, level: float) -> Verdict | None:
    """Compare the shares of one state at common intensities, as ln of their odds; None without such."""
    one, other = sides
    about: dict[str, Any] = {"source": source, "target": None, "one": one.method, "other": other.method}
    pairs = [(odds(a), odds(b)) for a, b in common(one.series, other.series)]
    return _of_series(Kind.OCCUPANCY, pairs, sides, about, level) if pairs else None


def common(one: Sequence[Quantity], other: Sequence[Quantity]) -> list[tuple[Quantity, Quantity]]:
    """Return the pairs of quantities at one intensity."""
    return [(a, b) for a in one for b in other if math.isclose(a.intensity, b.intensity, rel_tol=_LEAST_ERROR)]


def odds(share: Quantity) -> Quantity:
    """Return ln of the odds of a share, with its interval."""
    with np.errstate(divide="ignore"):
        ends: dict[str, Any] = {
            name: float(np.log(getattr(share, name)) - np.log1p(-getattr(share, name)))
            for name in ("value", "lower", "upper")
        }
    return dataclasses.replace(share, **ends)


def _of_series(kind: Kind, pairs: Sequence[tuple[Quantity, Quantity]], sides: Sides, about: dict[str, Any],
               level: float) -> Verdict:  # fmt: skip
    states = [pair for pair in pairs if pair[0].metastable and pair[1].metastable]
    if not states:
        return _not_metastable(kind, [each for pair in pairs for each in pair], about)
    known = [pair for pair in states if pair[0].resolved and pair[1].resolved]
    if not known:
        return _unresolved(kind, sides, about, [all(p[n].resolved for p in states) for n in (0, 1)])
    return _tested(kind, known, sides, about, level)


def _of_energies(sides: Sides, about: dict[str, Any], level: float) -> Verdict | None:
    one, other = sides
    if one.energy is None and other.energy is None:
        return None
    for side in (one, other):
        if side.series and sum(each.metastable for each in side.series) < min(2, len(side.series)):
            return _not_metastable(Kind.ENERGY, side.series, about)
    if one.energy is None or other.energy is None or not (one.energy.resolved and other.energy.resolved):
        return _unresolved(
            Kind.ENERGY, sides, about, [s.energy is not None and s.energy.resolved for s in (one, other)]
        )
    found = _tested(Kind.ENERGY, [(one.energy, other.energy)], sides, about, level)
    if abs(found.deviation) > DEVIATIONS:
        for rated, fixed in ((other, one), (one, other)):
            slopes = () if fixed.series else _drift(rated, fixed)
            if slopes and fixed.energy is not None:
                return dataclasses.replace(
                    found,
                    code=Agreement.ARRHENIUS_NOT_REACHED,
                    one=fixed.method,
                    other=rated.method,
                    deviation=found.deviation if rated is other else -found.deviation,
                    first=slopes[0],
                    last=slopes[1],
                    energy=fixed.energy.value,
                    less_certain=rated.method,
                    remedy="lower the noise intensities",
                )
    return found


def _drift(rated: Side, fixed: Side) -> tuple[float, ...]:
    """First and last slope, if they drift towards an energy as D falls, far enough to reach it; otherwise nothing.

    The drift is tested by the curvature of ln τ over 1/D, one-sided at 5 %, because its direction is given. A fit with
    a prefactor that is a power of D estimates the remaining drift. Terms of higher order are not known, so twice this
    drift is allowed, as in the error of the density's limit.
    """
    fit = fit_of([each for each in rated.series if each.metastable and each.resolved])
    if fit is None or not math.isfinite(fit.limit) or rated.energy is None or fixed.energy is None:
        return ()
    missing, explained = fixed.energy.value - rated.energy.value, fit.limit - fit.slope
    towards = math.copysign(1.0, missing)
    reach = 2.0 * towards * explained + DEVIATIONS * math.hypot(fit.limit_error, fixed.energy.error)
    drifts = towards * fit.curvature > 1.645 * fit.curvature_error  # a normal error exceeds it in 5 % of all cases
    slopes, _ = fit.local_slopes
    reached = drifts and towards * explained > 0 and abs(missing) <= reach
    return (float(slopes[0]), float(slopes[-1])) if reached else ()


def _tested(kind: Kind, pairs: Sequence[tuple[Quantity, Quantity]], sides: Sides, about: dict[str, Any],
            level: float) -> Verdict:  # fmt: skip
    """Test whether the differences are as large as the combined errors let expect, at a level."""
    errors = [_combined(*pair) for pair in pairs]
    deviations = np.array([(a.value - b.value) / error for (a, b), error in zip(pairs, errors, strict=True)])
    statistic = float(deviations @ deviations)
    p_value = float(stats.chi2.sf(statistic, len(pairs)))
    largest, best = int(np.argmax(np.abs(deviations))), int(np.argmin(errors))
    wider = [float(np.mean([pair[n].error for pair in pairs])) for n in (0, 1)]
    less = sides[int(wider[1] > wider[0])]
    scale = min(abs(each.value) for each in pairs[best]) if kind is Kind.ENERGY else 1.0
    code = Agreement.UNDER_RESOLVED if errors[best] >= scale > 0 else Agreement.AGREE
    return Verdict(
        Agreement.DISAGREE if p_value < level else code,
        kind, **about, statistic=statistic, terms=len(pairs), p_value=p_value, deviation=float(deviations[largest]),
        intensity=pairs[largest][0].intensity, error=errors[best], less_certain=less.method, remedy=less.remedy,
    )  # fmt: skip


def _combined(one: Quantity, other: Quantity) -> float:
    """Combined standard error of a difference, from the ends of the intervals that face one another."""
    low, high = sorted((one, other), key=lambda each: each.value)
    facing = math.hypot(high.below, low.above) / DEVIATIONS
    return max(facing, _LEAST_ERROR * max(abs(one.value), abs(other.value)), float(np.finfo(float).tiny))


def _not_metastable(kind: Kind, quantities: Sequence[Quantity], about: dict[str, Any]) -> Verdict:
    relaxations = [q.relaxations for q in quantities if q.relaxations < METASTABLE]
    shares = [q.core_share for q in quantities if q.core_share < HELD]
    return Verdict(
        Agreement.NOT_METASTABLE, kind, **about,
        relaxations=max(relaxations, default=math.nan), core_share=max(shares, default=math.nan),
    )  # fmt: skip


def _unresolved(kind: Kind, sides: Sides, about: dict[str, Any], known: Sequence[bool]) -> Verdict:
    less = sides[0] if not known[0] else sides[1]
    few = kind is Kind.ENERGY and 0 < len(less.series) < ENOUGH
    remedy = "add noise intensities" if few else less.remedy
    return Verdict(Agreement.UNDER_RESOLVED, kind, **about, less_certain=less.method, remedy=remedy)
