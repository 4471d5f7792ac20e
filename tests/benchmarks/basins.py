"""Seconds for a basin of hertz-0.570: vibrokit's, whose cells share answers, beside the best scalar loop.

    python tests/benchmarks/basins.py [--rounds 5] [--cells 400] [--threads 2] [--table-cells 400]

The scalar loops map each cell's centre, 256 classical Runge-Kutta steps a period, until it is within 1e-3 of a known
attractor, at most 500 periods: forcing tabulated, a square root in place of a power, cells handed to the threads in
small chunks. vibrokit runs as `find_structure` runs it by default. Every round runs all contestants one after another,
so that ratios compare neighbours in time. Then a table of work against precision: wrong labels against a basin at 1024
steps in which no cell shares, over the steps and over the margin at which cells share.
"""

import argparse
import math
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

sys.path.insert(0, str(Path(__file__).parents[2]))
import vibrokit as vk
from vibrokit.kernels.choice import CoarseStepsWarning
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.basins.grid import classify_grid

SCENE = vk.load_scene("hertz-0.570")
STEPS, MARGIN = 256, 2
NEAR, PERIODS = 1e-3, 500
MARGINS, TABLE_STEPS, REFERENCE_STEPS = (None, 1, 2, 3), (64, 128, 256, 512), 1024
FAR = 3  # cells from another label
CHUNK = 256

NUMBERS = SCENE.parameters
NATURAL = NUMBERS["natural_frequency"]
DAMPING, SQUARE = 2 * NUMBERS["damping_ratio"] * NATURAL, NATURAL**2
GAP, STIFFNESS = NUMBERS["barriers.0.position"], NUMBERS["barriers.0.law.stiffness"]
FREQUENCY = NUMBERS["excitations.0.frequency"]
H = 2 * math.pi / FREQUENCY / STEPS
HALF, SIXTH = 0.5 * H, H / 6
FORCING = NUMBERS["excitations.0.amplitude"] * np.cos(FREQUENCY * HALF * np.arange(2 * STEPS + 1))
FORCING += NUMBERS["excitations.1.force"]
FLAGS = {"nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz", "arcp"}}

Labels = NDArray[np.int64]
Contestant = Callable[[int], Labels]


# --- one trajectory at a time


@njit(**FLAGS)
def branching(x, v, f):
    """A predicted branch costs less than waiting for a square root."""
    depth = abs(x) - GAP
    free_flight = f - SQUARE * x - DAMPING * v
    if depth <= 0.0:
        return free_flight
    return free_flight - math.copysign(STIFFNESS * depth, x) * math.sqrt(depth)


@njit(**FLAGS)
def folded(x, v, f):
    """By symmetry: one depth, one root, no choice."""
    depth = max(abs(x) - GAP, 0.0)
    return f - SQUARE * x - DAMPING * v - math.copysign(STIFFNESS * depth, x) * math.sqrt(depth)


def scalar(acceleration, structure) -> Contestant:
    """Map each cell's centre until it settles."""

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

    @njit(**FLAGS, parallel=True)
    def run(starts, points, owners, forcing):
        labels = np.full(starts.shape[0], -1)
        for n in prange(starts.shape[0]):
            x, v = starts[n, 0], starts[n, 1]
            for _ in range(PERIODS):
                for k in range(STEPS):
                    x, v = step(x, v, forcing[2 * k], forcing[2 * k + 1], forcing[2 * k + 2])
                for place in range(points.shape[0]):
                    if math.hypot(x - points[place, 0], v - points[place, 1]) <= NEAR:
                        labels[n] = owners[place]
                if labels[n] >= 0:
                    break
        return labels

    points = np.concatenate([attractor.points for attractor in structure.attractors])
    owners = np.repeat([a.label for a in structure.attractors], [len(a.points) for a in structure.attractors])

    def contestant(cells: int) -> Labels:
        with numba.parallel_chunksize(CHUNK):
            labels = run(structure.basins.region.cell_centres((cells, cells)), points, owners, FORCING)
        return labels.reshape(cells, cells)

    return contestant


# --- vibrokit's


def follower(structure, steps: int) -> BasinClassifier:
    region = structure.basins.region
    return BasinClassifier(SCENE, structure.attractors, region, structure.settling, structure.budget, vk.RK4(steps))


