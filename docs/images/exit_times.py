"""Draws exit_times.png, the picture of docs/how-to/exit-times.rst: python docs/images/exit_times.py

It takes about half a minute.
"""

from pathlib import Path

from matplotlib.figure import Figure

import vibrokit as vk

INTENSITIES = (5e-5, 3.5e-5, 2.5e-5, 2e-5, 1.5e-5)
PERIODS = 40  # before an exit


def draw(structure, result, period):
    """Return a figure of exit times, mean exit times against 1/D, and escapes on the section."""
    figure = Figure(figsize=(15.5, 4.6), layout="constrained")
    first, second, third = figure.subplots(1, 3)
    result.plot_exit_times(ax=first, source="clear", intensity=2e-5)
    result.plot_rates(ax=second)
    structure.plot(ax=third)
    out = result.escapes("clear", intensity=2e-5)
    per_period = round(period / float(out.time[1] - out.time[0]))
    states = out[:, ::-1][:, : PERIODS * per_period : per_period].values
    third.plot(*states.reshape(-1, 2).T, ".", color="black", markersize=1, zorder=3)
    third.plot(*states[0].T, ".-", color="crimson", markersize=5, linewidth=1, zorder=4)
    third.set(xlim=(-0.35, 0.65), ylim=(-0.5, 0.3))
    return figure


def main():
    """Simulate exits from the clear-running state, and save the picture."""
    osc = vk.load_scene("hertz-0.570")
    structure = vk.find_structure(osc, manifolds=False, rng=0)
    analyzer = vk.MFET(source="clear", intensities=INTENSITIES, target_error=0.03, splitting=False, escapes=300)
    result = analyzer.run(osc, structure)
    draw(structure, result, osc.period).savefig(Path(__file__).with_suffix(".png"), dpi=80)


if __name__ == "__main__":
    main()
