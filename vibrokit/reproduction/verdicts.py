"""Verdicts: whether a published number is met, and if not, why."""

from __future__ import annotations

import dataclasses
import math

from vibrokit.reproduction.published import Published
from vibrokit.results.sentenced import Sentenced

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
