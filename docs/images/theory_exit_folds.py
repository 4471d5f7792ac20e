"""Draws theory_exit_folds.png, a picture of docs/theory/exit-paths.rst: python docs/images/theory_exit_folds.py"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vibrokit as vk
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.starts import fitted_domain
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.symbolic.flow_kind import Flow

PERIODS, HIGHEST, APART = 32, 0.3, 0.05  # sections followed; largest action; largest distance of neighbours
CUT = 2.1  # velocity on the right


class UnstableManifold:
    """Extremals from a ring around the attractor: lines of equal radius in it, and their images on the section."""

    def __init__(self, problem):
        self.scene, self.stepper = problem.scene, problem.ensemble_stepper(Flow.HAMILTONIAN)
        self.domain = fitted_domain(problem, self.stepper)
        if len(self.domain.shells) > 1:
            raise SystemExit("the ring is not on the section")

    def images(self, places):
        """Return (q, p, S) of starts (count, 2) and of their images, shape (sections, count, 5)."""
        starts, _ = self.domain.states(places)
        run = run_ensemble(self.scene, Flow.HAMILTONIAN, self.stepper, starts, PERIODS, visits=PERIODS)
        return np.concatenate([starts[None], np.moveaxis(run.visits, 1, 0)])

    def line(self, radius, angles=400, rounds=14):
        """Return the images of one radius, by angle; angles are added until neighbours are close together."""
        places = np.column_stack([np.linspace(0, 1, angles), np.full(angles, radius)])
        found = self.images(places)
        for _ in range(rounds):
            cheap = np.minimum(found[:, 1:, 4], found[:, :-1, 4]) < HIGHEST
            gap = np.linalg.norm(found[:, 1:, :2] - found[:, :-1, :2], axis=2)
            split = np.flatnonzero((cheap & ~(gap < APART)).any(axis=0))
            if not len(split):
                break
            between = (places[split] + places[split + 1]) / 2
            places = np.insert(places, split + 1, between, axis=0)
            found = np.insert(found, split + 1, self.images(between), axis=1)
        return found


def crossings(line, velocity):
    """Return x and S where the images of a line cross a velocity."""
    first, second = line[:, :-1], line[:, 1:]
    near = np.linalg.norm(second[..., :2] - first[..., :2], axis=2) < APART
    across = near & ((first[..., 1] - velocity) * (second[..., 1] - velocity) < 0)
    first, second = first[across], second[across]
    share = ((velocity - first[:, 1]) / (second[:, 1] - first[:, 1]))[:, None]
    return (first + share * (second - first))[:, [0, 4]]


if __name__ == "__main__":
    osc = vk.load_scene("duffing")
    structure = vk.find_structure(osc, cells=(120, 120), manifolds=False, rng=0)
    manifold = UnstableManifold(ExitProblem(osc, structure, structure.attractors[0], vk.LeaveBasin()))
    lines = [manifold.line(radius) for radius in np.linspace(0, 1, 40, endpoint=False)]
    figure = Figure(figsize=(10.0, 4.4), layout="constrained")
    section, cut = figure.subplots(1, 2, width_ratios=(1.1, 1.0))
    for image in lines[0]:
        shown = np.where(image[:, [4]] < HIGHEST, image, np.nan)
        section.plot(shown[:, 0], shown[:, 1], color="0.3", linewidth=0.5, zorder=1)
    cloud = np.concatenate([line.reshape(-1, 5)[line[..., 4].ravel() < HIGHEST][:, [0, 1, 4]] for line in lines])
    cloud = cloud[np.argsort(-cloud[:, 2])]  # the least action on top
    dots = section.scatter(cloud[:, 0], cloud[:, 1], c=cloud[:, 2], s=2, linewidths=0, rasterized=True, zorder=0)
    figure.colorbar(dots, ax=section, label=r"action $S$ (m$^2$ s$^{-3}$)")
    (saddle,) = structure.saddles
    section.plot(*structure.attractors[0].points[0], "o", color="white", markeredgecolor="black", label="attractor")
    section.plot(*saddle.points[0], "X", color="red", markeredgecolor="white", markersize=9, label="saddle")
    section.axhline(CUT, color="red", linewidth=0.8, linestyle="--")
    section.set(xlim=(-2.4, 1.4), ylim=(-1.6, 3.4), xlabel="position $x$ (m)", ylabel=r"velocity $v$ (m s$^{-1}$)")
    section.legend(loc="lower right")
    found = np.concatenate([crossings(line, CUT) for line in lines])
    found = found[found[:, 1] < HIGHEST]
    cut.plot(found[:, 0], found[:, 1], ".", color="black", markersize=2)
    cut.set(
        xlabel="position $x$ (m)", ylabel=r"action $S$ (m$^2$ s$^{-3}$)", title=f"on the line v = {CUT} m s$^{{-1}}$"
    )
    figure.savefig(Path(__file__).with_suffix(".png"), dpi=80)
