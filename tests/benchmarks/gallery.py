"""Scenes of a user's kind for least action, and exact energies of some; `baseline.py` runs them.

    python -m tests.benchmarks.gallery --scenes docs/data/scenes

writes a scene file of each.
"""

import argparse
import math
import re
from pathlib import Path

from scipy.optimize import minimize_scalar

import vibrokit as vk

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
forced("kelvin-voigt", 0.75, 0.2, damping=0.02, stops=both(vk.KelvinVoigt(100.0, 1.0), 0.4))
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

# Potential energies of the scenes without forcing whose energy is 4ζω_n times the barrier; ω_n is 1.
POTENTIALS = {
    "double well": lambda x: x**4 / 4 - x**2 / 2,
    "double well, overdamped": lambda x: x**4 / 4 - x**2 / 2,
    "double well, tilted": lambda x: x**4 / 4 - x**2 / 2 - 0.1 * x,
    "double well, stops": lambda x: x**4 / 4 - x**2 / 2 + 20.0 * 0.4 * max(abs(x) - 0.9, 0.0) ** 2.5,
    "triple well": lambda x: x**6 / 24 - 5 * x**4 / 16 + x**2 / 2,
    "triple well, overdamped": lambda x: x**6 / 24 - 5 * x**4 / 16 + x**2 / 2,
    "cubic well, unforced": lambda x: x**2 / 2 - x**3 / 3,
    "pendulum, tilted": lambda x: -math.cos(x) - 0.3 * x,
}
# Places over which motion escapes, or begins to turn over.
HILLTOPS = {"cubic well, unforced": 1.0, "pendulum, tilted": math.pi - math.asin(0.3)}
NEAR = 1e-12  # of the place of a hilltop, relative: its potential energy has an error of second order


def exact(osc, structure, energy):
    """The exact energy of an exit to a neighbouring well, an escape or a first contact; None if none is known."""
    name = next((name for name, each in SCENES.items() if each == osc), None)
    if name == "first contact":  # 2ζω_n³ times the squared distance of the forced motion from the stop
        return 2 * 0.05 * (0.5 - abs(0.1 / (1 - 0.57**2 + 2j * 0.05 * 0.57))) ** 2
    if name not in POTENTIALS:
        return None
    potential, places = POTENTIALS[name], [attractor.points[0, 0] for attractor in structure.attractors]
    start = places[energy.source]
    if name in HILLTOPS:
        top = potential(HILLTOPS[name])
    else:
        low, high = sorted((start, places[energy.target]))
        if any(low < place < high for place in places):
            return None
        found = minimize_scalar(lambda x: -potential(x), bounds=(low, high), method="bounded", options={"xatol": NEAR})
        top = -found.fun
    return 4 * osc.damping_ratio * (top - potential(start))


def file_name(name):
    """The name of the file of a scene: letters and digits, and the dot of a decimal number."""
    return re.sub(r"[^a-z0-9.]+", "-", name.lower()).strip("-") + ".toml"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=Path, required=True, help="folder for the scene files")
    folder = parser.parse_args().scenes
    folder.mkdir(parents=True, exist_ok=True)
    for name, osc in SCENES.items():
        vk.save_scene(osc, folder / file_name(name))
    print(f"{len(SCENES)} scenes in {folder}")


if __name__ == "__main__":
    main()
