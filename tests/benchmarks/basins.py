"""Seconds for a basin of hertz-0.570: vibrokit's, whose cells share answers, beside the best scalar loop.

    python -m tests.benchmarks.basins [--rounds 5] [--cells 400] [--threads 2] [--csv FILE]

The scalar loops map each cell's centre, 256 classical Runge-Kutta steps a period, until it is within 1e-3 of a known
attractor, at most 500 periods: forcing tabulated, a square root in place of a power, cells handed to the threads in
small chunks. vibrokit runs as `find_structure` runs it by default. `vibrokit trade` tells work against precision.
"""

import argparse
import math
from collections.abc import Callable

import numba
import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

import vibrokit as vk
from tests.benchmarks import table_file
from tests.benchmarks.by_hand import FLAGS, FORCING, SCENE, STEPS, branching, folded, runge_kutta
from tests.benchmarks.races import fastest, race, report, table, timed
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.basins.grid import classify_grid

MARGIN = 2
NEAR, PERIODS = 1e-3, 500
FAR = 3  # cells from another label
CHUNK = 256

Labels = NDArray[np.int64]
Contestant = Callable[[int], Labels]


def scalar(acceleration, structure) -> Contestant:
    """Map each cell's centre until it settles."""

    step = runge_kutta(acceleration)

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


def sharing(structure, margin: int | None = MARGIN) -> Contestant:
    """vibrokit, whose cells share answers at a margin; None if none do."""
    region = structure.basins.region
    follower = BasinClassifier(SCENE, structure.attractors, region, structure.settling, structure.budget, vk.RK4(STEPS))
    return lambda cells: classify_grid(follower, (cells, cells), margin=margin).labels


def far_from_others(labels: Labels) -> NDArray[np.bool_]:
    size = 2 * FAR - 1
    return minimum_filter(labels, size, mode="nearest") == maximum_filter(labels, size, mode="nearest")


def differing(labels: Labels, reference: Labels) -> tuple[float, float]:
    """Share of labels that differ: of all cells, of those three cells or more from another label."""
    wrong = labels != reference
    return float(wrong.mean()), float(wrong[far_from_others(reference)].mean())


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of a basin.")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--cells", type=int, default=400)
    parser.add_argument("--threads", type=int, default=2)
    table_file.add_option(parser)
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
    runs = race(
        {name: lambda _, each=each: timed(each, options.cells) for name, each in contestants.items()}, options.rounds
    )
    costs = {name: [seconds for _, seconds in each] for name, each in runs.items()}
    labels = {name: each[-1][0] for name, each in runs.items()}
    wrong = {name: differing(labels[ours], each) for name, each in labels.items()}
    report(costs, ours, "seconds", {
        name: f"{100 * (1 - everywhere):10.3f}% equal, {100 * (1 - far):.3f}% of those {FAR} cells from another label"
        for name, (everywhere, far) in wrong.items()
    })  # fmt: skip
    equal = {
        name: {"equal": f"{1 - everywhere:.5f}", "equal_far": f"{1 - far:.5f}"}
        for name, (everywhere, far) in wrong.items()
    }
    table_file.write(options.csv, table(costs, ours, equal))
    best = fastest(costs, "scalar")
    print(f"best scalar: {best}, {np.median(np.divide(costs[best], costs[ours])):.1f} times {ours}")


if __name__ == "__main__":
    main()
