"""Structure at the extremes, by default settings: what is found, or the reason, and the seconds.

    python -m tests.benchmarks.structure_extremes [WORDS …] [--limit 60] [--list]

Each scene whose name contains all the words runs in a process of its own, with a time limit. A row has the number of
attractors of each kind, of saddles, the share of the region that reaches no attractor, the stepper of the basins, and
the seconds of each stage. A first compilation is included.
"""

import argparse
import collections
import json
import math
import time

import vibrokit as vk
from tests.benchmarks.apart import apart
from vibrokit.errors import VibrokitError

SCENES = {}
NOISE = vk.WhiteNoise(intensity=1e-4)


def scene(name, *, natural=1.0, damping=0.01, stops=(), forces=((0.18, 0.57),), push=0.2, spring=None, noise=NOISE):
    given = {} if spring is None else {"spring": spring}
    excitations = [vk.Harmonic(*each) for each in forces] + [vk.Constant(push)] * bool(push)
    SCENES[name] = lambda: vk.Oscillator(
        natural_frequency=natural, damping_ratio=damping, barriers=tuple(stops), excitations=tuple(excitations),
        noise=noise, **given,
    )  # fmt: skip


def both(law, position=0.5):
    return vk.Barrier(law, position, "right"), vk.Barrier(law, -position, "left")


HARD = vk.CubicSpring(1.0, 0.3)

for power in range(0, 13, 2):
    scene(f"hertz k = 1e{power}", stops=both(vk.Hertz(10.0**power)))
    scene(f"linear k = 1e{power}", stops=both(vk.Linear(10.0**power)))
    scene(f"hertz k = 1e{power}, duffing", stops=both(vk.Hertz(10.0**power)), spring=HARD, damping=0.03)
for damping in (1e-4, 1e-3, 0.1, 1.0, 2.0):
    strong = 0.4 * max(damping, 0.01)
    scene(f"hertz, damping {damping:g}", stops=both(vk.Hertz(50.0)), damping=damping)
    scene(f"duffing, damping {damping:g}", spring=HARD, forces=((strong, 1.3),), push=0.0, damping=damping)
    scene(f"linear spring, no stops, damping {damping:g}", damping=damping)
for gap in (0.0, 1e-6, 1e-2, 10.0):
    scene(f"hertz, clearance {gap:g}", stops=both(vk.Hertz(50.0), gap), damping=0.03)
    scene(f"one linear stop, clearance {gap:g}", stops=(vk.Barrier(vk.Linear(100.0), gap, "right"),), damping=0.03)
for frequency in (1e-3, 1e-2, 0.1, 10.0, 100.0, 1e3):
    scene(f"hertz, frequency {frequency:g}", stops=both(vk.Hertz(50.0)), forces=((0.18, frequency),))
    scene(f"duffing, frequency {frequency:g}", spring=HARD, forces=((0.4, frequency),), push=0.0, damping=0.05)
for size in (1e-9, 1e-6, 1e-3, 1e3, 1e6):  # the paper's scene and a Duffing scene in other units of length
    stops, noise = both(vk.Hertz(50.0 * size**-0.5), 0.5 * size), vk.WhiteNoise(1e-4 * size**2)
    scene(f"hertz, lengths times {size:g}", stops=stops, forces=((0.18 * size, 0.57),), push=0.2 * size, noise=noise)
    spring, forces = vk.CubicSpring(1.0, 0.3 * size**-2), ((0.4 * size, 1.4),)
    scene(f"duffing, lengths times {size:g}", spring=spring, forces=forces, push=0.0, damping=0.05, noise=noise)
for stiffness in (1e11, 1e12, 1e13):  # a steel ball on a leaf spring of 40 Hz between steel plates, shaken at 50 Hz
    scene(
        f"steel ball, k = {stiffness:g}", natural=2 * math.pi * 40, damping=0.02, stops=both(vk.Hertz(stiffness), 1e-4),
        forces=((8.0, 2 * math.pi * 50),), push=0.0, noise=vk.WhiteNoise(1e-3),
    )  # fmt: skip
scene("double well, unforced, damping 0.001", spring=vk.CubicSpring(-1.0, 1.0), forces=(), push=0.0, damping=1e-3)
scene("free impacts, no forcing", stops=both(vk.Hertz(1e4)), forces=(), push=1.0)


def row_of(name, limit):
    began = time.perf_counter()
    try:
        structure = vk.find_structure(SCENES[name](), rng=0, time_limit=limit)
    except (VibrokitError, KeyboardInterrupt) as error:
        return {"found": f"{type(error).__name__}: {error}", "seconds": time.perf_counter() - began}
    kinds = collections.Counter(attractor.kind for attractor in structure.attractors)
    found = ", ".join(f"{count} {kind}" for kind, count in kinds.items()) + f", {len(structure.saddles)} saddles"
    return {
        "found": found if structure.complete else f"stopped; {found}",
        "stepper": structure.stepper,
        "findings": sorted({finding.code.value for finding in structure.findings}),
        "stages": {stage: round(seconds, 1) for stage, seconds in structure.stats.seconds.items() if seconds >= 0.5},
        "seconds": time.perf_counter() - began,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*")
    parser.add_argument("--limit", type=float, default=60.0)
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--scene", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.scene:
        print(json.dumps(row_of(given.scene, given.limit)))
        return
    names = [name for name in SCENES if all(word in name for word in given.words)]
    if given.list:
        print("\n".join(names))
        return
    late = []
    for name in names:
        row, why = apart("structure_extremes", "--scene", name, "--limit", given.limit, seconds=2 * given.limit + 60)
        row = row or {"found": why, "seconds": math.nan}
        late += [name] if not row["seconds"] <= 30 else []
        more = " ".join(str(row[key]) for key in ("stepper", "findings", "stages") if row.get(key))
        print(f"{name:40s} {row['seconds']:6.1f} s  {row['found']}  {more}", flush=True)
    print(f"\n{len(names)} scenes, {len(late)} over 30 s: {', '.join(late)}")


if __name__ == "__main__":
    main()
