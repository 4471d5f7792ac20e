"""A hand-written sample of the scene part of a kernel, so that the templates can be read and checked.

Two Hertz stops, a linear spring, harmonic and constant forcing; the Hamiltonian flow z = (x, v, p1, p2, S). `theta`
holds the damping 2ζω_n, ω_n², the amplitude and frequency of the harmonic force, the constant force, and stiffness and
position of the right and of the left stop. The attempts of all lanes are too long to be written by hand
(`vibrokit.kernels.attempts` writes them); here are their offsets in the numbers of a block, and what they do.
"""

from math import cos, sin, sqrt

from numba import njit

OPTIONS = {"nogil": True, "cache": True, "error_model": "numpy"}
CONTRACTED = {**OPTIONS, "fastmath": {"contract", "nsz", "arcp"}}
INLINED = {**CONTRACTED, "forceinline": True}

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
STATE, TRIAL = 0, 48  # states (z, t) before and after an attempt, each number in a row of lanes
LENGTH, ERROR, FACTOR = 96, 104, 112  # of the attempt; its error by the tolerance; by what to lengthen the next
LENGTHS, POINT, SLOPES = 120, 168, 216  # for each number; the point of a stage, and the slopes at all stages
SIZES, FIFTHS, THIRDS = 792, 840, 888  # of the numbers, and of two estimates of their errors
SIGMA, COURSE, WALL, SIDE, PUSHES = 936, 944, 952, 960, 968  # the course, and the stops
GRAIN, DEPTH, NEAR = 984, 992, 1000  # rounding of x at a stop
NUMBERS = 1008


@njit(**INLINED)
def forcing(t, theta):
    return theta[2] * cos(theta[3] * t)


@njit(**INLINED)
def stop(i, theta):
    if i == 0:
        return theta[6]
    return theta[8]


@njit(**INLINED)
def law(i, depth, rate, theta):
    if i == 0:
        return theta[5] * depth * sqrt(depth)
    return theta[7] * depth * sqrt(depth)


@njit(**INLINED)
def rates(x, v, p1, p2, S, f, on0, on1, theta):
    depth = x - theta[6] if on0 else theta[8] - x
    depth = max(depth, 1e-300) if on0 or on1 else 0.0
    hardness, side = (theta[5], 1.0) if on0 else (theta[7], -1.0)
    force = f + theta[4] - theta[0] * v - theta[1] * x - side * hardness * depth * sqrt(depth) + p2
    stiffness = theta[1] + 1.5 * hardness * sqrt(depth)
    return v, force, stiffness * p2, theta[0] * p2 - p1, 0.5 * p2 * p2


@njit(**OPTIONS)
def rhs(t, z, pushing, theta, out):
    f = forcing(t, theta)
    values = rates(z[0], z[1], z[2], z[3], z[4], f, pushing[0] != 0, pushing[1] != 0, theta)
    out[0], out[1], out[2], out[3], out[4] = values


@njit(**INLINED)
def attempt_lanes(lanes, theta, pushing, room):
    """Take a step from STATE to TRIAL in each lane, along its course."""


@njit(**INLINED)
def misfit_lanes(lanes, tolerance, span):
    """Find the ERROR of each attempt in units of the tolerance: the largest over the components.

    Each block is measured by its own size; a velocity near 0 by a hundredth of x over `span`, the time to integrate
    over. No step must be more accurate than the rounding of x allows: GRAIN is the uncertainty of the acceleration
    from it. So is that of the second derivative of a law, which affects only derivatives of the momenta.

    The fifth-order estimate can vanish by chance. In a step that is short enough the error is 0.02 to 0.1 times the
    square of the third-order one, which is a lower bound.
    """


@njit(**OPTIONS)
def flight_rate(theta):
    return max(2.0 * sqrt(theta[1]) + theta[0], theta[3])


@njit(**OPTIONS)
def taylor(t, z, theta, c):
    even = theta[2] * cos(theta[3] * t)
    odd = -theta[2] * sin(theta[3] * t)
    for e in range(EQUATIONS):
        c[e * TERMS] = z[e]
    for k in range(ORDER):
        force = even + theta[4] if k == 0 else even
        even, odd = odd * theta[3] / (k + 1), -even * theta[3] / (k + 1)
        x, v, p1, p2, action = (e * TERMS + k for e in range(EQUATIONS))
        c[x + 1] = c[v] / (k + 1)
        c[v + 1] = (force - theta[0] * c[v] - theta[1] * c[x] + c[p2]) / (k + 1)
        c[p1 + 1] = theta[1] * c[p2] / (k + 1)
        c[p2 + 1] = (theta[0] * c[p2] - c[p1]) / (k + 1)
        square = 0.0
        for j in range(k + 1):
            square += c[3 * TERMS + j] * c[3 * TERMS + k - j]
        c[action + 1] = 0.5 * square / (k + 1)