def sharing(structure, steps: int = STEPS, margin: int | None = MARGIN) -> Contestant:
    return lambda cells: classify_grid(follower(structure, steps), (cells, cells), margin=margin).labels


# --- comparing


def far_from_others(labels: Labels) -> NDArray[np.bool_]:
    size = 2 * FAR - 1
    return minimum_filter(labels, size, mode="nearest") == maximum_filter(labels, size, mode="nearest")


def differing(labels: Labels, reference: Labels) -> tuple[float, float]:
    """Share of labels that differ: of all cells, of those three cells or more from another label."""
    wrong = labels != reference
    return float(wrong.mean()), float(wrong[far_from_others(reference)].mean())


def race(contestants: dict[str, Contestant], rounds: int, cells: int) -> tuple[dict[str, list[float]], dict]:
    seconds: dict[str, list[float]] = {name: [] for name in contestants}
    labels = {}
    for number in range(rounds):
        names = list(contestants)
        for name in names if number % 2 else reversed(names):
            start = time.perf_counter()
            labels[name] = contestants[name](cells)
            seconds[name].append(time.perf_counter() - start)
    return seconds, labels


def report(seconds: dict[str, list[float]], labels: dict, ours: str) -> None:
    print(f"{'':24}{'seconds':>9}{'quartiles':>14}{'over ' + ours:>16}{'quartiles':>14}{'labels equal':>15}{'far':>10}")
    for name, times in seconds.items():
        ratios = np.array(times) / np.array(seconds[ours])
        (low, middle, high), (least, ratio, most) = (np.percentile(sample, [25, 50, 75]) for sample in (times, ratios))
        everywhere, far = differing(labels[ours], labels[name])
        row = f"{name:24}{middle:9.2f}{f'{low:.2f}-{high:.2f}':>14}{ratio:16.1f}{f'{least:.1f}-{most:.1f}':>14}"
        print(f"{row}{100 * (1 - everywhere):14.3f}%{100 * (1 - far):9.3f}%")
    best = min((name for name in seconds if name.startswith("scalar")), key=lambda name: np.median(seconds[name]))
    ratio = np.median(np.array(seconds[best]) / np.array(seconds[ours]))
    share = far_from_others(labels[best]).mean()
    print(f"best scalar: {best}, {ratio:.1f} times {ours}; far: {FAR} cells or more from another, {100 * share:.0f}%")


def table(structure, cells: int) -> None:
    """Time and wrong labels over steps and margins."""
    reference = sharing(structure, REFERENCE_STEPS, None)(cells)
    print(f"\n{cells} x {cells} cells against RK4({REFERENCE_STEPS}), every cell followed to its attractor")
    print(f"{'steps':>6}{'margin':>8}{'seconds':>10}{'wrong':>11}{'wrong, far':>12}{'unsettled':>11}")
    for steps in TABLE_STEPS:
        for margin in MARGINS:
            contestant = sharing(structure, steps, margin)
            contestant(10)  # loads the kernel
            start = time.perf_counter()
            labels = contestant(cells)
            spent = time.perf_counter() - start
            wrong, far = differing(labels, reference)
            unsettled = np.mean(labels < 0)
            print(f"{steps:6}{margin!s:>8}{spent:10.2f}{wrong:11.2e}{far:12.2e}{unsettled:11.2e}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of a basin.")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--cells", type=int, default=400)
    parser.add_argument("--table-cells", type=int, default=400, help="0: no table")
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    numba.set_num_threads(options.threads)
    structure = vk.find_structure(SCENE, cells=(10, 10), saddles=False, manifolds=False)
    ours = "vibrokit"
    contestants = {
        ours: sharing(structure),
        "vibrokit, no sharing": sharing(structure, margin=None),
        "scalar, branching": scalar(branching, structure),
        "scalar, folded": scalar(folded, structure),
    }
    for contestant in contestants.values():
        contestant(10)  # compiles
    print(f"{options.cells} x {options.cells} cells, {structure.basins.region}")
    report(*race(contestants, options.rounds, options.cells), ours)
    if options.table_cells:
        warnings.simplefilter("ignore", CoarseStepsWarning)  # 64 steps are in the table to show that
        table(structure, options.table_cells)


if __name__ == "__main__":
    main()
