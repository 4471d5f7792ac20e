"""Path ends of an exit problem, translated into exit targets of the graph."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.targets import ExitTarget, FaceTarget, StateTarget
from vibrokit.analyzers.path_ends import AtFace, AtSaddle, InBasin, PathEnd
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.basins import ESCAPED
from vibrokit.results.saddle import Saddle
from vibrokit.structure.basins.stop_cells import agreeing
from vibrokit.structure.orbits import unstable_direction

Array = NDArray[np.float64]


def exit_targets(problem: ExitProblem, model: StepModel) -> list[ExitTarget]:
    """Return the exit targets of a problem; raises StructureError if the graph can reach none of its path ends."""
    targets = [target for end in problem.path_ends for target in targets_at(end, problem, model)]
    if not targets and not problem.structure.complete:
        raise StructureError(
            f"the structure is incomplete, because its search was stopped, and has no place where a path from "
            f"{problem.attractor.name} may end; find the structure with more time."
        )
    if not targets:
        raise StructureError(
            f"{problem.exit} has no place where a path from {problem.attractor.name} may end; choose another exit, or "
            "find the structure on a wider region."
        )
    return targets


@functools.singledispatch
def targets_at(end: PathEnd, problem: ExitProblem, model: StepModel) -> list[ExitTarget]:
    """Return the exit targets that stand for a path end; raises StructureError if the graph does not know its kind."""
    raise StructureError(
        f"the graph cannot search paths that end at {end}; it knows AtSaddle, InBasin and AtFace. Use another method."
    )


@targets_at.register
def _(end: AtSaddle, problem: ExitProblem, model: StepModel) -> list[ExitTarget]:
    return [] if end.embedded or not (end.on_own_boundary and _labels(end)) else [at_saddle(end, problem, model)]


def at_saddle(end: AtSaddle, problem: ExitProblem, model: StepModel) -> StateTarget:
    """Return the exit target that stands for a saddle."""
    saddle = problem.structure.saddles[end.number]
    states = saddle.points[:, :2]
    scale = _straight(problem, model, states)
    return StateTarget(_labels(end), end.number, scale, states, direction=_unstable_direction(model, saddle))


@targets_at.register
def _(end: InBasin, problem: ExitProblem, model: StepModel) -> list[ExitTarget]:
    region, labels = problem.structure.basins.region, problem.structure.basins.labels
    certain = np.where(agreeing(labels, 1), labels, -1).ravel()
    centres = region.cell_centres(labels.shape)
    depth = 2 * np.diff(region.bounds, axis=1)[:, 0] / labels.shape  # of the nearest cell that surely lies inside
    targets: list[ExitTarget] = []
    for label in end.targets:
        points = problem.structure.attractors[label].points[:, :2]
        states = np.concatenate([centres[certain == label], points])
        targets.append(StateTarget((label,), -1, _straight(problem, model, points), states, depth=depth))
    return targets


@targets_at.register
def _(end: AtFace, problem: ExitProblem, model: StepModel) -> list[ExitTarget]:
    # Noise moves v by Δv within a time τ at the cost Δv²/(2τ), and x by Δx at about that of Δv = ω_n Δx.
    frequency = problem.scene.reference_frequency
    distance = (end.level - float(problem.attractor.points[0, end.axis])) * (frequency if end.axis == 0 else 1.0)
    scale = 10 * distance**2 / (2 * max(1 / frequency, problem.scene.section_interval))
    return [FaceTarget(end.targets[:1], -1, scale, model, end.axis, end.level)]


def _labels(end: AtSaddle) -> tuple[int, ...]:
    return tuple(label for label in end.targets if label >= 0 or label == ESCAPED)


def _straight(problem: ExitProblem, model: StepModel, states: Array) -> float:
    """Quadratic cost of reaching the cheapest of some states in one section interval, from the attractor.

    Raises StructureError where noise has no value at the attractor.
    """
    found = model.linear(problem.attractor.points[:1, :2], 0.0, model.scene.section_interval)
    if not np.isfinite(found.covariances).all():
        raise StructureError(
            f"the motion from the attractor at {tuple(problem.attractor.points[0].tolist())} cannot be linearized; the "
            "noise may have no real value there."
        )
    miss = states - found.images[0]
    cost = float(np.min(0.5 * np.einsum("ni,ij,nj->n", miss, np.linalg.pinv(found.covariances[0]), miss)))
    if np.isfinite(cost) and cost > 0:
        return cost
    # Pressed against a stiff stop, noise hardly moves the state: the scale of free motion.
    frequency = model.scene.reference_frequency
    return float(frequency**3 * np.min(np.sum((miss * [1.0, 1 / frequency]) ** 2, axis=1)))


def _unstable_direction(model: StepModel, saddle: Saddle) -> Array | None:
    if saddle.kind == "chaotic":
        return None
    found = unstable_direction(model.scene, saddle.nodes, max(1, saddle.period), model.stepper)
    return None if found is None else found[:2]
