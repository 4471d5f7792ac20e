"""Attractor: one steady state of the noise-free system, and how files hold it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import ResultFileError, counted
from vibrokit.results.arrays import Arrays
from vibrokit.results.fields import (
    PLANE,
    STATE,
    BySide,
    Field,
    Length,
    Number,
    Series,
    Spectrum,
    Variable,
    Vectors,
    Whole,
    Word,
)
from vibrokit.results.survival import Survival
from vibrokit.results.table import Table


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
        Its standard error, if the cells are taken as independent draws; above 0 where all cells lead to one attractor.
    residual : float
        Distance between the first point and its image after one period of the orbit, in units of the scene's motions (a
        length and ω_n times it); NaN for motion that never repeats.
    error : float
        Change of the first point when the integration is tightened; NaN for motion that never repeats.
    survival : tuple of Survival
        For motion that never repeats: the evidence that it lasts, at two accuracies of integration.
    turns : int
        Where the force of the spring repeats along x: by how many of its periods x advances in one orbit; 0 for motion
        that comes back.
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
    turns: int = 0

    @property
    def impacts(self) -> float:
        """Stop hits per orbit, of all stops together; for motion that never repeats, per forcing period on average."""
        return sum(self.hits.values())

    @property
    def extent(self) -> NDArray[np.float64]:
        """Array (2, 2): least and largest x, least and largest v along the orbit."""
        return np.stack([self.orbit.min(axis=0), self.orbit.max(axis=0)], axis=1)

    @property
    def growth(self) -> float:
        """Rate (s⁻¹) at which the fastest deviation grows: the largest Lyapunov exponent; negative if all decay."""
        return float(np.max(self.exponents.real))

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
            *([] if self.repeats else [f"Lyapunov exponent {self.growth:.3g} ± {self.exponent_error:.1g} s⁻¹"]),
            *([counted(self.turns, "turn")] if self.turns else []),
            f"{self.impacts:.4g} stop hits",
            f"basin fraction {self.basin_fraction:.4f} ± {self.basin_fraction_error:.1g}",
        )

    def __repr__(self) -> str:
        return f"Attractor {self.label} {self.name!r}: {', '.join(self.description)}"


ATTRACTOR_FIELDS: Mapping[str, Field] = {
    "label": Whole("label of the attractor"),
    "name": Word("name of the attractor"),
    "kind": Word("kind of the attractor", known=("periodic", "quasiperiodic", "chaotic", "equilibrium", "limit cycle")),
    "period": Whole("period in forcing periods; 0 for motion that never repeats"),
    "duration": Number("time after which the motion repeats; NaN for motion that never repeats", "s"),
    "points": Vectors(Length("visit", "points on the section"), STATE),
    "orbit": Vectors(Length("orbit_sample", "samples of the orbit"), PLANE),
    "multipliers": Spectrum(Length("multiplier", "multipliers"), "multiplier of the section map over one orbit"),
    "exponents": Spectrum(  # −∞ where a multiplier is 0
        Length("exponent", "exponents"), "rate at which deviations grow", "s-1", finite=False
    ),
    "exponent_error": Number("standard error of a Lyapunov exponent", "s-1"),
    "hits": BySide("hits of each stop per orbit; per forcing period for motion that never repeats"),
    "peak_depth": BySide("largest depth past each stop", "m"),
    "peak_force": BySide("largest push of each stop", "m s-2"),
    "basin_fraction": Number("share of the region's cells that lead to the attractor", "1", 0.0, 1.0),
    "basin_fraction_error": Number("standard error of the share", "1", 0.0, 1.0),
    "turns": Whole("periods of the spring's force by which x advances in one orbit", low=-(10**9)),
    "residual": Number("distance between the first point and its image after one orbit", "1"),
    "error": Number("change of the first point when the integration is tightened"),
}
SURVIVALS = Table(
    "survival",
    {
        "attractor": Whole("place of the attractor that it belongs to; -1 for the whole scene", low=-1),
        "stepper": Word("stepper of the integration"),
        "starts": Whole("number of starts"),
        "periods": Whole("forcing periods for which starts were followed"),
        "survivors": Whole("starts that had not settled by then"),
        "lifetime": Number("mean time until a start settles, in forcing periods"),
        "lifetime_error": Number("standard error of the lifetime, in forcing periods"),
        "settled_after": Series(
            Length("start", "starts"), "forcing periods until the start settled; -1 if it did not", whole=True, low=-1
        ),
    },
)


def attractor_variables(
    table: Table, attractors: Sequence[Attractor], others: Sequence[Survival] = ()
) -> dict[str, Variable]:
    """Return the arrays that hold attractors with their survivals, and other survivals that belong to none of them."""
    owned = [(place, one) for place, attractor in enumerate(attractors) for one in attractor.survival]
    owned += [(-1, one) for one in others]
    survivals = SURVIVALS.variables([one for _, one in owned], attractor=[place for place, _ in owned])
    return table.variables(attractors) | survivals


def read_attractors(arrays: Arrays, table: Table) -> tuple[tuple[Attractor, ...], tuple[Survival, ...]]:
    """Return attractors, each with its survivals, and the survivals that belong to none; raises ResultFileError."""
    attractors = [Attractor(**values) for values in table.read(arrays)]
    owned: dict[int, list[Survival]] = {}
    for values in SURVIVALS.read(arrays):
        owner, survival = values.pop("attractor"), Survival(**values)
        if not (survival.survivors <= survival.starts == len(survival.settled_after)):
            raise ResultFileError(
                f"a survival has {survival.starts} starts, {survival.survivors} survivors and "
                f"{len(survival.settled_after)} times, which contradict one another"
            )
        if owner >= len(attractors):
            raise ResultFileError(f"a survival belongs to attractor {owner}, and there are {len(attractors)}")
        owned.setdefault(owner, []).append(survival)
    for attractor in attractors:
        count = len(attractor.points)
        if count == 0 or (attractor.kind == "periodic" and count != attractor.period):
            raise ResultFileError(f"a {attractor.kind} attractor of period {attractor.period} has {count} points")
    return (
        tuple(dataclasses.replace(one, survival=tuple(owned.get(k, ()))) for k, one in enumerate(attractors)),
        tuple(owned.get(-1, ())),
    )
