"""Dense output: a polished path between its nodes."""

from __future__ import annotations

import numpy as np

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.newton import ExtremalPath
from vibrokit.kernels.single import record
from vibrokit.results.energy import ExitPath
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 128  # in a section interval: enough for pictures, and for quadrature to about 1e-6


def dense_path(propagator: SegmentPropagator, found: ExtremalPath) -> ExitPath:
    """Record a path piece by piece, each from its own node; the time is 0 at the start, which is on the section."""
    each, n, piece = _SAMPLES // propagator.pieces, propagator.size, propagator.piece
    lengths = np.append(np.full(len(found.points) - 2, piece), found.last)
    actions = found.head + np.concatenate([[0.0], np.cumsum(found.actions)])
    parts, times = [], []
    for node, length in enumerate(lengths):
        start = (found.first + node) % propagator.pieces * piece
        begin = np.append(found.points[node], actions[node])
        part = record(propagator.osc, Flow.HAMILTONIAN, propagator.stepper, begin, start, length / each, each)
        parts.append(part[:-1])
        times.append(node * piece + length / each * np.arange(len(part) - 1))
    z = np.vstack([*parts, np.append(found.points[-1], actions[-1])])
    t = np.concatenate([*times, [float(np.sum(lengths))]])
    section = np.arange(0, len(z) - (found.last != piece), _SAMPLES)
    return ExitPath(t, z[:, :n], z[:, n : 2 * n], z[:, -1], section)
