"""A hand-written sample of what the emitter generates, so that the templates can be read, checked and tested.

Two Hertz stops, a linear spring, harmonic and constant forcing; the Hamiltonian flow z = (x, v, p1, p2, S). `theta`
holds the damping 2ζω_n, ω_n², the amplitude and frequency of the harmonic force, the constant force, and stiffness and
position of the right and of the left stop.
"""

from math import cos, sin, sqrt

from numba import njit

OPTIONS = {"nogil": True, "cache": True, "error_model": "numpy"}
CONTRACTED = {**OPTIONS, "fastmath": {"contract", "nsz", "arcp"}}

STATES = 2
MOMENTA = 2
EQUATIONS = 5
BARRIERS = 2
SIDES = (1.0, -1.0)
CLAMPED = (False, False)
ROOTED = (True, True)
JUMPS = (False, False)
ORDER = 22
DERIVATIVES = 0
COVARIANCE = 0


@njit(**OPTIONS)
def forcing(t, theta):
    return theta[2] * cos(theta[3] * t) + theta[4]


@njit(**OPTIONS)
def stop(i, theta):
    if i == 0:
        return theta[6]
    return theta[8]


@njit(**OPTIONS)
def law(i, depth, rate, theta):
    if i == 0:
        return theta[5] * depth * sqrt(depth)
    return theta[7] * depth * sqrt(depth)


@njit(**OPTIONS)
def rhs(t, z, pushing, theta, out):
    x, v, p1, p2 = z[0], z[1], z[2], z[3]
    push = 0.0
    stiffness = 0.0
    if pushing[0]:
        depth = max(x - theta[6], 0.0)
        push -= theta[5] * depth * sqrt(depth)
        stiffness += 1.5 * theta[5] * sqrt(depth)
    if pushing[1]:
        depth = max(theta[8] - x, 0.0)
        push += theta[7] * depth * sqrt(depth)
        stiffness += 1.5 * theta[7] * sqrt(depth)
    out[0] = v
    out[1] = forcing(t, theta) - theta[0] * v - theta[1] * x + push + p2
    out[2] = (theta[1] + stiffness) * p2
    out[3] = theta[0] * p2 - p1
    out[4] = 0.5 * p2 * p2


@njit(**OPTIONS)
def flight_rate(theta):
    return max(2.0 * sqrt(theta[1]) + theta[0], theta[3])


@njit(**OPTIONS)
def taylor(t, z, theta, c):
    even = theta[2] * cos(theta[3] * t)
    odd = -theta[2] * sin(theta[3] * t)
    for e in range(EQUATIONS):
        c[e, 0] = z[e]
    for k in range(ORDER):
        force = even + theta[4] if k == 0 else even
        even, odd = odd * theta[3] / (k + 1), -even * theta[3] / (k + 1)
        action = 0.0
        for j in range(k + 1):
            action += c[3, j] * c[3, k - j]
        c[0, k + 1] = c[1, k] / (k + 1)
        c[1, k + 1] = (force - theta[0] * c[1, k] - theta[1] * c[0, k] + c[3, k]) / (k + 1)
        c[2, k + 1] = theta[1] * c[3, k] / (k + 1)
        c[3, k + 1] = (theta[0] * c[3, k] - c[2, k]) / (k + 1)
        c[4, k + 1] = 0.5 * action / (k + 1)
