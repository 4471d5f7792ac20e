"""SegmentPropagator: the flow over short pieces of time, from many nodes of a path at once."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.time_scales import contact_times
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.structure.linear_map import GaussianMap, HamiltonianMap, Map, gaussian_map, hamiltonian_map, joined
from vibrokit.symbolic.flow_kind import Flow

_SHORT = 0.25  # of a piece: contacts shorter than that
_BESIDE = 0.02  # of a piece: a state that may touch a stop within that time counts as in contact

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class SegmentPropagator:
    """Maps nodes of a path, which lie at whole multiples of a piece of the section interval."""

    osc: Oscillator
    stepper: Stepper
    pieces: int = 8  # number of pieces in a section interval

    @property
    def piece(self) -> float:
        """Duration of a piece (s)."""
        return self.osc.section_interval / self.pieces

    @property
    def size(self) -> int:
        """Number of coordinates of a state."""
        return 2 + (len(self.osc.noise.extra_states) if self.osc.noise else 0)

    @property
    def units(self) -> Array:
        """Sizes of the coordinates of a state that belong together: 1 m, ω_n m/s, and 1 for extra noise states."""
        units = np.ones(self.size)
        units[1] = self.osc.reference_frequency
        return units

    @property
    def grain(self) -> int:
        """Nodes from section to section; without forcing, every node is on the section."""
        return 1 if self.osc.autonomous else self.pieces

    @cached_property
    def _has_short_contacts(self) -> bool:
        durations = (contact.duration for contact in contact_times(self.osc, Flow.STATE))
        return min(durations, default=math.inf) < _SHORT * self.piece

    def in_short_contact(self, nodes: Array, beside: float = _BESIDE) -> NDArray[np.bool_]:
        """Return which inner nodes of a path (count, n or more) lie in a contact that is much shorter than a piece.

        Neither neighbour lies in it. A node that is `beside` a contact, in pieces, counts as one in it.
        """
        touching, short = np.zeros(len(nodes), dtype=bool), np.zeros(len(nodes), dtype=bool)
        if self._has_short_contacts:
            x, close = nodes[:, 0], beside * self.piece * np.abs(nodes[:, 1])
            for barrier in self.osc.barriers:
                touching |= barrier.sign * (x - barrier.position) > -close
            short[1:-1] = touching[1:-1] & ~touching[:-2] & ~touching[2:]
        return short

    def linear(self, states: Array, first: int, last: float | None = None) -> GaussianMap:
        """Map consecutive nodes (count, n) over one piece each without noise, with the covariance that noise adds.

        The phase of the first node is in pieces since the section; the last piece may have another duration (s).
        """
        return self._by_phase(gaussian_map, states, first + np.arange(len(states)), last)

    def extremal(self, points: Array, first: int, last: float | None = None) -> HamiltonianMap:
        """Map consecutive (q, p) over one piece each by Hamilton's equations; arguments as for `linear`."""
        return self.extremal_from(points, first + np.arange(len(points)), last)

    def extremal_from(self, points: Array, phases: NDArray[np.int64], last: float | None = None) -> HamiltonianMap:
        """Map (q, p) at any phases (count,) over one piece each; arguments otherwise as for `linear`."""
        return self._by_phase(hamiltonian_map, points, phases, last)

    def extremal_between(
        self, points: Array, nodes: NDArray[np.intp], first: int, last: float | None = None
    ) -> tuple[HamiltonianMap, Array]:
        """Map (q, p) at some nodes of a path, one or two pieces apart, each to the next; return also those between.

        The last two nodes are one piece apart, which may have another duration (s).
        """
        phases, twice = first + nodes[:-1], np.diff(nodes) == 2
        over = self.extremal_from(points, phases, last)
        between = over.images[twice]
        if twice.any():
            more = self.extremal_from(between, phases[twice] + 1)
            over.images[twice] = more.images
            over.derivatives[twice] = more.derivatives @ over.derivatives[twice]
            over.actions[twice] += more.actions
        return over, between

    def _by_phase(
        self, mapped: Callable[..., Map], points: Array, phases: NDArray[np.int64], last: float | None
    ) -> Map:
        """Map nodes, those of one phase next to each other, and the last one apart if its piece has its own length."""
        phases = phases % self.pieces
        whole = len(phases) if last is None or last == self.piece else len(phases) - 1
        order = np.argsort(phases[:whole], kind="stable")
        parts = []
        if whole:
            over = {"interval": self.piece, "phases": phases[order]}
            parts.append(mapped(self.osc, points[order], self.stepper, **over))
        if whole < len(phases):
            begin = float(phases[-1]) * self.piece
            parts.append(mapped(self.osc, points[-1:], self.stepper, start_time=begin, interval=last))
        found, back = joined(parts), np.argsort(np.append(order, np.arange(whole, len(phases))))
        return dataclasses.replace(found, **{name: values[back] for name, values in vars(found).items()})

    def rate(self, point: Array, start: float) -> Array:
        """Return (q′, p′) at a point (q, p)."""
        return VectorField(self.osc).hamiltonian_rate(point[: self.size], point[self.size :], start)

    def onward(self, state: Array, phase: int, count: int) -> Array:
        """Return the noise-free motion from one state at `count` + 1 nodes, the first included."""
        return record(self.osc, Flow.STATE, self.stepper, state, phase % self.pieces * self.piece, self.piece, count)
