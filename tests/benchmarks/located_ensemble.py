"""Ensembles with stops: steppers that locate contacts against RK4, at the same error.

    python tests/benchmarks/located_ensemble.py [--rounds 5] [--trajectories 4096] [--periods 5] [--scene hertz-0.570]
                                                [--errors 1e-6 1e-10]

Trajectories start near the last attractor of the scene, with momenta of 1e-3, and cost microseconds per trajectory and
period, on all threads. The error is the median distance in (x, v), after all periods, from the reference: FreeFlight at
1e-13 for Order8 and RK4, Order8 at 1e-13 for FreeFlight. With --errors, the tolerances are the loosest ones that have
these errors. Every round runs all contestants one after another; a row has the median of the ratios to RK4(256) of the
same round, with their smallest and largest.
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
FIXED, LOCATED = (vk.RK4(256), vk.RK4(1024)), (vk.Order8, vk.FreeFlight)
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
FINEST = 1e-13
HALVINGS, AROUND = 8, 100.0  # of the search for a tolerance: steps, and factor between it and the error on each side


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


class Contest:
    """Steppers on one flow, from the same starts."""

    def __init__(self, scene, flow, starts, periods):
        self.flow, self.starts, self.periods, self.scene = flow, starts, periods, scene
        self.references = {kind: self.run(kind(FINEST)) for kind in LOCATED}

    def run(self, stepper):
        return run_ensemble(self.scene, self.flow, stepper, self.starts, self.periods).states[:, :2]

    def error(self, stepper, ended):
        other = vk.Order8 if isinstance(stepper, vk.FreeFlight) else vk.FreeFlight
        return np.median(np.abs(ended - self.references[other]).max(axis=1))

    def at_error(self, kind, error):
        """The stepper of the loosest tolerance with at most an error."""
        fine, coarse = np.log(error / AROUND), np.log(error * AROUND)
        for _ in range(HALVINGS):
            middle = kind(float(np.exp((fine + coarse) / 2)))
            if self.error(middle, self.run(middle)) <= error:
                fine = np.log(middle.tolerance)
            else:
                coarse = np.log(middle.tolerance)
        return kind(float(f"{np.exp(fine):.3g}"))

    def measure(self, steppers, rounds):
        """Print a row for each stepper."""
        seconds, errors = {}, {}
        for stepper in steppers:
            compiled_kernel(self.scene, self.flow, stepper)
        for _ in range(rounds):
            for stepper in steppers:
                begun = time.perf_counter()
                ended = self.run(stepper)
                seconds.setdefault(stepper, []).append(time.perf_counter() - begun)
                errors[stepper] = self.error(stepper, ended)
        for stepper in steppers:
            ratios = [one / base for one, base in zip(seconds[stepper], seconds[steppers[0]], strict=True)]
            each = 1e6 * statistics.median(seconds[stepper]) / len(self.starts) / self.periods
            print(
                f"{self.flow.value:24} {stepper!r:28} {errors[stepper]:8.1e} {each:8.2f} µs  "
                f"{statistics.median(ratios):6.1f} ({min(ratios):.1f} - {max(ratios):.1f})",
                flush=True,
            )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--trajectories", type=int, default=4096)
    parser.add_argument("--periods", type=int, default=5)
    parser.add_argument("--scene", default="hertz-0.570")
    parser.add_argument("--errors", type=float, nargs="+")
    given = parser.parse_args()
    warnings.simplefilter("ignore")  # RK4 has too few steps for stiff stops
    scene = vk.load_scene(given.scene)
    point = vk.find_structure(scene, manifolds=False).attractors[-1].points[0, :2]
    print("flow, stepper, median error, cost per trajectory and period, ratio to RK4(256) (least - most)")
    for flow in FLOWS:
        contest = Contest(scene, flow, starts_near(point, flow, given.trajectories), given.periods)
        if given.errors:
            located = [contest.at_error(kind, each) for kind in LOCATED for each in given.errors]
        else:
            located = [kind(each) for kind in LOCATED for each in TOLERANCES]
        contest.measure((*FIXED, *located), given.rounds)


if __name__ == "__main__":
    main()
