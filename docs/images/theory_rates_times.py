"""Draws theory_rates_times.png, a picture of docs/theory/rates.rst: python docs/images/theory_rates_times.py

The exact rates are those of tests/klein_kramers.py. It takes about a minute.
"""

import math
import runpy
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

ROOT = Path(__file__).parents[2]
ZETA, ENERGY = 0.2, 0.2  # x⁴/4 − x²/2 has a barrier of 1/4, so that ΔU = 4ζ/4
DAMPING, STEP, WALKERS = 2 * ZETA, 0.02, 2000


def exit_times(ratio):
    """Times from the left well to the core of the right one, sorted, until a twentieth is left."""
    random = np.random.default_rng(1)
    temperature = ENERGY / ratio / (2 * DAMPING)
    kept, spread = math.exp(-DAMPING * STEP), math.sqrt(temperature * -math.expm1(-2 * DAMPING * STEP))
    x, v = -1 + math.sqrt(temperature / 2) * random.standard_normal(WALKERS) / 2, np.zeros(WALKERS)
    times, time = [], 0.0
    while len(x) > WALKERS / 20:
        v += 0.5 * STEP * (x - x**3)
        x += 0.5 * STEP * v
        v = kept * v + spread * random.standard_normal(len(v))
        x += 0.5 * STEP * v
        v += 0.5 * STEP * (x - x**3)
        time += STEP
        there = 2 * (x - 1) ** 2 + v**2 < temperature  # within one standard deviation
        times += [time] * int(there.sum())
        x, v = x[~there], v[~there]
    return np.array(times)


def kramers(ratio):
    """ln of Kramers' rate."""
    return math.log((math.sqrt(ZETA**2 + 1) - ZETA) * math.sqrt(2) / (2 * math.pi)) - ratio


def draw(exact):
    """Return a figure of exit times at two intensities, and of the exact rate over Kramers' rate."""
    figure = Figure(figsize=(10.5, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    for ratio, colour in ((1, "C1"), (6, "C0")):
        times = exit_times(ratio)
        remain = 1 - np.arange(1, len(times) + 1) / WALKERS
        mean = (times.sum() + (WALKERS - len(times)) * times[-1]) / len(times)
        left.plot(times / mean, remain, color=colour, label=f"ΔU/D = {ratio}, mean {mean:.0f} s")
    law = np.linspace(0, 3, 2)
    left.plot(law, np.exp(-law), "k--", linewidth=1, label="exp(−t/τ)")
    left.set(yscale="log", ylim=(0.05, 1.1), xlim=(0, 3), xlabel="time over mean time", ylabel="share not left, G")
    left.legend(frameon=False)
    ratios = np.array([3, 4, 5, 6, 8, 10, 12, 16, 20, 25])
    right.plot(1 / ratios, [math.exp(exact(ZETA, ENERGY / one) - kramers(one)) for one in ratios], "o")
    right.axhline(1, color="k", linestyle="--", linewidth=1)
    right.set(xlim=(0, None), ylim=(0.8, 1.02), xlabel="D/ΔU", ylabel="exact rate over Kramers' rate")
    return figure


def main():
    """Simulate exits from a double well, and save the picture."""
    exact = runpy.run_path(str(ROOT / "tests/klein_kramers.py"))["double_well_rate"]
    draw(exact).savefig(Path(__file__).with_suffix(".png"), dpi=80)


if __name__ == "__main__":
    main()
