"""Nanoseconds per trajectory-step of the noisy paper scene, one thread, contestants side by side.

    python tests/benchmarks/stochastic_step.py [--rounds 12] [--trajectories 2048] [--periods 8]

The scene is omega = 0.570 with two Hertz stops. One step draws two normals, kicks the velocity, takes one RK4
step of the drift and kicks again. Every round runs all contestants one after another, so that ratios compare
neighbours in time. Mean and spread of the final position show that all integrate the same equation.
To enter another contestant, add it to CONTESTANTS.
"""

import argparse
import concurrent.futures as futures
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit

sys.path.insert(0, str(Path(__file__).parents[2]))
import vibrokit
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.fixed_steps import RK4
from vibrokit.kernels.intrinsics import use_widest_registers
from vibrokit.kernels.streams import normal_pair, seed_lane, streams_of
from vibrokit.symbolic.flow_kind import Flow

SCENE = vibrokit.load_scene("hertz-0.570")
STEPS = 256
LANES = 32
DAMPING, STIFFNESS, GAP = 0.02, 50.0, 0.5
FREQUENCY, INTENSITY = 0.57, 2e-5
H = 2 * math.pi / FREQUENCY / STEPS
FORCING = 0.18 * np.cos(FREQUENCY * H / 2 * np.arange(2 * STEPS + 1)) + 0.2
HALF_KICK = 0.5 * math.sqrt(INTENSITY * H)
ROOT_THIRD = 1 / math.sqrt(3)
FLAGS = {"nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz", "arcp"}}


class Outcome(NamedTuple):
    nanoseconds: float  # per trajectory-step
    mean: float  # of the final position
    spread: float


# --- lane-packed


@njit(**FLAGS)
def smooth_drift(x, v, forcing):
    depth = max(abs(x) - GAP, 0.0)
    return forcing - DAMPING * v - x - math.copysign(STIFFNESS * depth * math.sqrt(depth), x)


@njit(**FLAGS)
def packed_normals(streams, u, w):
    use_widest_registers()
    for i in range(LANES):
        u[i], w[i] = normal_pair(streams, i)


@njit(**FLAGS)
def packed_step(x, v, u, w, f0, f1, f2):
    use_widest_registers()
    for i in range(LANES):
        q = x[i]
        p = v[i] + HALF_KICK * (u[i] + ROOT_THIRD * w[i])
        a1 = smooth_drift(q, p, f0)
        p2 = p + 0.5 * H * a1
        a2 = smooth_drift(q + 0.5 * H * p, p2, f1)
        p3 = p + 0.5 * H * a2
        a3 = smooth_drift(q + 0.5 * H * p2, p3, f1)
        p4 = p + H * a3
        a4 = smooth_drift(q + H * p3, p4, f2)
        x[i] = q + H / 6 * (p + 2 * (p2 + p3) + p4)
        v[i] = p + H / 6 * (a1 + 2 * (a2 + a3) + a4) + HALF_KICK * (u[i] - ROOT_THIRD * w[i])


@njit(**FLAGS)
def packed_ensemble(final, periods, seed, forcing):
    streams = np.empty((4, LANES), np.uint64)
    x, v, u, w = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    for start in range(0, final.size, LANES):
        for lane in range(LANES):
            seed_lane(streams, lane, seed, start + lane)
        x[:] = 0.0
        v[:] = 0.0
        for _ in range(periods):
            for step in range(STEPS):
                packed_normals(streams, u, w)
                packed_step(x, v, u, w, forcing[2 * step], forcing[2 * step + 1], forcing[2 * step + 2])
        final[start : start + LANES] = x


# --- one trajectory at a time


@njit(**FLAGS)
def branching_drift(x, v, forcing):
    depth = abs(x) - GAP
    free_flight = forcing - DAMPING * v - x
    if depth <= 0.0:  # a predicted branch costs less than waiting for a square root
        return free_flight
    return free_flight - math.copysign(STIFFNESS * depth * math.sqrt(depth), x)


@njit(**FLAGS)
def scalar_step(q, v, u, w, f0, f1, f2, half_kick):
    p = v + half_kick * (u + ROOT_THIRD * w)
    a1 = branching_drift(q, p, f0)
    p2 = p + 0.5 * H * a1
    a2 = branching_drift(q + 0.5 * H * p, p2, f1)
    p3 = p + 0.5 * H * a2
    a3 = branching_drift(q + 0.5 * H * p2, p3, f1)
    p4 = p + H * a3
    a4 = branching_drift(q + H * p3, p4, f2)
    position = q + H / 6 * (p + 2 * (p2 + p3) + p4)
    velocity = p + H / 6 * (a1 + 2 * (a2 + a3) + a4) + half_kick * (u - ROOT_THIRD * w)
    return position, velocity


@njit(**FLAGS)
def scalar_ensemble(final, periods, seed, forcing):
    np.random.seed(seed)  # noqa: NPY002 - the contestant is Numba's own generator
    for n in range(final.size):
        x = v = 0.0
        for _ in range(periods):
            for step in range(STEPS):
                u, w = np.random.standard_normal(), np.random.standard_normal()  # noqa: NPY002
                f0, f1, f2 = forcing[2 * step], forcing[2 * step + 1], forcing[2 * step + 2]
                x, v = scalar_step(x, v, u, w, f0, f1, f2, HALF_KICK)
        final[n] = x


