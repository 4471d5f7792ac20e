"""Whole paths: from the attractor itself to the exit itself, with the action that they really have."""

from __future__ import annotations

import math

import numpy as np

from vibrokit.analyzers.graph.lead_in import lead_in
from vibrokit.analyzers.graph.tracing import TracedPath
from vibrokit.analyzers.paths.action_descent import descend_action
from vibrokit.analyzers.paths.gauss_newton import gauss_newton
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.symbolic.flow_kind import Flow

_CONVERGED = 1e-5  # of the action, that another step of the descent would gain


def whole_action(problem: ExitProblem, path: TracedPath) -> float:
    """Return the action of a graph's path, joined to the attractor and led to the exit; infinite if it does not lead.

    Extremal segments join its points, so that this is the action of a motion, and no path of least action costs more.
    """
    if not _leads_out(problem, path):
        return math.inf
    propagator = SegmentPropagator(problem.scene, problem.single_stepper(Flow.HAMILTONIAN_VARIATIONAL), path.steps)
    end, states = path.start, path.states
    if not path.from_attractor:
        states = np.concatenate([lead_in(problem.attractor, propagator, states[0]), states])
    states = np.concatenate([states, end.beyond])
    try:
        points, _ = gauss_newton(propagator, 0, states, end.last, end.free)
    except StructureError:
        return math.inf
    _, action = descend_action(propagator, 0, points, last=end.last, free=end.free, converged=_CONVERGED)
    return action if math.isfinite(action) else math.inf


def _leads_out(problem: ExitProblem, path: TracedPath) -> bool:
    """Whether the end of a path is on a saddle or a face, or motion without noise leads on from it to the target."""
    target, end = path.target, path.start
    if target.is_sharp:
        return True
    classifier = BasinClassifier.of(
        problem.scene, problem.structure, problem.stepper or ensemble_stepper(problem.scene, Flow.STATE)
    )
    (reached,) = classifier.labels(end.state[None], end.phase * problem.scene.section_interval / path.steps)
    return int(reached) in target.labels
