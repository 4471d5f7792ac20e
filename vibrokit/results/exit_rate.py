"""ExitRate: how often an attractor is left at one noise intensity."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from vibrokit.construction import Constructed
from vibrokit.results.labels import exit_between

_DEVIATIONS = 2.0  # error estimates on each side of ln of a rate, as 95 % of normal errors


@dataclasses.dataclass(frozen=True)
class ExitRate(metaclass=Constructed):
    """Rate of exits from an attractor at a finite noise intensity.

    Attributes
    ----------
    source, target : int
        Labels of the attractor that is left and of the one that is reached; −1 for an exit that is no attractor, −2 for
        escape.
    intensity : float
        D (m² s⁻³).
    log_value : float
        ln of the rate in s⁻¹, which may be too small for a floating-point number.
    log_error : float
        Error estimate of it.
    log_lower, log_upper : float
        Interval of ``log_value``: the method's 95 % interval if it has one, otherwise two error estimates on each side.
    event : str
        What counts: ``"commitment"``, the first state on the section in the core of another attractor, or escape for
        good; ``"basin"``, the first one in another basin; or ``"contact"``, the first time at which position and
        velocity satisfy the exit condition.
    method : str
    """

    source: int
    target: int
    intensity: float
    log_value: float
    log_error: float
    event: str
    method: str
    log_lower: float = math.nan
    log_upper: float = math.nan

    def __post_init__(self) -> None:
        for name, side in (("log_lower", -_DEVIATIONS), ("log_upper", _DEVIATIONS)):
            if math.isnan(getattr(self, name)):
                object.__setattr__(self, name, self.log_value + side * self.log_error)

    @classmethod
    def total(cls, rates: Sequence[ExitRate]) -> ExitRate:
        """Return the rate of leaving an attractor at all, of its rates to each target at one noise intensity."""
        logs, errors = np.array([rate.log_value for rate in rates]), np.array([rate.log_error for rate in rates])
        total = float(np.logaddexp.reduce(logs))
        error = float(np.linalg.norm(np.exp(logs - total) * errors))
        return dataclasses.replace(rates[0], log_value=total, log_error=error, log_lower=math.nan, log_upper=math.nan)

    def exit_between(self, names: Sequence[str]) -> str:
        """Return the names of the attractors between which the exit leads: ``"hammering → clear"``."""
        return exit_between(names, self.source, self.target)

    @property
    def value(self) -> float:
        """The inverse of the mean time from the core of the attractor to the exit (s⁻¹), if there is no other exit."""
        return math.exp(self.log_value)

    @property
    def lower(self) -> float:
        """The rate less its error estimate (s⁻¹)."""
        return math.exp(self.log_value - self.log_error)

    @property
    def upper(self) -> float:
        """The rate with its error estimate added (s⁻¹)."""
        return math.exp(min(self.log_value + self.log_error, _LARGEST))

    @property
    def mean_time(self) -> float:
        """Mean exit time (s), if there is no other exit."""
        return math.exp(min(-self.log_value, _LARGEST))


_LARGEST = 709.0  # exponent of the largest floating-point number
