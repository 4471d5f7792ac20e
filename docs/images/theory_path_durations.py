"""Draws theory_path_durations.png, a picture of docs/theory/path-weight.rst.

Run it with python docs/images/theory_path_durations.py
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.linalg import expm, solve_continuous_lyapunov

ZETA, TURN = 0.05, 2 * np.pi
SLOPE, DIFFUSION = np.array([[0.0, 1.0], [-1.0, -2 * ZETA]]), np.diag([0.0, 1.0])
STATIONARY = solve_continuous_lyapunov(SLOPE, -DIFFUSION)


def covariance(duration):
    """Return the covariance that noise produces in some time, per unit D."""
    flow = expm(SLOPE * duration)
    return STATIONARY - flow @ STATIONARY @ flow.T


def least_action(duration):
    """Return the least action from rest to x = 1, v = 0 in some time."""
    return 0.5 * np.linalg.inv(covariance(duration))[0, 0]


def least_path(duration, times):
    """Return x and the noise force on the path of least action from rest to x = 1, v = 0 in some time."""
    last = np.linalg.solve(covariance(duration), [1.0, 0.0])
    momenta = np.array([expm(SLOPE.T * (duration - t)) @ last for t in times])
    states = np.array([covariance(t) @ p for t, p in zip(times, momenta, strict=True)])
    return states[:, 0], momenta[:, 1]


if __name__ == "__main__":
    figure = Figure(figsize=(10.0, 3.6), layout="constrained")
    cost, motion, force = figure.subplots(1, 3)
    durations = np.geomspace(0.2, 12.0, 300)
    cost.plot(durations, [least_action(turns * TURN) for turns in durations], color="black")
    cost.axhline(2 * ZETA, color="0.5", linestyle="--", label=r"$2\zeta\omega_n^3\ell^2$")
    cost.set(xscale="log", yscale="log", xlabel=r"duration $t_1$ (turns)", ylabel=r"least action $S(t_1)$")
    cost.set(xticks=[0.25, 1, 3, 10], xticklabels=["1/4", "1", "3", "10"], yticks=[0.1, 0.2, 0.5, 1, 2])
    cost.set_yticklabels(["0.1", "0.2", "0.5", "1", "2"])
    cost.legend()
    for turns, colour in ((1, "C3"), (3, "C1"), (10, "C0")):
        times = np.linspace(1e-9, turns * TURN, 150 * turns)
        path, noise = least_path(times[-1], times)
        cost.plot(turns, least_action(times[-1]), "o", color=colour)
        for axes, values in ((motion, path), (force, noise)):
            axes.plot(
                times / TURN - turns, values, color=colour, linewidth=1.2, label=f"{turns} turn{'s' * (turns > 1)}"
            )
    motion.set(xlabel=r"turns before the end", ylabel=r"displacement $x/\ell$")
    force.set(xlabel=r"turns before the end", ylabel=r"noise force $p_2/(\omega_n^2\ell)$")
    for axes in (motion, force):
        axes.set_xlim(-6.0, 0.1)
    motion.legend(loc="lower left")
    figure.savefig(Path(__file__).with_suffix(".png"), dpi=80)
