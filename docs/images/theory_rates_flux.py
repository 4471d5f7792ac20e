"""Draws theory_rates_flux.png, a picture of docs/theory/rates.rst: python docs/images/theory_rates_flux.py"""

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.special import ndtr

ZETA, INTENSITY = 0.2, 0.025
DAMPING = 2 * ZETA
GROWTH = math.sqrt(ZETA**2 + 1) - ZETA  # λ_u; the barrier of x⁴/4 − x²/2 has the curvature −1


def draw():
    """Return a figure of η around the saddle, with levels of energy and the directions of the saddle."""
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    ax = figure.subplots()
    x, v = np.meshgrid(np.linspace(-1.5, 1.5, 301), np.linspace(-0.9, 0.9, 241))
    temperature = INTENSITY / (2 * DAMPING)
    share = ndtr((v - (GROWTH + DAMPING) * x) * math.sqrt(GROWTH / (DAMPING * temperature)))
    picture = ax.contourf(x, v, share, np.linspace(0, 1, 11), cmap="RdYlBu", alpha=0.8)
    ax.contour(x, v, v**2 / 2 - x**2 / 2 + x**4 / 4, np.arange(-0.2, 0.3, 0.05), colors="0.35", linewidths=0.7,
               linestyles="solid")  # fmt: skip
    for slope, name in ((GROWTH, r"$\lambda_u$"), (-GROWTH - DAMPING, r"$\lambda_s$")):
        end = 0.55 / math.hypot(1, slope)
        for side in (1, -1):
            begin, stop = (0, 1) if slope > 0 else (1, 0)
            ax.annotate("", xy=(side * stop * end, side * stop * end * slope),
                        xytext=(side * begin * end, side * begin * end * slope),
                        arrowprops={"arrowstyle": "->", "linewidth": 1.5})  # fmt: skip
        ax.annotate(name, (1.15 * end, 1.15 * end * slope))
    edge = np.linspace(-0.5, 0.5, 2)
    ax.plot(edge, (GROWTH + DAMPING) * edge, "k--", linewidth=1.2, label="η = 1/2")
    ax.plot([-1, 1], [0, 0], "o", color="k")
    ax.plot(0, 0, "x", color="k")
    ax.set(xlim=(-1.5, 1.5), ylim=(-0.9, 0.9), xlabel="x", ylabel="v")
    ax.legend(loc="upper left", frameon=False)
    figure.colorbar(picture, ax=ax, label="η, share of the density that comes from the left")
    return figure


if __name__ == "__main__":
    draw().savefig(Path(__file__).with_suffix(".png"), dpi=80)
