"""Attractor: one steady state of the noise-free system."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vibrokit.results.survival import Survival


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Attractor:
    """A steady state.

    Attributes
    ----------
    label : int
        Its index among the attractors of a structure, and its label in the basin grid.
    kind : str
        ``"periodic"``, ``"quasiperiodic"``, ``"chaotic"``, ``"equilibrium"`` or ``"limit cycle"``.
    period : int
        In forcing periods; 0 for motion that never repeats, 1 for an equilibrium or a limit cycle.
    duration : float
        Time after which it repeats (s); 0 for an equilibrium, NaN for motion that never does.
    points : array (count, n)
        Its points on the section, in the order in which they are visited: one for each forcing period of an orbit, the
        turning point of greatest x of a limit cycle, a long sample of motion that never repeats.
    orbit : array (samples, 2)
        (x, v) along the whole orbit at equal time steps, its start repeated at the end; for motion that never repeats,
        along some periods of it.
    multipliers : complex array (n,)
        Eigenvalues of the map over one period of the orbit; of the flow over 2π/ω_n for an equilibrium; empty for
        motion that never repeats.
    exponents : complex array
        Rates (s⁻¹) at which deviations grow: eigenvalues at an equilibrium, log(multipliers)/duration for an orbit, the
        largest Lyapunov exponent for motion that never repeats.
    exponent_error : float
        Standard error of a Lyapunov exponent (s⁻¹); 0 for the others.
    hits : dict of str to float
        Hits of each stop (``"left"``, ``"right"``) per orbit; for motion that never repeats, per forcing period on
        average.
    peak_depth, peak_force : dict of str to float
        Largest depth past each stop (m), and the largest push of each (m s⁻²).
    basin_fraction : float
        Share of the region's cells that lead to it.
    basin_fraction_error : float
        Its standard error, if the cells are taken as independent draws.
    residual : float
        Distance between the first point and its image after one period of the orbit; NaN for motion that never repeats.
    error : float
        Change of the first point when the integration is tightened; NaN for motion that never repeats.
    survival : tuple of Survival
        For motion that never repeats: the evidence that it lasts, at two accuracies of integration.
    name : str
        Short name from what it does, such as ``"clear"`` or ``"hammering"``; distinct among the attractors of a
        structure.
    """

    label: int
    kind: str
    period: int
    duration: float
    points: NDArray[np.float64]
    orbit: NDArray[np.float64]
    multipliers: NDArray[np.complex128]
    exponents: NDArray[np.complex128]
    exponent_error: float
    hits: Mapping[str, float]
    peak_depth: Mapping[str, float]
    peak_force: Mapping[str, float]
    basin_fraction: float
    basin_fraction_error: float
    residual: float
    error: float
    survival: tuple[Survival, ...] = ()
    name: str = ""

    @property
    def impacts(self) -> float:
        """Stop hits per orbit, of all stops together; for motion that never repeats, per forcing period on average."""
        return sum(self.hits.values())

    @property
    def extent(self) -> NDArray[np.float64]:
        """Array (2, 2): least and largest x, least and largest v along the orbit."""
        return np.stack([self.orbit.min(axis=0), self.orbit.max(axis=0)], axis=1)

    @property
    def repeats(self) -> bool:
        """Whether it is an orbit or an equilibrium: points, multipliers and residual are those of one."""
        return self.kind in ("periodic", "equilibrium", "limit cycle")

    @property
    def is_fixed(self) -> bool:
        """Whether its points are fixed points of a power of the section map.

        This holds for periodic orbits and equilibria; a limit cycle may be shifted in time.
        """
        return self.kind in ("periodic", "equilibrium")

    @property
    def description(self) -> tuple[str, ...]:
        """What it is, as short texts: kind, period, stop hits, basin fraction."""
        return (
            self.kind,
            f"period {self.period}" if self.repeats else "never repeats",
            f"{self.impacts:.4g} stop hits",
            f"basin fraction {self.basin_fraction:.4f} ± {self.basin_fraction_error:.1g}",
        )

    def __repr__(self) -> str:
        return f"Attractor {self.label} {self.name!r}: {', '.join(self.description)}"
