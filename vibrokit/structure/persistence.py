"""How long transients take, and whether attractors persist: too few steps can destroy a weak one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.structure.along_x import turn_of, wrapped
from vibrokit.structure.scales import turns_of
from vibrokit.symbolic.flow_kind import Flow

LONGEST_WAIT = 20_000
"""Periods of a transient, at most."""

Array = NDArray[np.float64]


def wait_of(osc: Oscillator) -> int:
    """Return the periods that a transient needs, by the damping."""
    rate = 0.5 * osc.linear_damping
    if rate == 0 and osc.model.undamped:
        raise StructureError(
            "the scene has no damping (that of the scene is 0, and the stops are elastic), and undamped motion has no "
            "attractors; give it damping."
        )
    slowest = rate if rate < osc.reference_frequency else 0.5 * osc.reference_frequency**2 / rate
    return periods_of(osc, slowest) if slowest else 200


def periods_of(osc: Oscillator, rate: float) -> int:
    """Return the periods in which deviations that fall at a rate (s⁻¹) are gone: 30 e-foldings."""
    return min(LONGEST_WAIT, 200 + math.ceil(30 / (rate * osc.section_interval)))


def slowest_rate(attractor: Attractor) -> float:
    """Return the rate (s⁻¹) at which the slowest deviation from an orbit or an equilibrium falls; 0 for other sets."""
    if not attractor.repeats:
        return 0.0
    rates = attractor.exponents.real
    if attractor.kind == "limit cycle":  # a shift along it does not fall
        rates = np.delete(rates, np.argmin(np.abs(rates)))
    return float(-rates.max())


def persistent_stepper(osc: Oscillator, attractors: Sequence[Attractor], stepper: Stepper, distances: Array) -> Stepper:
    """Return a stepper, refined until every attractor persists with it within some distances, at most four times."""
    for _ in range(4):
        if _persist(osc, attractors, stepper, distances):
            break
        stepper = stepper.refined()
    return stepper


def _persist(osc: Oscillator, attractors: Sequence[Attractor], stepper: Stepper, distances: Array) -> bool:
    """Whether motions that start on attractors, all followed together, are on them after a long time.

    An orbit is followed for 512 of its periods, or 8192 free oscillations if these are fewer; other motion, from up to
    64 starts, for 2000 sections.
    """
    starts = [
        known.points[:1] if known.repeats else known.points[:: max(1, len(known.points) // 64)] for known in attractors
    ]
    lasting = min(512, max(8, math.ceil(8192 / turns_of(osc))))
    periods = [lasting * known.period if known.is_fixed else 2000 for known in attractors]
    counts = [len(states) for states in starts]
    ends = run_ensemble(osc, Flow.STATE, stepper, np.concatenate(starts), np.repeat(periods, counts)).states
    each = zip(attractors, np.split(ends, np.cumsum(counts)[:-1]), strict=True)
    return all(_is_still_on(osc, known, end, distances) for known, end in each)


def _is_still_on(osc: Oscillator, known: Attractor, ends: Array, distances: Array) -> bool:
    if known.kind == "limit cycle":
        return is_on_cycle(osc, known, ends[0])
    offsets = wrapped(osc, ends[:, None, :2] - known.points[None, :, :2])
    apart = np.linalg.norm(offsets / distances, axis=2).min(axis=1)
    return bool(np.mean(apart <= 2.0) > 0.9)


def is_on_cycle(osc: Oscillator, cycle: Attractor, point: Array) -> bool:
    """Whether a point lies on a limit cycle, within the spacing of its samples."""
    orbit, extent = cycle.orbit, np.ptp(cycle.orbit, axis=0)
    if cycle.turns:  # on which of its turns, only the speed can tell
        turn = turn_of(osc)
        first = orbit[:, 0].min() + (point[0] - orbit[:, 0].min()) % turn
        places = first + turn * np.arange(abs(cycle.turns))
        point = np.stack([places, np.full(len(places), point[1])], axis=1)[:, None]
    spacing = np.linalg.norm(np.diff(orbit, axis=0) / extent, axis=1).max()
    return bool(np.linalg.norm((orbit - point[..., :2]) / extent, axis=-1).min() <= spacing)
