"""Trace: a polished path with all that lies between its nodes."""

from __future__ import annotations

import numpy as np

from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.newton import Extremum
from vibrokit.kernels.single import record
from vibrokit.results.energy import ExitPath
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 128  # in a section interval


def traced(carrier: Carrier, found: Extremum) -> ExitPath:
    """Record a path piece by piece, each from its own node; the time is 0 at the start, which is on the section."""
    each, n = _SAMPLES // carrier.pieces, found.points.shape[1] // 2
    last = found.ending.last(found.free, carrier.piece)
    lengths = np.full(len(found.points) - 1, carrier.piece)
    lengths[-1] = last
    paid = found.head + np.concatenate([[0.0], np.cumsum(found.actions)])
    parts, times = [], []
    for node, (length, action) in enumerate(zip(lengths, paid, strict=False)):
        start = (found.first + node) % carrier.pieces * carrier.piece
        begin = np.concatenate([found.points[node], [action]])
        part = record(carrier.osc, Flow.HAMILTONIAN, carrier.stepper, begin, start, length / each, each)
        parts.append(part[:-1])
        times.append(node * carrier.piece + length / each * np.arange(len(part) - 1))
    end = np.concatenate([found.points[-1], [paid[-1]]])
    z = np.vstack([*parts, end])
    t = np.concatenate([*times, [float(np.sum(lengths))]])
    section = np.arange(0, len(z) - (last != carrier.piece), _SAMPLES)
    return ExitPath(t, z[:, :n], z[:, n : 2 * n], z[:, -1], section)
