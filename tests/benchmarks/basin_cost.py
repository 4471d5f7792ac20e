"""How the cost of basins grows: seconds, error and what failed, over grid size, stiffness, damping and clearance.

    python -m tests.benchmarks.basin_cost [--cells 100] [--only grid stiffness …] [--limit 300] [--quick]

Every row is `find_structure` on hertz-0.570 with one thing changed, without saddles and manifolds. The error is the
share of cells whose label changes in a second run with everything tightened: the next finer stepper, a tenth of the
settling distance, twice the budget, no sharing of answers; the shift is the largest change of a basin's fraction, which
is small even where basins are so finely mixed that single labels mean little. Attractors are matched by their points.
A run that takes longer than the limit is stopped, and what it had found by then is told.
"""

import argparse
import time
import warnings

import numpy as np
from numpy.typing import NDArray

import vibrokit as vk
from vibrokit.errors import StructureError, VibrokitError
from vibrokit.kernels.choice import CoarseStepsWarning
from vibrokit.kernels.named import named_stepper
from vibrokit.results.basins import ESCAPED, UNSETTLED

SCENE = "hertz-0.570"
GRIDS = (50, 100, 200, 400, 800)
STIFFNESSES = tuple(10.0**power for power in range(0, 13, 2))
DAMPINGS = (0.0, 1e-4, 1e-3, 0.01, 0.1, 0.5, 1.0, 2.0)
CLEARANCES = (0.0, 0.01, 0.1, 0.5, 1.0, 10.0)
SETTLING = 1e-3
SAME = 1e-3  # distance of two attractors, as a share of the region, below which they are one
OTHER = -9  # an attractor that the tightened run does not know


def changed(osc, name: str, value: float):
    """The scene with one thing changed; a clearance is the distance of each stop from the middle."""
    if name == "stiffness":
        return osc.replace({"barriers.0.law.stiffness": value, "barriers.1.law.stiffness": value})
    if name == "damping":
        return osc.replace({"damping_ratio": value})
    if name == "clearance":
        return osc.replace({"barriers.0.position": value, "barriers.1.position": -value})
    return osc


def run(osc, limit: int, **options) -> vk.Structure:
    """Attractors and basins, in the time given."""
    structure = vk.find_structure(osc, saddles=False, manifolds=False, time_limit=limit, **options)
    if not structure.complete:
        raise StructureError(f"stopped after {limit} s: {structure.status}")
    return structure


def tightened(osc, structure, limit: int) -> vk.Structure:
    """The same basins with everything tightened."""
    basins = structure.basins
    return run(
        osc, limit, region=basins.region, cells=basins.labels.shape, margin=None, settling=SETTLING / 10,
        budget=2 * structure.budget, stepper=named_stepper(structure.stepper).refined(),
    )  # fmt: skip


def renamed(structure, reference) -> NDArray[np.int64]:
    """Labels by the places of the reference's attractors, matched by the nearest point."""
    scale = SAME * float(reference.basins.region.widths.min())
    labels = structure.basins.labels.astype(np.int64)
    renamed = labels.copy()
    for attractor in structure.attractors:
        distances = [
            np.linalg.norm(attractor.points[:, None, :2] - other.points[None, :, :2], axis=2).min()
            for other in reference.attractors
        ]
        nearest = int(np.argmin(distances))
        spread = not attractor.repeats and not reference.attractors[nearest].repeats
        matched = distances[nearest] < scale or (spread and distances[nearest] < 10 * scale)
        renamed[labels == attractor.label] = reference.attractors[nearest].label if matched else OTHER
    return renamed


def row(name: str, value: float, cells: int, limit: int) -> str:
    """Run one case and say what came of it."""
    osc = changed(vk.load_scene(SCENE), name, value)
    head = f"{name:>10}{value:9g}{cells:6}"
    try:
        start = time.perf_counter()
        structure = run(osc, limit, cells=(cells, cells))
        seconds = time.perf_counter() - start
    except (VibrokitError, KeyboardInterrupt) as error:
        return f"{head}  {type(error).__name__}: {error}"
    kinds = ", ".join(f"{attractor.kind} {attractor.period}" for attractor in structure.attractors[:4])
    kinds += f" and {len(structure.attractors) - 4} more" if len(structure.attractors) > 4 else ""
    basins = structure.basins
    words = f"{structure.stepper}: {kinds}"
    try:
        reference = tightened(osc, structure, limit)
        labels, expected = renamed(structure, reference), reference.basins.labels
        shift = max(abs(np.mean(labels == name) - np.mean(expected == name)) for name in np.unique(expected))
        error = f"{np.mean(labels != expected):9.1e}{shift:9.1e}"
    except (VibrokitError, KeyboardInterrupt) as problem:
        error, words = f"{'none':>9}{'none':>9}", f"{words}; tightened, {type(problem).__name__}: {problem}"
    shares = f"{basins.fraction(UNSETTLED):10.1e}{basins.fraction(ESCAPED):9.1e}"
    return f"{head}{seconds:9.1f}{error}{shares}  {words}"


def cases(options: argparse.Namespace) -> list[tuple[str, float, int]]:
    grids = GRIDS[:2] if options.quick else GRIDS
    values = {"stiffness": STIFFNESSES, "damping": DAMPINGS, "clearance": CLEARANCES}
    wanted = [("grid", float(cells), cells) for cells in grids] if "grid" in options.only else []
    for name, sweep in values.items():
        if name in options.only:
            wanted += [(name, value, options.cells) for value in (sweep[:2] if options.quick else sweep)]
    return wanted


def main() -> None:
    sweeps = ["grid", "stiffness", "damping", "clearance"]
    parser = argparse.ArgumentParser(description="How the cost of basins grows.")
    parser.add_argument("--cells", type=int, default=100, help="cells in x and in v where the grid is not what changes")
    parser.add_argument("--only", nargs="+", choices=sweeps, default=sweeps)
    parser.add_argument("--limit", type=int, default=300, help="seconds for one run")
    parser.add_argument("--quick", action="store_true", help="the first two of each")
    options = parser.parse_args()
    warnings.simplefilter("ignore", CoarseStepsWarning)
    vk.find_structure(vk.load_scene(SCENE), cells=(10, 10), saddles=False, manifolds=False)  # loads the kernels
    print(
        f"{'changed':>10}{'value':>9}{'cells':>6}{'seconds':>9}"
        f"{'error':>9}{'shift':>9}{'unsettled':>10}{'left':>9}  carried by"
    )
    for case in cases(options):
        print(row(*case, options.limit), flush=True)


if __name__ == "__main__":
    main()
