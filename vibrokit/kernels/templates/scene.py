"""A hand-written sample of what stands above the templates, so that they can be read and checked.

The sizes are those of the Hamiltonian flow z = (x, v, p1, p2, S) of a scene with two Hertz stops. What the driver calls
in the module of a scene is in `vibrokit.kernels.links`; `misfit_lanes` is too long to be written by hand
(`vibrokit.kernels.attempts` writes it), so here are the offsets in the numbers of a block, and what it does.
"""

from numba import njit

from vibrokit.kernels.links import rhs
from vibrokit.kernels.options import INNER_LANES

__all__ = ["rhs"]  # of the scene itself, where a template stands in its module

STATES = 2
EQUATIONS = 5
BARRIERS = 2
SIDES = (1.0, -1.0)
CLAMPED = (False, False)
ROOTED = (True, True)
JUMPS = (False, False)
ORDER, TERMS = 22, 23
DERIVATIVES = 0
COVARIANCE = 0

LANES = 8
NODES, ROOM = 3, 1  # of fixed steps: values of the forcing, and numbers to work in
STATE, TRIAL = 0, 48  # states (z, t) before and after an attempt, each number in a row of lanes
LENGTH, ERROR, FACTOR = 96, 104, 112  # of the attempt; its error by the tolerance; by what to lengthen the next
LENGTHS, POINT, SLOPES = 120, 168, 216  # for each number; the point of a stage, and the slopes at all stages
SIZES, FIFTHS, THIRDS = 792, 840, 888  # of the numbers, and of two estimates of their errors
SIGMA, COURSE, WALL, SIDE, PUSHES = 936, 944, 952, 960, 968  # the course, and the stops
GRAIN, DEPTH, NEAR = 984, 992, 1000  # rounding of x at a stop
NUMBERS = 1008


@njit(**INNER_LANES)
def misfit_lanes(lanes, tolerance, span):
    """Find the ERROR of each attempt in units of the tolerance: the largest over the components.

    Each block is measured by its own size; a velocity near 0 by a hundredth of x over `span`, the time to integrate
    over. No step must be more accurate than the rounding of x allows: GRAIN is the uncertainty of the acceleration
    from it. So is that of the second derivative of a law, which affects only derivatives of the momenta.

    The fifth-order estimate can vanish by chance. In a step that is short enough the error is 0.02 to 0.1 times the
    square of the third-order one, which is a lower bound.
    """
