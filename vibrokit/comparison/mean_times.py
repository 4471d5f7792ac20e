"""MeanTimes: mean exit times by one method; interpolated between computed noise intensities, extrapolated beyond."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq
from scipy.special import logsumexp

from vibrokit.documented import documented
from vibrokit.errors import StructureError
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.exit_rate import ExitRate

_SAME = 1e-9  # relative: intensities that differ by less are one

Array = NDArray[np.float64]


@documented
@dataclasses.dataclass(frozen=True)
class LogTime:
    """ln of a mean time in s at one noise intensity."""

    value: Annotated[float, "ln τ"]
    lower: Annotated[float, "lower end of its 95 % interval"]
    upper: Annotated[float, "upper end of its 95 % interval"]
    intensity: Annotated[float, "noise intensity D", "m2 s-3"]
    methods: Annotated[tuple[str, ...], "the method that gives it, then those that contradict it and are included"]
    extrapolated: Annotated[bool, "whether D lies outside the intensities at which rates were computed"]


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class MeanTimes:
    """ln of the mean time of one exit, or of leaving a state at all, by one method at several noise intensities."""

    method: Annotated[str, "method"]
    event: Annotated[str, "what counts as an exit, as in `ExitRate`"]
    intensities: Annotated[Array, "noise intensities D (m² s⁻³), descending"]
    log_times: Annotated[Array, "ln τ, τ in s"]
    lower: Annotated[Array, "lower ends of 95 % intervals"]
    upper: Annotated[Array, "upper ends of 95 % intervals"]

    @classmethod
    def of(cls, rates: Iterable[ExitRate], method: str) -> MeanTimes:
        """Return the mean times of rates of one state; rates to several targets at one intensity are added.

        Raises
        ------
        StructureError
            There is no rate, or the rates count different events.
        """
        groups: dict[float, list[ExitRate]] = {}
        for rate in sorted(rates, key=lambda rate: -rate.intensity):
            same = [known for known in groups if abs(math.log(known / rate.intensity)) < _SAME]
            groups.setdefault(same[0] if same else rate.intensity, []).append(rate)
        events = {rate.event for group in groups.values() for rate in group}
        if len(events) != 1:
            raise StructureError(f"mean times need rates of one event, got {', '.join(sorted(events)) or 'no rate'}.")
        sums = np.array([log_sum(group) for group in groups.values()])
        return cls(method, events.pop(), np.array(list(groups)), -sums[:, 0], -sums[:, 2], -sums[:, 1])

    def at(self, intensity: float, energy: ActivationEnergy | None = None) -> LogTime | None:
        """Return ln τ at a noise intensity; None where it is not known.

        Between computed intensities ln τ is interpolated in 1/D, monotonically where there are three or more. The
        interval also contains the difference from a straight line between neighbours. Beyond them, τ = C exp(ΔU/D) with
        C from the nearest intensity. There the interval contains the bounds of ΔU and a prefactor C that varies with a
        power of D. This power is the one that the last two intensities show, and at least 1.

        Parameters
        ----------
        intensity : float
            D (m² s⁻³).
        energy : ActivationEnergy, optional
            ΔU; without it, nothing is known beyond the computed intensities.
        """
        places, place = 1.0 / self.intensities, 1.0 / intensity
        nearest = int(np.argmin(np.abs(np.log(places / place))))
        if abs(math.log(places[nearest] / place)) < _SAME:
            value, lower, upper = (float(ends[nearest]) for ends in (self.log_times, self.lower, self.upper))
            return LogTime(value, lower, upper, intensity, (self.method,), extrapolated=False)
        if places[0] < place < places[-1]:
            return LogTime(*self._between(place), intensity, (self.method,), extrapolated=False)
        if energy is None:
            return None
        return LogTime(*self._beyond(nearest, place, energy), intensity, (self.method,), extrapolated=True)

    def _between(self, place: float) -> tuple[float, float, float]:
        places = 1.0 / self.intensities
        straight = float(np.interp(place, places, self.log_times))
        curved = float(PchipInterpolator(places, self.log_times)(place)) if len(places) > 2 else straight
        bend = abs(curved - straight)
        below, above = (
            float(np.interp(place, places, np.abs(ends - self.log_times))) for ends in (self.lower, self.upper)
        )
        return curved, curved - below - bend, curved + above + bend

    def _beyond(self, nearest: int, place: float, energy: ActivationEnergy) -> tuple[float, float, float]:
        from_here = 1.0 / float(self.intensities[nearest])
        far = place - from_here
        power = 1.0
        if len(self.intensities) > 1:
            ends = slice(0, 2) if nearest == 0 else slice(-2, None)
            (near, next_), (one, other) = 1.0 / self.intensities[ends], self.log_times[ends]
            power = max(power, abs((other - one - energy.value * (next_ - near)) / math.log(next_ / near)))
        drift = power * abs(math.log(place / from_here))
        less, more = sorted((far * energy.lower, far * energy.upper))
        value, lower, upper = (float(known[nearest]) for known in (self.log_times, self.lower, self.upper))
        return value + far * energy.value, lower + less - drift, upper + more + drift


def most_certain(
    known: Sequence[MeanTimes], intensity: float, energy: ActivationEnergy | None = None
) -> LogTime | None:
    """Return ln τ by the method with the narrowest interval; None where no method knows it.

    Methods that computed rates at D, or on both sides of it, precede those that extrapolate. If the interval of another
    method does not overlap the narrowest one, the methods disagree, and the interval is widened to contain both.
    """
    found = [one for times in known if (one := times.at(intensity, energy)) is not None]
    if not found:
        return None
    known_best = [one for one in found if not one.extrapolated] or found
    best = min(known_best, key=lambda one: one.upper - one.lower)
    others = [one for one in known_best if one.lower > best.upper or one.upper < best.lower]
    return dataclasses.replace(
        best,
        lower=min(one.lower for one in (best, *others)),
        upper=max(one.upper for one in (best, *others)),
        methods=tuple(method for one in (best, *others) for method in one.methods),
    )


def intensity_for(
    known: Sequence[MeanTimes], log_time: float, energy: ActivationEnergy | None = None
) -> tuple[LogTime, float, float] | None:
    """Return ln τ at the noise intensity at which it equals `log_time`, and bounds of that intensity.

    None if the methods and the energy give that mean time at no intensity. A bound that is not found is 0 or infinite.
    """

    def excess(log_intensity: float, end: str) -> float:
        found = most_certain(known, math.exp(log_intensity), energy)
        return math.nan if found is None else float(getattr(found, end)) - log_time

    def crossing(start: float, end: str, step: float) -> float | None:
        """ln of the nearest intensity from a start at which an end of the interval is `log_time`."""
        first = excess(start, end)
        for number in range(300):  # over thirteen decades
            low, high = start + number * step, start + (number + 1) * step
            if not excess(high, end) * first > 0:
                known_there = not math.isnan(excess(high, end))
                return float(brentq(excess, low, high, args=(end,))) if known_there else None
        return None

    step = 0.1  # in ln D: ln τ is smooth over 10 %
    computed = np.log(np.unique(np.concatenate([times.intensities for times in known])))
    start = float(computed[np.argmin([abs(excess(one, "value")) for one in computed])])
    value = crossing(start, "value", step if excess(start, "value") > 0 else -step)
    if value is None:
        return None
    found = most_certain(known, math.exp(value), energy)
    assert found is not None
    lower, upper = crossing(value, "lower", -step), crossing(value, "upper", step)
    return found, 0.0 if lower is None else math.exp(lower), math.inf if upper is None else math.exp(upper)


def log_sum(rates: Sequence[ExitRate]) -> tuple[float, float, float]:
    """Return ln of the sum of rates with independent errors, and its interval."""
    logs = np.array([rate.log_value for rate in rates])
    total = float(logsumexp(logs))
    widths = np.array([[rate.log_value - rate.log_lower, rate.log_upper - rate.log_value] for rate in rates])
    halves = widths.mean(axis=1, keepdims=True)  # where an interval does not contain its value
    widths = np.where(widths.min(axis=1, keepdims=True) < 0, halves, widths)
    below, above = np.linalg.norm(np.exp(logs - total)[:, None] * widths, axis=0).tolist()
    return total, total - below, total + above
