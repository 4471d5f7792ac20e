"""Draws theory_exit_path.png, a picture of docs/theory/exit-paths.rst: python docs/images/theory_exit_path.py"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.starts import fitted_domain
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.symbolic.flow_kind import Flow

ANGLES, RADII, PERIODS = 240, 12, 80

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, cells=(100, 100), manifolds=False, rng=0)
(energy,) = vk.LeastAction(source="clear", graph=None).run(osc, structure).energies
problem = ExitProblem(osc, structure, structure.attractors[0], vk.LeaveBasin())
stepper = problem.ensemble_stepper(Flow.HAMILTONIAN)
ring = np.stack(np.meshgrid(np.linspace(0, 1, ANGLES), np.linspace(0, 1, RADII), indexing="ij"), axis=-1)
starts, _ = fitted_domain(problem, stepper).states(ring.reshape(-1, 2))
images = run_ensemble(osc, Flow.HAMILTONIAN, stepper, starts, PERIODS, visits=PERIODS).visits.reshape(-1, 5)

figure = Figure(figsize=(10.0, 4.2), layout="constrained")
section, history = figure.subplots(1, 2)
cheap = images[(images[:, 4] < 1.5 * energy.value) & (images[:, 4] > 0)]
cheap = cheap[np.argsort(-cheap[:, 4])]
dots = section.scatter(cheap[:, 0], cheap[:, 1], c=cheap[:, 4], s=1.5, linewidths=0)
figure.colorbar(dots, ax=section, label=r"action $S$ (m$^2$ s$^{-3}$)").formatter.set_powerlimits((0, 0))
path, saddle = energy.path, structure.saddles[energy.saddle]
points = path.q[path.section]
section.plot(points[:, 0], points[:, 1], ".-", color="black", markersize=4, linewidth=0.5, label="exit path")
section.plot(*structure.attractors[0].points[0], "o", color="white", markeredgecolor="black", label="attractor")
section.plot(*saddle.points[0], "X", color="red", markeredgecolor="white", markersize=9, label="saddle")
section.set(xlim=(0.36, 0.56), ylim=(-0.15, 0.15), xlabel="position $x$ (m)", ylabel=r"velocity $v$ (m s$^{-1}$)")
section.legend(loc="lower right")

turns = (path.t - path.t[0]) / osc.section_interval
left = energy.value - path.action
history.semilogy(turns, path.action, color="C0", label="action $S$")
history.semilogy(turns[left > 0], left[left > 0], color="C1", label=r"remaining action $\Delta U - S$")
growth = -2 * np.log(np.abs(structure.attractors[0].multipliers).max())
decay = 2 * np.log(np.abs(saddle.multipliers).max())
early = turns < 0.5 * turns[-1]
late = (turns > 0.5 * turns[-1]) & (left > 1e-8 * energy.value)
history.semilogy(turns[early], path.action[0] * np.exp(growth * turns[early]), "k--", linewidth=0.8)
at = np.flatnonzero(late)[-1]
history.semilogy(
    turns[late], left[at] * np.exp(decay * (turns[at] - turns[late])), "k--", linewidth=0.8, label="linear"
)
history.set(
    xlabel="section intervals from the start", ylabel=r"m$^2$ s$^{-3}$", ylim=(1e-8 * energy.value, 3 * energy.value)
)
history.legend(loc="lower center")
figure.savefig(Path(__file__).with_suffix(".png"), dpi=80)
