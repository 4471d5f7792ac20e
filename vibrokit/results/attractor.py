"""Attractor: one steady state of the noise-free system, and how files hold it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.documented import documented
from vibrokit.errors import ResultFileError, counted
from vibrokit.results.arrays import Arrays
from vibrokit.results.fields import (
    PLANE,
    STATE,
    ByName,
    Length,
    Number,
    Series,
    Spectrum,
    Variable,
    Vectors,
    Whole,
    Word,
)
from vibrokit.results.table import Table, fields_of

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Sides = Mapping[str, float]

_SETTLED = Series(
    "forcing periods until the start settled; -1 if it did not", length=Length("start", "starts"), low=-1
)  # fmt: skip


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class Survival:
    """Long runs of starts that had not settled: how many settled after all, and when.

    The lifetime is the estimate of maximum likelihood from the starts that settled and those that did not.
    """

    stepper: Annotated[str, "stepper of the integration"]
    starts: Annotated[int, "number of starts"]
    periods: Annotated[int, "forcing periods for which starts were followed"]
    survivors: Annotated[int, "starts that had not settled by then"]
    lifetime: Annotated[float, "mean time until a start settles, in forcing periods; infinite if none did"]
    lifetime_error: Annotated[float, "standard error of the lifetime, in forcing periods"]
    settled_after: Annotated[NDArray[np.int64], _SETTLED]

    def __str__(self) -> str:
        words = (
            f"{self.survivors} of {self.starts} starts had not settled after {self.periods} periods ({self.stepper})"
        )
        if not np.isfinite(self.lifetime):
            return f"{words}, and none ever settled"
        return f"{words}; mean time until a start settles: {self.lifetime:.3g} ± {self.lifetime_error:.2g} periods"


_KIND = Word(
    '"periodic", "quasiperiodic", "chaotic", "equilibrium" or "limit cycle"',
    known=("periodic", "quasiperiodic", "chaotic", "equilibrium", "limit cycle"),
)
_POINTS = Vectors(
    "points on the section as they are visited: one for each forcing period of an orbit, the turning point of greatest "
    "x of a limit cycle, a long sample of motion that never repeats",
    length=Length("visit", "points on the section"), columns=STATE,
)  # fmt: skip
_ORBIT = Vectors(
    "(x, v) along the whole orbit at equal time steps, its start repeated at the end; along some periods of motion "
    "that never repeats",
    length=Length("orbit_sample", "samples of the orbit"), columns=PLANE,
)  # fmt: skip
_MULTIPLIERS = Spectrum(
    "multipliers of the section map over one orbit, of the flow over 2π/ω_n at rest; none of motion that never repeats",
    length=Length("multiplier", "multipliers"),
)
_STOPS: dict[str, Any] = {"what": "side", "low": 0.0, "known": ("left", "right")}
_EXPONENTS = Spectrum(  # −∞ where a multiplier is 0
    "rates at which deviations grow: eigenvalues at rest, log(multipliers)/duration of an orbit, otherwise the largest "
    "Lyapunov exponent",
    "s-1", length=Length("exponent", "exponents"), finite=False,
)  # fmt: skip


@documented
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Attractor:
    """A steady state. Residual and error are in units of the scene's motions: a length, and ω_n times it."""

    label: Annotated[int, "label of the attractor: its place in the structure, and its label in the basins"]
    kind: Annotated[str, _KIND]
    period: Annotated[int, "period in forcing periods; 0 for motion that never repeats, 1 at rest or on a limit cycle"]
    duration: Annotated[float, "time after which the motion repeats; 0 at rest, NaN for motion that never repeats", "s"]
    points: Annotated[Array, _POINTS]
    orbit: Annotated[Array, _ORBIT]
    multipliers: Annotated[Complex, _MULTIPLIERS]
    exponents: Annotated[Complex, _EXPONENTS]
    exponent_error: Annotated[float, "standard error of a Lyapunov exponent; 0 for the others", "s-1"]
    hits: Annotated[Sides, ByName("hits of each stop per orbit; per forcing period if it never repeats", "1", **_STOPS)]
    peak_depth: Annotated[Sides, ByName("largest depth past each stop", "m", **_STOPS)]
    peak_force: Annotated[Sides, ByName("largest push of each stop", "m s-2", **_STOPS)]
    basin_fraction: Annotated[float, Number("share of the region's cells that lead to the attractor", "1", 0.0, 1.0)]
    basin_fraction_error: Annotated[
        float, Number("standard error of the share; above 0 also where all cells lead to one attractor", "1", 0.0, 1.0)
    ]
    residual: Annotated[float, "distance between the first point and its image after one orbit; NaN as the duration"]
    error: Annotated[float, "change of the first point when the integration is tightened; NaN as the duration"]
    survival: Annotated[tuple[Survival, ...], "the evidence that motion without a period lasts, at two accuracies"] = ()
    name: Annotated[str, 'name of the attractor from what it does, such as "hammering"; distinct in a structure'] = ""
    turns: Annotated[int, Whole("periods of the spring's force by which x advances in one orbit", low=-(10**9))] = 0

    @property
    def impacts(self) -> float:
        """Stop hits per orbit, of all stops together; for motion that never repeats, per forcing period on average."""
        return sum(self.hits.values())

    @property
    def touched(self) -> tuple[str, ...]:
        """Sides of the stops that it touches, in alphabetical order."""
        return tuple(sorted(side for side, depth in self.peak_depth.items() if depth > 0))

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


_SURVIVALS = Table(
    "survival",
    {
        "attractor": Whole("place of the attractor that it belongs to; -1 for the whole scene", low=-1),
        **fields_of(Survival),
    },
)


def attractor_variables(
    table: Table, attractors: Sequence[Attractor], others: Sequence[Survival] = ()
) -> dict[str, Variable]:
    """Return the arrays that hold attractors with their survivals, and other survivals that belong to none of them."""
    owned = [(place, one) for place, attractor in enumerate(attractors) for one in attractor.survival]
    owned += [(-1, one) for one in others]
    survivals = _SURVIVALS.variables([one for _, one in owned], attractor=[place for place, _ in owned])
    return table.variables(attractors) | survivals


def read_attractors(arrays: Arrays, table: Table) -> tuple[tuple[Attractor, ...], tuple[Survival, ...]]:
    """Return attractors, each with its survivals, and the survivals that belong to none; raises ResultFileError."""
    attractors = [Attractor(**values) for values in table.read(arrays)]
    owned: dict[int, list[Survival]] = {}
    for values in _SURVIVALS.read(arrays):
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
