"""Draws least_action.png, the picture of docs/how-to/least-action.rst: python docs/images/least_action.py"""

from pathlib import Path

from matplotlib.figure import Figure

import vibrokit as vk

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, rng=0)
shots = vk.ActionPlot().run(osc, structure)
result = vk.LeastAction().run(osc, structure)


def draw(shots, result):
    """Return a figure of the action plot, the exit paths, their histories and a quasi-potential."""
    figure = Figure(figsize=(12.6, 10.4), layout="constrained")
    (shooting, section), (histories, potential) = figure.subfigures(2, 2, wspace=0.03, hspace=0.03)
    shots.plot(ax=shooting.add_subplot())
    axes = section.add_subplot()
    result.plot(ax=axes)
    axes.set(xlim=(-0.3, 0.65), ylim=(-0.45, 0.45))
    result.plot_history(ax=histories.subplots(2, 2))
    result.plot_quasi_potential(0, ax=potential.add_subplot())
    return figure


draw(shots, result).savefig(Path(__file__).with_suffix(".png"), dpi=90)
