"""Draws theory_potential_levels.png, a picture of docs/theory/quasi-potential.rst.

Run it with python docs/images/theory_potential_levels.py
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk

figure = Figure(figsize=(10.6, 4.2), layout="constrained")
exact, forced = figure.subplots(1, 2)

well = vk.load_scene("double-well")
structure = vk.find_structure(well, cells=(60, 60), manifolds=False, rng=0)
search = vk.LeastAction(source="left-rest", graph=None, shooting=vk.Shooting(points=500))
path = search.run(well, structure).energies[0].path
x, v = np.meshgrid(np.linspace(-1.6, 0.0, 300), np.linspace(-0.9, 0.9, 300))
potential = 4 * 0.05 * (v**2 / 2 - x**2 / 2 + x**4 / 4 + 1 / 4)  # Ψ in the well, below the barrier
shades = exact.contourf(x, v, potential, levels=np.linspace(0, 0.05, 21), cmap="YlGnBu_r")
exact.contour(x, v, potential, levels=np.linspace(0, 0.05, 11)[1:-1], colors="0.25", linewidths=0.4)
exact.contour(x, v, potential, levels=[0.05], colors="black", linewidths=1.2)
exact.plot(path.q[:, 0], path.q[:, 1], color="#c4007a", linewidth=0.9, label="exit path")
exact.plot(-1, 0, "o", color="C0", markeredgecolor="white", label="attractor")
exact.plot(0, 0, "X", color="black", markeredgecolor="white", markersize=8, label="saddle")
exact.set(xlim=(-1.6, 0.2), xlabel="position $x$ (m)", ylabel=r"velocity $v$ (m s$^{-1}$)")
exact.legend(loc="lower right", fontsize=8)
exact.set_title(r"double well: $\Psi = 4\zeta\omega_n E$", fontsize=10)
figure.colorbar(shades, ax=exact, label=r"$\Psi$ (m$^2$ s$^{-3}$)")

osc = vk.load_scene("hertz-0.570")
states = vk.find_structure(osc, cells=(100, 100), manifolds=False, rng=0)
graph = vk.ActionGraph(source="clear", nodes=(120, 120), steps_per_period=16).run(osc, states)
graph.plot(ax=forced)
(energy,) = vk.LeastAction(source="clear", graph=None).run(osc, states).energies
points = energy.path.q[energy.path.section]
forced.plot(points[:, 0], points[:, 1], ".-", color="#c4007a", markersize=4, linewidth=0.5)
forced.set_xlabel("position $x$ (m)")
figure.savefig(Path(__file__).with_suffix(".png"), dpi=80)
