"""Draws theory_density_intensities.png, a picture of docs/theory/densities.rst.

python docs/images/theory_density_intensities.py; it takes about a minute.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk

ZETA, LEVELS = 0.2, (0.05, 0.025, 0.0125)


def draw(result):
    """Return a figure of −D ln ρ of the left well at v = 0, and of its barrier against D."""
    figure = Figure(figsize=(10.5, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    data = result.data.isel(source=0)
    x, v = data["density_x"].values, data["density_v"].values
    for place, level in enumerate(LEVELS):
        height = -level * data["log_density"].values[place][:, np.argmin(np.abs(v))]
        left.plot(x, height - np.nanmin(height), label=f"−D ln ρ, D = {level:g}")
    places = np.linspace(-2, 0, 200)
    exact = 4 * ZETA * (places**4 / 4 - places**2 / 2 + 0.25)
    left.plot(places, exact, "k--", linewidth=1.2, label=r"$\Psi = 4\zeta\omega_n E$")
    left.set(
        xlim=(-1.7, 0.6),
        ylim=(-0.01, 0.32),
        xlabel="position $x$ (m), at $v$ = 0",
        ylabel="−D ln ρ, Ψ (m² s⁻³)",
    )
    left.legend(frameon=False, fontsize=9)
    right.plot(LEVELS, result.barrier("left-rest").values, "o", label="−D ln ρ, saddle less attractor")
    line = np.linspace(0, 0.055, 2)
    right.plot(line, 0.2 + line * math.log(2), "k--", linewidth=1.2, label="ΔU + D ln 2")
    right.axhline(0.2, color="0.6", linewidth=1)
    right.set(
        xlim=(0, 0.055),
        ylim=(0.19, 0.245),
        xlabel="noise intensity $D$ (m² s⁻³)",
        ylabel="barrier of the density (m² s⁻³)",
    )
    right.legend(frameon=False, fontsize=9)
    return figure


def main():
    """Compute the densities of one well, and save the picture."""
    well = vk.load_scene("double-well").replace({"damping_ratio": ZETA})
    structure = vk.find_structure(well, cells=(60, 60), rng=0)
    result = vk.SGCM(source="left-rest", intensities=LEVELS, nodes=(120, 120)).run(well, structure)
    draw(result).savefig(Path(__file__).with_suffix(".png"), dpi=80)


if __name__ == "__main__":
    main()
