"""Seconds for the published ring on hertz-0.570: vibrokit's kernel beside the best scalar loop.

    python -m tests.benchmarks.ring_speed [--rounds 20] [--points 100000] [--threads 2] [--source 0 1] [--csv FILE]

Starts lie on a circle of radius 1e-6 round an attractor, with the momentum of the linearised quasi-potential, and are
carried by Hamilton's equations, classical Runge-Kutta with 256 steps a period, until they are in a cell of another
basin, outside the region, or out of periods. The scalar loops do the same, trajectory by trajectory, each until its
own exit: forcing tabulated, a square root in place of a power, small chunks for the threads; the naive one as the
formula is written down.

First all must agree, on a share of the ring: in how and when each path ended, and in its action, as far as rounding
lets them. Then the scalar loops race each other on that share, and the fastest goes on. Then the whole ring is carried,
in rounds: each takes another share of the points, by all contestants one after another, so that ratios compare
neighbours in time whatever else the machine does. What counts is the processor's time, of all threads.
"""

import argparse
import concurrent.futures as futures
import time
from collections.abc import Callable

import numba
import numpy as np
from numba import njit, prange

import vibrokit as vk
from tests.benchmarks import table_file
from tests.benchmarks.by_hand import FORCING, SCENE, STEPS, H
from tests.benchmarks.hamiltonian_ensemble import (
    Array,
    both_stops,
    branching,
    folded,
    moved,
    naive_slopes,
    runge_kutta,
)
from tests.benchmarks.races import fastest, race, report, table
from vibrokit.analyzers.paths.local_potential import local_potential
from vibrokit.analyzers.shooting.shooting import default_effort
from vibrokit.analyzers.shooting.starts import Ring
from vibrokit.kernels.ensemble import Stop, run_ensemble
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

RADIUS = 1e-6
CHUNK = 64
SHARE = 40  # every so many-th start is for the check and for the heats of the scalar loops
HEATS = 5
LEFT_REGION, LEFT_BASIN = 1, 2

Ends = tuple[Array, Array, Array]  # last states, periods, status
Contestant = Callable[[Array], Ends]


@njit(nogil=True, error_model="numpy")
def left(x, v, region, labels, home):
    """How a state of the section has left; 0 if it has not."""
    if x < region[0, 0] or x > region[0, 1] or v < region[1, 0] or v > region[1, 1]:
        return 1
    i = min(int((x - region[0, 0]) / (region[0, 1] - region[0, 0]) * labels.shape[0]), labels.shape[0] - 1)
    j = min(int((v - region[1, 0]) / (region[1, 1] - region[1, 0]) * labels.shape[1]), labels.shape[1] - 1)
    return 2 if labels[i, j] >= 0 and labels[i, j] != home else 0


def scalar(slopes, stop: Stop, budget: int) -> Contestant:
    """One trajectory at a time, numbers folded in."""
    step = runge_kutta(slopes)

    @njit(parallel=True, error_model="numpy")
    def run(starts, forcing, region, labels, home):
        final = np.empty_like(starts)
        periods, status = np.zeros(len(starts), dtype=np.int64), np.zeros(len(starts), dtype=np.int64)
        for n in prange(len(starts)):
            x, v, p, q, s = starts[n, 0], starts[n, 1], starts[n, 2], starts[n, 3], starts[n, 4]
            for period in range(budget):
                for k in range(STEPS):
                    x, v, p, q, s = step(x, v, p, q, s, forcing[2 * k], forcing[2 * k + 1], forcing[2 * k + 2])
                periods[n] = period + 1
                status[n] = left(x, v, region, labels, home)
                if status[n] > 0:
                    break
            final[n, 0], final[n, 1], final[n, 2], final[n, 3], final[n, 4] = x, v, p, q, s
        return final, periods, status

    return chunked(lambda starts: run(starts, FORCING, stop.region, stop.labels, stop.home))


def naive(stop: Stop, budget: int) -> Contestant:
    """The formula as one writes it down."""

    @njit(parallel=True)
    def run(starts, region, labels, home):
        final = np.empty_like(starts)
        periods, status = np.zeros(len(starts), dtype=np.int64), np.zeros(len(starts), dtype=np.int64)
        for n in prange(len(starts)):
            z = (starts[n, 0], starts[n, 1], starts[n, 2], starts[n, 3], starts[n, 4])
            for period in range(budget):
                for step in range(STEPS):
                    t = step * H
                    k1 = naive_slopes(t, z)
                    k2 = naive_slopes(t + H / 2, moved(z, H / 2, k1))
                    k3 = naive_slopes(t + H / 2, moved(z, H / 2, k2))
                    k4 = naive_slopes(t + H, moved(z, H, k3))
                    z = moved(moved(moved(moved(z, H / 6, k1), H / 3, k2), H / 3, k3), H / 6, k4)
                periods[n] = period + 1
                status[n] = left(z[0], z[1], region, labels, home)
                if status[n] > 0:
                    break
            final[n, 0], final[n, 1], final[n, 2], final[n, 3], final[n, 4] = z
        return final, periods, status

    return chunked(lambda starts: run(starts, stop.region, stop.labels, stop.home))


