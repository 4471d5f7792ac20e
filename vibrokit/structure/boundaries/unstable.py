"""Unstable orbits, one by one: refined to rounding, described, and where what leaves them goes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StepperError, StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.saddle import Saddle
from vibrokit.structure.cycles import Cycle, equilibrium_exponents, refine_cycle
from vibrokit.structure.orbits import Orbit, exponents_of, least_period, moved_by_tightening, refine_orbit, visited
from vibrokit.structure.scales import size_of
from vibrokit.structure.settle import Settler
from vibrokit.symbolic.flow_kind import Flow

_PARTS_OF_A_TURN = 16  # of 2π/ω_n: over what time the flow is looked at for an equilibrium
_RESTING = 1e-8  # what a state may move, relative to its size, and be called an equilibrium
_RESIDUAL = 1e-10
_DEPARTURE = 1e-5  # of the region's size: how far from a saddle its branches are entered
_CLEAR = 100.0  # times the error of the carrier at the saddle, if that is more
_LARGEST_DEPARTURE = 1e-2
_ON_A_BRANCH = 16
_ROUND = 32  # directions that a repeller is left in
_TIGHTENED = 2  # times, for the error

Array = NDArray[np.float64]


def refine_unstable(osc: Oscillator, guess: Array, period: int, stepper: Stepper) -> Orbit:
    """Refine an unstable orbit, or an equilibrium of an autonomous scene, to its least period.

    The monodromy matrix of an equilibrium is that over a sixteenth of 2π/ω_n. A finer stepper is taken where the
    residual asks for it.

    Raises
    ------
    StructureError
        Newton's method found no such orbit near; or, in an autonomous scene, no equilibrium.
    """
    interval = short_interval(osc)
    orbit = refine_orbit(osc, guess, period, stepper, interval=interval)
    if orbit.residual > _RESIDUAL:
        finer = refine_orbit(osc, orbit.point, period, stepper.refined().refined(), interval=interval)
        orbit = min(orbit, finer, key=lambda found: found.residual)
    if interval is None:
        return least_period(osc, orbit, stepper)
    # A cycle may happen to close after this time; it does not after every other.
    later = run_ensemble(osc, Flow.STATE, stepper, orbit.point[None], 1, interval=0.618 * interval).states[0]
    if np.linalg.norm(later - orbit.point) > _RESTING * (size_of(osc) + np.linalg.norm(orbit.point)):
        raise StructureError(f"the motion through {tuple(np.round(orbit.point, 6))} is not at rest.")
    return orbit


def short_interval(osc: Oscillator) -> float | None:
    """Time over which an autonomous scene is looked at, short of what makes deviations huge; None if it is forced."""
    return osc.section_interval / _PARTS_OF_A_TURN if osc.autonomous else None


def describe_unstable(osc: Oscillator, orbit: Orbit, stepper: Stepper, leads_to: tuple[int, ...]) -> Saddle:
    """Describe an unstable orbit from `refine_unstable`: begun at its point of least x, certified by tighter steps."""
    points = visited(osc, orbit, stepper)
    if orbit.period > 1:
        orbit = refine_orbit(osc, points[np.argmin(points[:, 0])], orbit.period, stepper)
        points = visited(osc, orbit, stepper)
    multipliers = sorted_multipliers(orbit.monodromy)
    interval = short_interval(osc)
    if interval is None:
        duration = orbit.period * osc.section_interval
        exponents = exponents_of(multipliers, duration)
    else:
        duration = 0.0
        exponents = equilibrium_exponents(osc, orbit.point, stepper)
        multipliers = np.exp(exponents * osc.section_interval)

    def refined(finer: Stepper) -> Array:
        return refine_orbit(osc, orbit.point, orbit.period, finer, interval=interval).point

    return Saddle(
        kind=kind_of(multipliers),
        period=orbit.period,
        duration=duration,
        points=points,
        multipliers=multipliers,
        exponents=exponents,
        leads_to=leads_to,
        residual=orbit.residual,
        error=moved_by_tightening(orbit.point, refined, stepper, _TIGHTENED),
    )


def describe_unstable_cycle(osc: Oscillator, cycle: Cycle, stepper: Stepper, leads_to: tuple[int, ...]) -> Saddle:
    """Describe an unstable limit cycle of an autonomous scene; no direction in (x, v) but its own leads to it."""
    multipliers = sorted_multipliers(cycle.monodromy)

    def refined(finer: Stepper) -> Array:
        return refine_cycle(osc, cycle.point, cycle.duration, finer).point

    return Saddle(
        kind="repeller",
        period=1,
        duration=cycle.duration,
        points=cycle.point[None],
        multipliers=multipliers,
        exponents=exponents_of(multipliers, cycle.duration),
        leads_to=leads_to,
        residual=cycle.residual,
        error=moved_by_tightening(cycle.point, refined, stepper, _TIGHTENED),
    )


def kind_of(multipliers: NDArray[np.complex128]) -> str:
    """Name an unstable orbit by its multipliers, the largest first."""
    growing = multipliers[np.abs(multipliers) > 1]
    if len(growing) > 1:
        return "repeller"
    return "flip saddle" if growing[0].real < 0 else "saddle"


def sorted_multipliers(monodromy: Array) -> NDArray[np.complex128]:
    """Return eigenvalues, the largest first; of a complex pair the one above the real axis first."""
    values = np.linalg.eigvals(monodromy).astype(complex)
    return values[np.lexsort((-values.imag, -np.abs(values).round(14)))]


def branch_fates(settler: Settler, orbit: Orbit) -> tuple[int, ...]:
    """Return the labels of what leaves an unstable orbit comes to.

    Each branch is entered at points that together stand for all of it: between one distance from the orbit and the
    next that the map makes of it. Two labels are returned, of the branch towards lesser x and of the other; where a
    branch winds between basins, its commonest label, or the next if both branches would have the same one. For a
    repeller, the labels met all round.

    Parameters
    ----------
    settler : Settler
    orbit : Orbit
        From `refine_unstable`.
    """
    orbit = _as_carried(settler, orbit)
    values, vectors = np.linalg.eig(orbit.monodromy)
    reach = settler.region.size
    away = min(_LARGEST_DEPARTURE * reach, max(_DEPARTURE * reach, _CLEAR * _mismatch(settler, orbit)))
    if np.sum(np.abs(values) > 1) > 1:
        angles = 2 * np.pi * np.arange(_ROUND) / _ROUND
        ring = np.zeros((_ROUND, len(orbit.point)))
        ring[:, 0], ring[:, 1] = np.cos(angles), np.sin(angles)
        return tuple(int(label) for label in np.unique(settler.labels(orbit.point + away * ring)))
    largest = int(np.argmax(np.abs(values)))
    direction = vectors[:, largest].real / np.linalg.norm(vectors[:, largest].real)
    direction *= np.copysign(1.0, direction[np.flatnonzero(direction)[0]])
    growth = np.clip(np.abs(values[largest]), 2.0, _LARGEST_DEPARTURE * reach / away)
    distances = away * growth ** ((np.arange(_ON_A_BRANCH) + 0.5) / _ON_A_BRANCH)
    sides = [settler.labels(orbit.point + side * distances[:, None] * direction) for side in (-1, 1)]
    return _named(sides[0], sides[1])


def _as_carried(settler: Settler, orbit: Orbit) -> Orbit:
    """The same orbit of the settler's own, slightly different map; the given one where that cannot be had."""
    try:
        return refine_orbit(
            settler.osc, orbit.point, orbit.period, settler.stepper, interval=short_interval(settler.osc)
        )
    except (StepperError, StructureError):
        return orbit


def _mismatch(settler: Settler, orbit: Orbit) -> float:
    """How far the settler's map takes the point of an orbit from itself."""
    osc = settler.osc
    ended = run_ensemble(
        osc, Flow.STATE, settler.stepper, orbit.point[None], orbit.period, interval=short_interval(osc)
    )  # fmt: skip
    return float(np.linalg.norm(ended.states[0] - orbit.point))


def _named(low: NDArray[np.int64], high: NDArray[np.int64]) -> tuple[int, int]:
    """One label for each of two branches, different ones if either meets more than one."""
    commonest = [_by_count(labels) for labels in (low, high)]
    first, second = commonest[0][0][1], commonest[1][0][1]
    if first == second:
        others = [(count, side, label) for side in (0, 1) for count, label in commonest[side][1:2]]
        if others:
            _, side, label = max(others)
            first, second = (label, second) if side == 0 else (first, label)
    return first, second


def _by_count(labels: NDArray[np.int64]) -> list[tuple[int, int]]:
    """(count, label), the commonest first."""
    values, counts = np.unique(labels, return_counts=True)
    return sorted(((int(count), int(value)) for value, count in zip(values, counts, strict=True)), reverse=True)
