"""Energies of all scenes of reference in one table, and what became worse between two of them.

    python -m tests.benchmarks.baseline run TABLE.csv [WORDS …] [--limit 120] [--list]
    python -m tests.benchmarks.baseline compare BEFORE.csv AFTER.csv

The scenes are the gallery and the paper's with default settings, and the extremes with smaller ones. Each runs in a
process of its own, and its rows are appended together, so that a run that was cut goes on with the scenes that are
missing. Given words, only scenes with at least one of them in their names run; a name is such as "gallery: pendulum".
A row is one exit. The seconds are processor time of all threads, of the whole call that found the exit; the limits are
on the clock, so that a busy machine finds less. An exact energy outside its bounds is WRONG.
"""

import argparse
import json
import statistics
import time
from pathlib import Path

import vibrokit as vk
from tests.benchmarks import table_file
from tests.benchmarks.apart import apart
from tests.benchmarks.gallery import SCENES, exact
from tests.extremes.scenes_of_action import ActionScene, scenes
from vibrokit.errors import VibrokitError
from vibrokit.reproduction.published import scenes as names_of_the_paper
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Severity

COLUMNS = (
    "scene", "exit", "energy", "lower", "upper", "bound", "error", "residual", "angle", "exact", "seconds", "remarks",
)  # fmt: skip
ROOM = 300.0  # s beyond the limits, for what cannot be stopped
SAME = 1e-8  # relative: two energies, and an exact one and its bounds
LOOSER = 0.01  # of the energy: by so much a lower bound is worse
SLOWER, LEAST = 1.05, 2.0  # times the seconds, and the fewest seconds that count
LIMITS = 5  # a scene has at most so many attractors that reach the limit
SMALL = {"cells": (50, 50), "starts": (8, 8), "manifolds": False}


def all_scenes():
    """What makes the rows of each scene, by name."""
    found = {f"gallery: {name}": (of_gallery, osc) for name, osc in SCENES.items()}
    found |= {f"paper: {name}": (of_paper, vk.load_scene(name)) for name in names_of_the_paper()}
    return found | {f"extremes: {scene.name}": (of_extremes, scene) for scene in scenes()}


def of_gallery(osc, limit):
    """Each attractor alone, so that no mirror image of another one's path helps."""
    structure = vk.find_structure(osc, rng=0)
    escapes = any(ESCAPED in saddle.leads_to for saddle in structure.saddles)
    exit_ = vk.LeaveBasin() if len(structure.attractors) > 1 or escapes else vk.FirstContact()
    for attractor in structure.attractors:
        analyzer = vk.LeastAction(source=attractor.label, exit=exit_)
        yield from rows_of(analyzer, osc, structure, limit, attractor.name, exact)


def of_paper(osc, limit):
    """All attractors together, in several times the limit: these energies are compared to ten digits."""
    yield from rows_of(vk.LeastAction(), osc, vk.find_structure(osc, rng=0), LIMITS * limit)


def of_extremes(scene: ActionScene, limit):
    """All attractors together on few nodes, with exact energies where they are known."""
    osc = scene.oscillator
    structure = vk.find_structure(osc, region=scene.region, time_limit=limit, rng=0, **SMALL)
    small = {"shooting": vk.Shooting(points=3000), "graph": vk.GraphSearch(nodes=(120, 120))}
    if scene.contact is None:
        by_place = sorted(structure.attractors, key=lambda attractor: attractor.points[0, 0])
        known = scene.exact if len(scene.exact) == len(by_place) else ()
        values = {attractor.label: value for attractor, value in zip(by_place, known, strict=False)}
        analyzer = vk.LeastAction(**small)
    else:
        values = {attractor.label: scene.contact for attractor in structure.attractors if not attractor.impacts}
        analyzer = vk.LeastAction(exit=vk.FirstContact(), **small)

    def known(osc, structure, energy):
        return values.get(energy.source)

    yield from rows_of(analyzer, osc, structure, limit, known=known)


def rows_of(analyzer, osc, structure, limit, name="", known=lambda *_: None):
    """One row for each exit, or one that says why there is none.

    `known` returns the exact energy of an exit, given scene, structure and energy, or None.
    """
    began = time.process_time()
    try:
        result = analyzer.run(osc, structure, time_limit=limit)
    except VibrokitError as error:
        return [{"exit": name, "remarks": f"{type(error).__name__}: {error}", "seconds": time.process_time() - began}]
    seconds = f"{time.process_time() - began:.2f}"
    codes = {finding.code.value for finding in result.findings if finding.severity is not Severity.INFO}
    rest = {"seconds": seconds, "remarks": " ".join(sorted(codes))}
    rows = []
    for energy in result.energies:
        certificate = energy.certificate
        row = {
            "exit": result.exit_of(energy), "energy": energy.value, "lower": energy.lower, "upper": energy.upper,
            "bound": energy.bound.value, "error": energy.numerical_error,
            "exact": known(osc, structure, energy), **rest,
        }  # fmt: skip
        if certificate is not None:
            row |= {"residual": f"{certificate.residual:.1e}", "angle": f"{certificate.transversality:.1e}"}
        rows.append(row)
    return rows or [{"exit": name, **rest}]


