"""Nanoseconds per trajectory-step of the noisy paper scene, one thread, contestants side by side.

    python -m tests.benchmarks.stochastic_step [--rounds 12] [--trajectories 2048] [--periods 8] [--csv FILE]

The scene is omega = 0.570 with two Hertz stops. One step draws two normals, kicks the velocity, takes one RK4
step of the drift and kicks again. Every round runs all contestants one after another, so that ratios compare
neighbours in time. Mean and spread of the final position show that all integrate the same equation.
To enter another contestant, add it to CONTESTANTS.
"""

import argparse
import concurrent.futures as futures
import math
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit

import vibrokit as vk
from tests.benchmarks import table_file
from tests.benchmarks.by_hand import FLAGS, FORCING, SCENE, STEPS, H, branching, folded, runge_kutta
from tests.benchmarks.races import race, report, table
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.intrinsics import use_widest_registers
from vibrokit.kernels.streams import normal_pair, seed_lane, streams_of
from vibrokit.symbolic.flow_kind import Flow

LANES = 32
HALF_KICK = 0.5 * math.sqrt(SCENE.parameters["noise.intensity"] * H)
ROOT_THIRD = 1 / math.sqrt(3)
smooth_step, branching_step = runge_kutta(folded), runge_kutta(branching)


class Outcome(NamedTuple):
    nanoseconds: float  # per trajectory-step
    mean: float  # of the final position
    spread: float


# --- lane-packed


@njit(**FLAGS)
def packed_normals(streams, u, w):
    use_widest_registers()
    for i in range(LANES):
        u[i], w[i] = normal_pair(streams, i)


@njit(**FLAGS)
def packed_step(x, v, u, w, f0, f1, f2):
    use_widest_registers()
    for i in range(LANES):
        kicked = v[i] + HALF_KICK * (u[i] + ROOT_THIRD * w[i])
        x[i], after = smooth_step(x[i], kicked, f0, f1, f2)
        v[i] = after + HALF_KICK * (u[i] - ROOT_THIRD * w[i])


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
def scalar_step(q, v, u, w, f0, f1, f2, half_kick):
    position, velocity = branching_step(q, v + half_kick * (u + ROOT_THIRD * w), f0, f1, f2)
    return position, velocity + half_kick * (u - ROOT_THIRD * w)


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
    ended = run_ensemble(SCENE, Flow.NOISY, vk.RK4(STEPS), starts, periods, streams=streams, executor=Here())
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


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of one noisy step, one thread.")
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("--trajectories", type=int, default=2048, help=f"rounded up to a multiple of {LANES}")
    parser.add_argument("--periods", type=int, default=8)
    parser.add_argument("--cc", default="cc", help="C compiler")
    table_file.add_option(parser)
    options = parser.parse_args()
    trajectories = -(-options.trajectories // LANES) * LANES
    with tempfile.TemporaryDirectory() as folder:
        contestants = CONTESTANTS | {"C, xoshiro and ziggurat": c_program(folder, options.cc)}
        for contestant in contestants.values():
            contestant(LANES, 1, 0)  # compiles
        runs = race(
            {
                name: lambda number, each=each: each(trajectories, options.periods, number + 1)
                for name, each in contestants.items()
            },
            options.rounds,
        )
    final = {name: np.mean([(one.mean, one.spread) for one in each], axis=0) for name, each in runs.items()}
    costs = {name: [one.nanoseconds for one in each] for name, each in runs.items()}
    report(
        costs, REFERENCE, "ns per step",
        {name: f"   final x {mean:.5f}, spread {spread:.5f}" for name, (mean, spread) in final.items()},
    )  # fmt: skip
    table_file.write(options.csv, table(costs, REFERENCE))


if __name__ == "__main__":
    main()
