"""Error against steps of every stepper, for Hertz and linear stops and without: the orders that are stated, measured.

Run by hand: ``python tests/benchmarks/convergence.py``. Prints the order fitted for each law and start, and saves
``docs/images/convergence.png``. Errors are medians over the starts, against the finest setting of another stepper
(FreeFlight for RK4 and Order8, Order8 for FreeFlight). Steps of the adaptive steppers are counted by finding the
smallest limit of steps that they get by with. In a flight FreeFlight takes the same few exact steps at any tolerance,
so over a period its error has no order in steps, but falls with the tolerance; the order of its contacts shows where a
constant load holds the mass in the stop, from the first touch on.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk
from vibrokit.kernels.ensemble import Stop, advance_block, run_ensemble
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


def scene(law, damping=0.01, load=0.2):
    stops = () if law is None else (vk.Barrier(law, PLACE, "right"), vk.Barrier(law, -PLACE, "left"))
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping, barriers=stops,
        excitations=(vk.Harmonic(amplitude=0.18, frequency=0.57), vk.Constant(load)),
    )  # fmt: skip


def cases():
    """Name, scene and starts."""
    rng = np.random.default_rng(1)
    between = np.column_stack([rng.uniform(-0.5, 0.5, COUNT), rng.uniform(-0.5, 0.5, COUNT)])
    at_touch = np.column_stack([np.full(COUNT, PLACE), rng.uniform(0.4, 0.6, COUNT)])
    for name, law in LAWS.items():
        yield f"{name}: one period", scene(law), between
        if law is not None:
            yield f"{name}: held in the stop, from touch", scene(law, damping=0.15, load=30.0), at_touch


def ends(osc, stepper, states):
    return run_ensemble(osc, Flow.STATE, stepper, states).states


def steps_taken(osc, stepper, states):
    """Mean number of steps of a trajectory."""
    if isinstance(stepper, vk.RK4):
        return stepper.steps
    interval = osc.section_interval
    kernel, theta = kernel_for(osc, Flow.STATE, stepper), theta_of(osc)
    settings = np.array(stepper.settings(osc, interval))
    none, one = np.empty((1, 0), dtype=np.uint64), np.ones(1, dtype=np.int64)

    def stalls(state, limit):
        settings[1] = limit
        ended = advance_block(kernel, state[None], one, (theta, 0.0, interval, settings), none, 0 * one, Stop(), 0, 1)
        return ended.status[0] == STALLED

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


def slope(costs, errors):
    """Exponent with which the error falls, where it is small enough to show one and well above rounding."""
    kept = (errors < 1e-3) & (errors > 3e-14)
    if kept.sum() < 3 or np.ptp(np.log(costs[kept])) < 0.3:
        return float("nan")
    return -np.polyfit(np.log(costs[kept]), np.log(errors[kept]), 1)[0]


def told(name, title, steps, errors):
    """What the picture and the table say about a curve."""
    if name == "FreeFlight" and "period" in title:
        power = slope(np.array([1 / stepper.tolerance for stepper in LADDERS[name]]), errors)
        return f"error ∝ tolerance^{power:.1f}" if np.isfinite(power) else "exact"
    return f"order {slope(steps, errors):.1f}"


def curve(osc, name, states):
    judge = vk.Order8(FINEST) if name == "FreeFlight" else vk.FreeFlight(FINEST)
    reference = ends(osc, judge, states)
    rows = []
    for stepper in LADDERS[name]:
        error = np.median(np.linalg.norm(ends(osc, stepper, states) - reference, axis=1))
        rows.append((steps_taken(osc, stepper, states), max(error, FLOOR)))
    return np.array(rows).T


def main():
    figure = Figure(figsize=(11, 6.6), layout="constrained")
    grid = figure.subplots(2, 3, sharey=True)
    places = [grid[0, 0], grid[0, 1], grid[1, 1], grid[0, 2], grid[1, 2]]
    grid[1, 0].axis("off")
    for axes, (title, osc, states) in zip(places, cases(), strict=True):
        for name in LADDERS:
            steps, errors = curve(osc, name, states)
            words = told(name, title, steps, errors)
            axes.loglog(steps, errors, "o-", color=COLOURS[name], markersize=3, label=f"{name}: {words}")
            span = f"{steps[0]:.0f} … {steps[-1]:.0f} steps, error {errors[0]:.1e} … {errors[-1]:.1e}"
            print(f"{title:<38} {name:<11} {words:<22} {span}", flush=True)
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
