"""Orbits without a search."""

import numpy as np

from vibrokit.kernels.choice import single_stepper
from vibrokit.results.saddle import Saddle
from vibrokit.structure.attractors.describe import describe_orbit
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow


def stable_orbits(osc, *starts, period=1):
    """Describe the stable orbits that some starts come to."""
    stepper = single_stepper(osc, Flow.STATE_VARIATIONAL)
    ends = osc.section_map(starts, 400, stepper=stepper)
    return tuple(describe_orbit(osc, refine_orbit(osc, end, period, stepper), stepper) for end in ends)


def saddle(*points, kind="saddle", period=1, duration=0.0):
    """A record with what manifolds are grown from."""
    nothing, places = np.empty(0, dtype=complex), np.array(points, dtype=float)
    return Saddle(kind, period, duration, places, places[:1], nothing, nothing, (0, 1), 0.0, 0.0)
