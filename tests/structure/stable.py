"""Stable orbits without a search."""

from vibrokit.kernels.choice import single_stepper
from vibrokit.structure.attractors.describe import describe_orbit
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow


def stable_orbits(osc, *starts, period=1):
    """Describe the stable orbits that some starts come to."""
    stepper = single_stepper(osc, Flow.STATE_VARIATIONAL)
    ends = osc.section_map(starts, 400, stepper=stepper)
    return tuple(describe_orbit(osc, refine_orbit(osc, end, period, stepper), stepper) for end in ends)
