"""Certified energies of the gallery against direct minimization of ∫ ½ u² dt, by a program that shares no code.

    python -m tests.benchmarks.action_minimized [WORDS …] [--limit 120] [--csv FILE]

Given words, only scenes with at least one of them in their names run.

Each polished path is the first guess of a minimization on a grid of its own (`tests.physics.reference_action`), with
both orbits found anew. The window is longer by as many periods as distances from the orbits need to decay by `LEFT`,
and the grid is halved where a stop is met, then twice everywhere. A row is one path, with the relative difference of
its two actions. The minimization has linear and cubic springs, harmonic and constant forces, additive noise, and stops
of any power of the depth.
"""

import argparse
import time

import numpy as np

import vibrokit as vk
from tests.benchmarks import table_file
from tests.benchmarks.gallery import SCENES
from tests.physics import reference_action as reference
from tests.physics.reference_guesses import sampled

SAMPLES = 128  # of a polished path, in a period
FINEST = 200  # times shorter than a sample are the elements at the stops
REFINED = 2  # each divides what the grid costs, 3e-6 of an energy of hertz-0.570 before, by about 30
LEFT = 1e-4  # of a distance from an orbit, after the periods added
MOST_ADDED = 150


def model_of(osc):
    """The same scene for the minimization.

    Raises
    ------
    KeyError, ValueError, TypeError
        If the scene has parts that the minimization lacks.
    """
    given = osc.parameters
    known = {"damping_ratio", "natural_frequency", "noise.intensity"}
    spring = (given["spring.linear"], given["spring.cubic"]) if "spring.linear" in given else (1.0, 0.0)
    known |= {"spring.linear", "spring.cubic"}
    tones, push = [], 0.0
    for number, _ in enumerate(osc.excitations):
        at = f"excitations.{number}."
        if at + "force" in given:
            push += given[at + "force"]
        else:
            tones.append((given[at + "amplitude"], given[at + "frequency"]))
        known |= {at + "force", at + "amplitude", at + "frequency", at + "phase"}
    stops = []
    for number, barrier in enumerate(osc.barriers):
        at, law = f"barriers.{number}.", barrier.law
        power = 1.0 if isinstance(law, vk.Linear) else 1.5
        stiffness = given.get(at + "law.stiffness", given.get(at + "law.k"))
        side = 1 if barrier.side == "right" else -1
        stops.append(reference.Stop(given[at + "position"], side, stiffness, power, given.get(at + "law.c", 0.0)))
        known |= {at + "law.stiffness", at + "law.k", at + "law.c", at + "law.formula", at + "position"}
    if osc.natural_frequency != 1.0 or not tones:
        raise ValueError("the minimization takes a natural frequency of 1 and at least one harmonic force.")
    if strange := sorted(set(given) - known):
        raise ValueError(f"the minimization has no {', '.join(strange)}.")
    return reference.Model(osc.damping_ratio, *spring, tuple(stops), tuple(tones), push)


def minimized(osc, structure, energy):
    """The path of the minimization that begins with the path of an energy."""
    model = model_of(osc)
    guess = sampled(model, energy.path, SAMPLES)
    ends = []
    for orbit in (structure.attractors[energy.source], structure.saddles[energy.saddle]):
        periods, rates = len(orbit.points), np.abs(np.log(np.abs(orbit.multipliers)))
        needed = np.log(1 / LEFT) / (rates.min() / periods)
        added = periods * int(np.ceil(min(needed, MOST_ADDED) / periods))
        ends += [(model.orbit(orbit.points[0], periods), periods), added]
    source, before, saddle, after = ends
    start, end = at_phase(model, source, guess.nodes[0]), at_phase(model, saddle, guess.nodes[-1])
    extended = guess.extended(start, before, end, after, SAMPLES)
    found = reference.followed_in(extended, model.period / SAMPLES / FINEST)
    for _ in range(REFINED):
        found = reference.least(found.refined())
    return found


def at_phase(model, orbit, node):
    """The point of an orbit on the section that is nearest to a node."""
    state, periods = orbit
    states = model.orbit_nodes(state, periods, model.period * np.arange(periods))[:, :2]
    return states[np.argmin(np.linalg.norm(states - node[:2], axis=1))], periods


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*")
    parser.add_argument("--limit", type=float, default=120.0)
    table_file.add_option(parser)
    given = parser.parse_args()
    rows = []
    for name, osc in SCENES.items():
        if given.words and not any(word in name for word in given.words):
            continue
        try:
            model_of(osc)
        except (KeyError, ValueError, TypeError) as error:
            print(f"{name:30s} {error}")
            continue
        structure = vk.find_structure(osc, rng=0)
        for attractor in structure.attractors:
            if not attractor.is_fixed or len(structure.attractors) == 1:
                continue
            result = vk.LeastAction(source=attractor.label, graph=None).run(osc, structure, time_limit=given.limit)
            for energy in result.energies:
                if energy.certificate is None or energy.saddle is None:
                    continue
                began = time.perf_counter()
                found = minimized(osc, structure, energy)
                print(
                    f"{name:30s} {result.exit_of(energy):40s} {energy.value:.10g} minimized {found.action:.10g}, "
                    f"relative difference {found.action / energy.value - 1:+.1e}, minimum {found.minimum}, "
                    f"{time.perf_counter() - began:.0f} s",
                    flush=True,
                )
                rows.append({
                    "scene": name, "exit": result.exit_of(energy), "energy": f"{energy.value:.12g}",
                    "minimized": f"{found.action:.12g}", "difference": f"{found.action / energy.value - 1:.1e}",
                })  # fmt: skip
                table_file.write(given.csv, rows, timed=False)


if __name__ == "__main__":
    main()
