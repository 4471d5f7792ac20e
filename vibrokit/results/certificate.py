"""Certificate: numerical evidence for an exit path."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Certificate:
    """Evidence for a polished exit path: how well it solves its equations, and how the action depends on the settings.

    Attributes
    ----------
    residual : float
        Largest misfit of the pieces and of both ends, relative to the size of what is matched.
    start_distance : float
        Distance in (x, v) between the path's first point and the attractor, where the linear end is joined.
    end_distance : float
        Distance in (x, v) between its last point and the saddle, along the saddle's stable manifold; 0 for a path that
        ends at first contact with a stop.
    periods : float
        Length of the path between its two ends, in forcing periods (2π/ω_n without forcing).
    by_start : float
        Change of the action when the start is ten times as far from the attractor (m² s⁻³).
    by_length : float
        Change when two periods are added at each end.
    by_stepper : float
        Change when the integration is tightened.
    transversality : float
        Sine of the angle at which the two manifolds meet along the path, from 0 (tangent: a flat valley) to 1.
    """

    residual: float
    start_distance: float
    end_distance: float
    periods: float
    by_start: float
    by_length: float
    by_stepper: float
    transversality: float

    @property
    def error(self) -> float:
        """Estimated error of the action (m² s⁻³): the changes, added."""
        return abs(self.by_start) + abs(self.by_length) + abs(self.by_stepper)
