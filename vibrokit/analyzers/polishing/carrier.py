"""Carrier: short pieces of the motion, many at once, from which paths are put together."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import RAN_OUT
from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.flow_kind import Flow

_RATE = 1e-4  # of a piece: over what time a rate of change is taken

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Linear:
    """Motion free of noise over one piece, from each of some states, and what noise does to it.

    Attributes
    ----------
    images : array (count, n)
    steps : array (count, n, n)
        M, derivative of the image.
    gramians : array (count, n, n)
        C, covariance (per D) that noise gathers.
    """

    images: Array
    steps: Array
    gramians: Array


@dataclasses.dataclass(frozen=True, eq=False)
class Extremal:
    """Motion by Hamilton's equations over one piece, from each of some (q, p).

    Attributes
    ----------
    images : array (count, 2n)
        NaN where the numbers ran out of range.
    slopes : array (count, 2n, 2n)
        Derivative of the image.
    actions : array (count,)
        Action paid.
    """

    images: Array
    slopes: Array
    actions: Array


@dataclasses.dataclass(frozen=True, eq=False)
class Carrier:
    """Carries nodes of a path, which lie at whole multiples of a piece of the section interval.

    Attributes
    ----------
    osc : Oscillator
    stepper : Stepper
    pieces : int
        In a section interval.
    """

    osc: Oscillator
    stepper: Stepper
    pieces: int = 8

    @property
    def piece(self) -> float:
        """Length of a piece (s)."""
        return self.osc.section_interval / self.pieces

    @property
    def size(self) -> int:
        """Numbers in a state."""
        return 2 + (len(self.osc.noise.extra_states) if self.osc.noise else 0)

    def linear(self, states: Array, first: int, last: float | None = None) -> Linear:
        """Carry consecutive nodes over one piece each without noise.

        Parameters
        ----------
        states : array (count, n)
        first : int
            Phase of the first node, in pieces since the section.
        last : float, optional
            Length of the last piece (s), if it is not one like the others.
        """
        count, n = states.shape
        rest = self.extremal(np.hstack([states, np.zeros((count, n))]), first, last)
        steps = rest.slopes[:, :n, :n]
        gathered = rest.slopes[:, :n, n:] @ steps.transpose(0, 2, 1)
        return Linear(rest.images[:, :n], steps, (gathered + gathered.transpose(0, 2, 1)) / 2)

    def extremal(self, points: Array, first: int, last: float | None = None) -> Extremal:
        """Carry consecutive (q, p) over one piece each, those of one phase together; arguments as for `linear`."""
        count, double = points.shape
        found = Extremal(np.empty((count, double)), np.empty((count, double, double)), np.empty(count))
        phases = (first + np.arange(count)) % self.pieces
        kinds = np.zeros(count, dtype=np.int64) if self.osc.autonomous else phases.copy()
        if last is not None and last != self.piece:
            kinds[-1] = -1
        for kind in np.unique(kinds):
            some = np.flatnonzero(kinds == kind)
            length = self.piece if kind >= 0 or last is None else last
            part = self.over(points[some], float(phases[some[0]]) * self.piece, length)
            found.images[some], found.slopes[some], found.actions[some] = part.images, part.slopes, part.actions
        return found

    def over(self, points: Array, start: float, duration: float) -> Extremal:
        """Carry (q, p), all from one time, over any duration."""
        count, double = points.shape
        identity = np.broadcast_to(np.eye(double).ravel(), (count, double * double))
        begin = np.hstack([points, np.zeros((count, 1)), identity])
        ended = run_ensemble(
            self.osc, Flow.HAMILTONIAN_VARIATIONAL, self.stepper, begin, start_time=start, interval=duration
        )
        states = np.where((ended.status == RAN_OUT)[:, None], ended.states, np.nan)
        slopes = states[:, double + 1 :].reshape(count, double, double)
        return Extremal(states[:, :double], slopes, states[:, double])

    def rate(self, point: Array, start: float) -> Array:
        """Time derivative of (q, p), from the flow over a short time and over twice that."""
        short = _RATE * self.piece
        once, twice = (self.over(point[None], start, time).images[0] for time in (short, 2 * short))
        return (4 * once - 3 * point - twice) / (2 * short)

    def onward(self, state: Array, phase: int, count: int) -> Array:
        """Carry one state without noise over `count` pieces; return all nodes, the first included."""
        return record(self.osc, Flow.STATE, self.stepper, state, phase % self.pieces * self.piece, self.piece, count)

    def with_stepper(self, stepper: Stepper) -> Carrier:
        """The same with another stepper."""
        return dataclasses.replace(self, stepper=stepper)