def alone(name, limit):
    """The rows of one scene, from a process of its own."""
    rows, why = apart("baseline", "one", name, "--limit", limit, seconds=LIMITS * limit + ROOM)
    return [{"remarks": why}] if rows is None else rows


def run(table, words, limit):
    """Append the rows of the scenes that the table lacks."""
    if not table.exists():
        table_file.begin(table, COLUMNS, tolerance=SAME)
    known = {row["scene"] for row in table_file.read(table)}
    for name in all_scenes():
        if name in known or (words and not any(word in name for word in words)):
            continue
        rows = [{"scene": name, **row} for row in alone(name, limit)]
        table_file.append(table, COLUMNS, rows)
        for row in rows:
            print("  ".join(str(row.get(column, "")) for column in COLUMNS), flush=True)
    summarize(table)


def summarize(table):
    """Print the share that is certified, the seconds, and what is wrong."""
    rows = [row for row in table_file.read(table) if row["energy"]]
    for group in dict.fromkeys(row["scene"].partition(":")[0] for row in rows):
        own = [row for row in rows if row["scene"].startswith(group)]
        certified = sum(row["residual"] != "" for row in own)
        tight = sum(float(row["lower"]) >= 0.95 * float(row["energy"]) for row in own)
        seconds = [float(row["seconds"]) for row in own]
        print(
            f"{table}, {group}: {len(own)} exits, {certified} certified, {tight} with a lower bound of 0.95 or more; "
            f"median {statistics.median(seconds):.1f} s, most {max(seconds):.1f} s"
        )
    for row in rows:
        if row["exact"]:
            low, high, exact = (float(row[column]) for column in ("lower", "upper", "exact"))
            if not low * (1 - SAME) <= exact <= high * (1 + SAME):
                print(f"WRONG  {row['scene']}, {row['exit']}: {low} to {high}, exact {exact}")


def worse(before, after):
    """What became worse for one exit, in words."""
    if not after["energy"]:
        return [f"energy {before['energy']} is lost: {after['remarks']}"] if before["energy"] else []
    if not before["energy"]:
        return []
    (old, old_low, old_s), (new, new_low, new_s) = (
        [float(row[column]) for column in ("energy", "lower", "seconds")] for row in (before, after)
    )
    found = [f"energy {old:.12g} → {new:.12g}"] if new > old * (1 + SAME) else []
    if new_low < old_low - LOOSER * old:
        found.append(f"lower bound {old_low:.6g} → {new_low:.6g} of {new:.6g}")
    if before["residual"] and not after["residual"]:
        found.append("no certificate")
    if new_s > SLOWER * old_s and new_s > old_s + LEAST:
        found.append(f"{old_s:.1f} → {new_s:.1f} s")
    if before["bound"] != after["bound"]:
        found.append(f"{before['bound']} → {after['bound']}")
    return found


def compare(before, after):
    """Print the exits that are missing or worse, of the scenes that both tables have, and a summary of each table."""
    old, new = ({(row["scene"], row["exit"]): row for row in table_file.read(table)} for table in (before, after))
    both = {scene for scene, _ in old} & {scene for scene, _ in new}
    for key, row in old.items():
        if key[0] in both:
            found = worse(row, new[key]) if key in new else ["missing"] * bool(row["energy"])
            if found:
                print(f"{key[0]}, {key[1]}: {'; '.join(found)}")
    total = [sum(float(rows[key]["seconds"] or 0) for key in old.keys() & new.keys()) for rows in (old, new)]
    print(f"{len(both)} scenes in both; {total[0]:.0f} → {total[1]:.0f} s in all")
    for table in (before, after):
        summarize(table)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "compare", "one"))
    parser.add_argument("names", nargs="*")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds for each attractor, or for each extreme")
    parser.add_argument("--list", action="store_true")
    given = parser.parse_args()
    if given.list:
        print("\n".join(all_scenes()))
    elif given.what == "one":
        make, scene = all_scenes()[given.names[0]]
        print(json.dumps(list(make(scene, given.limit))))
    elif given.what == "run":
        run(Path(given.names[0]), given.names[1:], given.limit)
    else:
        compare(*map(Path, given.names))


if __name__ == "__main__":
    main()
