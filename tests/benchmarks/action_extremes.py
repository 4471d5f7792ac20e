"""Least action at the extremes: energies and bounds against exact values, with the findings.

    python tests/benchmarks/action_extremes.py [WORDS …] [--limit 300] [--full] [--list] [--out FILE]

Runs the scenes of `tests/extremes/scenes_of_action.py` whose names contain all the words, each in a separate process
with a time limit, and prints the rows of a list-table. What was found by then is among them. A row marked WRONG has an
exact energy outside its bounds.
"""

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
import vibrokit as vk
from tests.extremes.scenes_of_action import ActionScene, scenes
from vibrokit.errors import VibrokitError
from vibrokit.progress import Update
from vibrokit.results.codes import Code, Severity

HEADER = (
    "scene",
    "from → to",
    "energy [bounds]",
    "exact",
    "relative error",
    "residual",
    "graph",
    "CPU seconds",
    "findings",
)
ROOM = 60.0  # s, for what cannot be stopped
ROUNDING = 1e-9  # relative: an exact energy this close to a bound is not outside it
COMPARED = (Code.AGREEMENT, Code.CHEAPER_PATH_EXPECTED, Code.GRAPH_TOO_COARSE, Code.NO_POLISHED_PATH, Code.BRACKET)


def structure_of(scene: ActionScene, full: bool, limit: float) -> vk.Structure:
    smaller = {} if full else {"cells": (50, 50), "starts": (8, 8), "manifolds": False}
    return vk.find_structure(scene.oscillator, region=scene.region, time_limit=limit, **smaller)


def analyzer(full: bool, **changes) -> vk.LeastAction:
    if full:
        return vk.LeastAction(**changes)
    return vk.LeastAction(shooting=vk.Shooting(points=3000), graph=vk.GraphSearch(nodes=(120, 120)), **changes)


def exact_energies(scene: ActionScene, structure: vk.Structure) -> dict[int, float]:
    """By label; the scene has them by growing x."""
    if len(scene.exact) != len(structure.attractors):
        return {}
    by_place = sorted(structure.attractors, key=lambda attractor: attractor.points[0, 0])
    return {attractor.label: exact for attractor, exact in zip(by_place, scene.exact, strict=True)}


def tell(update: Update) -> None:
    """Print the stage under way to standard error, for a run that is stopped at the limit."""
    if not update.finished:
        print(f"{update.stage}, {update.subject}: {update.done} {update.unit}", file=sys.stderr, flush=True)


def least(
    scene: ActionScene, structure: vk.Structure, full: bool, limit: float, exact: dict[int, float], **changes
) -> list[dict]:
    """Run, and return one row for each energy; one row with the reason if there is none."""
    began = time.process_time()
    try:
        result = analyzer(full, **changes).run(scene.oscillator, structure, progress=tell, time_limit=limit)
    except VibrokitError as error:
        return [{"findings": f"{type(error).__name__}: {error}", "seconds": time.process_time() - began}]
    seconds = time.process_time() - began
    found = " ".join(f.sentence(result.names) for f in result.findings if f.severity is not Severity.INFO)
    rows = [
        {
            "way": result.exit_of(e),
            "value": e.value,
            "bounds": [e.lower, e.upper],
            "method": f"{e.method}, {e.bound}",
            "exact": exact.get(e.source),
            "residual": e.residual,
            "graph": graph_value(result, e),
            "findings": found,
            "seconds": seconds,
        }
        for e in result.energies
    ]
    return rows or [{"findings": found, "seconds": seconds}]


def graph_value(result: vk.Result, energy: vk.ActivationEnergy) -> str:
    """Return the graph's value and error of an exit."""
    for finding in result.findings:
        if finding.code in COMPARED and (finding.source, finding.target) == (energy.source, energy.target):
            return f"{finding.values['graph']:.4g} ± {finding.values['error']:.1g}"
    return ""


