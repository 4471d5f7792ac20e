"""A periodic force as a finite Fourier series, given or of a measured record."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from vibrokit.errors import ParameterError, shown
from vibrokit.parts.excitation import Excitation
from vibrokit.parts.functions import cos, sin
from vibrokit.parts.named_constants import NamedConstants
from vibrokit.parts.parameter import Parameter, parameter

if TYPE_CHECKING:
    from vibrokit.measured.fourier import PeriodicEstimate

_PERIOD = Parameter("period", "period", "T", "s", above=0)
_NAME = re.compile(r"([cs])_([1-9]\d?|100)")


class Periodic(NamedConstants, Excitation):
    """Periodic force: the Fourier series c_0 + Σ_k (c_k cos kωt + s_k sin kωt).

    Parameters
    ----------
    frequency : float
        ω, in rad s⁻¹, positive.
    mean : float
        c_0, in m s⁻².
    **coefficients : float
        ``c_1``, ``s_1``, ``c_2``, … up to ``s_100``, in m s⁻², one or more; those not given are 0.

    Examples
    --------
    >>> Periodic(frequency=0.57, c_1=0.18, s_3=0.02)
    Periodic(frequency=0.57, mean=0.0, c_1=0.18, s_3=0.02)
    """

    frequency: float = parameter("omega", "rad s^-1", above=0)
    mean: float = parameter("c_0", "m s^-2")
    constants: tuple[tuple[str, Any], ...]

    def __init__(self, frequency: float, mean: float = 0.0, **coefficients: float) -> None:
        for declared, value in zip(self._own(), (frequency, mean), strict=True):
            object.__setattr__(self, declared.attribute, declared.checked("Periodic", value))
        places = {name: _place(name) for name in coefficients}
        if not places:
            raise ParameterError("Periodic: no coefficient is given; give one or more of c_1, s_1, c_2, ... to s_100.")
        ordered = sorted(coefficients.items(), key=lambda pair: (places[pair[0]], pair[0]))
        checked = tuple((name, self._constant(name).checked("Periodic", value)) for name, value in ordered)
        object.__setattr__(self, "constants", checked)

    def _constant(self, name: str) -> Parameter:
        return Parameter(name, name, name, "m s^-2")

    @classmethod
    def from_samples(cls, t: Any, f: Any, error: float = 0.01, period: float | None = None) -> PeriodicEstimate:
        """Return the shortest Fourier series of a measured force, by least squares, with its error.

        Parameters
        ----------
        t : array
            Times of the samples (s), rising, equally spaced or not, of a whole number of periods.
        f : array
            Force per unit mass (m s⁻²).
        error : float, optional
            Root mean square of what may be left out, as a part of that of the force about its mean.
        period : float, optional
            Period (s). By default the record is one period, and its last sample begins the next.

        Returns
        -------
        PeriodicEstimate

        Raises
        ------
        ParameterError
            There are fewer than eight samples, they are no whole number of periods, the ends do not match, or as many
            harmonics as the samples resolve leave out more.
        """
        from vibrokit.measured.fourier import fitted_series

        length = None if period is None else _PERIOD.known("Periodic", period)
        return fitted_series(cls, t, f, error, length)

    def force(self, t: Any) -> Any:
        """Force at time t: the series."""
        return self.mean + sum(
            value * (cos if name[0] == "c" else sin)(_place(name) * self.frequency * t)
            for name, value in self.constants
        )

    @property
    def period(self) -> float:
        """Period 2π/ω (s)."""
        return 2 * math.pi / self.frequency

    @property
    def frequencies(self) -> tuple[float, ...]:
        """The frequencies kω (s⁻¹) of the harmonics."""
        return tuple(sorted({_place(name) * self.frequency for name, _ in self.constants}))


def _place(name: str) -> int:
    """Which harmonic a coefficient is of."""
    found = _NAME.fullmatch(name)
    if found is None:
        raise ParameterError(f"Periodic: coefficients are c_1, s_1, c_2, ... to s_100, got {shown(name)}.")
    return int(found[2])
