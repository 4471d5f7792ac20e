"""From the power spectral density that an engineer has to the intensity of the noise."""

from __future__ import annotations

import dataclasses
from enum import StrEnum
from typing import Any

from vibrokit.errors import ParameterError, shown
from vibrokit.parts.parameter import Parameter
from vibrokit.quantity import per_mass

_MASS = Parameter("mass", "mass", "m", "kg", above=0)
_LEVEL = Parameter("level", "level", "S", "m^2 s^-4 Hz^-1", minimum=0)


class Measured(StrEnum):
    """What a power spectral density was measured of."""

    ACCELERATION = "acceleration"
    """The random force per unit mass, (m/s²)²/Hz."""
    FORCE = "force"
    """The random force on the mass, N²/Hz."""
    BASE_ACCELERATION = "base acceleration"
    """The support that the displacement is counted from, (m/s²)²/Hz: its inertial force per unit mass is −a."""


def intensity_of(owner: str, level: Any, of: Any, mass: Any) -> float:
    """Return the intensity D = S/2 (m² s⁻³) of white noise with a one-sided density S; that of a force, S/(2m²).

    The two-sided density of ξ over the frequency in Hz is the Fourier transform of D δ(τ), which is D. The one-sided
    density is twice that (Bendat and Piersol, *Random Data*).

    Raises
    ------
    ParameterError
        A number is out of range, `of` is no `Measured`, or a mass is missing or has no use.
    """
    if of not in tuple(Measured):
        allowed = ", ".join(repr(one.value) for one in Measured)
        raise ParameterError(f"{owner}: of must be one of {allowed}, got {shown(of)}.")
    if Measured(of) is not Measured.FORCE:
        if mass is not None:
            raise ParameterError(
                f"{owner}: mass is for the density of a force, got {shown(mass)} with of={str(of)!r}; leave it out."
            )
        return _LEVEL.known(owner, level) / 2
    if mass is None:
        raise ParameterError(
            f"{owner}: the density of a force, in N²/Hz, needs the mass that it acts on; give mass= in kg."
        )
    of_force = dataclasses.replace(_LEVEL, unit="kg^2 m^2 s^-4 Hz^-1")
    return per_mass(of_force.known(owner, level), _MASS.known(owner, mass), 2) / 2
