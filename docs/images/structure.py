"""Draws docs/images/structure.png: attractors, saddles, manifolds and basins of the two scenes of the paper."""

from pathlib import Path

from matplotlib.figure import Figure

import vibrokit as vk

figure = Figure(figsize=(11.0, 4.9), layout="constrained")
for axes, name in zip(figure.subplots(1, 2), ("hertz-0.525", "hertz-0.570"), strict=True):
    structure = vk.find_structure(vk.load_scene(name), region=((-0.6, 0.6), (-0.6, 0.6)), cells=(200, 200))
    structure.plot(ax=axes)
    axes.set_title(rf"$\omega = {name.removeprefix('hertz-')}$")
    legend = axes.get_legend()
    if legend is not None:
        legend.remove()
figure.savefig(Path(__file__).with_suffix(".png"), dpi=110)
