"""Microseconds per trajectory-period of the paper scene's Hamiltonian flow, contestants side by side.

    python -m tests.benchmarks.hamiltonian_ensemble [--rounds 12] [--trajectories 8192] [--periods 20] [--threads 2]
                                                    [--csv FILE]

The scene is omega = 0.570 with two Hertz stops; five equations (x, v, two momenta, action), classical Runge-Kutta
with 256 steps a period. Every round runs all contestants one after another, so that ratios compare neighbours in
time. All must agree before they race: after one period to rounding, after the whole run as far as rounding has
grown by then, for many of these trajectories are chaotic. To enter another contestant, add it to CONTESTANTS.
"""

import argparse
import concurrent.futures as futures
import math
from collections.abc import Callable

import numba
import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

import vibrokit as vk
from tests.benchmarks import table_file
from tests.benchmarks.by_hand import (
    AMPLITUDE,
    CONSTANT,
    DAMPING,
    FLAGS,
    FORCING,
    FREQUENCY,
    GAP,
    HALF,
    NATURAL,
    SCENE,
    SIXTH,
    SQUARE,
    STEPS,
    STIFFNESS,
    H,
)
from tests.benchmarks.races import fastest, race, report, table, timed
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.symbolic.flow_kind import Flow

LANES = 32
SLOPE = 1.5 * STIFFNESS

Array = NDArray[np.float64]
Contestant = Callable[[Array, int], Array]


# --- the right-hand side, by hand, in four forms; what arrives last, the root, is used last


@njit(**FLAGS)
def folded(x, v, p, q, f):
    """By symmetry: one depth, one root, no choice."""
    depth = max(abs(x) - GAP, 0.0)
    root = math.sqrt(depth)
    free_flight = f - SQUARE * x - DAMPING * v + q
    push = math.copysign(STIFFNESS * depth, x)
    return v, free_flight - push * root, q * (SQUARE + SLOPE * root), DAMPING * q - p, 0.5 * q * q


@njit(**FLAGS)
def both_stops(x, v, p, q, f):
    """Each stop by itself, without a branch."""
    right, left = max(x - GAP, 0.0), max(-GAP - x, 0.0)
    one, other = math.sqrt(right), math.sqrt(left)
    free_flight = f - SQUARE * x - DAMPING * v + q
    force = STIFFNESS * left * other - STIFFNESS * right * one
    return v, free_flight + force, q * (SQUARE + SLOPE * (one + other)), DAMPING * q - p, 0.5 * q * q


@njit(**FLAGS)
def branching(x, v, p, q, f):
    """A predicted branch costs less than waiting for a square root."""
    depth = abs(x) - GAP
    free_flight = f - SQUARE * x - DAMPING * v + q
    if depth <= 0.0:
        return v, free_flight, q * SQUARE, DAMPING * q - p, 0.5 * q * q
    root = math.sqrt(depth)
    push = math.copysign(STIFFNESS * depth, x)
    return v, free_flight - push * root, q * (SQUARE + SLOPE * root), DAMPING * q - p, 0.5 * q * q


@njit(**FLAGS)
def general(x, v, p, q, f, square, damping, right, right_stiffness, left, left_stiffness):
    """What a generated kernel must do: numbers given at run time, and two stops that need not be alike."""
    nearer = x - right > left - x
    stiffness = right_stiffness if nearer else left_stiffness
    depth = max(x - right, left - x, 0.0)
    root = math.sqrt(depth)
    free_flight = f - square * x - damping * v + q
    push = stiffness * depth if nearer else -stiffness * depth
    return v, free_flight - push * root, q * (square + 1.5 * stiffness * root), damping * q - p, 0.5 * q * q


