"""Least action on scenes of a user's kind, by default settings: the share that is certified, and the seconds.

    python tests/benchmarks/action_gallery.py [WORDS …] [--limit 120] [--list]

Each scene whose name contains all the words runs in a process of its own. A row is one attractor: its energy with the
relative numerical error, the certificate's residual and transversality, the graph's relative error, and the seconds of
`LeastAction` on that attractor alone. What runs into the limit is stopped by `time_limit=` and says what is missing.
"""

import argparse
import json
import math
import statistics
import subprocess
import sys
import time

import vibrokit as vk
from vibrokit.errors import VibrokitError
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Severity

SCENES = {}
NOISE = vk.WhiteNoise(intensity=1e-4)


def forced(
    name, frequency, amplitude, *, spring=None, damping=0.05, stops=(), push=0.0, noise=NOISE, natural=1.0, more=()
):
    excitations = [vk.Harmonic(amplitude=amplitude, frequency=frequency)] if amplitude else []
    excitations += [vk.Constant(push)] if push else []
    given = {} if spring is None else {"spring": spring}
    SCENES[name] = vk.Oscillator(
        natural_frequency=natural, damping_ratio=damping, barriers=tuple(stops), excitations=(*excitations, *more),
        noise=noise, **given,
    )  # fmt: skip


def both(law, position):
    return vk.Barrier(law, position, "right"), vk.Barrier(law, -position, "left")


HARD, WELLS = vk.CubicSpring(1.0, 0.3), vk.CubicSpring(-1.0, 1.0)
forced("duffing, hardening", 1.4, 0.4, spring=HARD)
forced("duffing, softening", 0.9, 0.15, spring=vk.CubicSpring(1.0, -0.05), damping=0.03)
forced("duffing, weak forcing", 1.2, 0.1, spring=HARD, damping=0.02)
forced("duffing, weakly damped", 1.1, 0.05, spring=HARD, damping=0.005)
forced("duffing, subharmonic", 3.3, 3.0, spring=vk.CubicSpring(1.0, 0.2), damping=0.01)
forced("duffing, multiplicative noise", 1.4, 0.4, spring=HARD, noise=vk.StateDependentNoise(1e-4, "1 + c*x**2", c=0.3))
forced("duffing, damping of x^2 v", 1.4, 0.5, spring=vk.CustomSpring("x + b*x**3 + c*x**2*v", b=0.3, c=0.05))
forced(
    "duffing, SI", 1.4 * 2 * math.pi * 50, 0.4e-4 * (2 * math.pi * 50) ** 2, natural=2 * math.pi * 50,
    spring=vk.CubicSpring((2 * math.pi * 50) ** 2, 0.3e8 * (2 * math.pi * 50) ** 2),
    noise=vk.WhiteNoise(intensity=1e-5),
)  # fmt: skip
forced("double well", 0.0, 0.0, spring=WELLS)
forced("double well, overdamped", 0.0, 0.0, spring=WELLS, damping=1.5)
forced("double well, tilted", 0.0, 0.0, spring=WELLS, push=0.1)
forced("double well, forced", 0.8, 0.1, spring=WELLS, damping=0.1)
forced("double well, linear stops", 0.9, 0.15, spring=WELLS, damping=0.15, stops=both(vk.Linear(30.0), 1.2))
forced("double well, stops", 0.0, 0.0, spring=WELLS, stops=both(vk.Hertz(20.0), 0.9))
forced("double well, slowly forced", 0.05, 0.15, spring=WELLS, damping=0.1)
forced("double well, very slowly forced", 0.02, 0.2, spring=WELLS, damping=0.2)
forced("double well, five orbits", 2.4, 0.3, spring=WELLS, damping=0.03)
forced("double well, two orbits each", 2.5, 0.3, spring=vk.CubicSpring(-5.0, 5.0), damping=0.1)
forced("double well, chaotic", 1.2, 0.3, spring=WELLS, damping=0.15)
TRIPLE = vk.CustomSpring("x*(x**2 - 1)*(x**2 - 4)/4")
forced("triple well", 0.0, 0.0, spring=TRIPLE)
forced("triple well, overdamped", 0.0, 0.0, spring=TRIPLE, damping=1.5)
forced("triple well, forced", 0.8, 0.05, spring=TRIPLE, damping=0.2)
forced("cubic well", 0.85, 0.05, spring=vk.CustomSpring("x - x**2"))
forced("cubic well, one orbit", 0.88, 0.035, spring=vk.CustomSpring("x - x**2"), damping=0.04)
forced("cubic well, stop", 0.85, 0.04, spring=vk.CustomSpring("x - x**2"), damping=0.03,
       stops=(vk.Barrier(vk.Linear(50.0), -0.35, "left"),))  # fmt: skip
forced("cubic well, unforced", 0.0, 0.0, spring=vk.CustomSpring("x - x**2"))
forced("pendulum", 0.75, 0.25, spring=vk.CustomSpring("sin(x)"))
forced("pendulum, tilted", 0.0, 0.0, spring=vk.CustomSpring("sin(x)"), damping=0.1, push=0.3)
for frequency in (0.525, 0.570):
    SCENES[f"hertz-{frequency:.3f}"] = vk.load_scene(f"hertz-{frequency:.3f}")
forced("linear stops", 0.57, 0.18, damping=0.01, push=0.2, stops=both(vk.Linear(50.0), 0.5))
forced("two linear stops", 1.3, 0.25, damping=0.03, stops=both(vk.Linear(200.0), 0.25))
forced("hunt-crossley", 0.57, 0.18, damping=0.01, push=0.2,
       stops=both(vk.CustomLaw("k*depth**1.5*(1 + c*rate)", k=50.0, c=0.3), 0.5))  # fmt: skip
