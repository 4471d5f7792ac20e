"""Orbits without a search, and records with what one part of the package reads."""

import math

import numpy as np

from vibrokit.kernels.choice import single_stepper
from vibrokit.results.attractor import Attractor
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


def attractor(points, kind="periodic", orbit=None):
    """A record with what a classifier reads."""
    points = np.atleast_2d(points)
    none = np.empty(0, dtype=complex)
    return Attractor(
        label=0, kind=kind, period=len(points), duration=math.nan, points=points,
        orbit=np.empty((0, 2)) if orbit is None else orbit, multipliers=none, exponents=none, exponent_error=0.0,
        hits={}, peak_depth={}, peak_force={}, basin_fraction=0.0, basin_fraction_error=0.0, residual=0.0, error=0.0,
    )  # fmt: skip
