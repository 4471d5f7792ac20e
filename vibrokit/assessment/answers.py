"""Answers: mean times, probabilities and noise intensities, each with its 95 % interval and the methods behind it."""

from __future__ import annotations

import dataclasses
import math

from vibrokit.assessment.durations import interval_text
from vibrokit.comparison.mean_times import LogTime
from vibrokit.results.rated import METASTABLE
from vibrokit.text_table import power_text


@dataclasses.dataclass(frozen=True, kw_only=True)
class Answer:
    """A number with its interval.

    Attributes
    ----------
    question : str
        What was asked, such as ``"mean time until clear is left"``.
    value, lower, upper : float
        The number and its 95 % interval, in SI units.
    unit : str
    intensity : float
        Noise intensity D that it is for (m² s⁻³).
    methods : tuple of str
        The methods behind it: the one with the narrowest interval first, then those whose intervals do not overlap that
        one. The interval of the answer contains theirs.
    extrapolated : bool
        Whether D lies outside the intensities at which rates were computed.
    """

    question: str
    value: float
    lower: float
    upper: float
    unit: str
    intensity: float
    methods: tuple[str, ...]
    extrapolated: bool

    @property
    def number(self) -> str:
        """The number with its interval and unit, as text."""
        return f"{self.value:.3g} ({self.lower:.3g} to {self.upper:.3g}) {self.unit}".strip()

    def __str__(self) -> str:
        support = " and ".join(self.methods)
        return f"{self.question}: {self.number}, by {support}{', extrapolated' if self.extrapolated else ''}."


@dataclasses.dataclass(frozen=True, kw_only=True)
class MeanTime(Answer):
    """A mean time, which may be too long for a floating-point number.

    Attributes
    ----------
    log_value, log_lower, log_upper : float
        ln of the time in s and its 95 % interval.
    period : float
        Forcing period, or 2π/ω_n without forcing (s).
    metastable : bool
        Whether the mean time is at least ten relaxation times of the state; true where the relaxation time is unknown.
    """

    log_value: float
    log_lower: float
    log_upper: float
    period: float
    metastable: bool

    @classmethod
    def of(cls, question: str, time: LogTime, period: float, relaxation: float) -> MeanTime:
        """Make it of ln of a time, the period and the relaxation time of the state (s; NaN where not known)."""
        return cls(
            question=question, value=exponential(time.value), lower=exponential(time.lower),
            upper=exponential(time.upper), unit="s", intensity=time.intensity, methods=time.methods,
            extrapolated=time.extrapolated, log_value=time.value, log_lower=time.lower, log_upper=time.upper,
            period=period, metastable=not (relaxation > 0 and time.value < math.log(METASTABLE * relaxation)),
        )  # fmt: skip

    @property
    def number(self) -> str:
        """The time with its interval in the unit that reads best, and as a number of periods where that is readable."""
        text = interval_text(self.log_value, self.log_lower, self.log_upper)
        periods = self.log_value - math.log(self.period)
        return f"{text}, {power_text(periods)} periods" if periods < math.log(1e6) else text


@dataclasses.dataclass(frozen=True, kw_only=True)
class AllowedIntensity(Answer):
    """The largest noise intensity at which a state lasts a given mean time.

    Attributes
    ----------
    psd_ratio : float
        One-sided power spectral density of the acceleration at rest over D: 2 for white noise; NaN for coloured noise.
    given_unit : tuple of (str, float), optional
        Unit in which the scene gives its noise intensity, and D of that size (m² s⁻³); None for a number without one.
    """

    psd_ratio: float
    given_unit: tuple[str, float] | None = None

    @property
    def psd(self) -> tuple[float, float, float]:
        """One-sided power spectral density of the acceleration and its interval ((m/s²)²/Hz)."""
        return self.psd_ratio * self.value, self.psd_ratio * self.lower, self.psd_ratio * self.upper

    @property
    def number(self) -> str:
        """D, the spectral density that it stands for, and the same in the unit of the scene."""
        texts, (value, lower, upper) = [super().number], self.psd
        if not math.isnan(value):
            texts.append(f"a PSD of {value:.3g} ({lower:.3g} to {upper:.3g}) (m/s²)²/Hz")
        if self.given_unit is not None:
            unit, size = self.given_unit
            if not math.isclose(size * self.psd_ratio, 1.0, rel_tol=1e-9):  # another unit than that above
                value, lower, upper = self.value / size, self.lower / size, self.upper / size
                texts.append(f"which is {value:.3g} ({lower:.3g} to {upper:.3g}) {unit}")
        return ", ".join(texts)


def probability_within(time: float, leaving: LogTime, goal: LogTime, relaxation: float) -> tuple[float, float, float]:
    """Return the probability that a state is left for a target within a time (s), and its interval.

    `leaving` is the time until the state is left at all, `goal` the inverse of the rate to the target: the same if that
    is the only one, or any. The relaxation time (s) is NaN where it is not known.
    """
    delay = METASTABLE * relaxation if relaxation > 0 else 0.0

    def within(seconds: float, log_leaving: float, log_goal: float) -> float:
        gone = -math.expm1(-exponential(math.log(seconds) - log_leaving)) if seconds > 0 else 0.0
        return gone if goal is leaving else min(1.0, exponential(log_leaving - log_goal)) * gone

    # The mean time includes the delay: after it, motion leaves at the rate 1/(τ − delay).
    part = delay * exponential(-leaving.lower)
    soon = leaving.lower + (math.log1p(-part) if part < 1.0 else -math.inf)
    value = within(time, leaving.value, goal.value)
    return value, within(time - delay, leaving.upper, goal.upper), max(value, within(time, soon, goal.lower))


def exponential(logarithm: float) -> float:
    """Return exp of a logarithm; infinite where that is too large."""
    return math.exp(logarithm) if logarithm < 709.0 else math.inf
