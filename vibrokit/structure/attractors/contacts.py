"""Contacts along an orbit: how often each stop is hit, how deep the mass goes and how hard the stop pushes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.parts.barrier import Barrier
from vibrokit.symbolic.flow_kind import Flow

_FINER = 64  # samples that a stretch is looked at with again
_DEEPEST = 6  # how often, before a touch that is never seen counts as none
_ENOUGH = 32  # samples in one contact, for its peak
_LOOKS = 5  # each thirty times as close as the one before

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Path:
    """A recorded stretch of motion.

    Attributes
    ----------
    states : array (count, n)
    start : float
        Time of the first (s).
    spacing : float
        Time from one to the next (s).
    """

    states: Array
    start: float
    spacing: float


@dataclasses.dataclass(frozen=True)
class Contacts:
    """What a stop saw of an orbit.

    Attributes
    ----------
    hits : int
        Entries into contact.
    depth : float
        Deepest (m).
    force : float
        Largest push (m s⁻²).
    """

    hits: int
    depth: float
    force: float


def contacts_along(osc: Oscillator, path: Path, stop: int, stepper: Stepper) -> Contacts:
    """Look at a path, sampled along a whole orbit, for contacts with one stop.

    A contact shorter than the spacing of the samples shows by a velocity that turns next to the stop; such a stretch is
    integrated again with finer samples.

    Parameters
    ----------
    osc : Oscillator
    path : Path
    stop : int
        Index of the barrier.
    stepper : Stepper
        The one that made the path.
    """
    barrier = osc.barriers[stop]
    depth, _ = _depth_and_rate(path.states, barrier)
    entries, deepest, hardest = int(np.sum((depth[:-1] <= 0) & (depth[1:] > 0))), 0.0, 0.0
    touching = np.flatnonzero(depth > 0)
    for run in np.split(touching, np.flatnonzero(np.diff(touching) > 1) + 1):
        if run.size:
            around = _around(osc, path, max(run[0] - 1, 0), min(run[-1] + 1, len(depth) - 1), stepper)
            peak = _peak(osc, around, stop, stepper)
            deepest, hardest = max(deepest, peak[0]), max(hardest, peak[1])
    for unseen in _hidden(osc, path, barrier, stepper, _DEEPEST):
        peak = _peak(osc, unseen, stop, stepper)
        entries, deepest, hardest = entries + 1, max(deepest, peak[0]), max(hardest, peak[1])
    return Contacts(entries, deepest, hardest)


def _depth_and_rate(states: Array, barrier: Barrier) -> tuple[Array, Array]:
    return barrier.sign * (states[:, 0] - barrier.position), barrier.sign * states[:, 1]


def _around(osc: Oscillator, path: Path, first: int, last: int, stepper: Stepper) -> Path:
    """The stretch between two samples, with samples enough for its peaks."""
    if last - first >= _ENOUGH or first == last:
        return Path(path.states[first : last + 1], path.start + first * path.spacing, path.spacing)
    finer = path.spacing * (last - first) / _FINER
    begin = path.start + first * path.spacing
    return Path(record(osc, Flow.STATE, stepper, path.states[first], begin, finer, _FINER), begin, finer)


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
    """Greatest depth and greatest push along a stretch, each looked at again ever more closely."""
    law, theta = kernel_for(osc, Flow.STATE, stepper).module.law, theta_of(osc)

    def depths(states: Array) -> Array:
        return _depth_and_rate(states, osc.barriers[stop])[0]

    def pushes(states: Array) -> Array:
        pairs = zip(*_depth_and_rate(states, osc.barriers[stop]), strict=True)
        return np.array([float(law(stop, depth, rate, theta)) if depth > 0 else 0.0 for depth, rate in pairs])

    return _greatest(osc, path, depths, stepper), _greatest(osc, path, pushes, stepper)


def _greatest(osc: Oscillator, path: Path, measure: Callable[[Array], Array], stepper: Stepper) -> float:
    """Largest value of a function of the state along a path, by ever finer samples round the largest one."""
    best = 0.0
    for _ in range(_LOOKS):
        values = measure(path.states)
        top = int(np.argmax(values))
        best = max(best, float(values[top]))
        path = _around(osc, path, max(top - 1, 0), min(top + 1, len(values) - 1), stepper)
        if len(path.states) < 2:
            break
    return best
