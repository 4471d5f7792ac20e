"""Linearize Hamilton's equations along any closed orbit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.linearized_at_nodes import orbit_at_nodes
from vibrokit.analyzers.polishing.linearized_cycle import linearized_cycle
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit

Array = NDArray[np.float64]


def linearized_orbit(propagator: SegmentPropagator, nodes: Array, period: int, duration: float) -> LinearizedOrbit:
    """Linearize Hamilton's equations along an orbit, an equilibrium, or a limit cycle, of any stability.

    Parameters
    ----------
    propagator : SegmentPropagator
    nodes : array (count, n)
        One of its points on the section, or several states at equal times from such a point on; they are refined.
    period : int
        In section intervals; 0 and 1 are the same.
    duration : float
        Time after which it repeats (s); 0 for an equilibrium.

    Raises
    ------
    StructureError
        There is no such orbit near the nodes, or it is not hyperbolic.
    """
    if propagator.osc.autonomous and duration > 0:
        return linearized_cycle(propagator, nodes[0], duration)
    return orbit_at_nodes(propagator, nodes, max(1, period))