forced("kelvin-voigt", 0.75, 0.2, damping=0.02, stops=both(vk.CustomLaw("k*depth + c*rate", k=100.0, c=1.0), 0.4))
forced("one stop, hard", 1.3, 0.2, damping=0.03, stops=(vk.Barrier(vk.Hertz(100.0), 0.5, "right"),))
forced("two tones", 0.6, 0.2, damping=0.03, stops=both(vk.Hertz(30.0), 0.6), more=(vk.Harmonic(0.05, 1.2),))
forced("zero gap", 2.0, 0.3, damping=0.03, stops=(vk.Barrier(vk.Linear(3.0), 0.0, "right"),))
forced("stiff linear stop", 2.6, 0.4, damping=0.03, stops=(vk.Barrier(vk.Linear(1000.0), 0.2, "right"),))
forced("stiff Hertz stops", 0.8, 0.3, damping=0.03, stops=both(vk.Hertz(1e4), 0.4))
forced("backlash", 0.75, 0.2, natural=0.1, damping=0.4, push=0.3, stops=both(vk.Linear(1.0), 1.0))
forced("preloaded contact", 1.05, 0.25, natural=0.05, damping=0.3, push=1.0,
       stops=(vk.Barrier(vk.Hertz(1.0), 0.0, "right"),))  # fmt: skip
forced("self-excited", 0.0, 0.0, damping=0.0, spring=vk.CustomSpring("x + c*(1 - 5*x**2 + 2*x**4)*v", c=0.1))
forced("self-excited, one way", 0.0, 0.0, damping=0.0, spring=vk.CustomSpring("x + (a - b*x**2)*v", a=0.1, b=0.1))
forced("first contact", 0.57, 0.1, damping=0.05, stops=both(vk.Hertz(50.0), 0.5))


def rows_of(name, limit):
    """Rows of one scene."""
    osc, began = SCENES[name], time.perf_counter()
    try:
        structure = vk.find_structure(osc, rng=0)
    except VibrokitError as error:
        return [{"attractor": "", "why": f"{type(error).__name__}: {error}", "seconds": time.perf_counter() - began}]
    seconds = time.perf_counter() - began
    found = f"{len(structure.attractors)} attractors, {len(structure.saddles)} saddles"
    rows = [{"attractor": "structure", "why": found, "seconds": seconds}]
    escapes = any(ESCAPED in saddle.leads_to for saddle in structure.saddles)
    exit_ = vk.LeaveBasin() if len(structure.attractors) > 1 or escapes else vk.FirstContact()
    for attractor in structure.attractors:
        began = time.perf_counter()
        row = {"attractor": attractor.name, "kind": attractor.kind, "why": ""}
        try:
            result = vk.LeastAction(source=attractor.label, exit=exit_).run(osc, structure, time_limit=limit)
        except VibrokitError as error:
            row["why"] = f"{type(error).__name__}: {error}"
        else:
            serious = [f for f in result.findings if f.severity is not Severity.INFO]
            row["why"] = "; ".join(sorted({f.code.value for f in serious}))
            row["energies"] = [
                {
                    "to": result.exit_of(e).split("→")[-1].strip(), "value": e.value, "bound": e.bound.value,
                    "error": e.numerical_error / e.value, "lower": e.lower / e.value,
                    "residual": None if e.certificate is None else e.certificate.residual,
                    "angle": None if e.certificate is None else e.certificate.transversality,
                }
                for e in result.energies if e.value > 0
            ]  # fmt: skip
            row["stages"] = {stage: round(s, 1) for stage, s in result.stats.seconds.items() if s > 0.5}
        row["seconds"] = time.perf_counter() - began
        rows.append(row)
    return rows


def limited(name, limit):
    """The rows of one scene, from a process of its own."""
    command = [sys.executable, "-W", "ignore", __file__, "--scene", name, "--limit", str(limit)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=5 * limit + 120, check=False)
    except subprocess.TimeoutExpired:
        return [{"attractor": "", "why": "did not end", "seconds": 5 * limit + 120}]
    if done.returncode:
        return [{"attractor": "", "why": (done.stderr.strip().splitlines() or ["?"])[-1], "seconds": math.nan}]
    return json.loads(done.stdout.splitlines()[-1])


def show(name, row):
    print(f"{name:30s} {row['attractor']:22s} {row['seconds']:6.1f} s  {row['why']}", flush=True)
    for one in row.get("energies", ()):
        certificate = "" if one["residual"] is None else f" residual {one['residual']:.0e}, angle {one['angle']:.0e},"
        print(
            f"{'':12s}→ {one['to']:20s} {one['value']:.10g} ± {one['error']:.0e},{certificate} lower end "
            f"{one['lower']:.2f}, {one['bound']}",
            flush=True,
        )
    if row.get("stages"):
        print(f"{'':14s}{row['stages']}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*")
    parser.add_argument("--limit", type=float, default=120.0)
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--scene", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.scene:
        print(json.dumps(rows_of(given.scene, given.limit)))
        return
    names = [name for name in SCENES if all(word in name for word in given.words)]
    if given.list:
        print("\n".join(names))
        return
    seconds, certified = [], 0
    for name in names:
        for row in limited(name, given.limit):
            show(name, row)
            if row.get("kind") == "periodic" or row.get("kind") == "equilibrium":
                seconds.append(row["seconds"])
                certified += any(one["residual"] is not None for one in row.get("energies", ()))
    if seconds:
        print(
            f"\n{certified} of {len(seconds)} certified; seconds: median {statistics.median(seconds):.1f}, "
            f"most {max(seconds):.1f}"
        )


if __name__ == "__main__":
    main()
