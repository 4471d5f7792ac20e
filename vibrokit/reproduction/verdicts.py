"""Our numbers beside the published ones, and verdicts: whether a published number is met, and if not, why."""

from __future__ import annotations

import dataclasses
import math

from vibrokit.comparison.quantities import DEVIATIONS
from vibrokit.comparison.stationary import StationaryDensity
from vibrokit.errors import StructureError
from vibrokit.reproduction.published import STATES, Method, Published, paper, published_energies, target_of
from vibrokit.reproduction.steps import METHODS, Records
from vibrokit.results.arrhenius import ArrheniusFit
from vibrokit.results.codes import Sentenced
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.one_scene import merged
from vibrokit.results.rated import RatedResult
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.sgcm import SGCMResult

_SAMPLES = 1e9  # the states of a simulation that fills a histogram, at most


class Match(Sentenced):
    """Whether a published number is met; its sentence has the fields of a `Verdict`."""

    MET = "met", "It lies within the interval."
    RING = (
        "ring",
        "A certified path costs {below:.0%} less. Starts on one circle at one phase miss the cheapest path; the circle "
        "of the paper gives {beside:.4g} here.",
    )
    TAILS = (
        "sampled-tails",
        "At this noise, {depth:.3g} = ΔU/D; the density at the saddle is below a part in {samples:.0e} of its maximum, "
        "which no simulation samples.",
    )
    REGIME = (
        "regime-not-reached",
        "It is a number at finite noise. Here the same method gives {beside:.4g} at that noise, and {certified:.4g} in "
        "the limit.",
    )
    NOT_MET = "not-met", "It lies outside the interval."
    UNKNOWN = "unknown", "There is no number of our own: {missing}"


@dataclasses.dataclass(frozen=True)
class Verdict:
    """A published number beside our own (m² s⁻³)."""

    published: Published
    value: float  # our number by the same method, and its interval
    lower: float
    upper: float
    certified: float  # activation energy with the strongest bounds
    match: Match
    beside: float = math.nan  # what explains the difference, see `Match`
    depth: float = math.nan  # ΔU/D at the noise of the published number, where it matters
    missing: str = ""  # why there is no number of our own

    @property
    def sentence(self) -> str:
        """Why the number is met or not."""
        return self.match.sentence.format(
            below=1 - self.certified / self.published.value, samples=_SAMPLES, **vars(self)
        )


def unknown(one: Published, missing: str) -> Verdict:
    """Return that nothing of our own can be compared, and why."""
    return Verdict(one, math.nan, math.nan, math.nan, math.nan, Match.UNKNOWN, missing=missing)


def _within(one: Published, lower: float, upper: float) -> bool:
    return lower - one.half_digit <= one.value <= upper + one.half_digit


def of_action_plot(one: Published, lower: float, upper: float, ring: float) -> Verdict:
    """Compare an action with certified bounds; `ring` is our own action by starts on the paper's circle."""
    if _within(one, lower, upper):
        match = Match.MET
    else:
        match = Match.RING if one.value > upper and ring > upper else Match.NOT_MET
    return Verdict(one, upper, lower, upper, upper, match, beside=ring)


def of_density(one: Published, value: float, error: float, certified: float, intensity: float) -> Verdict:
    """Compare a barrier of the density with our own at the same noise intensity."""
    if not error < value:
        return unknown(one, f"{value:.3g} has an error of {error:.2g}, which more nodes reduce.")
    depth = certified / intensity
    if _within(one, value - error, value + error):
        match = Match.MET
    elif depth > math.log(_SAMPLES):
        match = Match.TAILS
    else:
        match = Match.NOT_MET
    return Verdict(one, value, value - error, value + error, certified, match, depth=depth)


def of_exit_times(one: Published, slope: float, error: float, certified: float) -> Verdict:
    """Compare a slope of ln τ with our own; the slope at finite noise need not be that of the limit."""
    if _within(one, slope - error, slope + error):
        match = Match.MET
    elif abs(slope - certified) > error and (one.value - certified) * (slope - certified) > 0:
        match = Match.REGIME
    else:
        match = Match.NOT_MET
    return Verdict(one, slope, slope - error, slope + error, certified, match, beside=slope)


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
            error = intensity * max(rate.log_error for rate in density.rates)  # ln ρ is the sum of both states' parts
            return of_density(one, value, error, energy.value, intensity)
        case Method.EXIT_TIMES if isinstance(times, RatedResult):
            fit = total_fit(times, energy)
            return of_exit_times(one, fit.slope, DEVIATIONS * fit.slope_error, energy.value)
    return None


def of_both(known: dict[str, Record], method: str) -> Result | None:
    """Return what a method found for both states, as one result; None if one is missing."""
    found = [one for state in STATES if isinstance(one := known.get(f"{method}-{state}"), Result)]
    return merged(found) if len(found) == len(STATES) else None


def total_fit(times: RatedResult, energy: ActivationEnergy) -> ArrheniusFit:
    """Return the Arrhenius law of leaving a state for any target: the paper counts every exit."""
    own = [rate for rate in times.rates if rate.source == energy.source]
    at = dict.fromkeys(rate.intensity for rate in own)
    return ArrheniusFit.of([ExitRate.total([rate for rate in own if rate.intensity == one]) for one in at])


def _value(result: Result, source: str, target: str | None) -> float:
    try:
        return result.energy(source, target).value
    except StructureError:
        return math.nan
