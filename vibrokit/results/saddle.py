"""Saddle: an unstable orbit."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import counted


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Saddle:
    """An unstable orbit; on the boundary of two basins, where its branches lead to different attractors.

    Attributes
    ----------
    kind : str
        ``"saddle"``, ``"flip saddle"`` (its unstable multiplier is negative), ``"repeller"`` (no stable direction), or
        ``"chaotic"`` for a chaotic set on the boundary.
    period : int
        In forcing periods; 0 for a chaotic set, 1 for an equilibrium or a limit cycle.
    duration : float
        Time after which it repeats (s); 0 for an equilibrium, NaN for a chaotic set.
    points : array (count, n)
        Its points on the section, in the order in which they are visited; a sample of a chaotic set.
    nodes : array (count, n)
        States along the orbit at equal times, the first point first. One is enough where motion from it comes back;
        there are more where it is so unstable that rounding errors carry motion away within its duration. Empty for a
        chaotic set.
    multipliers : complex array (n,)
        Eigenvalues of the map over one period of the orbit, the largest first, none above 1.8e308; of the flow over
        2π/ω_n for an equilibrium; empty for a chaotic set.
    exponents : complex array
        Rates (s⁻¹): eigenvalues at an equilibrium, log(multiplier)/duration for an orbit, the largest Lyapunov
        exponent for a chaotic set.
    leads_to : tuple of int
        Labels of the attractors that the two branches of the unstable direction reach, then of the others that a
        branch reaches which winds between basins; for a chaotic set, of the two basins between which it was found.
        Negative as in `Basins.labels` where a branch does not settle.
    residual : float
        Distance between the nodes and the images of those before them, in units of the scene's motions (a length and
        ω_n times it); NaN for a chaotic set.
    error : float
        How far the first point moves when the integration is tightened; NaN for a chaotic set.
    embedded : bool
        Whether it is one of the orbits inside a chaotic set, which is a saddle of its own.
    orbit : array (samples, 2)
        (x, v) along the whole orbit at equal time steps, its start repeated at the end; one point of an equilibrium,
        none of a chaotic set.
    """

    kind: str
    period: int
    duration: float
    points: NDArray[np.float64]
    nodes: NDArray[np.float64]
    multipliers: NDArray[np.complex128]
    exponents: NDArray[np.complex128]
    leads_to: tuple[int, ...]
    residual: float
    error: float
    embedded: bool = False
    orbit: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty((0, 2)))

    @property
    def on_boundary(self) -> bool:
        """Whether its branches lead to different attractors."""
        return len(set(self.leads_to)) > 1

    @property
    def displacement(self) -> float:
        """About how far its points lie from the exact orbit, in units of the scene's motions; NaN for a chaotic set.

        Motion beside an orbit grows from node to node, and the residual with it.
        """
        growth = float(np.abs(self.multipliers).max(initial=1.0))
        return float(self.residual / growth ** (1.0 / max(1, len(self.nodes))))

    @property
    def at_equal_times(self) -> NDArray[np.float64]:
        """Its nodes, or its points if these are more."""
        return max(self.nodes, self.points, key=len)

    def __repr__(self) -> str:
        points = counted(len(self.points), "point")
        return f"Saddle: {self.kind}, period {self.period}, {points}, leads to {self.leads_to}"
