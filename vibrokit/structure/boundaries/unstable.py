"""Unstable orbits: refined to rounding, described, with the limits of their unstable branches."""

from __future__ import annotations

import contextlib
import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StepperError, StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.saddle import Saddle
from vibrokit.structure.along_x import shifted, turn_of, turns_to, wrapped
from vibrokit.structure.autonomous import equilibrium_exponents, refine_equilibrium
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.boundaries.meetings import settled
from vibrokit.structure.orbits import (
    SAMPLES,
    Orbit,
    least_period,
    nodes_from,
    refine_orbit,
    sampled,
    states_along,
    visited,
)
from vibrokit.symbolic.flow_kind import Flow

RESIDUAL = 1e-10
"""Largest residual of an unstable orbit that is accepted without a finding."""
_FARTHEST = 1e-2  # of the region's widths: distance from a saddle at which its branches are followed, at most

Array = NDArray[np.float64]


def refine_unstable(osc: Oscillator, guess: Array, period: int, stepper: Stepper) -> Orbit:
    """Refine an unstable orbit, or an equilibrium of an autonomous scene, to its least period.

    The guess is as of `refine_orbit`; several nodes become four times as many, so that steps from one to the next have
    accurate multipliers below 1 as well. A finer stepper is used where the residual is too large. A StructureError is
    raised if Newton's method finds no such orbit near the guess, or in an autonomous scene no equilibrium.
    """
    if osc.autonomous:
        return refine_equilibrium(osc, guess)
    orbit = refine_orbit(osc, guess, period, stepper)
    if len(orbit.nodes) > 1:
        pieces = 4 * len(orbit.nodes) // period
        orbit = refine_orbit(osc, states_along(osc, orbit.nodes, period, stepper, pieces), period, stepper)
    growth = float(np.abs(orbit.multipliers).max()) ** (1.0 / len(orbit.nodes))  # of a residual, from node to node
    if orbit.residual > RESIDUAL * max(1.0, growth):
        finer = refine_orbit(osc, orbit.nodes, period, stepper.refined().refined())
        orbit = min(orbit, finer, key=lambda found: found.residual)
    return least_period(osc, orbit, stepper)


def describe_unstable(osc: Oscillator, orbit: Orbit, stepper: Stepper, leads_to: tuple[int, ...]) -> Saddle:
    """Describe an unstable orbit or limit cycle, from its point of least x on, checked with finer steppers."""
    points = visited(osc, orbit, stepper)
    if orbit.period > 1:
        nodes = nodes_from(int(np.argmin(points[:, 0])), orbit.nodes, points)
        orbit = refine_orbit(osc, nodes, orbit.period, stepper)
        points = visited(osc, orbit, stepper)
    if orbit.kind == "equilibrium":
        exponents = equilibrium_exponents(osc, orbit.point)
        with np.errstate(over="ignore"):  # next to a pole, one may be too large for a number
            multipliers = np.exp(exponents * osc.section_interval)
    else:
        # The largest first; of a complex pair the one above the real axis first.
        order = np.lexsort((-orbit.multipliers.imag, -np.abs(orbit.multipliers).round(14)))
        multipliers, exponents = orbit.multipliers[order], orbit.exponents[order]
    return Saddle(
        # No direction in (x, v) leads to a cycle but its own.
        kind="repeller" if orbit.kind == "limit cycle" else _kind_of(multipliers),
        period=orbit.period,
        duration=orbit.duration,
        points=points,
        nodes=orbit.nodes,
        multipliers=multipliers,
        exponents=exponents,
        leads_to=leads_to,
        residual=orbit.residual,
        error=orbit.moved_by_tightening(osc, stepper, 2),
        orbit=_along(osc, orbit, stepper),
    )


def _along(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Array:
    """(x, v) along an orbit at equal times, its start repeated at the end; each piece starts at a node."""
    if orbit.kind == "equilibrium":
        return orbit.nodes[:, :2]
    each = -(-SAMPLES * max(1, round(orbit.duration / osc.section_interval)) // len(orbit.nodes))
    states = sampled(osc, orbit.nodes, orbit.duration, stepper, each)
    return np.concatenate([states, orbit.nodes[:1]])[:, :2]


def _kind_of(multipliers: NDArray[np.complex128]) -> str:
    """Name an unstable orbit by its multipliers, the largest first."""
    growing = multipliers[np.abs(multipliers) > 1]
    if len(growing) > 1:
        return "repeller"
    return "flip saddle" if growing[0].real < 0 else "saddle"


def in_turn(osc: Oscillator, saddle: Saddle, middle: float) -> Saddle:
    """Return a saddle moved along x by whole turns, its points to the turn around a place."""
    away = -turn_of(osc) * float(turns_to(osc, saddle.points[:1], middle)[0])
    points = wrapped(osc, saddle.points, middle)
    return dataclasses.replace(
        saddle, points=points, nodes=shifted(saddle.nodes, away), orbit=shifted(saddle.orbit, away)
    )


def branch_limits(classifier: BasinClassifier, orbit: Orbit) -> tuple[int, ...]:
    """Return the labels of the attractors that motion from an unstable orbit leads to.

    Each branch is followed from a fundamental domain: from points between one distance from the orbit and its image
    under the map. The first label is that of the branch towards smaller x, the second that of the other one. If a
    branch winds between basins, its label is the most frequent one, or the next if both branches have the same one; the
    other attractors that are reached follow. A repeller has the labels of all directions.
    """
    # Nearer than a hundred errors of the stepper, coarse steps across contacts may have orbits of their own.
    away = min(_FARTHEST, max(1e-5, 100 * _mismatch(classifier, orbit)))
    with contextlib.suppress(StepperError, StructureError):  # the classifier's map may not have the orbit
        orbit = orbit.refined(classifier.osc, classifier.stepper)
    widths = classifier.region.widths
    if np.sum(np.abs(orbit.multipliers) > 1) > 1:
        angles = 2 * np.pi * np.arange(32) / 32
        ring = np.zeros((32, len(orbit.point)))
        ring[:, 0], ring[:, 1] = widths[0] * np.cos(angles), widths[1] * np.sin(angles)
        return tuple(int(label) for label in np.unique(classifier.labels(orbit.point + away * ring)))
    direction = orbit.unstable_direction
    direction = direction / np.linalg.norm(direction[:2] / widths)
    direction *= np.copysign(1.0, direction[np.flatnonzero(direction)[0]])
    growth = np.clip(np.abs(orbit.multipliers).max(), 2.0, _FARTHEST / away)
    distances = away * growth ** ((np.arange(16) + 0.5) / 16)
    along = np.concatenate([-distances, distances])
    labels = classifier.labels(orbit.point + along[:, None] * direction)  # together, which takes as long as one side
    first, second = _label_of_each(labels[:16], labels[16:])
    reached = np.unique(labels)
    others = [int(label) for label in reached[settled(reached)] if label not in (first, second)]
    return (first, second, *others)


def _mismatch(classifier: BasinClassifier, orbit: Orbit) -> float:
    """Return the largest distance, in widths, of a node from the image of the one before by the classifier's map."""
    if classifier.osc.autonomous:
        return orbit.residual
    count = len(orbit.nodes)
    interval, phases = orbit.duration / count, np.arange(count)
    ended = run_ensemble(classifier.osc, Flow.STATE, classifier.stepper, orbit.nodes, interval=interval, phases=phases)
    return float(classifier.region.apart(ended.states, np.roll(orbit.nodes, -1, axis=0)).max())


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
    return sorted(zip(counts.tolist(), values.tolist(), strict=True), reverse=True)
