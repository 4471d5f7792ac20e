"""ExitRate: how often an attractor is left at one noise intensity."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np

from vibrokit.construction import Constructed
from vibrokit.documented import documented
from vibrokit.results.labels import exit_between

_DEVIATIONS = 2.0  # error estimates on each side of ln of a rate, as 95 % of normal errors


_EVENT = (
    '"commitment", the first state on the section in the core of another attractor, or escape for good; "basin", the '
    'first in another basin; "contact", the first time at which position and velocity satisfy the exit condition'
)


@documented
@dataclasses.dataclass(frozen=True)
class ExitRate(metaclass=Constructed):
    """Rate of exits from an attractor at a finite noise intensity."""

    source: Annotated[int, "label of the attractor that is left"]
    target: Annotated[int, "label of the attractor that is reached; −1 for another exit, −2 for escape"]
    intensity: Annotated[float, "noise intensity D", "m2 s-3"]
    log_value: Annotated[float, "ln of the rate in s⁻¹, which may be too small for a floating-point number"]
    log_error: Annotated[float, "error estimate of it"]
    event: Annotated[str, _EVENT]
    method: Annotated[str, "method"]
    log_lower: Annotated[float, "lower end of its 95 % interval; by default two error estimates below"] = math.nan
    log_upper: Annotated[float, "upper end of its 95 % interval; by default two error estimates above"] = math.nan

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
