"""Other beginnings of a known exit path, from the graph on a grid that covers no more than its beginning."""

from __future__ import annotations

import dataclasses

import numpy as np

from vibrokit.analyzers.graph.hierarchy_search import HierarchySearch
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.targets import StateTarget
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.energy import ActivationEnergy, ExitPath

_SHARE = 0.3  # of the action, that the beginning takes
_NODES, _FEWEST_NODES = 2 / 3, 32  # along a side, as a part of those of the known potential
_LEAST = 1e-3  # of the action: a shorter one lies where the linearized equations hold


def beginnings(
    problem: ExitProblem, search: HierarchySearch, potential: Potential, energy: ActivationEnergy
) -> tuple[Candidate, ...]:
    """Return paths that differ from a known one up to a state on the section, where it has spent a third of its action.

    While it spirals away from the attractor, an impact more or less changes the action of a path by parts of a
    thousand, which a grid that holds the whole path cannot tell. A known potential shows what a closer grid has to
    cover. On ``hertz-0.570``, leaving the hammering state, 240 nodes along each side find the cheaper of two such
    paths, and 180 do not.

    None are returned for a path without a beginning on the section. Raises StructureError as the search does.
    """
    path = energy.path
    if path is None or not len(path.section):
        return ()
    spent = path.action[path.section] / path.action[-1]
    early = np.flatnonzero(spent <= _SHARE)
    if not early.size or spent[early[-1]] < _LEAST:
        return ()
    start = int(path.section[early[-1]])
    known = float(path.action[start])
    target = StateTarget((energy.target,), energy.saddle, known, path.q[start, :2][None])
    nx, nv = (max(_FEWEST_NODES, round(_NODES * nodes)) for nodes in potential.grids.shape)
    found = search.within(potential, target, (nx, nv))
    return tuple(_continued(each, path, start, energy.value - known) for each in found)


def _continued(found: Candidate, path: ExitPath, start: int, rest: float) -> Candidate:
    """The same path, which goes on along a known one."""
    step = found.times[1] - found.times[0]
    every = round(step / (path.t[1] - path.t[0]))
    states = np.concatenate([found.states, path.q[start + every :: every, :2]])
    times = step * np.arange(len(states), dtype=float)
    return dataclasses.replace(found, times=times, states=states, action=found.action + rest)
