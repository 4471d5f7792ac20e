"""Draws question_spectrum.png, the picture of docs/questions/spectrum-to-d.rst.

python docs/images/question_spectrum.py
"""

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk

SCENE = Path(__file__).parents[1] / "questions" / "lever.toml"


def spectrum(path, step):
    """Return frequencies (Hz) and the share of the action of a path per Hz."""
    t = np.arange(path.t[0], path.t[-1], step)
    padded = 16 * len(t)
    frequencies = np.fft.rfftfreq(padded, step)
    parts = np.abs(np.fft.rfft(np.interp(t, path.t, path.p[:, 1]), padded)) ** 2
    return t, frequencies, parts / (parts.sum() * frequencies[1])


def draw(osc, energy):
    """Return a figure of the force of the noise along the exit path, and of its spectrum."""
    path = energy.path
    figure = Figure(figsize=(8.0, 3.8), layout="constrained")
    first, second = figure.subplots(1, 2)
    first.plot(path.t - path.t[-1], path.p[:, 1], color="tab:red", linewidth=1)
    first.set(xlabel="time before the end of the path (s)", ylabel="force of the noise $p_2$ (m/s²)", xlim=(-0.8, 0))
    _, frequencies, share = spectrum(path, osc.section_interval / 256)
    second.plot(frequencies, share, color="tab:blue")
    second.fill_between(frequencies, share, color="tab:blue", alpha=0.2, linewidth=0)
    marks = {"natural frequency": osc.own_frequency, "forcing": osc.parameters["excitations.0.frequency"]}
    for (name, value), style in zip(marks.items(), ("--", ":"), strict=True):
        second.axvline(value / (2 * math.pi), color="black", linestyle=style, linewidth=1, label=name)
    second.set(xlabel="frequency $f$ (Hz)", ylabel="share of the action $w$ (1/Hz)", xlim=(20, 80))
    second.set_ylim(bottom=0)
    second.legend(frameon=False, loc="upper right")
    return figure


def main():
    """Find the exit path of the gear lever, and save the picture."""
    osc = vk.load_scene(SCENE)
    structure = vk.find_structure(osc, cells=(60, 60), manifolds=False, rng=0)
    search = vk.LeastAction(source="clear", graph=None, shooting=vk.Shooting(points=500))
    energy = search.run(osc, structure).energy("clear", "hammering")
    draw(osc, energy).savefig(Path(__file__).with_suffix(".png"), dpi=80)


if __name__ == "__main__":
    main()
