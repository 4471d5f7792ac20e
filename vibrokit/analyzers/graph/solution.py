"""GraphSolution: what the graph finds about the exits of one attractor."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
import xarray

from vibrokit.analyzers.graph.hierarchy import PATH_FACTOR, TargetEstimate
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.finding import Finding


@dataclasses.dataclass(frozen=True, eq=False)
class GraphSolution:
    """Least actions of the exits of an attractor, on a grid."""

    energies: tuple[ActivationEnergy, ...]  # of each place where paths may end, the cheapest first
    candidates: tuple[Candidate, ...]  # distinct paths to these places, in the same order, that end beyond the exit
    potential: Potential  # on the grid that reaches farthest
    findings: tuple[Finding, ...]
    cheapest: Mapping[int, TargetEstimate]  # what gave each target's best energy
    most_steps: int  # steps in a section interval that those on more nodes may have
    last: bool  # no other one on as many nodes follows
    finer: int  # how many times the nodes along a side may still be doubled
    last_for_all: bool  # whether finer ones follow only for exits that it is too coarse for

    def calibrated(self, polished: Sequence[ActivationEnergy]) -> tuple[ActivationEnergy, ...]:
        """Return the estimates, with errors from actions that are known.

        What linearization over a step and interpolation change is estimated from the action of the graph's own path,
        which is relaxed only roughly. The action of a polished path to the same target shows it better: of a cheaper
        one always, of a costlier one where the error is smaller than the graph's own.
        """
        least: dict[int, float] = {}
        for path in polished:
            least[path.target] = min(path.value, least.get(path.target, np.inf))
        found = []
        for one in self.estimates:
            action = least.get(one.target, np.inf)
            error = self.cheapest[one.target].by_nodes + PATH_FACTOR * abs(action - one.value)
            found.append(_with_error(one, error if action < one.value else min(error, one.numerical_error)))
        return tuple(found)

    @property
    def estimates(self) -> tuple[ActivationEnergy, ...]:
        """The best energy of each target."""
        best: dict[int, ActivationEnergy] = {}
        for energy in self.energies:
            best.setdefault(energy.target, energy)
        return tuple(best.values())

    def dataset(self) -> xarray.Dataset:
        """Return the potential on the section, and the cheapest path.

        The variables are those of `vibrokit.results.action_graph.ActionGraphResult`, without ``source``.
        """
        nodes, values = self.potential.on_section()
        known = np.where(values < self.potential.ceiling, values, np.nan)
        paths = [np.column_stack([path.times, path.states]) for path in self.candidates]
        t, x, v = (paths[0] if paths else np.full((1, 3), np.nan)).T
        return xarray.Dataset(
            {
                "quasi_potential": _array(("node_x", "node_v"), known, "m2 s-3", "quasi-potential on the section"),
                "graph_path_t": _array("graph_step", t, "s", "time along the graph's cheapest path"),
                "graph_path_x": _array("graph_step", x, "m", "position along the graph's cheapest path"),
                "graph_path_v": _array("graph_step", v, "m s-1", "velocity along the graph's cheapest path"),
            },
            coords={
                "quasi_potential_x": _array("node_x", nodes[:, 0, 0], "m", "position of the nodes"),
                "quasi_potential_v": _array("node_v", nodes[0, :, 1], "m s-1", "velocity of the nodes"),
            },
        )


def _with_error(energy: ActivationEnergy, error: float) -> ActivationEnergy:
    """The same energy with another error."""
    return dataclasses.replace(
        energy, lower=max(0.0, energy.value - error), upper=energy.value + error, numerical_error=error
    )


def _array(dims: str | tuple[str, ...], values: object, units: str, long_name: str) -> xarray.Variable:
    return xarray.Variable(dims, values, {"units": units, "long_name": long_name})
