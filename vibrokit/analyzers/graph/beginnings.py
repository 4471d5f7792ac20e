"""Other beginnings of a known exit path, from the graph on a grid that covers no more than its beginning."""

from __future__ import annotations

import dataclasses

import numpy as np

from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.regions import WholeRegion
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.targets import StateTarget
from vibrokit.analyzers.graph.tolerances import TOLERANCES
from vibrokit.analyzers.graph.tracing import SolvedGrid
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.progress import stage
from vibrokit.results.energy import ActivationEnergy, ExitPath
from vibrokit.symbolic.flow_kind import Flow


def beginnings(problem: ExitProblem, potential: Potential, energy: ActivationEnergy) -> list[Candidate]:
    """Return paths that differ from a known one up to a state on the section, where it has spent a third of its action.

    While it spirals away from the attractor, an impact more or less changes the action of a path by parts of a
    thousand, which a grid that holds the whole path cannot tell. A known potential shows what a closer grid has to
    cover. On ``hertz-0.570``, leaving the hammering state, 240 nodes along each side find the cheaper of two such
    paths, and 180 do not.

    None are returned for a path without a beginning on the section, and for one so short that the linearized equations
    hold there. Raises StructureError if the grid does not reach that state.
    """
    path = energy.path
    if path is None or not len(path.section):
        return []
    spent = path.action[path.section] / path.action[-1]
    early = np.flatnonzero(spent <= 0.3)
    if not early.size or spent[early[-1]] < 1e-3:
        return []
    start = int(path.section[early[-1]])
    known = float(path.action[start])
    target = StateTarget((energy.target,), energy.saddle, known, path.q[start, :2][None])
    model = StepModel(problem.scene, problem.ensemble_stepper(Flow.LINEARISED))
    coverage, before = WholeRegion(problem, model, (target,), ()), SolvedGrid(problem, model, potential)
    nx, nv = (max(32, round(nodes * 2 / 3)) for nodes in potential.grids.shape)
    with stage("graph", subject=problem.attractor.name, unit="sweeps"):
        grids, ceiling = coverage.around(before).with_shape((nx, nv)), TOLERANCES.room * coverage.highest(before)
        found = coverage.solved(grids, ceiling, before).paths(target)
    return [_continued(each.candidate, path, start, energy.value - known) for each in found]


def _continued(found: Candidate, path: ExitPath, start: int, rest: float) -> Candidate:
    """The same path, which goes on along a known one."""
    step = found.times[1] - found.times[0]
    every = round(step / (path.t[1] - path.t[0]))
    states = np.concatenate([found.states, path.q[start + every :: every, :2]])
    times = step * np.arange(len(states), dtype=float)
    return dataclasses.replace(found, times=times, states=states, action=found.action + rest)
