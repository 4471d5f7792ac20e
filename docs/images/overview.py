"""Draws overview.png, the picture of the README: python docs/images/overview.py"""

from pathlib import Path

from matplotlib.figure import Figure

import vibrokit as vk
from vibrokit.plots.portraits import phase_portrait

NEAR_THE_CLEAR_STATE = ((0.36, 0.56), (-0.15, 0.15))

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, cells=(400, 400), rng=0)
close_up = vk.find_structure(osc, region=NEAR_THE_CLEAR_STATE, cells=(300, 300), rng=0)
(energy,) = vk.ActionPlot(source=0).run(osc, structure).energies

figure = Figure(figsize=(10.8, 3.6), layout="constrained")
portraits, basins, way_out = figure.subplots(1, 3)

for attractor, name in zip(structure.attractors, ("runs clear", "hammers"), strict=True):
    orbit = osc.trajectory(attractor.points[0], periods=attractor.period, samples=2048)
    drawn = phase_portrait(orbit.x, orbit.v, stops=orbit.stops, label=attractor.label, ax=portraits)
    drawn.line.set_label(name)
portraits.legend(loc="lower left", fontsize=8)
portraits.set_title("two steady states (stops dashed)", fontsize=10)

structure.plot(ax=basins)
basins.set_title("their basins at t = 0 mod T", fontsize=10)
basins.set_xticks([-0.5, 0.0, 0.5])

close_up.plot(ax=way_out)
section = energy.path.q[energy.path.section]
way_out.plot(section[:, 0], section[:, 1], ".-", color="black", markersize=4, linewidth=0.4)
way_out.set(xlim=NEAR_THE_CLEAR_STATE[0], ylim=NEAR_THE_CLEAR_STATE[1])
way_out.set_title("most probable way out, once a period", fontsize=10)

figure.savefig(Path(__file__).with_suffix(".png"), dpi=110)