def rows_of(scene: ActionScene, full: bool, limit: float) -> list[dict]:
    began, start = time.process_time(), time.perf_counter()
    try:
        structure = structure_of(scene, full, limit / 2)
    except VibrokitError as refusal:
        return [{"findings": f"structure, {type(refusal).__name__}: {refusal}", "seconds": time.process_time() - began}]
    found = f"[{len(structure.attractors)} attractors, {len(structure.saddles)} saddles] "
    print(f"{scene.name}: {found}{time.process_time() - began:.1f} s. {structure.status}", file=sys.stderr, flush=True)
    left = max(1.0, limit - (time.perf_counter() - start))
    if scene.contact is None:
        rows = least(scene, structure, full, left, exact_energies(scene, structure))
    else:
        first = {attractor.label: scene.contact for attractor in structure.attractors if not attractor.impacts}
        rows = least(scene, structure, full, left, first, exit=vk.FirstContact())
    for row in rows:
        row["findings"] = found + row["findings"]
    return rows


def limited(name: str, full: bool, limit: float) -> list[dict]:
    """Run a scene in a separate process with a time limit (s)."""
    command = [sys.executable, __file__, "--scene", name, "--limit", str(limit), *(["--full"] if full else [])]
    began = time.perf_counter()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit + ROOM, check=False)
    except subprocess.TimeoutExpired as ended:
        last = ((ended.stderr or b"").decode().splitlines() or ["no structure yet"])[-1]
        return [{"findings": f"stopped after {limit:g} s: {last}", "seconds": time.perf_counter() - began}]
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return [{"findings": f"CRASH ({done.returncode}): {last}", "seconds": time.perf_counter() - began}]
    return json.loads(done.stdout.splitlines()[-1])


def verdict(row: dict) -> str:
    exact = row.get("exact")
    if exact is None:
        return ""
    low, high = row["bounds"]
    if low > exact * (1 + ROUNDING) or high < exact * (1 - ROUNDING):
        return "WRONG "
    return ""


def cells_of(name: str, row: dict) -> tuple[str, ...]:
    if "value" not in row:
        return name, "", "", "", "", "", "", f"{row['seconds']:.0f}", row["findings"]
    value, (low, high), exact = row["value"], row["bounds"], row["exact"]
    return (
        name,
        row["way"],
        f"{verdict(row)}{value:.9g} [{low:.9g}, {high:.9g}], {row['method']}",
        "" if exact is None else f"{exact:.9g}",
        "" if not exact else f"{value / exact - 1:.1e}",
        f"{row['residual']:.0e}",
        row["graph"],
        f"{row['seconds']:.0f}",
        row["findings"],
    )


def print_row(cells: tuple[str, ...]) -> None:
    for number, cell in enumerate(cells):
        print(f"   {'*' if number == 0 else ' '} - {' '.join(cell.split())}", flush=True)


def main(words: list[str], limit: float, full: bool, out: str | None) -> None:
    print(".. list-table::\n   :header-rows: 1\n")
    print_row(HEADER)
    for scene in scenes():
        if all(word in scene.name for word in words):
            rows = limited(scene.name, full, limit)
            if out is not None:
                with Path(out).open("a") as record:
                    record.write(json.dumps({"scene": scene.name, "rows": rows}) + "\n")
            for row in rows:
                print_row(cells_of(scene.name, row))


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("words", nargs="*")
    options.add_argument("--limit", type=float, default=300.0)
    options.add_argument("--full", action="store_true", help="default settings throughout")
    options.add_argument("--list", action="store_true")
    options.add_argument("--out", help="file to which each scene's rows are added as JSON")
    options.add_argument("--scene", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.list:
        print("\n".join(scene.name for scene in scenes()))
    elif given.scene:
        (chosen,) = (scene for scene in scenes() if scene.name == given.scene)
        print(json.dumps(rows_of(chosen, given.full, given.limit)))
    else:
        main(given.words, given.limit, given.full, given.out)
