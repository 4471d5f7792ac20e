"""Draws question_how_long.png, the picture of docs/questions/how-much-noise.rst.

python docs/images/question_how_long.py

It takes some minutes. With the name of a file, the assessment is kept there, and a second call goes on from it.
"""

import math
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk
from vibrokit.errors import StructureError

SCENE = Path(__file__).parents[1] / "questions" / "lever.toml"
GRAVITY = 9.80665  # m/s²
YEAR = 365.25 * 86400.0
TIMES = {"1 min": 60.0, "8 h": 8 * 3600.0, "1 month": YEAR / 12, "1 yr": YEAR, "20 yr": 20 * YEAR}


def draw(assessment):
    """Return a figure of the mean time in the clear state, with its interval, against the level of the vibration."""
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    ax = figure.subplots()
    levels, rows = [], []
    for intensity in np.geomspace(4.7e-5, 3e-4, 80):
        try:
            time = assessment.mean_time("clear", intensity=float(intensity))
        except StructureError:
            continue
        levels.append(2 * intensity / GRAVITY**2)
        rows.append((time.log_value, time.log_lower, time.log_upper))
    middle, lower, upper = np.exp(np.array(rows).T)
    ax.fill_between(levels, lower, upper, color="tab:blue", alpha=0.25, linewidth=0, label="95 % interval")
    ax.plot(levels, middle, color="tab:blue", label="mean time")
    own = assessment.mean_time("clear")
    ax.plot([2 * own.intensity / GRAVITY**2], [own.value], "o", color="black", label="the scene's level")
    for name, time in TIMES.items():
        ax.axhline(time, color="0.7", linewidth=0.8, zorder=0)
        ax.annotate(name, (levels[-1], time), ha="right", va="bottom", color="0.3")
    ax.set(
        xscale="log", yscale="log", xlim=(levels[0], levels[-1]), ylim=(1.0, 1e11),
        xlabel="one-sided spectral density $G$ ($g_n^2$/Hz)", ylabel="mean time in the clear state τ (s)",
    )  # fmt: skip
    ticks = [1e-6, 1.5e-6, 2e-6, 3e-6, 4e-6, 6e-6]
    ax.set_xticks(ticks, [f"{1e6 * tick:g}·10⁻⁶" for tick in ticks])
    ax.minorticks_off()
    ax.legend(frameon=False, loc="lower left")
    return figure


def main():
    """Assess the gear lever, and save the picture."""
    kept = sys.argv[1] if len(sys.argv) > 1 else None
    assessment = vk.assess(vk.load_scene(SCENE), source="clear", time_limit=None, checkpoint=kept)
    assert math.isfinite(assessment.mean_time("clear").value)
    draw(assessment).savefig(Path(__file__).with_suffix(".png"), dpi=80)


if __name__ == "__main__":
    main()