def runge_kutta(slopes):
    """One classical step with the given right-hand side, compiled."""

    @njit(**FLAGS)
    def step(x, v, p, q, s, f0, f1, f2, *numbers):
        x1, v1, p1, q1, s1 = slopes(x, v, p, q, f0, *numbers)
        x2, v2, p2, q2, s2 = slopes(x + HALF * x1, v + HALF * v1, p + HALF * p1, q + HALF * q1, f1, *numbers)
        x3, v3, p3, q3, s3 = slopes(x + HALF * x2, v + HALF * v2, p + HALF * p2, q + HALF * q2, f1, *numbers)
        x4, v4, p4, q4, s4 = slopes(x + H * x3, v + H * v3, p + H * p3, q + H * q3, f2, *numbers)
        return (
            x + SIXTH * (x1 + 2 * (x2 + x3) + x4),
            v + SIXTH * (v1 + 2 * (v2 + v3) + v4),
            p + SIXTH * (p1 + 2 * (p2 + p3) + p4),
            q + SIXTH * (q1 + 2 * (q2 + q3) + q4),
            s + SIXTH * (s1 + 2 * (s2 + s3) + s4),
        )

    return step


# --- lane-packed


def lane_packed(slopes, numbers: tuple[float, ...] = ()) -> Contestant:
    step = runge_kutta(slopes)

    @njit(**FLAGS)
    def packed_step(z, f0, f1, f2, *numbers):
        for i in range(LANES):
            x, v, p, q, s = z[0, i], z[1, i], z[2, i], z[3, i], z[4, i]
            z[0, i], z[1, i], z[2, i], z[3, i], z[4, i] = step(x, v, p, q, s, f0, f1, f2, *numbers)

    @njit(**FLAGS)
    def packed_block(starts, final, periods, forcing, numbers):
        z = np.empty((5, LANES))
        z[:] = starts.T
        for _ in range(periods):
            for k in range(STEPS):
                packed_step(z, forcing[2 * k], forcing[2 * k + 1], forcing[2 * k + 2], *numbers)
        final[:] = z.T

    @njit(**FLAGS, parallel=True)
    def run(starts, periods, forcing, numbers):
        final = np.empty_like(starts)
        for block in prange(starts.shape[0] // LANES):
            here = slice(block * LANES, (block + 1) * LANES)
            packed_block(starts[here], final[here], periods, forcing, numbers)
        return final

    return lambda starts, periods: run(starts, periods, FORCING, numbers)


# --- one trajectory at a time


def scalar(slopes) -> Contestant:
    step = runge_kutta(slopes)

    @njit(**FLAGS, parallel=True)
    def run(starts, periods, forcing):
        final = np.empty_like(starts)
        for n in prange(starts.shape[0]):
            x, v, p, q, s = starts[n, 0], starts[n, 1], starts[n, 2], starts[n, 3], starts[n, 4]
            for _ in range(periods):
                for k in range(STEPS):
                    x, v, p, q, s = step(x, v, p, q, s, forcing[2 * k], forcing[2 * k + 1], forcing[2 * k + 2])
            final[n, 0], final[n, 1], final[n, 2], final[n, 3], final[n, 4] = x, v, p, q, s
        return final

    return lambda starts, periods: run(starts, periods, FORCING)


# --- the formula as one writes it down


@njit
def naive_slopes(t, z):
    x, v, p, q, _ = z
    force, stiffness = 0.0, 0.0
    if x > GAP:
        force = -STIFFNESS * (x - GAP) ** 1.5
        stiffness = 1.5 * STIFFNESS * (x - GAP) ** 0.5
    if x < -GAP:
        force = STIFFNESS * (-GAP - x) ** 1.5
        stiffness = 1.5 * STIFFNESS * (-GAP - x) ** 0.5
    drift = AMPLITUDE * math.cos(FREQUENCY * t) + CONSTANT - DAMPING * v - NATURAL**2 * x + force
    return v, drift + q, q * (NATURAL**2 + stiffness), DAMPING * q - p, q**2 / 2


@njit
def moved(z, length, k):
    return (
        z[0] + length * k[0],
        z[1] + length * k[1],
        z[2] + length * k[2],
        z[3] + length * k[3],
        z[4] + length * k[4],
    )


@njit(parallel=True)
def naive_run(starts, periods):
    final = np.empty_like(starts)
    for n in prange(starts.shape[0]):
        z = (starts[n, 0], starts[n, 1], starts[n, 2], starts[n, 3], starts[n, 4])
        for _ in range(periods):
            for step in range(STEPS):
                t = step * H
                k1 = naive_slopes(t, z)
                k2 = naive_slopes(t + H / 2, moved(z, H / 2, k1))
                k3 = naive_slopes(t + H / 2, moved(z, H / 2, k2))
                k4 = naive_slopes(t + H, moved(z, H, k3))
                z = moved(moved(moved(moved(z, H / 6, k1), H / 3, k2), H / 3, k3), H / 6, k4)
        final[n, 0], final[n, 1], final[n, 2], final[n, 3], final[n, 4] = z
    return final


# --- vibrokit's


def generated(pool: futures.Executor) -> Contestant:
    def run(starts: Array, periods: int) -> Array:
        return run_ensemble(SCENE, Flow.HAMILTONIAN, vk.RK4(STEPS), starts, periods, executor=pool).states

    return run


REFERENCE, SCALAR = "vibrokit, generated", "scalar"
CONTESTANTS: dict[str, Contestant] = {
    "lane-packed by hand, general": lane_packed(general, (SQUARE, DAMPING, GAP, STIFFNESS, -GAP, STIFFNESS)),
    "lane-packed by hand, folded": lane_packed(folded),
    "lane-packed by hand, both stops": lane_packed(both_stops),
    f"{SCALAR}, branching": scalar(branching),
    f"{SCALAR}, folded": scalar(folded),
    f"{SCALAR}, both stops": scalar(both_stops),
    "naive scalar": naive_run,
}


def start_states(trajectories: int) -> Array:
    rng = np.random.default_rng(0)
    starts = np.zeros((trajectories, 5))
    starts[:, :2] = rng.uniform(-0.6, 0.6, (trajectories, 2))
    starts[:, 2:4] = 1e-4 * rng.standard_normal((trajectories, 2))
    return starts


def check(contestants: dict[str, Contestant], starts: Array, periods: int) -> None:
    """All give the same trajectories, as far as they are defined at all; this also compiles them."""
    print(f"median relative difference from {REFERENCE}")
    reference = contestants[REFERENCE]
    for count, allowed in ((1, 1e-12), (periods, 1e-8)):
        expected = reference(starts, count)
        nudged = np.median(np.abs(reference(np.nextafter(starts, 1.0), count) / expected - 1))
        print(f"  after {count} periods; starts that differ in the last bit: {nudged:.1e}")
        for name, contestant in contestants.items():
            difference = np.median(np.abs(contestant(starts, count) / expected - 1))
            print(f"    {name:32}{difference:9.1e}")
            assert difference <= max(allowed, 100 * nudged), f"{name} differs by {difference:.1e}."


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of the lane-packed Hamiltonian ensemble.")
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("--trajectories", type=int, default=8192, help=f"rounded up to a multiple of {LANES}")
    parser.add_argument("--periods", type=int, default=20)
    parser.add_argument("--threads", type=int, default=2)
    table_file.add_option(parser)
    options = parser.parse_args()
    numba.set_num_threads(options.threads)
    starts = start_states(-(-options.trajectories // LANES) * LANES)
    with futures.ThreadPoolExecutor(options.threads) as pool:
        contestants = {REFERENCE: generated(pool)} | CONTESTANTS
        check(contestants, starts, options.periods)
        costs = {
            name: [1e6 * seconds / (len(starts) * options.periods) for _, seconds in runs]
            for name, runs in race(
                {name: lambda _, run=run: timed(run, starts, options.periods) for name, run in contestants.items()},
                options.rounds,
            ).items()
        }
    report(costs, REFERENCE, "µs per trajectory-period")
    table_file.write(options.csv, table(costs, REFERENCE))
    best = fastest(costs, SCALAR)
    print(f"best scalar: {best}, {np.median(np.divide(costs[best], costs[REFERENCE])):.2f} times {REFERENCE}")


if __name__ == "__main__":
    main()
