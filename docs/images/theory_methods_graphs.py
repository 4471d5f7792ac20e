"""Draws theory_methods_graphs.png, a picture of docs/theory/methods.rst: python docs/images/theory_methods_graphs.py"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

FACTOR = 0.2  # 4ζω_n
PLACES = {"L": -2.0, "M": 0.0, "R": 2.0}
GRAPHS = {"L": ("RM", "ML"), "M": ("LM", "RM"), "R": ("LM", "MR")}


def potential(x):
    """Energy per unit mass."""
    return x**6 / 24 - 5 * x**4 / 16 + x**2 / 2


def energy(arrow):
    """ΔU over the barrier beside the first state."""
    return FACTOR * (potential(1.0) - potential(PLACES[arrow[0]]))


def draw():
    """Return a figure of the potential and of the cheapest trees of its wells."""
    figure = Figure(figsize=(7.6, 5.0), layout="constrained")
    top, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    x = np.linspace(-2.45, 2.45, 300)
    top.plot(x, potential(x), color="0.2")
    for name, place in PLACES.items():
        top.plot(place, potential(place), "o", color="C0", markersize=9)
        top.annotate(name, (place, potential(place)), (0, 10), textcoords="offset points", ha="center")
    top.set(ylabel="U", ylim=(-0.45, 0.6))
    for row, (root, arrows) in enumerate(GRAPHS.items()):
        for name, place in PLACES.items():
            below.plot(place, -row, "o", color="C3" if name == root else "C0", markersize=9)
        for arrow in arrows:
            begin, end = (PLACES[name] for name in arrow)
            shift = 0.12 * np.sign(end - begin)
            below.annotate("", (end - shift, -row), (begin + shift, -row), arrowprops={"arrowstyle": "->"})
            below.annotate(f"{energy(arrow):.4f}", ((begin + end) / 2, -row), (0, 3), textcoords="offset points",
                           ha="center", fontsize=9)  # fmt: skip
        below.annotate(f"$S_\\mathrm{{{root}}}$ = {sum(map(energy, arrows)):.4f}", (2.6, -row), va="center")
    below.set(ylim=(-2.5, 0.7), xlim=(-2.6, 3.9), xlabel="x", yticks=[])
    return figure


if __name__ == "__main__":
    draw().savefig(Path(__file__).with_suffix(".png"), dpi=80)
