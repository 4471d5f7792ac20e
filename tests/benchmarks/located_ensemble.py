"""Ensembles with stops: steppers that locate contacts against RK4, at the same error.

    python tests/benchmarks/located_ensemble.py [--rounds 5] [--trajectories 4096] [--periods 5] [--scene hertz-0.570]

Trajectories start near the last attractor of the scene, with momenta of 1e-3, and cost microseconds per trajectory and
period, on all threads. The error is the median distance in (x, v), after all periods, from the reference: FreeFlight at
1e-13 for Order8 and RK4, Order8 at 1e-13 for FreeFlight. Every round runs all contestants one after another; a row has
the median of the ratios to RK4(256) of the same round, with their smallest and largest.
"""

import argparse
import statistics
import sys
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
import vibrokit as vk
from vibrokit.kernels.ensemble import compiled_kernel, run_ensemble
from vibrokit.symbolic.flow_kind import Flow

FLOWS = (Flow.STATE, Flow.STATE_VARIATIONAL, Flow.HAMILTONIAN, Flow.HAMILTONIAN_VARIATIONAL)
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
STEPPERS = (vk.RK4(256), vk.RK4(1024), *(kind(each) for kind in (vk.Order8, vk.FreeFlight) for each in TOLERANCES))
FINEST = 1e-13


def starts_near(point, flow, count):
    """States near a point, in the layout of a flow, with derivatives of the identity."""
    rng, n = np.random.default_rng(1), 2
    states = [point + 1e-2 * rng.standard_normal((count, n))]
    if flow.has_momenta:
        states += [1e-3 * rng.standard_normal((count, n)), np.zeros((count, 1))]
    if flow in (Flow.STATE_VARIATIONAL, Flow.HAMILTONIAN_VARIATIONAL):
        size = 2 * n if flow.has_momenta else n
        states += [np.broadcast_to(np.eye(size).ravel(), (count, size**2))]
    return np.hstack(states)


def measure(scene, flow, starts, periods, rounds):
    """Print a row for each stepper."""
    seconds, errors = {}, {}
    references = {
        kind: run_ensemble(scene, flow, kind(FINEST), starts, periods).states[:, :2]
        for kind in (vk.FreeFlight, vk.Order8)
    }
    for stepper in STEPPERS:
        compiled_kernel(scene, flow, stepper)
    for _ in range(rounds):
        for stepper in STEPPERS:
            begun = time.perf_counter()
            ended = run_ensemble(scene, flow, stepper, starts, periods)
            seconds.setdefault(stepper, []).append(time.perf_counter() - begun)
            other = vk.Order8 if isinstance(stepper, vk.FreeFlight) else vk.FreeFlight
            errors[stepper] = np.median(np.abs(ended.states[:, :2] - references[other]).max(axis=1))
    for stepper in STEPPERS:
        ratios = [one / base for one, base in zip(seconds[stepper], seconds[STEPPERS[0]], strict=True)]
        each = 1e6 * statistics.median(seconds[stepper]) / len(starts) / periods
        print(
            f"{flow.value:24} {stepper!r:28} {errors[stepper]:8.1e} {each:8.2f} µs  "
            f"{statistics.median(ratios):6.1f} ({min(ratios):.1f} - {max(ratios):.1f})",
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--trajectories", type=int, default=4096)
    parser.add_argument("--periods", type=int, default=5)
    parser.add_argument("--scene", default="hertz-0.570")
    given = parser.parse_args()
    warnings.simplefilter("ignore")  # RK4 has too few steps for stiff stops
    scene = vk.load_scene(given.scene)
    point = vk.find_structure(scene, manifolds=False).attractors[-1].points[0, :2]
    print("flow, stepper, median error, cost per trajectory and period, ratio to RK4(256) (least - most)")
    for flow in FLOWS:
        measure(scene, flow, starts_near(point, flow, given.trajectories), given.periods, given.rounds)


if __name__ == "__main__":
    main()
