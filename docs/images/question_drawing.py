"""Draws question_drawing.png, the picture of docs/questions/drawing-to-scene.rst.

python docs/images/question_drawing.py
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

STEEL, STOP, RED = "0.75", "0.45", "tab:red"


def arrow(ax, start, end, text, place, color="black", style="<->"):
    """Draw an arrow between two points, and its text."""
    ax.annotate("", end, start, arrowprops={"arrowstyle": style, "color": color, "shrinkA": 0, "shrinkB": 0})
    ax.text(*place, text, color=color, ha="center", va="center")


def machine(ax):
    """Draw a tube between two supports, with a baffle around its middle."""
    x = np.linspace(0, 10, 200)
    bent = 0.55 * np.sin(np.pi * x / 10)
    ax.fill_between(x, -0.35, 0.35, color="0.93", linewidth=0)
    ax.fill_between(x, bent - 0.35, bent + 0.35, color=STEEL, linewidth=0)
    for place in (0.0, 10.0):
        ax.add_patch(Polygon([(place, -0.35), (place - 0.4, -1.1), (place + 0.4, -1.1)], color=STOP))
    for bottom in (1.25, -2.75):
        ax.add_patch(Rectangle((4.6, bottom), 0.8, 1.5, color=STOP))
    ax.plot([5, 5], [-0.35, 0.35], ":", color="0.3")
    ax.text(5.7, 2.1, "stop", va="center")
    ax.text(5.7, -2.1, "stop", va="center")
    arrow(ax, (4.2, -0.35), (4.2, -1.25), "clearance", (3.0, -0.85))
    arrow(ax, (2.5, 1.9), (2.5, 0.85), "$F\\,\\cos\\,\\omega t$", (2.5, 2.2), RED, "->")
    arrow(ax, (0, -3.3), (10, -3.3), "$L$", (5, -3.65))
    ax.text(7.9, 1.0, "$\\mu$, $EI$, $\\varphi(s)$", ha="left")
    ax.set_title("drawing", fontsize=11)
    ax.set(xlim=(-0.8, 10.8), ylim=(-4.0, 2.8))


def zigzag(start, end, teeth=6, size=0.22):
    """Return the points of a spring between two places at one height."""
    inner = np.linspace(start[0] + 0.3, end[0] - 0.3, 2 * teeth)
    heights = start[1] + size * np.where(np.arange(2 * teeth) % 2, 1.0, -1.0)
    return [start[0], start[0] + 0.3, *inner, end[0] - 0.3, end[0]], [start[1], start[1], *heights, end[1], end[1]]


def model(ax):
    """Draw the mass on a spring and a damper between two stops."""
    ax.add_patch(Rectangle((3.9, -0.7), 2.2, 1.4, facecolor=STEEL, edgecolor="black"))
    ax.text(5, 0.05, "mass", ha="center", va="center")
    ax.add_patch(Rectangle((-0.3, -0.6), 0.3, 2.4, color=STOP))
    ax.plot(*zigzag((0, 0.4), (3.9, 0.4)), color="black")
    ax.text(2.0, 0.95, "stiffness", ha="center")
    ax.plot([0, 1.7, 1.7], [-0.35, -0.35, -0.35], color="black")
    ax.plot([2.3, 1.6, 1.6, 2.3], [-0.12, -0.12, -0.58, -0.58], color="black")
    ax.plot([2.0, 2.0], [-0.5, -0.2], color="black")
    ax.plot([2.0, 3.9], [-0.35, -0.35], color="black")
    ax.text(2.0, -0.95, "damping_ratio", ha="center")
    for side, place in ((-1, 2.7), (1, 7.3)):
        ax.add_patch(Rectangle((place - 0.15, -2.45), 0.3, 0.9, color=STOP))
        edge = 5 + side * 1.1
        ax.plot([edge, edge], [-0.7, -2.35], ":", color="0.4")
        arrow(ax, (edge, -2.0), (place - side * 0.15, -2.0), "", (0, 0))
    ax.text(2.2, -2.95, "left: position −c", ha="center")
    ax.text(7.8, -2.95, "right: position +c", ha="center")
    ax.text(8.6, -2.0, "law", va="center", ha="center")
    arrow(ax, (6.1, 0.2), (7.6, 0.2), "amplitude, frequency", (8.3, 0.6), RED, "->")
    arrow(ax, (6.1, -0.4), (7.6, -0.4), "noise intensity", (8.3, -0.75), "tab:blue", "->")
    arrow(ax, (5, 1.3), (6.2, 1.3), "x", (6.4, 1.3), style="->")
    ax.plot([5, 5], [1.15, 1.45], color="black")
    ax.set_title("scene", fontsize=11)
    ax.set(xlim=(-0.6, 10.6), ylim=(-4.0, 2.8))


def main():
    """Save the picture."""
    figure = Figure(figsize=(10.0, 3.6), layout="constrained")
    for ax, draw in zip(figure.subplots(1, 2), (machine, model), strict=True):
        draw(ax)
        ax.set_axis_off()
    figure.savefig(Path(__file__).with_suffix(".png"), dpi=80)


if __name__ == "__main__":
    main()
