"""A hand-written sample of what stands above the templates, so that they can be read and checked.

The sizes are those of flows of a scene with two states and two stops. What the driver calls in other modules is in
`vibrokit.kernels.links`.
"""

from vibrokit.kernels.links import rhs

__all__ = ["rhs"]  # of the scene itself, where a template stands in its module

STATES = 2
EQUATIONS = 5
BARRIERS = 2
CLAMPED = (False, False)
JUMPS = (False, False)
ORDER, TERMS = 22, 23
DERIVATIVES = 0
COVARIANCE = 0

LANES = 8
NODES, ROOM = 3, 1  # of fixed steps: values of the forcing, and numbers to work in

# Numbers of a block of lanes, each in a row of lanes. Of a state (t, z), these are the places of z; so are those of the
# slopes of the first stage.
ROW, CLOCK = 22, -1  # rows of a state, enough for every flow; the row of t
STATE, TRIAL = 8, 184  # states before and after an attempt
LENGTH, ERROR, FACTOR = 352, 360, 368  # of the attempt; its error by the tolerance; by what to lengthen the next
POINT, SLOPES = 560, 736  # the point of a stage, and the slopes at all stages
SIGMA, COURSE, WALL, SIDE, PUSHES = 3360, 3368, 3376, 3384, 3392  # the course, and the stops
GRAIN, DEPTH = 3408, 3416  # rounding of x at a stop
NUMBERS = 3432
