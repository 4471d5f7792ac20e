"""Smooth ensembles: RK8, Order8 and RK4 against heyoka's batch integrator, one thread each, at the same error.

    python -m tests.benchmarks.smooth_ensemble [--rounds 5] [--trajectories 8192] [--periods 20]

A forced Duffing oscillator, x″ + 0.1 x′ + x + 0.3 x³ = 0.4 cos 1.4 t, and Hamilton's equations with momenta of 1e-3.
Each contestant has the coarsest of its settings whose median error after all periods is at most the wanted one; the
reference is heyoka at 1e-17. heyoka (pip install heyoka) integrates batches of as many trajectories as its registers
hold, with one integrator for all of them.
"""

import argparse
import concurrent.futures as futures
import functools
import math

import heyoka
import numpy as np

import vibrokit as vk
from tests.benchmarks.races import race, report, timed
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.symbolic.flow_kind import Flow

FREQUENCY = 1.4
PERIOD = 2 * math.pi / FREQUENCY
SCENE = vk.Oscillator(
    natural_frequency=1.0, damping_ratio=0.05, spring=vk.CubicSpring(1.0, 0.3),
    excitations=(vk.Harmonic(0.4, FREQUENCY),), noise=vk.WhiteNoise(intensity=1e-4),
)  # fmt: skip
TOLERANCES = tuple(10.0**-k for k in range(7, 17))
WANTED = (1e-6, 1e-9, 1e-12)


@functools.cache
def integrator(flow, tolerance):
    """heyoka's integrator of a batch."""
    x, v, p1, p2, action = heyoka.make_vars("x", "v", "p1", "p2", "action")
    force = 0.4 * heyoka.cos(FREQUENCY * heyoka.time) - 0.1 * v - x - 0.3 * x**3
    equations = [(x, v), (v, force)]
    if flow is Flow.HAMILTONIAN:
        equations = [(x, v), (v, force + p2), (p1, (1 + 0.9 * x**2) * p2), (p2, 0.1 * p2 - p1), (action, 0.5 * p2**2)]
    batch = heyoka.recommended_simd_size()
    return heyoka.taylor_adaptive_batch(equations, np.zeros((len(equations), batch)), tol=tolerance)


def heyoka_ends(flow, tolerance, starts, periods):
    ends, batch, work = np.empty_like(starts), heyoka.recommended_simd_size(), integrator(flow, tolerance)
    for first in range(0, len(starts), batch):
        work.set_time(0.0)
        work.state[:] = starts[first : first + batch].T
        work.propagate_until(periods * PERIOD)
        ends[first : first + batch] = work.state.T
    return ends


def our_ends(flow, stepper, starts, periods, executor):
    return run_ensemble(SCENE, flow, stepper, starts, periods, executor=executor).states


def starts_of(flow, count):
    generator = np.random.default_rng(0)
    starts = generator.uniform(-1.5, 1.5, (count, 2))
    if flow is Flow.HAMILTONIAN:
        starts = np.hstack([starts, generator.normal(0.0, 1e-3, (count, 2)), np.zeros((count, 1))])
    return starts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--trajectories", type=int, default=8192)
    parser.add_argument("--periods", type=int, default=20)
    given = parser.parse_args()
    print(f"heyoka {heyoka.__version__}, batches of {heyoka.recommended_simd_size()}; one thread each")
    with futures.ThreadPoolExecutor(1) as one_thread:
        for flow in (Flow.STATE, Flow.HAMILTONIAN):
            contest(flow, given, one_thread)


def contest(flow, given, one_thread):
    starts = starts_of(flow, given.trajectories)
    reference = heyoka_ends(flow, 1e-17, starts, given.periods)
    ours = functools.partial(our_ends, flow, starts=starts, periods=given.periods, executor=one_thread)
    theirs = functools.partial(heyoka_ends, flow, starts=starts, periods=given.periods)
    contestants = {
        "heyoka": [(f"tolerance {tolerance:g}", functools.partial(theirs, tolerance)) for tolerance in TOLERANCES],
        "RK4": [(f"{steps} steps", functools.partial(ours, vk.RK4(steps))) for steps in (2**k for k in range(6, 14))],
        "RK8": [
            (f"{steps} steps", functools.partial(ours, vk.RK8(steps)))
            for steps in (8, 12, 16, 20, 24, 28, 32, 40, 48, 56, 64, 72, 80, 96)
        ],
        "Order8": [
            (f"tolerance {tolerance:g}", functools.partial(ours, vk.Order8(tolerance)))
            for tolerance in (10.0**-k for k in range(4, 14))
        ],
    }  # fmt: skip
    settled = np.isfinite(reference).all(axis=1)
    errors = {
        name: [
            (setting, run, np.median(np.linalg.norm((run() - reference)[settled], axis=1))) for setting, run in ladder
        ]
        for name, ladder in contestants.items()
    }
    for wanted in WANTED:
        chosen = {
            name: next(((setting, run, error) for setting, run, error in rows if error <= wanted), None)
            for name, rows in errors.items()
        }
        racing = {name: one for name, one in chosen.items() if one is not None}
        runs = race({name: lambda _, run=run: timed(run) for name, (_, run, _) in racing.items()}, given.rounds)
        each = 1e6 / given.trajectories / given.periods
        costs = {name: [each * seconds for _, seconds in times] for name, times in runs.items()}
        texts = {name: f"   {setting}, error {error:.1e}" for name, (setting, _, error) in racing.items()}
        print(f"{flow.value}, error {wanted:g}")
        report(costs, "heyoka", "µs a period", texts)


if __name__ == "__main__":
    main()
