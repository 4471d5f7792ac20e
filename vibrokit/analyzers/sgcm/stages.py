"""The probability to leave before a return to the core, at several times of a section interval."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates

from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sgcm.density_flow import SAME, DensityFlow
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.analyzers.sgcm.quasi_stationary import relevant_legs
from vibrokit.analyzers.sgcm.solution import DensitySolver
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.symbolic.flow_kind import Flow

_BELOW = 20.0  # in ln: values so far below the least of the core are not computed

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class CommittorStages:
    """ln of the committor through a section interval."""

    flow: DensityFlow
    intensity: float  # D (m² s⁻³)
    times: Array  # (stages,): since the section (s), ascending from 0 to the next section
    log_values: Array  # (stages, nx, nv); where they are not known, the nearest known one

    @property
    def grid(self) -> DensityGrid:
        """The nodes."""
        return self.flow.grid

    def at(self, count: int) -> Array:
        """Return ln of the committor at parts of a section interval, shape (count, nx, nv).

        At the stages it is as solved; before each, noise is neglected until that stage. To interpolate in time would be
        wrong, since in a stage the motion passes several nodes.
        """
        grid, interval = self.grid, self.flow.scene.section_interval
        nodes = grid.nodes.reshape(-1, 2)
        found = np.empty((count, *grid.shape))
        for number, time in enumerate(np.arange(count) * interval / count):
            stage = int(np.searchsorted(self.times, time - SAME * interval))
            rest = max(self.times[stage] - time, 0.0)
            states = nodes
            if rest > SAME * interval:
                states = run_ensemble(
                    self.flow.scene, Flow.STATE, self.flow.stepper, nodes, start_time=float(time), interval=float(rest)
                ).states
            places = np.nan_to_num(grid.places(states)).T
            found[number] = map_coordinates(self.log_values[stage], places, order=1, mode="nearest").reshape(grid.shape)
        return found


def committor_stages(problem: ExitProblem, intensity: float) -> CommittorStages:
    """Solve for the committor of all exits together; on a coarse grid at more noise, if this D needs too many nodes.

    Raises StructureError if there is none.
    """
    one = DensitySolver(problem).guide(intensity)
    if not one.committors:
        raise StructureError(f"no committor was found at D = {one.intensity:g}.")
    together = np.minimum(functools.reduce(np.logaddexp, [each.log_values for each in one.committors.values()]), 0.0)
    floor, propagator = float(together.min()) - _BELOW, one.density.propagator
    earlier = propagator.earlier(relevant_legs(one.density), together, floor, at_exit=0.0)
    found = np.array([values.copy() for values in earlier])[::-1]
    stages = np.concatenate([np.where(found > floor + 0.5 * _BELOW, found, np.nan), together[None]])
    for stage in stages:
        nearest = distance_transform_edt(np.isnan(stage), return_distances=False, return_indices=True)
        stage[:] = stage[tuple(nearest)]
    flow = propagator.flow
    return CommittorStages(flow, one.intensity, np.append(flow.leg_times, flow.scene.section_interval), stages)