def chunked(run: Contestant) -> Contestant:
    """Paths differ in length: small chunks keep all threads busy."""

    def contestant(starts: Array) -> Ends:
        with numba.parallel_chunksize(CHUNK):
            return run(starts)

    return contestant


def generated(stop: Stop, budget: int, pool: futures.Executor) -> Contestant:
    def contestant(starts: Array) -> Ends:
        ended = run_ensemble(SCENE, Flow.HAMILTONIAN, vk.RK4(STEPS), starts, budget, stop=stop, executor=pool)
        return ended.states, ended.intervals, ended.status

    return contestant


OURS, SCALAR = "vibrokit", "scalar"


def check(contestants: dict[str, Contestant], starts: Array) -> None:
    """All end the same way; this also compiles them.

    A path near an edge of a cell, or one that rounding has taken elsewhere by then, may end otherwise: as many as do
    for starts that differ in the last bit, with some room, may.
    """
    state, periods, status = contestants[OURS](starts)
    nudged = contestants[OURS](np.nextafter(starts, 1.0))
    ways = ", ".join(f"{np.sum(status == way)} {name}" for way, name in ((LEFT_BASIN, "out"), (LEFT_REGION, "far out")))
    print(f"  of {len(starts)} paths {ways}; {periods.mean():.1f} periods a path; least action "
          f"{state[status == LEFT_BASIN, -1].min():.6g}")  # fmt: skip
    others = {name: contestant(starts) for name, contestant in contestants.items() if name != OURS}
    for name, ends in {"starts moved by a bit": nudged, **others}.items():
        same = (ends[1] == periods) & (ends[2] == status)
        apart = np.abs(ends[0][same, -1] / state[same, -1] - 1)
        print(f"  {name:24} same end {100 * same.mean():9.4f}%   action differs by {np.median(apart):8.1e} (median), "
              f"{np.quantile(apart, 0.99):8.1e} (99 %)")  # fmt: skip
        assert same.mean() > 0.99, f"{name} ends otherwise"
        assert np.median(apart) < 1e-6, f"{name} pays otherwise"


def processor_seconds(contestants: dict[str, Contestant], starts: Array, rounds: int) -> dict[str, list[float]]:
    """Of all threads, in each round, which takes every so many-th start."""

    def run(contestant: Contestant, number: int) -> float:
        share = np.ascontiguousarray(starts[number::rounds])
        used = time.process_time()
        contestant(share)
        return time.process_time() - used

    return race({name: lambda number, each=each: run(each, number) for name, each in contestants.items()}, rounds)


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of the published ring.")
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--source", type=int, nargs="+", default=[0, 1])
    table_file.add_option(parser)
    options = parser.parse_args()
    rows = []
    numba.set_num_threads(options.threads)
    structure = vk.find_structure(SCENE, cells=(200, 200), saddles=False, manifolds=False)
    with futures.ThreadPoolExecutor(options.threads) as pool:
        for source in options.source:
            attractor = structure.attractors[source]
            orbit = refine_orbit(SCENE, attractor.points[0], attractor.period, vk.RK4(STEPS))
            ring = Ring(orbit.point, local_potential(SCENE, orbit, vk.RK4(STEPS)), RADIUS)
            starts, _ = ring.states(np.arange(options.points)[:, None] / options.points)
            stop = vk.LeaveBasin().stop(SCENE, structure, source)
            budget, _ = default_effort(attractor, 1 / RADIUS)
            ours = {OURS: generated(stop, budget, pool)}
            scalars = {
                f"{SCALAR}, {slopes.__name__}": scalar(slopes, stop, budget)
                for slopes in (branching, folded, both_stops)
            }
            plain = {"naive": naive(stop, budget)}
            print(f"leaving attractor {source}, at most {budget} periods, RK4({STEPS}), {options.threads} threads")
            share = np.ascontiguousarray(starts[::SHARE])
            check(ours | scalars | plain, share)
            heats = processor_seconds(scalars, share, HEATS)
            best = fastest(heats, SCALAR)
            report(heats, best, "processor seconds")
            print(f"  {len(starts)} points, in {options.rounds} rounds", flush=True)
            costs = processor_seconds(ours | {best: scalars[best]} | plain, starts, options.rounds)
            report(costs, OURS, "processor seconds", {name: f"{sum(each):9.2f} in all" for name, each in costs.items()})
            totals = {name: {"total": f"{sum(each):.2f}"} for name, each in costs.items()}
            rows += [{"attractor": attractor.name} | row for row in table(costs, OURS, totals)]
    table_file.write(options.csv, rows)


if __name__ == "__main__":
    main()
