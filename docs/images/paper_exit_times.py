"""Draws paper_exit_times.png, the picture of docs/how-to/exit-times.rst with the paper's two scenes.

python docs/images/paper_exit_times.py

It takes about ten minutes: 400 exits at each intensity, or splitting.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk
from vibrokit.plots.escapes import escapes

WANTED = 0.05  # relative error of 400 exits
REALIZATIONS, SHOWN = 8, 8  # and periods of each before the exit
# Exits of each state: scene, source, exit, intensities and the slope that the paper has from its simulations
RUNS = {
    "0.525, clear": ("hertz-0.525", "clear", vk.LeaveBasin(), (3e-5, 2.3e-5, 2e-5, 1.7e-5), 1.07e-4),
    "0.525, impacting": (
        "hertz-0.525", "hammering", vk.LeaveBasin(to="clear"), (3e-5, 2.6e-5, 2.3e-5, 2e-5), 1.14e-4,
    ),
    "0.570, clear": ("hertz-0.570", "clear", vk.LeaveBasin(), (5e-5, 3e-5, 2e-5, 1.5e-5), 8.2e-5),
    "0.570, impacting": ("hertz-0.570", "hammering", vk.LeaveBasin(), (3e-4, 2.4e-4, 2e-4), 1.147e-3),
}  # fmt: skip


def totals(result, period):
    """Intensities, ln of the mean time to any exit in periods, and errors, from the rates to each target."""
    rows = []
    for intensity in result.intensities:
        rates = [rate for rate in result.rates if rate.intensity == intensity]
        values = np.exp([rate.log_value for rate in rates])
        error = math.hypot(*(values * [rate.log_error for rate in rates])) / values.sum()
        rows.append((intensity, -math.log(values.sum() * period), error))
    return np.array(rows).T


def draw_times(ax, scene, found, period):
    """Draw ln τ against 1/D, with the slope of a straight line through it, beside lines of the published slopes."""
    for number, (name, result) in enumerate(found.items()):
        intensity, log_time, error = totals(result, period)
        (slope, _), spread = np.polyfit(1 / intensity, log_time, 1, w=1 / error, cov="unscaled")
        state, published = name.split(", ")[1], RUNS[name][-1]
        ax.errorbar(
            1 / intensity,
            log_time,
            error,
            fmt="o",
            color=f"C{number}",
            label=f"{state}, simulated: slope {slope:.3g} ± {spread[0, 0] ** 0.5:.1g}",
        )
        middle = np.mean(1 / intensity), np.mean(log_time)
        ends = np.array([1 / intensity[0], 1 / intensity[-1]])
        ax.plot(
            ends, middle[1] + published * (ends - middle[0]), "--", color=f"C{number}",
            label=f"{state}, published: {published:.3g} m² s⁻³",
        )  # fmt: skip
    ax.set(title=scene, xlabel="1/D (s³ m⁻²)", ylabel="ln of the mean time in periods")
    ax.legend(frameon=False, fontsize="small")


def main():
    """Simulate, and save the picture."""
    figure = Figure(figsize=(15.5, 4.8), layout="constrained")
    axes = figure.subplots(1, 3)
    for ax, scene in zip(axes, ("hertz-0.525", "hertz-0.570"), strict=False):
        osc = vk.load_scene(scene)
        structure = vk.find_structure(osc, rng=0)
        found = {}
        for name, (own, source, exit_, intensities, _) in RUNS.items():
            if own == scene:
                analyzer = vk.MFET(
                    source=source, exit=exit_, intensities=intensities, target_error=WANTED, escapes=200
                )  # fmt: skip
                found[name] = analyzer.run(osc, structure)
        draw_times(ax, scene, found, osc.period)
        if scene == "hertz-0.525":
            result = found["0.525, impacting"]
            out = result.escapes("hammering", intensity=2e-5).sel(time=slice(-SHOWN * osc.period, None))[:REALIZATIONS]
            escapes(out.values, points=result.section.points, saddles=result.section.saddles, ax=axes[2])
            axes[2].set(title="hertz-0.525, D = 2e-5 m² s⁻³")
    figure.savefig(Path(__file__).with_suffix(".png"), dpi=80)


if __name__ == "__main__":
    main()
