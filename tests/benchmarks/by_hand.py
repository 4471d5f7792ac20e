"""`hertz-0.570` as one writes it by hand for Numba: numbers folded in, forcing tabulated, roots in place of powers."""

import math

import numpy as np
from numba import njit

import vibrokit as vk

STEPS = 256  # in a period
SCENE = vk.load_scene("hertz-0.570")
NUMBERS = SCENE.parameters
NATURAL = NUMBERS["natural_frequency"]
DAMPING, SQUARE = 2 * NUMBERS["damping_ratio"] * NATURAL, NATURAL**2
GAP, STIFFNESS = NUMBERS["barriers.0.position"], NUMBERS["barriers.0.law.stiffness"]
AMPLITUDE, FREQUENCY = NUMBERS["excitations.0.amplitude"], NUMBERS["excitations.0.frequency"]
CONSTANT = NUMBERS["excitations.1.force"]
H = 2 * math.pi / FREQUENCY / STEPS
HALF, SIXTH = 0.5 * H, H / 6
FORCING = AMPLITUDE * np.cos(FREQUENCY * HALF * np.arange(2 * STEPS + 1)) + CONSTANT  # at the nodes of all steps
FLAGS = {"nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz", "arcp"}}


@njit(**FLAGS)
def branching(x, v, f):
    """Acceleration; a predicted branch costs less than waiting for a square root."""
    depth = abs(x) - GAP
    free_flight = f - SQUARE * x - DAMPING * v
    if depth <= 0.0:
        return free_flight
    return free_flight - math.copysign(STIFFNESS * depth, x) * math.sqrt(depth)


@njit(**FLAGS)
def folded(x, v, f):
    """Acceleration, by symmetry: one depth, one root, no choice."""
    depth = max(abs(x) - GAP, 0.0)
    return f - SQUARE * x - DAMPING * v - math.copysign(STIFFNESS * depth, x) * math.sqrt(depth)


def runge_kutta(acceleration):
    """One classical step of (x, v) with an acceleration, compiled."""

    @njit(**FLAGS)
    def step(x, v, f0, f1, f2):
        a1 = acceleration(x, v, f0)
        v2 = v + HALF * a1
        a2 = acceleration(x + HALF * v, v2, f1)
        v3 = v + HALF * a2
        a3 = acceleration(x + HALF * v2, v3, f1)
        v4 = v + H * a3
        a4 = acceleration(x + H * v3, v4, f2)
        return x + SIXTH * (v + 2 * (v2 + v3) + v4), v + SIXTH * (a1 + 2 * (a2 + a3) + a4)

    return step
