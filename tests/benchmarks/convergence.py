"""Error against steps of every stepper, for Hertz and linear stops and without: the orders that are stated, measured.

Run by hand: ``python tests/benchmarks/convergence.py``. Prints the order fitted for each law and start, and saves
``docs/images/convergence.png``. Errors are medians over the starts, against the finest setting of another stepper
(FreeFlight for RK4 and Order8, Order8 for FreeFlight). Steps of the adaptive steppers are counted by finding the
smallest limit of steps that they get by with.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk
from vibrokit.kernels.ensemble import Stop, run_ensemble
from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.kernels.stopping import STALLED
from vibrokit.symbolic.flow_kind import Flow

PLACE, COUNT, FINEST = 0.5, 24, 1e-15
LAWS = {"no contact": None, "linear": vk.Linear(50.0), "Hertz": vk.Hertz(50.0)}
LADDERS = {
    "RK4": [vk.RK4(2**k) for k in range(5, 15)],
    "Order8": [vk.Order8(10.0**-k) for k in np.arange(3, 14.6, 0.5)],
    "FreeFlight": [vk.FreeFlight(10.0**-k) for k in np.arange(3, 14.6, 0.5)],
}
COLOURS = {"RK4": "#3b6ea8", "Order8": "#c8553d", "FreeFlight": "#588b5b"}
FLOOR = 1e-16


def scene(law):
    stops = () if law is None else (vk.Barrier(law, PLACE, "right"), vk.Barrier(law, -PLACE, "left"))
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.01, barriers=stops,
        excitations=(vk.Harmonic(amplitude=0.18, frequency=0.57), vk.Constant(0.2)),
    )  # fmt: skip


def cases():
    """Name, scene, starts, and time to integrate."""
    rng = np.random.default_rng(1)
    between = np.column_stack([rng.uniform(-0.5, 0.5, COUNT), rng.uniform(-0.5, 0.5, COUNT)])
    at_touch = np.column_stack([np.full(COUNT, PLACE), rng.uniform(0.4, 0.6, COUNT)])
    for name, law in LAWS.items():
        osc = scene(law)
        yield f"{name}: one period", osc, between, osc.section_interval
        if law is not None:
            yield f"{name}: from touch, in contact", osc, at_touch, 0.3


def ends(osc, stepper, states, interval):
    return run_ensemble(osc, Flow.STATE, stepper, states, interval=interval).states


def steps_taken(osc, stepper, states, interval):
    """Mean number of steps of a trajectory."""
    if isinstance(stepper, vk.RK4):
        return max(1, round(stepper.steps * interval / osc.time_unit))
    module, theta, stop = kernel_for(osc, Flow.STATE, stepper).module, theta_of(osc), Stop()
    settings = np.array(stepper.settings(osc, interval))
    tests = (stop.region, stop.labels, stop.home, stop.points, stop.point_labels, stop.tolerance)

    def stalls(state, limit):
        settings[1] = limit
        out = np.empty((1, 2)), *(np.zeros(1, dtype=np.int64) for _ in range(3))
        module.advance(state[None], theta, 0.0, interval, settings, np.ones(1, dtype=np.int64), *tests, *out)
        return out[2][0] == STALLED

    counts = []
    for state in states:
        low, high = 0, 1
        while stalls(state, high):
            low, high = high, 2 * high
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if stalls(state, middle) else (low, middle)
        counts.append(high)
    return float(np.mean(counts))


def order(steps, errors):
    """Slope where errors are small enough to show it and well above rounding."""
    kept = (errors < 1e-3) & (errors > 3e-14) & (steps > 2)
    if kept.sum() < 3 or np.ptp(np.log(steps[kept])) < 0.3:
        return float("nan")
    return -np.polyfit(np.log(steps[kept]), np.log(errors[kept]), 1)[0]


def curve(osc, name, states, interval):
    judge = vk.Order8(FINEST) if name == "FreeFlight" else vk.FreeFlight(FINEST)
    reference = ends(osc, judge, states, interval)
    rows = []
    for stepper in LADDERS[name]:
        error = np.median(np.linalg.norm(ends(osc, stepper, states, interval) - reference, axis=1))
        rows.append((steps_taken(osc, stepper, states, interval), max(error, FLOOR)))
    return np.array(rows).T


def main():
    every = list(cases())
    figure = Figure(figsize=(11, 6.6), layout="constrained")
    grid = figure.subplots(2, 3, sharey=True)
    places = [grid[0, 0], grid[0, 1], grid[1, 1], grid[0, 2], grid[1, 2]]
    grid[1, 0].axis("off")
    print(f"{'case':<34} {'stepper':<11} {'order':>6}   error at coarsest … finest")
    for axes, (title, osc, states, interval) in zip(places, every, strict=True):
        for name in LADDERS:
            steps, errors = curve(osc, name, states, interval)
            slope = order(steps, errors)
            told = f"order {slope:.1f}" if np.isfinite(slope) else "no order"
            axes.loglog(steps, errors, "o-", color=COLOURS[name], markersize=3, label=f"{name}: {told}")
            print(f"{title:<34} {name:<11} {slope:>6.2f}   {errors[0]:.1e} … {errors[-1]:.1e}", flush=True)
        axes.set_title(title, fontsize=10)
        axes.set_xlabel("steps")
        axes.grid(color="0.9", linewidth=0.6)
        axes.legend(fontsize=8)
    for axes in (grid[0, 0], grid[1, 1]):
        axes.set_ylabel("median error in $(x, v)$")
        axes.tick_params(labelleft=True)
    picture = Path(__file__).parents[2] / "docs" / "images" / "convergence.png"
    figure.savefig(picture, dpi=90)
    print(picture, f"{picture.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
