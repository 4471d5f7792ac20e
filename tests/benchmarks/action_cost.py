"""How the cost of the searches for least action grows: with points, nodes, time steps and periods.

    python tests/benchmarks/action_cost.py [--source 0] [--only points nodes steps periods] [--repeats 3] [--quick]
    python tests/benchmarks/action_cost.py --scene hertz-0.525 --structure found.nc --source 1

Prints one table for each, ready for the manual: the median of the wall times with their range, the processor time of
all threads, which other work on the machine hardly changes, the least action, and its distance from the certified one
where that is known. One setting varies. All others keep their defaults, except that nodes vary at 8 steps per period,
steps on 160 × 160 nodes, and periods (the budget of a path) without refinement. Each repeat runs all settings of a
table in turn, so that other work on the machine affects all of them.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
import vibrokit as vk
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import VibrokitError

CERTIFIED = {("hertz-0.570", 0): 7.9052156e-5, ("hertz-0.570", 1): 8.170861e-4, ("hertz-0.525", 0): 9.432543e-5}
POINTS = (1_500, 3_000, 6_000, 12_000, 24_000, 48_000)
NODES = (40, 80, 160, 320, 640)
STEPS = (2, 4, 8, 16, 32)
PERIODS = (5, 10, 20, 40, 80, 320)
RING = (1_000, 10_000, 100_000)

HEADS = {
    "points": "points",
    "nodes": "nodes",
    "steps": "steps per period",
    "periods": "periods, at most",
}


def searches(table: str, quick: bool) -> list[tuple[str, Any]]:
    """The settings of a table, by the text of its first column."""
    few = slice(0, 3) if quick else slice(None)
    if table == "points":
        ring = [(f"{points}, ring", vk.Shooting(radius=1e-6, points=points)) for points in RING]
        grid = [(f"{points}, no rounds", vk.Shooting(points=points, rounds=0)) for points in POINTS]
        return [*ring[few], *grid[few], *((f"{points}", vk.Shooting(points=points)) for points in POINTS[few])]
    if table == "nodes":
        return [(f"{count}²", vk.GraphSearch(nodes=(count, count), steps_per_period=8)) for count in NODES[few]]
    if table == "steps":
        return [(f"{steps}", vk.GraphSearch(nodes=(160, 160), steps_per_period=steps)) for steps in STEPS[few]]
    return [(f"{periods}", vk.Shooting(budget=periods, rounds=0)) for periods in PERIODS[few]]


def least(found: Any) -> float:
    """The least action that a search found; infinite if it found no exit."""
    return min((energy.value for energy in found.estimates), default=float("inf"))


def rows_of(work: Callable[[Any], Any], settings: Sequence[tuple[str, Any]], repeats: int, certified: float | None):
    """Cells of a table, row by row."""
    seconds: dict[str, list[float]] = {name: [] for name, _ in settings}
    processor: dict[str, list[float]] = {name: [] for name, _ in settings}
    values: dict[str, str] = {}
    for _ in range(repeats):
        for name, setting in settings:
            begun, used = time.perf_counter(), time.process_time()
            try:
                value = least(work(setting))
            except VibrokitError as error:
                values[name] = f"error: {error}"
                continue
            seconds[name].append(time.perf_counter() - begun)
            processor[name].append(time.process_time() - used)
            far = "–" if certified is None or not np.isfinite(value) else f"{value / certified - 1:+.1e}"
            values[name] = f"{value:.6g}|{far}"
    for name, _ in settings:
        times, used = seconds[name], processor[name]
        if not times:
            yield [name, "–", "–", "–", "–", values[name]]
            continue
        spread = f"{min(times):.2f} – {max(times):.2f}"
        yield [name, f"{np.median(times):.2f}", spread, f"{np.median(used):.2f}", *values[name].split("|")]


def printed(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table as reStructuredText has it."""
    columns = list(zip(heads, *rows, strict=True))
    widths = [max(len(cell) for cell in column) for column in columns]
    rule = "  ".join("=" * width for width in widths)
    lines = ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)) for row in (heads, *rows)]
    return "\n".join([rule, lines[0].rstrip(), rule, *(line.rstrip() for line in lines[1:]), rule])


def main() -> None:
    parser = argparse.ArgumentParser(description="How the cost of the searches for least action grows.")
    parser.add_argument("--scene", default="hertz-0.570")
    parser.add_argument("--structure", type=Path, metavar="FILE", help="saved, in place of finding it")
    parser.add_argument("--source", type=int, default=0)
    parser.add_argument("--only", nargs="+", choices=list(HEADS), default=list(HEADS))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="the first three of each")
    options = parser.parse_args()
    osc = vk.load_scene(options.scene)
    structure = vk.load_result(options.structure) if options.structure else vk.find_structure(osc, cells=(100, 100))
    certified = CERTIFIED.get((options.scene, options.source))
    problem = ExitProblem(osc, structure, structure.attractor(options.source), vk.LeaveBasin())

    def work(setting: Any) -> Any:
        return setting.search(problem)

    for warm in (vk.Shooting(points=64, rounds=1), vk.GraphSearch(nodes=(80, 80), steps_per_period=2)):  # loads kernels
        work(warm)
    print(f"leaving attractor {options.source} of {options.scene}, {options.repeats} repeats")
    for table in options.only:
        heads = (HEADS[table], "seconds", "least – most", "processor", "ΔU", "above the certified")
        rows = list(rows_of(work, searches(table, options.quick), options.repeats, certified))
        print(f"\n{printed(heads, rows)}", flush=True)


if __name__ == "__main__":
    main()
