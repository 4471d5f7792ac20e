"""Draws theory_methods_domain.png, a picture of docs/theory/methods.rst: python docs/images/theory_methods_domain.py

It takes about a minute.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk

CERTIFIED = 7.9052156e-5  # of clear → hammering


def draw(result):
    """Return a figure of the actions over the fundamental domain, and of the least action at each radius."""
    figure = Figure(figsize=(10.5, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    result.plot_domain("clear", ax=left)
    data = result.data.isel(source=0)
    radius, action = data["radius"].values, data["action"].values
    known = np.isfinite(action)
    edges = np.linspace(0, 1, 41)
    band = np.digitize(radius[known], edges) - 1
    least = [action[known][band == one].min() if (band == one).any() else np.nan for one in range(40)]
    right.stairs(np.array(least) * 1e5, edges, color="C0", label="least action of the starts in a band")
    right.axhline(CERTIFIED * 1e5, color="k", linestyle="--", linewidth=1.2, label="certified")
    right.set(xlim=(0, 1), ylim=(7.6, 9.6), xlabel="radius of the start (log scale, 0 to 1)", ylabel="action, 1e-5")
    right.legend(frameon=False, fontsize=9)
    return figure


def main():
    """Search by shooting, and save the picture."""
    osc = vk.load_scene("hertz-0.570")
    structure = vk.find_structure(osc, cells=(100, 100), manifolds=False, rng=0)
    result = vk.ActionPlot(source="clear").run(osc, structure)
    draw(result).savefig(Path(__file__).with_suffix(".png"), dpi=80)


if __name__ == "__main__":
    main()
