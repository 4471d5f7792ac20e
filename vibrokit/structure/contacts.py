"""Contacts along an orbit: how often each stop is hit, how deep the mass goes and how hard the stop pushes."""

from __future__ import annotations

import dataclasses

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
            peak = _peak(osc, around.states, stop, stepper)
            deepest, hardest = max(deepest, peak[0]), max(hardest, peak[1])
    for states in _hidden(osc, path, barrier, stepper, _DEEPEST):
        peak = _peak(osc, states, stop, stepper)
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


def _hidden(osc: Oscillator, path: Path, barrier: Barrier, stepper: Stepper, finer: int) -> list[Array]:
    """Stretches in which the stop is touched between two samples that are both clear of it."""
    depth, rate = _depth_and_rate(path.states, barrier)
    clear, turns = (depth[:-1] <= 0) & (depth[1:] <= 0), (rate[:-1] > 0) & (rate[1:] < 0)
    reachable = depth[:-1] + rate[:-1] * path.spacing > 0
    found = []
    for index in np.flatnonzero(clear & turns & reachable):
        closer = _around(osc, path, int(index), int(index) + 1, stepper)
        inside, _ = _depth_and_rate(closer.states, barrier)
        if inside.max() > 0:
            found.append(closer.states)
        elif finer > 0:
            found += _hidden(osc, closer, barrier, stepper, finer - 1)
    return found


def _peak(osc: Oscillator, states: Array, stop: int, stepper: Stepper) -> tuple[float, float]:
    """Greatest depth, by a parabola through the deepest samples, and greatest push, at that depth or at a sample."""
    barrier = osc.barriers[stop]
    depth, rate = _depth_and_rate(states, barrier)
    law = kernel_for(osc, Flow.STATE, stepper).module.law
    theta = theta_of(osc)
    force = max((float(law(stop, d, r, theta)) for d, r in zip(depth, rate, strict=True) if d > 0), default=0.0)
    top = int(np.argmax(depth))
    deepest = float(depth[top])
    if 0 < top < len(depth) - 1:
        before, after = float(depth[top - 1]), float(depth[top + 1])
        bend = before - 2 * deepest + after
        if bend < 0 and rate[top - 1] > 0 > rate[top + 1]:
            deepest -= (after - before) ** 2 / (8 * bend)
            force = max(force, float(law(stop, deepest, 0.0, theta)))
    return max(deepest, 0.0), max(force, 0.0)
