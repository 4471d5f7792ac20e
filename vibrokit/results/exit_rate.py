"""ExitRate: how often an attractor is left at one noise intensity."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class ExitRate:
    """Rate of exits from an attractor at a finite noise intensity.

    Attributes
    ----------
    source, target : int
        Labels of the attractor that is left and of the one that is reached; −1 for an exit that is no attractor.
    intensity : float
        D (m² s⁻³).
    value : float
        Exits per unit of time (s⁻¹) while the density that has not left keeps its shape.
    lower, upper : float
        Error estimate of the method.
    event : str
        What counts: ``"commitment"``, the first state on the section in the core of another attractor, or
        ``"contact"``, the first time at which position and velocity satisfy the exit condition.
    method : str
    """

    source: int
    target: int
    intensity: float
    value: float
    lower: float
    upper: float
    event: str
    method: str

    @property
    def mean_time(self) -> float:
        """Mean exit time (s), if there is no other exit."""
        return 1.0 / self.value
