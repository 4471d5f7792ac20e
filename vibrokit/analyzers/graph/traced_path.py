"""TracedPath: the result of tracing, how it leaves the attractor, and its action apart from the grid."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.targets import ExitTarget, TraceStart
from vibrokit.analyzers.paths.action_descent import descend_action
from vibrokit.analyzers.paths.candidate import Candidate, same_action
from vibrokit.analyzers.paths.gauss_newton import gauss_newton
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.results.attractor import Attractor
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.symbolic.flow_kind import Flow

# Relaxation times on the attractor. A path that has t relaxation times to reach a state near it costs 1/(1 − e^(−2t))
# of what one without a beginning costs up to there, by the linearized equations: 0.03 % more.
_RELAXATIONS = 4.0

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class TracedPath:
    """A path to an exit target, relaxed to a local minimum of the action."""

    candidate: Candidate  # priced by Hamilton's equations, except for the quadratic form that it starts in
    quadratic: float  # its cost as the graph computes it, with linearized steps
    states: Array  # (count, 2): from a section on, a step apart
    steps: int  # in a section interval
    from_attractor: bool  # whether the first state is on the attractor itself, not next to it
    target: ExitTarget
    start: TraceStart  # the end of the path

    @property
    def linearization_error(self) -> float:
        """Relative difference that linearization over a step makes."""
        return abs(self.quadratic - self.candidate.action) / self.candidate.action


def distinct(paths: Iterable[TracedPath]) -> list[TracedPath]:
    """Return each path once, the cheapest first."""
    kept: list[TracedPath] = []
    for path in sorted(paths, key=lambda path: path.candidate.action):
        if not any(same_action(path.candidate.action, other.candidate.action, 1e-4) for other in kept):
            kept.append(path)
    return kept


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
    _, action = descend_action(propagator, 0, points, last=end.last, free=end.free, converged=1e-5)
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


def lead_in(attractor: Attractor, propagator: SegmentPropagator, state: Array) -> Array:
    """Return states (count, 2) on an attractor, a piece apart, that end a piece before a section state near it.

    The first one is on the section. A path through them and the state, relaxed with the first one held, leaves from
    the attractor itself.
    """
    steps, interval = propagator.pieces, propagator.osc.section_interval
    units = np.array([propagator.osc.reference_frequency, 1.0])
    intervals = min(250, max(1, math.ceil(_RELAXATIONS * _relaxation(attractor) / interval)))
    curve = attractor.orbit if attractor.kind == "limit cycle" else attractor.points
    place = int(np.argmin(np.linalg.norm((curve[:, :2] - state) * units, axis=1)))
    if attractor.kind == "limit cycle":
        back = place - intervals * interval / attractor.duration * (len(curve) - 1)
        at = back % (len(curve) - 1)
        start = np.array([np.interp(at, np.arange(len(curve)), curve[:, axis]) for axis in (0, 1)])
    elif attractor.is_fixed:
        start = curve[(place - intervals) % len(curve), :2]
    else:
        intervals = min(intervals, place)  # points follow each other in time
        start = curve[place - intervals, :2]
    return propagator.onward(start, 0, intervals * steps)[:-1]


def _relaxation(attractor: Attractor) -> float:
    """The time in which deviations from an attractor fall by a factor e (s); 0 where that is not known."""
    rates = np.sort(attractor.exponents.real)
    if attractor.kind == "limit cycle":
        rates = rates[:-1]  # without that of a shift along it
    slowest = float(-rates[-1]) if len(rates) else 0.0
    return 1 / slowest if slowest > 0 else 0.0
