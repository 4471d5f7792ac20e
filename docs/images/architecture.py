"""Draws architecture.png, the picture of docs/architecture.rst: python docs/images/architecture.py"""

from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

ROOMS = (  # name, what flows out of it
    ("parts", "laws, springs, excitations, noise:\none formula each"),
    ("symbolic", "drift, Hamiltonian and\nall derivatives, as source text"),
    ("kernels", "compiled modules, steppers,\nensembles on keyed streams"),
    ("structure", "steady states, saddles,\nbasins, branches"),
    ("analyzers", "energies, paths, densities,\nexit rates: one Analysis each"),
    ("results", "labelled records, files,\nfindings as codes"),
    ("comparison, assessment", "one answer from all methods,\nwith intervals"),
    ("report, plots, cli", "words, pictures, pages"),
)
ROAD = (  # stage of LeastAction, the object that carries it
    ("1  problem", "ExitProblem"),
    ("2  propose", "Candidate"),
    ("3  solve", "SolvedPath"),
    ("4  bound", "GraphSolution"),
    ("5  compare", "ComparedExit"),
    ("6  answer", "Analysis"),
)
FACE, EDGE, ACCENT = "#eef3f8", "#3b6ea5", "#c4512d"


def box(axes, x, y, width, height, title, text, colour=EDGE):
    """Draw a rounded box with a title above a text."""
    axes.add_patch(
        FancyBboxPatch((x, y), width, height, boxstyle="round,pad=0.02,rounding_size=0.08", fc=FACE, ec=colour)
    )
    axes.text(x + width / 2, y + 0.66 * height, title, ha="center", va="center", weight="bold", size=9)
    axes.text(x + width / 2, y + 0.28 * height, text, ha="center", va="center", size=7.5)


def arrow(axes, start, end, colour=EDGE):
    axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0})


def draw():
    """Return a figure of the rooms, in the order in which data flows, and of the road inside LeastAction."""
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    axes = figure.add_subplot()
    axes.set(xlim=(-0.1, 10.9), ylim=(-0.1, 4.5), aspect="equal")
    axes.axis("off")
    width, height, gap = 2.4, 0.95, 0.4
    for index, (name, text) in enumerate(ROOMS):
        row, column = divmod(index, 4)
        x, y = column * (width + gap), 3.4 - row * 1.35
        box(axes, x, y, width, height, name, text)
        if column < 3:
            arrow(axes, (x + width + 0.05, y + height / 2), (x + width + gap - 0.05, y + height / 2))
    x = 3 * (width + gap) + width / 2
    axes.plot([x, x, width / 2, width / 2], [3.35, 3.2, 3.2, 3.12], color=EDGE, lw=1)
    arrow(axes, (width / 2, 3.14), (width / 2, 3.04))
    step = 1.55
    for index, (name, text) in enumerate(ROAD):
        x = index * (step + 0.295)
        box(axes, x, 0.2, step, 0.8, name, text, ACCENT)
        if index < len(ROAD) - 1:
            arrow(axes, (x + step + 0.04, 0.6), (x + step + 0.255, 0.6), ACCENT)
    axes.text(0, 1.22, "inside LeastAction", color=ACCENT, size=8, style="italic")
    axes.plot([width / 2] * 2, [2.0, 1.4], color=ACCENT, lw=0.8, ls=":")
    return figure


draw().savefig(Path(__file__).with_suffix(".png"), dpi=110)
