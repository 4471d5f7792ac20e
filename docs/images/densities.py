"""Draws densities.png, the picture of docs/how-to/density.rst: python docs/images/densities.py

It takes several minutes: the rates are computed on 480 × 480 nodes.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk

BOX = ((-0.4, 0.4), (-0.4, 0.4))
REGION = ((-0.75, 0.75), (-0.9, 0.9))
INTERVALS = (1, 3, 10, 30)
INTENSITIES = (5e-5, 3.5e-5, 2.5e-5, 2e-5, 1.5e-5)
FINE = {"nodes": (480, 480), "max_memory_gib": 6.0}


def draw(history, simulated, stationary, paths, rates, limit):
    """Return a figure of transients, the stationary quasi-potential, mean exit times and their slopes."""
    figure = Figure(figsize=(12.6, 9.4), layout="constrained")
    (first, second), (third, fourth) = figure.subplots(2, 2)
    artists = history.plot(ax=first)
    for line, sample in zip(artists.lines, simulated, strict=True):
        shares, edges = np.histogram(sample, 140, density=True)
        first.plot((edges[1:] + edges[:-1]) / 2, shares, ".", markersize=3.5, color=line.get_color())
    (dots,) = first.plot([], [], ".", color="0.3", markersize=3.5, label=f"{len(simulated[0])} trajectories")
    first.legend(handles=[*artists.lines, dots], fontsize=8, frameon=False)
    first.set_xlim(-0.45, 0.75)
    stationary.plot(ax=second, paths=[path.q[path.section] for path in paths])
    second.set(xlim=(-0.45, 0.65), ylim=(-0.55, 0.55))
    rates.plot_rates(ax=third)
    rates.plot_slopes(ax=fourth, limits=[limit])
    return figure


def main():
    """Compute the densities of the scene, and save the picture."""
    osc = vk.load_scene("hertz-0.570")
    structure = vk.find_structure(osc, rng=0)
    history = vk.evolve_density(osc, REGION, INTERVALS, start=BOX, nodes=(400, 400))
    starts = np.random.default_rng(5).uniform(*np.transpose(BOX), (40_000, 2))
    simulated = [osc.section_map(starts, interval, rng=7)[:, 0] for interval in INTERVALS]
    stationary = vk.StationaryDensity.of(vk.SGCM(intensities=(2e-5,), **FINE).run(osc, structure), nodes=(480, 480))
    rates = vk.SGCM(source="clear", intensities=INTENSITIES, **FINE).run(osc, structure)
    actions = vk.LeastAction().run(osc, structure)
    paths = [energy.path for energy in actions.energies]
    figure = draw(history, simulated, stationary, paths, rates, actions.energy("clear", "hammering"))
    figure.savefig(Path(__file__).with_suffix(".png"), dpi=90)


if __name__ == "__main__":
    main()
