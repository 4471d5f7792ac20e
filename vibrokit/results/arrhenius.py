"""The Arrhenius law ln τ = ln τ₀ + ΔU/D, fitted to exit rates at several noise intensities."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from vibrokit.documented import documented
from vibrokit.errors import StructureError
from vibrokit.results.exit_rate import ExitRate

ENOUGH = 3
"""Noise intensities, at least, that show how a prefactor depends on D, so that an energy has bounds."""

_DEVIATIONS = 1.96  # of the normal law, for intervals of 95 %

Array = NDArray[np.float64]


_SYSTEMATIC = (
    "how far the slope may be from ΔU because the prefactor depends on D: what a prefactor proportional to D or 1/D "
    "changes or, if that is more, one with the power of D that fits; infinite with two intensities"
)


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class ArrheniusFit:
    """A straight line through ln τ against 1/D, each point with the weight of its error; NaN where too few are."""

    slope: Annotated[float, "d ln τ/d(1/D); it tends to ΔU as D → 0", "m2 s-3"]
    slope_error: Annotated[float, "standard error of the slope", "m2 s-3"]
    log_prefactor: Annotated[float, "ln τ₀, τ₀ in s"]
    log_prefactor_error: Annotated[float, "standard error of ln τ₀"]
    intensities: Annotated[Array, "noise intensities D (m² s⁻³), descending"]
    log_times: Annotated[Array, "ln τ at each"]
    errors: Annotated[Array, "standard errors of ln τ"]
    curvature: Annotated[float, "curvature of ln τ against 1/D by a parabola through three or more", "m4 s-6"]
    curvature_error: Annotated[float, "standard error of the curvature", "m4 s-6"]
    systematic: Annotated[float, _SYSTEMATIC, "m2 s-3"]
    limit: Annotated[float, "slope at D = 0 if the prefactor is a power of D, fitted too", "m2 s-3"] = math.nan
    limit_error: Annotated[float, "standard error of that slope", "m2 s-3"] = math.nan

    @classmethod
    def of(cls, rates: Sequence[ExitRate]) -> ArrheniusFit:
        """Fit the rates of one exit; raises StructureError unless there are two intensities or more."""
        known = sorted(rates, key=lambda rate: -rate.intensity)
        intensities = np.array([rate.intensity for rate in known])
        if len(np.unique(intensities)) < 2 or len(np.unique(intensities)) < len(known):
            raise StructureError(
                "a fit needs the rates of one exit at two noise intensities or more, each once; the intensities are "
                f"{', '.join(f'{one:g}' for one in intensities) or 'none'}."
            )
        log_times = np.array([-rate.log_value for rate in known])
        errors = np.maximum([rate.log_error for rate in known], 1e-12)
        places, powers = 1 / intensities, np.log(intensities)
        line, spread = _fitted([places**0, places], log_times, errors)
        curvature, curvature_error = math.nan, math.nan
        systematic, limit, limit_error = math.inf, math.nan, math.nan
        if len(known) >= ENOUGH:
            parabola, around = _fitted([places**0, places, places**2], log_times, errors)
            curvature, curvature_error = 2 * float(parabola[2]), 2 * float(around[2])
            straight, straight_errors = _fitted([places**0, places, powers], log_times, errors)
            limit, limit_error = float(straight[1]), float(straight_errors[1])
            of_one = abs(float(_fitted([places**0, places], powers, errors)[0][1]))  # what the first power changes
            of_power = math.sqrt(max(limit_error**2 - float(spread[1]) ** 2, 0.0))  # without that of the slope
            systematic = max(of_one, _power_bound(limit - float(line[1]), of_power, of_one))
        return cls(
            float(line[1]), float(spread[1]), float(line[0]), float(spread[0]),
            intensities, log_times, errors, curvature, curvature_error, systematic,
            limit, limit_error,
        )  # fmt: skip

    @property
    def interval(self) -> tuple[float, float]:
        """An interval for ΔU (m² s⁻³): that of 95 % for the slope, and what a prefactor that depends on D changes."""
        error = _DEVIATIONS * self.slope_error + self.systematic
        return self.slope - error, self.slope + error

    @property
    def drifts(self) -> bool:
        """Whether the slope changes with D by more than its errors allow: then it is not yet ΔU."""
        return abs(self.curvature) > _DEVIATIONS * self.curvature_error

    @property
    def local_slopes(self) -> tuple[Array, Array]:
        """Slopes between neighbouring intensities, and their standard errors, shape (count − 1,)."""
        steps = np.diff(1 / self.intensities)
        return np.diff(self.log_times) / steps, np.hypot(self.errors[1:], self.errors[:-1]) / steps


def _power_bound(change: float, error: float, of_one: float) -> float:
    """Largest change of a slope by the power of D that its prefactor has, at 95 %.

    `change` and its standard error are what a fit of the power shows; `of_one` is what the first power changes. Where
    the rates do not show the power, it is taken as normal with the mean 0 and the standard deviation 1: Kramers' rate
    has −1 at weak damping and 0 elsewhere, and 1/2 if the force is periodic.
    """
    weight = of_one**2 / (of_one**2 + error**2)
    return abs(weight * change) + _DEVIATIONS * math.sqrt(weight) * error


def _fitted(terms: Sequence[Array], values: Array, errors: Array) -> tuple[Array, Array]:
    """Coefficients of a weighted sum of terms, and their standard errors from the known errors."""
    units = np.array([np.abs(term).max() for term in terms])
    inverse = np.linalg.pinv(np.stack(terms, axis=1) / units / errors[:, None])
    return inverse @ (values / errors) / units, np.linalg.norm(inverse, axis=1) / units