@njit(**FLAGS)
def scalar_ensemble_ziggurat(final, periods, rng, forcing):
    for n in range(final.size):
        x = v = 0.0
        for _ in range(periods):
            for step in range(STEPS):
                u, w = rng.standard_normal(), rng.standard_normal()
                f0, f1, f2 = forcing[2 * step], forcing[2 * step + 1], forcing[2 * step + 2]
                x, v = scalar_step(x, v, u, w, f0, f1, f2, HALF_KICK)
        final[n] = x


# --- the contestants: (trajectories, periods, seed) -> Outcome


def timed(kernel, trajectories: int, periods: int, randomness) -> Outcome:
    final = np.empty(trajectories)
    start = time.perf_counter_ns()
    kernel(final, periods, randomness, FORCING)
    elapsed = time.perf_counter_ns() - start
    return Outcome(elapsed / (trajectories * periods * STEPS), float(final.mean()), float(final.std()))


def lane_packed(trajectories: int, periods: int, seed: int) -> Outcome:
    return timed(packed_ensemble, trajectories, periods, seed)


def numba_scalar(trajectories: int, periods: int, seed: int) -> Outcome:
    return timed(scalar_ensemble, trajectories, periods, seed)


def numba_scalar_ziggurat(trajectories: int, periods: int, seed: int) -> Outcome:
    return timed(scalar_ensemble_ziggurat, trajectories, periods, np.random.default_rng(seed))


def c_program(folder: str, compiler: str) -> Callable[[int, int, int], Outcome]:
    """The C program, compiled; it times itself, so starting the process does not count."""
    binary = Path(folder) / "stochastic_step"
    source = Path(__file__).with_suffix(".c")
    subprocess.run([compiler, "-O3", "-march=native", "-o", binary, source, "-lm"], check=True)

    def contestant(trajectories: int, periods: int, seed: int) -> Outcome:
        command = [binary, str(trajectories), str(periods), str(seed)]
        output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return Outcome(*map(float, output.split()))

    return contestant


class Here(futures.Executor):
    """Carries work in the calling thread, where the other contestants run too."""

    def submit(self, work, /, *arguments, **options):
        future = futures.Future()
        future.set_result(work(*arguments, **options))
        return future


def generated(trajectories: int, periods: int, seed: int) -> Outcome:
    starts = np.zeros((trajectories, 2))
    start = time.perf_counter_ns()
    streams = streams_of(seed, np.arange(trajectories))
    ended = run_ensemble(SCENE, Flow.NOISY, RK4(STEPS), starts, periods, streams=streams, executor=Here())
    elapsed = time.perf_counter_ns() - start
    final = ended.states[:, 0]
    return Outcome(elapsed / (trajectories * periods * STEPS), float(final.mean()), float(final.std()))


REFERENCE = "lane-packed Numba"
CONTESTANTS: dict[str, Callable[[int, int, int], Outcome]] = {
    REFERENCE: lane_packed,
    "vibrokit, generated": generated,
    "scalar Numba, np.random": numba_scalar,
    "scalar Numba, Generator": numba_scalar_ziggurat,
}


def race(contestants, rounds: int, trajectories: int, periods: int) -> dict[str, list[Outcome]]:
    outcomes = {name: [] for name in contestants}
    for contestant in contestants.values():
        contestant(LANES, 1, 0)  # compiles
    for number in range(rounds):
        names = list(contestants)
        for name in names if number % 2 else reversed(names):
            outcomes[name].append(contestants[name](trajectories, periods, number + 1))
    return outcomes


def report(outcomes: dict[str, list[Outcome]]) -> None:
    print(f"{'':26}{'ns per step':>21}{'over ' + REFERENCE:>27}{'final x':>19}")
    print(f"{'':26}{'median':>9}{'quartiles':>12}{'median':>15}{'quartiles':>12}{'mean':>11}{'spread':>8}")
    reference = np.array([outcome.nanoseconds for outcome in outcomes[REFERENCE]])
    for name, runs in outcomes.items():
        cost = np.array([outcome.nanoseconds for outcome in runs])
        row = f"{name:26}"
        for values, width in ((cost, 9), (cost / reference, 15)):
            low, middle, high = np.percentile(values, [25, 50, 75])
            row += f"{middle:{width}.2f}{f'{low:.2f}-{high:.2f}':>12}"
        mean, spread = np.mean([(outcome.mean, outcome.spread) for outcome in runs], axis=0)
        print(row + f"{mean:11.5f}{spread:8.5f}")


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of one noisy step, one thread.")
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("--trajectories", type=int, default=2048, help=f"rounded up to a multiple of {LANES}")
    parser.add_argument("--periods", type=int, default=8)
    parser.add_argument("--cc", default="cc", help="C compiler")
    options = parser.parse_args()
    trajectories = -(-options.trajectories // LANES) * LANES
    with tempfile.TemporaryDirectory() as folder:
        contestants = CONTESTANTS | {"C, xoshiro and ziggurat": c_program(folder, options.cc)}
        report(race(contestants, options.rounds, trajectories, options.periods))


if __name__ == "__main__":
    main()
