"""The Fourier series of a measured force, by least squares."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.arguments import real
from vibrokit.construction import called
from vibrokit.errors import ParameterError, counted, shown
from vibrokit.measured.record import checked_samples

MOST_HARMONICS = 100
_FEWEST = 8  # samples
_TRIED = (8, 32, MOST_HARMONICS)  # few harmonics cost little
_SURPLUS = 2  # samples for each coefficient
_LARGEST_STEP = 2.0  # from the last sample to the first, in the largest step between neighbours
_ROUNDING = 1e-6  # of a step, of times that are printed with few digits

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class PeriodicEstimate:
    """The periodic force of a measured record, with its error.

    Attributes
    ----------
    excitation : Periodic
        The Fourier series.
    harmonics : int
        How many it has.
    left_out : float
        Root mean square of what the series leaves out, divided by that of the force about its mean.
    rms_error : float
        The same in m s⁻²; degrees of freedom that the coefficients take are counted.
    coefficient_error : float
        Standard error of each coefficient (m s⁻²), if what is left out is noise.
    samples, periods : int
        Size of the record.
    """

    excitation: Any
    harmonics: int
    left_out: float
    rms_error: float
    coefficient_error: float
    samples: int
    periods: int

    def __str__(self) -> str:
        """One line, for people."""
        record = f"{self.samples} samples in {counted(self.periods, 'period')}"
        return (
            f"{counted(self.harmonics, 'harmonic')} of {self.excitation.frequency:.6g} rad/s from {record}: "
            f"{100 * self.left_out:.2g} % of the variation is left out ({self.rms_error:.2g} m/s² rms), and "
            f"coefficients are within {self.coefficient_error:.2g} m/s²."
        )


@dataclasses.dataclass(frozen=True, eq=False)
class _Record:
    times: Array
    force: Array
    period: float
    periods: int

    @property
    def most(self) -> int:
        """Harmonics that the samples resolve: two samples in each wave, and more samples than coefficients."""
        phases = np.sort(np.mod(self.times - self.times[0], self.period))
        phases = phases[phases < self.period * (1 - _ROUNDING)]
        gap = np.diff(phases, append=self.period).max()
        return min(
            MOST_HARMONICS, math.ceil(self.period / (2 * gap) - _ROUNDING) - 1, (len(self.times) // _SURPLUS - 1) // 2
        )

    def columns(self, harmonics: int) -> Array:
        """1, cos ωt, sin ωt, cos 2ωt, …"""
        angles = np.outer(2 * math.pi / self.period * self.times, np.arange(1, harmonics + 1))
        waves = np.stack([np.cos(angles), np.sin(angles)], axis=2).reshape(len(self.times), -1)
        return np.hstack([np.ones((len(self.times), 1)), waves])


@called
def fitted_series(make: Callable[..., Any], t: Any, f: Any, error: Any, period: float | None) -> PeriodicEstimate:
    """Return the shortest series that leaves out at most `error` of a record; raises ParameterError if none does.

    `make` makes the excitation of its frequency, its mean, and the coefficients by name.
    """
    allowed = real(error)
    if not 1e-6 <= allowed <= 0.5:
        raise ParameterError(f"Periodic: error must be a number from 1e-06 to 0.5, got {shown(error)}.")
    record = _record(t, f, period)
    most, count, size = record.most, len(record.times), float(record.force.std())
    if most < 1:
        raise ParameterError(
            f"Periodic: {count} samples are too few for a period of {record.period:.6g} s; give {_FEWEST} or more, at "
            "most an eighth of the period apart."
        )
    for top in sorted({min(one, most) for one in _TRIED}):
        basis, triangle = np.linalg.qr(record.columns(top))
        shares = basis.T @ record.force
        rest = np.maximum(0.0, record.force @ record.force - np.cumsum(shares**2)[2::2])
        errors = np.sqrt(rest / (count - 2 * np.arange(1, top + 1) - 1))
        enough = np.flatnonzero(errors <= allowed * size)
        if enough.size:
            harmonics = int(enough[0]) + 1
            size_of = slice(0, 2 * harmonics + 1)
            mean, *waves = np.linalg.solve(triangle[size_of, size_of], shares[size_of]).tolist()
            named = {f"{'cs'[place % 2]}_{place // 2 + 1}": value for place, value in enumerate(waves)}
            left = float(errors[harmonics - 1])
            excitation = make(2 * math.pi / record.period, mean, **named)
            deviation = left * math.sqrt(2 / count)
            return PeriodicEstimate(excitation, harmonics, left / size, left, deviation, count, record.periods)
    left = errors[-1] / size
    raise ParameterError(
        f"Periodic: {counted(most, 'harmonic')}, as many as {count} samples allow, leave out {left:.2g} of the "
        f"variation, more than error = {allowed:g}; check the period, {record.period:.6g} s, or allow a larger error."
    )


def _record(t: Any, f: Any, period: float | None) -> _Record:
    times, force = _checked(t, f)
    steps, span = np.diff(times), float(times[-1] - times[0])
    if period is None:
        length, periods = span, 1
    else:
        length = float(period)
        periods = max(1, round(span / length))
        if abs(periods * length - span) > (1 + _ROUNDING) * steps.max():
            raise ParameterError(
                f"Periodic: the record of {span:.6g} s is no whole number of periods of {length:.6g} s, but "
                f"{span / length:.4g} of them; cut it, or give its own period."
            )
    largest, closing = float(np.abs(np.diff(force)).max()), abs(float(force[0] - force[-1]))
    if largest == 0.0:
        raise ParameterError(f"Periodic: the force is {force[0]:g} at all times; give Constant({force[0]:g}).")
    if closing > _LARGEST_STEP * largest:
        raise ParameterError(
            f"Periodic: the ends do not match: the force would change by {closing:.3g} from the end of a period of "
            f"{length:.6g} s to the next, and changes by at most {largest:.3g} between other samples; give period=, or "
            "begin the record elsewhere."
        )
    return _Record(times, force, length, periods)


def _checked(t: Any, f: Any) -> tuple[Array, Array]:
    times, force = checked_samples("Periodic", t, f, _FEWEST)
    back = np.flatnonzero(np.diff(times) <= 0)
    if back.size:
        earlier, later = times[back[0] : back[0] + 2]
        raise ParameterError(f"Periodic: times must rise, got {later:g} after {earlier:g}; sort the samples by time.")
    return times, force
