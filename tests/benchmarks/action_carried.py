"""Certified energies of the gallery against SciPy's DOP853, which carries each path from section to section once more.

    python -m tests.benchmarks.action_carried [WORDS …] [--limit 120] [--csv FILE]

Given words, only scenes with at least one of them in their names run.

Hamilton's equations are written out here: x″ = f + p₂, p₁′ = −p₂ ∂f/∂x, p₂′ = −p₁ − p₂ ∂f/∂v, with the action
∫ ½ p₂² dt. Contacts are located as events. A row is one path: the largest misfit at a section, in units of the path's
extent; the parts of its two ends that do not belong to the manifolds of the orbits there, relative to their distances,
with manifolds from central differences of DOP853's own flow; and the relative difference of the action, that of both
ends being ½ p δq and −½ p δq. If all of them are small, the path is extremal between both orbits and its action is
right; it is not shown that no other path is cheaper.
"""

import argparse

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import vibrokit as vk
from tests.benchmarks import table_file
from tests.benchmarks.action_minimized import model_of
from tests.benchmarks.gallery import SCENES

STEP = 1e-7  # of central differences, in units of the path's extent: a saddle may stretch it by 1e4
PARTS = 2000  # of a period: where steps are 300 in a period, one contact of "linear stops" is passed over
EXACT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}


def rates(model, t, z, inside):
    """Rates of (x, v, p₁, p₂, action) while the mass is inside some of the stops."""
    x, v, p1, p2, _ = z
    force = sum(amplitude * np.cos(frequency * t) for amplitude, frequency in model.tones) + model.push
    force -= 2 * model.damping * v + model.linear * x + model.cubic * x**3
    in_x, in_v = -model.linear - 3 * model.cubic * x**2, -2 * model.damping
    for stop in (stop for stop, touched in zip(model.stops, inside, strict=True) if touched):
        pull, slope, rate, *_ = stop.pull(np.array(x), np.array(v))
        force, in_x, in_v = force - float(pull), in_x - float(slope), in_v - float(rate)
    return [v, force + p2, -p2 * in_x, -p1 - p2 * in_v, 0.5 * p2**2]


def carried(model, z, start, duration):
    """Carry (x, v, p₁, p₂) over some time, or back; return it with the action, restarted at each contact."""
    z, t, end = np.append(z, 0.0), start, start + duration
    inside = [stop.depth(z[0]) > 0 for stop in model.stops]
    while t != end:
        events = [lambda t, z, stop=stop: stop.depth(z[0]) for stop in model.stops]
        for event, touched in zip(events, inside, strict=True):
            event.terminal, event.direction = True, -1.0 if touched else 1.0
        run = solve_ivp(
            lambda t, z: rates(model, t, z, inside), (t, end), z, events=events, max_step=model.period / PARTS, **EXACT
        )
        t, z = float(run.t[-1]), run.y[:, -1]
        if run.status == 1:
            met = next(number for number, times in enumerate(run.t_events) if len(times))
            inside[met] = not inside[met]
    return z


def linearized(model, orbit, duration, extent):
    """The point of an orbit found anew, and the derivative of the flow over some time there, shape (4, 4)."""

    def misfit(state):
        return carried(model, [*state, 0.0, 0.0], 0.0, abs(duration))[:2] - state

    point = np.append(fsolve(misfit, orbit, xtol=1e-13), [0.0, 0.0])
    moves = STEP * np.diag(extent)
    columns = [
        (carried(model, point + move, 0.0, duration) - carried(model, point - move, 0.0, duration))[:4] / (2 * size)
        for move, size in zip(moves, STEP * extent, strict=True)
    ]
    return point, np.stack(columns, axis=1)


def astray(slopes, offset, extent):
    """The part of an offset that is not in the growing directions, relative to it."""
    values, vectors = np.linalg.eig(slopes * extent / extent[:, None])
    parts = np.linalg.solve(vectors, offset / extent)
    shrinking = np.abs(values) < 1
    return float(np.linalg.norm((vectors * parts)[:, shrinking].sum(axis=1)) / np.linalg.norm(offset / extent))


def checked(osc, structure, energy):
    """Misfit at the sections, both ends' parts astray, and the relative difference of the action."""
    model, path = model_of(osc), energy.path
    states = np.hstack([path.q, path.p])
    extent = np.ptp(states, axis=0)
    nodes, times = states[path.section], path.t[path.section]
    misfit, action = 0.0, 0.0
    for node, after, begin in zip(nodes[:-1], nodes[1:], times[:-1], strict=True):
        found = carried(model, node, begin, model.period)
        misfit, action = max(misfit, float(np.abs((found[:4] - after) / extent).max())), action + found[4]
    ends = []
    for orbit, node, sign in (
        (structure.attractors[energy.source], nodes[0], 1),
        (structure.saddles[energy.saddle], nodes[-1], -1),  # what it attracts grows backwards in time
    ):
        nearest = orbit.points[np.argmin(np.linalg.norm(orbit.points - node[:2], axis=1))]
        point, slopes = linearized(model, nearest, sign * len(orbit.points) * model.period, extent)
        offset = node - point
        ends.append(astray(slopes, offset, extent))
        action += sign * 0.5 * float(offset[2:] @ offset[:2])
    return misfit, *ends, action / energy.value - 1


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
        structure = vk.find_structure(osc, rng=0, manifolds=False)
        for attractor in structure.attractors:
            if not attractor.is_fixed or len(structure.attractors) == 1:
                continue
            result = vk.LeastAction(source=attractor.label, graph=None).run(osc, structure, time_limit=given.limit)
            for energy in result.energies:
                if energy.certificate is None or energy.saddle is None:
                    continue
                misfit, start, end, difference = checked(osc, structure, energy)
                print(
                    f"{name:30s} {result.exit_of(energy):40s} {energy.value:.10g}, misfit {misfit:.0e}, "
                    f"astray {start:.0e} and {end:.0e}, action {difference:+.1e}",
                    flush=True,
                )
                rows.append({
                    "scene": name, "exit": result.exit_of(energy), "energy": f"{energy.value:.12g}",
                    "misfit": f"{misfit:.1e}", "start": f"{start:.1e}", "end": f"{end:.1e}",
                    "difference": f"{difference:.1e}",
                })  # fmt: skip
                table_file.write(given.csv, rows, timed=False)


if __name__ == "__main__":
    main()
