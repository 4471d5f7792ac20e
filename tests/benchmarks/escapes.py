"""Time to first exits of the noisy paper scene, one thread, contestants side by side.

    python tests/benchmarks/escapes.py [--rounds 8] [--trajectories 1024] [--leg 16]

The scene is that of stochastic_step.py with an intensity of 5e-5. Trajectories start at the attractor without impacts
and end at the section where they are in an ellipse around the attractor with two. All contestants take the same steps
and make the same test, so their mean exit times agree. "in legs" pauses after every leg and goes on with those that
are still under way, which closes the ranks in the lanes. A lane is idle while it holds no trajectory; the replay of
the rule by which lanes are refilled says for how many steps.
"""

import argparse
import functools
import heapq
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

sys.path.insert(0, str(Path(__file__).parent))
from stochastic_step import FLAGS, FORCING, LANES, SCENE, STEPS, H, Here, scalar_step

from vibrokit.kernels.ensemble import Stop, _blocks, run_ensemble
from vibrokit.kernels.fixed_steps import RK4
from vibrokit.kernels.stopping import REACHED
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
    idle: tuple[float, float] = (math.nan, math.nan)  # share of lane steps, while trajectories wait and in all


def exits(seconds: float, periods, idle=(math.nan, math.nan)) -> Exits:
    periods = np.asarray(periods, dtype=float)
    return Exits(seconds, periods.size, float(periods.sum()), float((periods**2).sum()), idle)


# --- vibrokit


class Lanes:
    """Adds up how many steps lanes took and how many of them without a trajectory, in periods."""

    def __init__(self) -> None:
        self.waiting, self.total = np.zeros(2, dtype=int), np.zeros(2, dtype=int)  # idle, all

    def replay(self, intervals) -> None:
        """Fill the lanes of each block as the kernel does: at every section, in order, until none waits."""
        for block in _blocks(len(intervals)):
            ends = [0] * LANES  # when each lane is free
            last = 0
            for taken in intervals[block]:
                last = ends[0]  # the last trajectory starts
                heapq.heapreplace(ends, ends[0] + int(taken))
            busy, length = int(intervals[block].sum()), max(ends)
            after = sum(end - last for end in ends if end > last)
            self.waiting += LANES * last - (busy - after), LANES * last
            self.total += LANES * length - busy, LANES * length

    def idle(self) -> tuple[float, float]:
        shares = (float(idle / max(both, 1)) for idle, both in (self.waiting, self.total))
        return next(shares), next(shares)


STOP = Stop(points=HAMMERING[None], point_labels=np.array([1]), metrics=METRIC[None])


def packed(trajectories: int, seed: int, leg: int) -> Exits:
    osc, stepper, lanes, parts = SCENE.replace({"noise.intensity": INTENSITY}), RK4(STEPS), Lanes(), []
    start = time.perf_counter_ns()
    states, streams = np.tile(CLEAR, (trajectories, 1)), streams_of(seed, np.arange(trajectories))
    periods, left = np.zeros(trajectories, dtype=np.int64), np.arange(trajectories)
    while left.size:
        ended = run_ensemble(osc, Flow.NOISY, stepper, states, leg, stop=STOP, streams=streams, executor=Here())
        parts.append(ended.intervals)
        periods[left] += ended.intervals
        going = ended.status != REACHED
        states, streams, left = ended.states[going], ended.streams[going], left[going]
    elapsed = time.perf_counter_ns() - start
    for part in parts:
        lanes.replay(part)
    return exits(elapsed / 1e9, periods, lanes.idle())


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


def numba_scalar(trajectories: int, seed: int) -> Exits:
    periods = np.zeros(trajectories, dtype=np.int64)
    half_kick, rng = 0.5 * math.sqrt(INTENSITY * H), np.random.default_rng(seed)
    start = time.perf_counter_ns()
    scalar_exits(periods, tuple(CLEAR), tuple(HAMMERING), METRIC, half_kick, rng, FORCING)
    return exits((time.perf_counter_ns() - start) / 1e9, periods)


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


# --- the race

REFERENCE = "vibrokit"


def race(contestants: dict[str, Callable[[int, int], Exits]], rounds: int, trajectories: int) -> dict[str, list[Exits]]:
    outcomes = {name: [] for name in contestants}
    for contestant in contestants.values():
        contestant(1, 0)  # compiles
    for number in range(rounds):
        names = list(contestants)
        for name in names if number % 2 else reversed(names):
            outcomes[name].append(contestants[name](trajectories, number + 1))
    return outcomes


def report(outcomes: dict[str, list[Exits]]) -> None:
    print(
        f"{'':26}{'ns per step':>21}{'exits per s':>13}{'exits over ' + REFERENCE:>23}{'mean time, periods':>21}",
        end="",
    )
    print(f"{'idle, waiting':>15}{'in all':>8}")
    speeds = {name: np.array([run.count / run.seconds for run in runs]) for name, runs in outcomes.items()}
    for name, runs in outcomes.items():
        steps = np.array([1e9 * run.seconds / (run.total * STEPS) for run in runs])
        low, middle, high = np.percentile(steps, [25, 50, 75])
        row = f"{name:26}{middle:9.2f}{f'{low:.2f}-{high:.2f}':>12}{np.median(speeds[name]):13.1f}"
        low, middle, high = np.percentile(speeds[name] / speeds[REFERENCE], [25, 50, 75])
        row += f"{middle:11.3f}{f'{low:.3f}-{high:.3f}':>12}"
        count, total, squares = (sum(values) for values in zip(*(run[1:4] for run in runs), strict=True))
        mean = total / count
        row += f"{f'{mean:.2f} ± {math.sqrt((squares / count - mean**2) / count):.2f}':>21}"
        idle = np.mean([run.idle for run in runs], axis=0)
        print(row + "".join("" if math.isnan(x) else f"{x:{width}.1%}" for x, width in zip(idle, (15, 8), strict=True)))


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of first exits, one thread.")
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--trajectories", type=int, default=1024)
    parser.add_argument("--leg", type=int, default=16, help="periods from pause to pause")
    parser.add_argument("--cc", default="cc", help="C compiler")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        contestants = {
            REFERENCE: functools.partial(packed, leg=ENOUGH),
            "vibrokit, in legs": functools.partial(packed, leg=options.leg),
            "scalar Numba, Generator": numba_scalar,
            "C, xoshiro and ziggurat": c_program(folder, options.cc),
        }
        report(race(contestants, options.rounds, options.trajectories))


if __name__ == "__main__":
    main()
