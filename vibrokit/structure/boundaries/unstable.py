"""Unstable orbits, one by one: refined to rounding, described, with the limits of their unstable branches."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StepperError, StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.saddle import Saddle
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.cycles import Cycle, refine_cycle
from vibrokit.structure.equilibria import equilibrium_exponents, refine_equilibrium
from vibrokit.structure.orbits import Orbit, exponents_of, least_period, moved_by_tightening, refine_orbit, visited
from vibrokit.symbolic.flow_kind import Flow

_RESIDUAL = 1e-10
_DEPARTURE = 1e-5  # of the region's size: distance from a saddle at which its branches are followed
_CLEAR = 100.0  # times the error of the stepper at the saddle, if that is larger
_LARGEST_DEPARTURE = 1e-2
_ON_A_BRANCH = 16
_ROUND = 32  # directions from a repeller
_TIGHTENED = 2  # times, for the error

Array = NDArray[np.float64]


def refine_unstable(osc: Oscillator, guess: Array, period: int, stepper: Stepper) -> Orbit:
    """Refine an unstable orbit, or an equilibrium of an autonomous scene, to its least period.

    The monodromy matrix of an equilibrium is that over a sixteenth of 2π/ω_n. A finer stepper is used where the
    residual is too large.

    Raises
    ------
    StructureError
        Newton's method found no such orbit, or in an autonomous scene no equilibrium, near the guess.
    """
    if osc.autonomous:
        return refine_equilibrium(osc, guess)
    orbit = refine_orbit(osc, guess, period, stepper)
    if orbit.residual > _RESIDUAL:
        finer = refine_orbit(osc, orbit.point, period, stepper.refined().refined())
        orbit = min(orbit, finer, key=lambda found: found.residual)
    return least_period(osc, orbit, stepper)


def describe_unstable(osc: Oscillator, orbit: Orbit, stepper: Stepper, leads_to: tuple[int, ...]) -> Saddle:
    """Describe an unstable orbit from `refine_unstable`, from its point of least x on, checked with finer steppers."""
    if osc.autonomous:  # an equilibrium, which does not depend on the stepper
        points, duration, error = orbit.point[None], 0.0, 0.0
        exponents = equilibrium_exponents(osc, orbit.point)
        multipliers = np.exp(exponents * osc.section_interval)
    else:
        points, duration = visited(osc, orbit, stepper), orbit.period * osc.section_interval
        if orbit.period > 1:
            orbit = refine_orbit(osc, points[np.argmin(points[:, 0])], orbit.period, stepper)
            points = visited(osc, orbit, stepper)
        multipliers = sorted_multipliers(orbit.monodromy)
        exponents = exponents_of(multipliers, duration)
        error = moved_by_tightening(
            orbit.point, lambda finer: refine_orbit(osc, orbit.point, orbit.period, finer).point, stepper, _TIGHTENED
        )
    return Saddle(
        kind=kind_of(multipliers),
        period=orbit.period,
        duration=duration,
        points=points,
        multipliers=multipliers,
        exponents=exponents,
        leads_to=leads_to,
        residual=orbit.residual,
        error=error,
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


def branch_limits(classifier: BasinClassifier, orbit: Orbit) -> tuple[int, ...]:
    """Return the labels of the attractors that motion from an unstable orbit leads to.

    Each branch is followed from a fundamental domain: from points between one distance from the orbit and its image
    under the map. Two labels are returned, first that of the branch towards smaller x. If a branch winds between
    basins, its label is the most frequent one, or the next if both branches have the same one. A repeller has the
    labels of all directions.

    Parameters
    ----------
    classifier : BasinClassifier
    orbit : Orbit
        From `refine_unstable`.
    """
    orbit = _orbit_of_stepper(classifier, orbit)
    values, vectors = np.linalg.eig(orbit.monodromy)
    reach = classifier.region.size
    away = min(_LARGEST_DEPARTURE * reach, max(_DEPARTURE * reach, _CLEAR * _mismatch(classifier, orbit)))
    if np.sum(np.abs(values) > 1) > 1:
        angles = 2 * np.pi * np.arange(_ROUND) / _ROUND
        ring = np.zeros((_ROUND, len(orbit.point)))
        ring[:, 0], ring[:, 1] = np.cos(angles), np.sin(angles)
        return tuple(int(label) for label in np.unique(classifier.labels(orbit.point + away * ring)))
    largest = int(np.argmax(np.abs(values)))
    direction = vectors[:, largest].real / np.linalg.norm(vectors[:, largest].real)
    direction *= np.copysign(1.0, direction[np.flatnonzero(direction)[0]])
    growth = np.clip(np.abs(values[largest]), 2.0, _LARGEST_DEPARTURE * reach / away)
    distances = away * growth ** ((np.arange(_ON_A_BRANCH) + 0.5) / _ON_A_BRANCH)
    sides = [classifier.labels(orbit.point + side * distances[:, None] * direction) for side in (-1, 1)]
    return _label_of_each(sides[0], sides[1])


def _orbit_of_stepper(classifier: BasinClassifier, orbit: Orbit) -> Orbit:
    """The same orbit of the classifier's slightly different map; the given one where Newton's method finds none."""
    if classifier.osc.autonomous:  # an equilibrium is the same for every stepper
        return orbit
    try:
        return refine_orbit(classifier.osc, orbit.point, orbit.period, classifier.stepper)
    except (StepperError, StructureError):
        return orbit


def _mismatch(classifier: BasinClassifier, orbit: Orbit) -> float:
    """Distance between the point of an orbit and its image under the classifier's map."""
    if classifier.osc.autonomous:
        return orbit.residual
    ended = run_ensemble(classifier.osc, Flow.STATE, classifier.stepper, orbit.point[None], orbit.period)
    return float(np.linalg.norm(ended.states[0] - orbit.point))


def _label_of_each(low: NDArray[np.int64], high: NDArray[np.int64]) -> tuple[int, int]:
    """One label for each of two branches, different ones if either has more than one."""
    frequent = [_by_count(labels) for labels in (low, high)]
    first, second = frequent[0][0][1], frequent[1][0][1]
    if first == second:
        others = [(count, side, label) for side in (0, 1) for count, label in frequent[side][1:2]]
        if others:
            _, side, label = max(others)
            first, second = (label, second) if side == 0 else (first, label)
    return first, second


def _by_count(labels: NDArray[np.int64]) -> list[tuple[int, int]]:
    """(count, label), the most frequent first."""
    values, counts = np.unique(labels, return_counts=True)
    return sorted(((int(count), int(value)) for value, count in zip(values, counts, strict=True)), reverse=True)
