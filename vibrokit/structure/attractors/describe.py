"""Describes steady states: turns an orbit that was found into the record of an attractor, with its contacts."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.parts.barrier import Barrier
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.survival import Survival
from vibrokit.structure.along_x import turns_to, wrapped
from vibrokit.structure.attractors.wandering import LyapunovEstimate
from vibrokit.structure.autonomous import equilibrium_exponents
from vibrokit.structure.orbits import EQUAL, SAMPLES, Orbit, visited
from vibrokit.structure.scales import size_of
from vibrokit.symbolic.flow_kind import Flow

_WANDERING = 64  # periods of motion that never repeats

Array = NDArray[np.float64]


def describe_orbit(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Attractor:
    """Describe a stable orbit or limit cycle, or the equilibrium that an orbit of an autonomous scene rests at."""
    path = _path_of(osc, orbit, stepper)
    resting = osc.autonomous and orbit.kind != "limit cycle" and _still(osc, path)
    return _described(
        osc, path, stepper,
        kind="equilibrium" if resting else orbit.kind,
        period=orbit.period,
        duration=0.0 if resting else orbit.duration,
        points=wrapped(osc, visited(osc, orbit, stepper)),
        turns=int(turns_to(osc, path.states[-1:] - path.states[:1])[0]),
        multipliers=orbit.multipliers,
        exponents=equilibrium_exponents(osc, orbit.point) if resting else orbit.exponents,
        residual=orbit.residual,
        error=orbit.moved_by_tightening(osc, stepper, 1),
    )  # fmt: skip


def is_cycle(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> bool:
    """Whether an orbit of an autonomous scene moves: a limit cycle that nearly repeats after section intervals."""
    return osc.autonomous and not _still(osc, _path_of(osc, orbit, stepper))


def describe_wandering(
    osc: Oscillator,
    kind: str,
    sample: Array,
    estimate: LyapunovEstimate,
    survival: tuple[Survival, ...],
    stepper: Stepper,
) -> Attractor:
    """Describe motion that never repeats, from a sample (count, n) of its points on the section."""
    found = _described(
        osc, _wandering_path(osc, sample[0], stepper), stepper,
        kind=kind,
        period=0,
        duration=np.nan,
        points=sample,
        multipliers=np.empty(0, dtype=complex),
        exponents=np.array([estimate.value], dtype=complex),
        exponent_error=estimate.error,
        residual=np.nan,
        error=np.nan,
        survival=survival,
    )  # fmt: skip
    # Hits are per orbit; those of motion that never repeats are per period.
    return dataclasses.replace(found, hits={side: hits / _WANDERING for side, hits in found.hits.items()})


def _described(osc: Oscillator, path: Path, stepper: Stepper, *, exponent_error: float = 0.0, **own: Any) -> Attractor:
    """Return the record of an attractor, with its contacts along a path on it; label and basin are set later."""
    seen = {barrier.side: contacts_along(osc, path, stop, stepper) for stop, barrier in enumerate(osc.barriers)}
    return Attractor(
        label=UNSETTLED,
        orbit=path.states[:, :2],
        exponent_error=exponent_error,
        hits={side: one.hits for side, one in seen.items()},
        peak_depth={side: one.depth for side, one in seen.items()},
        peak_force={side: one.force for side, one in seen.items()},
        basin_fraction=0.0,
        basin_fraction_error=0.0,
        **own,
    )


def _path_of(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Path:
    """Samples along an orbit, so many in a section interval."""
    count = SAMPLES * max(1, round(orbit.duration / osc.section_interval))
    return _path(osc, wrapped(osc, orbit.point), orbit.duration, count, stepper)


def _still(osc: Oscillator, path: Path) -> bool:
    return bool(np.ptp(path.states, axis=0).max() < EQUAL * (size_of(osc) + np.abs(path.states).max()))


def _path(osc: Oscillator, point: Array, duration: float, count: int, stepper: Stepper) -> Path:
    spacing = duration / count
    return Path(record(osc, Flow.STATE, stepper, point, 0.0, spacing, count), 0.0, spacing)


def _wandering_path(osc: Oscillator, point: Array, stepper: Stepper) -> Path:
    """Return some periods, each started from the section as by the section map, whose attractor this is."""
    interval, pieces = osc.section_interval, []
    for _ in range(_WANDERING):
        pieces.append(_path(osc, point, interval, SAMPLES, stepper).states[:-1])
        point = run_ensemble(osc, Flow.STATE, stepper, point[None], 1).states[0]
    return Path(np.concatenate([*pieces, point[None]]), 0.0, interval / SAMPLES)


@dataclasses.dataclass(frozen=True, eq=False)
class Path:
    """A recorded stretch of motion: states (count, n), the time of the first, and that from one to the next (s)."""

    states: Array
    start: float
    spacing: float


@dataclasses.dataclass(frozen=True)
class Contacts:
    """The contacts of an orbit with a stop: entries into contact, largest depth (m), largest push (m s⁻²)."""

    hits: int
    depth: float
    force: float


def contacts_along(osc: Oscillator, path: Path, stop: int, stepper: Stepper) -> Contacts:
    """Find the contacts with one stop in a path, sampled along a whole orbit by a stepper.

    A contact shorter than the spacing of the samples shows by a velocity that turns next to the stop; such a stretch is
    integrated again with finer samples.
    """
    barrier = osc.barriers[stop]
    depth, _ = _depth_and_rate(path.states, barrier)
    entries, touching = int(np.sum((depth[:-1] <= 0) & (depth[1:] > 0))), np.flatnonzero(depth > 0)
    runs = [run for run in np.split(touching, np.flatnonzero(np.diff(touching) > 1) + 1) if run.size]
    last, unseen = len(depth) - 1, _hidden(osc, path, barrier, stepper, 6)
    around = [_around(osc, path, max(run[0] - 1, 0), min(run[-1] + 1, last), stepper) for run in runs]
    peaks = [_peak(osc, each, stop, stepper) for each in (*around, *unseen)]
    deepest, hardest = np.max([(0.0, 0.0), *peaks], axis=0).tolist()
    return Contacts(entries + len(unseen), deepest, hardest)


def _depth_and_rate(states: Array, barrier: Barrier) -> tuple[Array, Array]:
    return barrier.sign * (states[:, 0] - barrier.position), barrier.sign * states[:, 1]


def _around(osc: Oscillator, path: Path, first: int, last: int, stepper: Stepper) -> Path:
    """Return the stretch between two samples, with enough samples for its peaks."""
    if last - first >= 32 or first == last:
        return Path(path.states[first : last + 1], path.start + first * path.spacing, path.spacing)
    finer = path.spacing * (last - first) / 64
    begin = path.start + first * path.spacing
    return Path(record(osc, Flow.STATE, stepper, path.states[first], begin, finer, 64), begin, finer)


def _hidden(osc: Oscillator, path: Path, barrier: Barrier, stepper: Stepper, finer: int) -> list[Path]:
    """Stretches in which the stop is touched between two samples that are both clear of it."""
    depth, rate = _depth_and_rate(path.states, barrier)
    clear, turns = (depth[:-1] <= 0) & (depth[1:] <= 0), (rate[:-1] > 0) & (rate[1:] < 0)
    reachable = depth[:-1] + rate[:-1] * path.spacing > 0
    found = []
    for index in np.flatnonzero(clear & turns & reachable):
        closer = _around(osc, path, int(index), int(index) + 1, stepper)
        inside, _ = _depth_and_rate(closer.states, barrier)
        if inside.max() > 0:
            found.append(closer)
        elif finer > 0:
            found += _hidden(osc, closer, barrier, stepper, finer - 1)
    return found


def _peak(osc: Oscillator, path: Path, stop: int, stepper: Stepper) -> tuple[float, float]:
    """Return the greatest depth and the greatest push along a stretch."""
    law, theta = kernel_for(osc, Flow.STATE, stepper).module.law, theta_of(osc)

    def depths(states: Array) -> Array:
        return _depth_and_rate(states, osc.barriers[stop])[0]

    def pushes(states: Array) -> Array:
        pairs = zip(*_depth_and_rate(states, osc.barriers[stop]), strict=True)
        return np.array([float(law(stop, depth, rate, theta)) if depth > 0 else 0.0 for depth, rate in pairs])

    return _greatest(osc, path, depths, stepper), _greatest(osc, path, pushes, stepper)


def _greatest(osc: Oscillator, path: Path, measure: Callable[[Array], Array], stepper: Stepper) -> float:
    """Return the largest value of a function of the state along a path, from ever finer samples around it."""
    best = 0.0
    for _ in range(5):
        values = measure(path.states)
        top = int(np.argmax(values))
        best = max(best, float(values[top]))
        path = _around(osc, path, max(top - 1, 0), min(top + 1, len(values) - 1), stepper)
        if len(path.states) < 2:
            break
    return best
