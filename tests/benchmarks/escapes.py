"""Time to first exits of the noisy paper scene, one thread, contestants side by side.

    python -m tests.benchmarks.escapes [--rounds 8] [--trajectories 1024]

The scene is that of stochastic_step.py with an intensity of 5e-5. Trajectories start at the attractor without impacts
and end at the section where they are in an ellipse around the attractor with two. All contestants take the same steps
and make the same test, so their mean exit times agree.
"""

import argparse
import math
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit

import vibrokit as vk
from tests.benchmarks.by_hand import FLAGS, FORCING, SCENE, STEPS, H
from tests.benchmarks.races import race, report, timed
from tests.benchmarks.stochastic_step import Here, scalar_step
from vibrokit.kernels.ensemble import Stop, run_ensemble
from vibrokit.kernels.streams import streams_of
from vibrokit.symbolic.flow_kind import Flow

INTENSITY = 5e-5
# find_structure(SCENE, cells=(100, 100)): its attractors "clear" and "hammering", both of one period.
CLEAR = np.array([0.4665511592632757, 0.0025656190681273314])
HAMMERING = np.array([0.023582201921608106, -0.049071326504500856])
METRIC = np.array([[12.0, 3.0], [-2.0, 8.0]])  # half axes of 0.08 and 0.13; CLEAR is at a length of 5.5
ENOUGH = 100_000  # periods, more than any exit takes


class Exits(NamedTuple):
    seconds: float
    count: int
    total: float  # periods taken, and their squares
    squares: float


def exits(work, *given) -> Exits:
    """Time some work that returns the periods of each trajectory."""
    periods, seconds = timed(work, *given)
    return Exits(seconds, len(periods), float(periods.sum()), float((periods.astype(float) ** 2).sum()))


# --- vibrokit


STOP = Stop(points=HAMMERING[None], point_labels=np.array([1]), metrics=METRIC[None])


def packed(trajectories: int, seed: int):
    osc, states = SCENE.replace({"noise.intensity": INTENSITY}), np.tile(CLEAR, (trajectories, 1))
    streams = streams_of(seed, np.arange(trajectories))
    return run_ensemble(
        osc, Flow.NOISY, vk.RK4(STEPS), states, ENOUGH, stop=STOP, streams=streams, executor=Here()
    ).intervals


# --- one trajectory at a time


@njit(**FLAGS)
def scalar_exits(periods, start, target, metric, half_kick, rng, forcing):
    for n in range(periods.size):
        x, v = start
        reached = False
        while not reached:
            for step in range(STEPS):
                u, w = rng.standard_normal(), rng.standard_normal()
                f0, f1, f2 = forcing[2 * step], forcing[2 * step + 1], forcing[2 * step + 2]
                x, v = scalar_step(x, v, u, w, f0, f1, f2, half_kick)
            periods[n] += 1
            dx, dv = x - target[0], v - target[1]
            first, second = metric[0, 0] * dx + metric[0, 1] * dv, metric[1, 0] * dx + metric[1, 1] * dv
            reached = math.hypot(first, second) <= 1.0


def numba_scalar(trajectories: int, seed: int):
    periods = np.zeros(trajectories, dtype=np.int64)
    half_kick, rng = 0.5 * math.sqrt(INTENSITY * H), np.random.default_rng(seed)
    scalar_exits(periods, tuple(CLEAR), tuple(HAMMERING), METRIC, half_kick, rng, FORCING)
    return periods


def c_program(folder: str, compiler: str) -> Callable[[int, int], Exits]:
    """The C program, compiled; it times itself, so starting the process does not count."""
    binary = Path(folder) / "escapes"
    source = Path(__file__).with_suffix(".c")
    subprocess.run([compiler, "-O3", "-march=native", "-o", binary, source, "-lm"], check=True)

    def contestant(trajectories: int, seed: int) -> Exits:
        numbers = [INTENSITY, *CLEAR, *HAMMERING, *METRIC.ravel()]
        command = [binary, str(trajectories), str(seed), *(repr(float(number)) for number in numbers)]
        nanoseconds, total, squares = map(
            float, subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
        )
        return Exits(nanoseconds / 1e9, trajectories, total, squares)

    return contestant


def mean_time(runs: list[Exits]) -> str:
    """The mean periods to an exit, in words."""
    count, total, squares = (sum(values) for values in zip(*(run[1:] for run in runs), strict=True))
    mean = total / count
    return f"   {mean:.2f} ± {math.sqrt((squares / count - mean**2) / count):.2f} periods"


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of first exits, one thread.")
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--trajectories", type=int, default=1024)
    parser.add_argument("--cc", default="cc", help="C compiler")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        contestants = {
            "vibrokit": lambda count, seed: exits(packed, count, seed),
            "scalar Numba, Generator": lambda count, seed: exits(numba_scalar, count, seed),
            "C, xoshiro and ziggurat": c_program(folder, options.cc),
        }
        for contestant in contestants.values():
            contestant(1, 0)  # compiles
        runs = race(
            {
                name: lambda number, each=each: each(options.trajectories, number + 1)
                for name, each in contestants.items()
            },
            options.rounds,
        )
    times = {name: mean_time(each) for name, each in runs.items()}
    report(
        {name: [1e9 * one.seconds / (one.total * STEPS) for one in each] for name, each in runs.items()},
        "vibrokit", "ns per step",
    )  # fmt: skip
    report(
        {name: [one.count / one.seconds for one in each] for name, each in runs.items()},
        "vibrokit",
        "exits per s",
        times,
    )


if __name__ == "__main__":
    main()
