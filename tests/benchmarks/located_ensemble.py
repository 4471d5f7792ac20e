"""Ensembles with stops: steppers that locate contacts against RK4, at the same error.

    python -m tests.benchmarks.located_ensemble [--rounds 5] [--trajectories 4096] [--periods 5] [--scene hertz-0.570]
                                                   [--errors 1e-6 1e-10] [--csv FILE]

Trajectories start near the last attractor of the scene, with momenta of 1e-3, and cost microseconds per trajectory and
period, on all threads. The error is the median distance in (x, v), after all periods, from the reference: FreeFlight at
1e-13 for Order8 and RK4, Order8 at 1e-13 for FreeFlight. With --errors, the tolerances are the loosest ones that have
these errors.
"""

import argparse
import warnings

import numpy as np

import vibrokit as vk
from tests.benchmarks import table_file
from tests.benchmarks.races import race, report, table, timed
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
        """Print a row for each stepper, and return the rows."""
        for stepper in steppers:
            compiled_kernel(self.scene, self.flow, stepper)
        runs = race({repr(one): lambda _, one=one: timed(self.run, one) for one in steppers}, rounds)
        each = 1e6 / len(self.starts) / self.periods
        errors = {repr(one): self.error(one, runs[repr(one)][-1][0]) for one in steppers}
        costs = {name: [each * seconds for _, seconds in times] for name, times in runs.items()}
        print(self.flow.value)
        report(costs, repr(steppers[0]), "µs", {name: f"   error {error:.1e}" for name, error in errors.items()})
        more = {name: {"error": f"{error:.1e}"} for name, error in errors.items()}
        return [{"flow": self.flow.value} | row for row in table(costs, repr(steppers[0]), more)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--trajectories", type=int, default=4096)
    parser.add_argument("--periods", type=int, default=5)
    parser.add_argument("--scene", default="hertz-0.570")
    parser.add_argument("--errors", type=float, nargs="+")
    table_file.add_option(parser)
    given = parser.parse_args()
    rows = []
    warnings.simplefilter("ignore")  # RK4 has too few steps for stiff stops
    scene = vk.load_scene(given.scene)
    point = vk.find_structure(scene, manifolds=False).attractors[-1].points[0, :2]
    for flow in FLOWS:
        contest = Contest(scene, flow, starts_near(point, flow, given.trajectories), given.periods)
        if given.errors:
            located = [contest.at_error(kind, each) for kind in LOCATED for each in given.errors]
        else:
            located = [kind(each) for kind in LOCATED for each in TOLERANCES]
        rows += contest.measure((*FIXED, *located), given.rounds)
    table_file.write(given.csv, rows)


if __name__ == "__main__":
    main()
