"""Bias of simulated exits: that of the time steps, and that of tests at discrete times.

    python tests/benchmarks/exit_bias.py [--error 0.005] [--trajectories 2000000]

Three tables for hertz-0.570 with noise:

- mean and deviation of v after three periods from the hammering state, against time steps per period: the weak error
  of the stepper across contacts;
- the mean time from the core of the clear state to that of the hammering state, against time steps per period;
- the mean time until the first contact, against tests per period, with the same trajectories in each row.
"""

import argparse
import dataclasses
import math
import time

import numpy as np

import vibrokit as vk
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.streams import streams_of
from vibrokit.symbolic.flow_kind import Flow

INTENSITY = 5e-5
PERIODS = 3


class ContactAtTests(vk.FirstContact):
    """First contact, tested so many times in a period."""

    tests: int = 32

    def checks_per_period(self, osc):
        return self.tests


def of_steps(osc, structure, trajectories):
    """Print the weak error against steps; the last row is the reference of the others."""
    osc = dataclasses.replace(osc, noise=dataclasses.replace(osc.noise, intensity=INTENSITY))
    start = np.tile(structure.attractor("hammering").points[0], (trajectories, 1))
    rows = []
    for steps in (32, 64, 128, 256, 512, 1024):
        streams = streams_of(steps, np.arange(trajectories))
        begun = time.perf_counter()
        ended = run_ensemble(osc, Flow.NOISY, vk.RK4(steps), start, PERIODS, streams=streams)
        v = ended.states[:, 1]
        rows.append((steps, v.mean(), v.std(), time.perf_counter() - begun))
    *_, (_, mean, deviation, _) = rows
    print(f"\nv after {PERIODS} periods from the hammering state, D = {INTENSITY:g}: {mean:.5f} ± {deviation:.5f}")
    print(f"errors in units of that deviation; {(2 / trajectories) ** 0.5:.5f} of each is statistical")
    print("steps in a period   of the mean   of the deviation   seconds")
    for steps, other, spread, seconds in rows:
        print(f"{steps:17d}   {(other - mean) / deviation:+11.5f}   {spread / deviation - 1:+16.5f}   {seconds:7.1f}")


def of_exits(osc, structure, error):
    """Print mean exit times against steps."""
    print(f"\nmean time from clear to hammering, D = {INTENSITY:g}")
    print("steps in a period   ln of periods     ±")
    for steps in (64, 128, 256, 512):
        found = vk.MFET(
            source="clear", intensities=(INTENSITY,), target_error=error, splitting=False, escapes=0,
            stepper=vk.RK4(steps), seed=steps,
        ).run(osc, structure)  # fmt: skip
        (rate,) = found.rates
        print(f"{steps:17d}   {-rate.log_value - math.log(osc.period):13.4f}   {rate.log_error:.4f}")


def of_tests(osc, structure, error):
    """Print mean times until the first contact against tests; the trajectories are the same in all rows."""
    print(f"\nmean time until the first contact from clear, D = {INTENSITY / 10:g}")
    print("tests in a period   ln of periods   change to the row below")
    rows = []
    for tests in (4, 8, 16, 32, 64, 128, 256):
        found = vk.MFET(
            source="clear", intensities=(INTENSITY / 10,), target_error=error, splitting=False, escapes=0,
            stepper=vk.RK4(256), exit=ContactAtTests(tests=tests),
        ).run(osc, structure)  # fmt: skip
        rows.append((tests, -found.rates[0].log_value - math.log(osc.period)))
    for (tests, value), (_, below) in zip(rows, [*rows[1:], (0, math.nan)], strict=True):
        print(f"{tests:17d}   {value:13.4f}   {below - value:+.4f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--error", type=float, default=0.005)
    parser.add_argument("--trajectories", type=int, default=2_000_000)
    given = parser.parse_args()
    osc = vk.load_scene("hertz-0.570")
    structure = vk.find_structure(osc, cells=(100, 100), manifolds=False, rng=0)
    of_steps(osc, structure, given.trajectories)
    of_exits(osc, structure, given.error)
    of_tests(osc, structure, given.error)


if __name__ == "__main__":
    main()
