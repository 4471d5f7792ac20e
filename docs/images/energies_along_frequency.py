"""Draws energies_along_frequency.png, the picture of docs/how-to/least-action.rst.

python docs/images/energies_along_frequency.py

The exit paths of the paper's scene from 0.52 to 0.60, beside the published values. It takes about ten minutes.
"""

from pathlib import Path

import numpy as np

import vibrokit as vk

SEARCHED = {"clear": (0.525, 0.57, 0.595), "hammering": (0.55, 0.57, 0.585, 0.6)}
TARGETS = {"clear": None, "hammering": "clear"}  # near 0.55 other impacting states cost far less to reach
PUBLISHED = {  # action plot, density, exit times
    "clear": {0.525: (9.7e-5, 9.11e-5, 1.07e-4), 0.57: (8.2e-5, 7.3e-5, 8.2e-5)},
    "hammering": {0.525: (1.02e-4, 9.65e-5, 1.14e-4), 0.57: (1.07e-3, 1.09e-3, 1.147e-3)},
}
MARKS = {"action plot": "s", "density": "D", "exit times": "^"}


def main():
    osc, values = vk.load_scene("hertz-0.570"), np.round(np.arange(0.52, 0.6001, 0.005), 3)
    ax = None
    for source, searched in SEARCHED.items():
        analyzer = vk.LeastAction(source=source, graph=None if source == "clear" else vk.GraphSearch())
        found = vk.energy_continuation(
            osc, "excitations.0.frequency", values, analyzer=analyzer, search=searched, progress=True
        )
        target = TARGETS[source]
        least = found.energy(source, target)
        if ax is None:
            ax = found.plot().ax
            ax.clear()
        colour = f"C{len(ax.lines) // 5}"
        for number, branch in enumerate(found.branches):
            if branch.source == source and target in (None, branch.target):
                name = f"{source}: all paths" if not number else None
                ax.plot(values, branch.action, "-", color=colour, linewidth=0.6, alpha=0.6, label=name)
        ax.plot(values, least, "o-", color=colour, markersize=3, label=f"{source}: least action")
        for place, (method, mark) in enumerate(MARKS.items()):
            published = PUBLISHED[source]
            ax.plot(
                list(published), [each[place] for each in published.values()], mark, color=colour,
                markerfacecolor="white", label=f"{source}, published: {method}",
            )  # fmt: skip
        ax.set_xlabel(found.axis_label)
    ax.set_yscale("log")
    ax.set_ylabel(r"action $S$ (m$^2$ s$^{-3}$)")
    ax.legend(fontsize=7, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    ax.figure.savefig(Path(__file__).with_suffix(".png"), dpi=150)


if __name__ == "__main__":
    main()
