"""Draws energies_along_frequency.png, the picture of docs/how-to/least-action.rst.

python docs/images/energies_along_frequency.py

The exit paths of the paper's scene from 0.52 to 0.60, beside the published values. Those of the clear-running state are
followed; below 0.55 the impacting states change their period often, so that theirs are searched for at each frequency.
It takes about twenty minutes.
"""

from pathlib import Path

import numpy as np

import vibrokit as vk
from vibrokit.results.energy import Bound

FREQUENCIES = np.round(np.arange(0.52, 0.6001, 0.005), 3)
SEARCHED = (0.525, 0.57, 0.595)
PUBLISHED = {  # action plot, density, exit times
    "clear": {0.525: (9.7e-5, 9.11e-5, 1.07e-4), 0.57: (8.2e-5, 7.3e-5, 8.2e-5)},
    "impacting": {0.525: (1.02e-4, 9.65e-5, 1.14e-4), 0.57: (1.07e-3, 1.09e-3, 1.147e-3)},
}
MARKS = {"action plot": "s", "density": "D", "exit times": "^"}
COLOURS = {"clear": "C0", "impacting": "C1"}


def draw_clear(osc):
    """Follow the paths that leave the clear-running state; return the axes."""
    analyzer = vk.LeastAction(source="clear", graph=None)
    found = vk.energy_continuation(
        osc, "excitations.0.frequency", FREQUENCIES, analyzer=analyzer, search=SEARCHED, progress=True
    )
    ax = found.plot().ax
    ax.clear()
    ax.set_xlabel(found.axis_label)
    branches = [branch for branch in found.branches if branch.source == "clear"]
    for number, branch in enumerate(branches):
        name = None if number else "clear: all paths"
        ax.plot(FREQUENCIES, branch.action, "-", color=COLOURS["clear"], linewidth=0.6, alpha=0.6, label=name)
    least = found.energy("clear")
    ax.plot(FREQUENCIES, least, "o-", color=COLOURS["clear"], markersize=3, label="clear: least action")
    return ax


def draw_impacting(osc, ax):
    """Search for the paths from every impacting state to the clear-running one, at each frequency."""
    at, energies = [], []
    for frequency in FREQUENCIES:
        changed = osc.replace({"excitations.0.frequency": frequency})
        structure = vk.find_structure(changed, rng=0, progress=True)
        for state in structure.attractors:
            if state.name == "clear":
                continue
            analyzer = vk.LeastAction(source=state.label, exit=vk.LeaveBasin(to="clear"))
            found = analyzer.run(changed, structure, time_limit=150, progress=True).energies
            at += [frequency] * len(found)
            energies += found
    colour, values = COLOURS["impacting"], np.array([energy.value for energy in energies])
    frequencies = np.array(at)
    least = [min(values[frequencies == frequency], default=np.nan) for frequency in FREQUENCIES]
    ax.plot(FREQUENCIES, least, "-", color=colour, label="impacting: least action of any state")
    certified = np.array([energy.bound is Bound.CERTIFIED for energy in energies])
    ax.plot(frequencies[certified], values[certified], "o", color=colour, markersize=3, label="impacting: each state")
    ax.plot(
        frequencies[~certified], values[~certified], "v", color=colour, markerfacecolor="white", markersize=4,
        label="impacting: upper bound",
    )  # fmt: skip


def main():
    osc = vk.load_scene("hertz-0.570")
    ax = draw_clear(osc)
    draw_impacting(osc, ax)
    for source, published in PUBLISHED.items():
        for place, (method, mark) in enumerate(MARKS.items()):
            ax.plot(
                list(published), [each[place] for each in published.values()], mark, color=COLOURS[source],
                markerfacecolor="white", label=f"{source}, published: {method}",
            )  # fmt: skip
    ax.set_yscale("log")
    ax.set_ylabel(r"action $S$ (m$^2$ s$^{-3}$)")
    ax.legend(fontsize=7, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    ax.figure.savefig(Path(__file__).with_suffix(".png"), dpi=150)


if __name__ == "__main__":
    main()
