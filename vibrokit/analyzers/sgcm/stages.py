"""The probability to leave before a return to the core, at several times of a section interval."""

from __future__ import annotations

import dataclasses
import functools
import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sgcm.density_flow import steps_for
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.analyzers.sgcm.propagator import Propagator
from vibrokit.analyzers.sgcm.solution import AtIntensity, DensitySolver
from vibrokit.errors import StructureError

_MEMORY = 2.0  # GiB
_BELOW = 20.0  # in ln: values so far below the least of the core are not computed

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class CommittorStages:
    """ln of the committor through a section interval.

    Attributes
    ----------
    grid : DensityGrid
    intensity : float
        D (m² s⁻³).
    times : array (stages,)
        Since the section (s), ascending from 0.
    log_values : array (stages, nx, nv)
        NaN where they are not known.
    """

    grid: DensityGrid
    intensity: float
    times: Array
    log_values: Array


def committor_stages(problem: ExitProblem, intensity: float) -> CommittorStages:
    """Solve for the committor of all exits together; on a coarse grid at more noise, if this D needs too many nodes.

    Raises StructureError if there is none.
    """
    orbits = [attractor.orbit[:, :2] for attractor in problem.structure.attractors]
    solver = DensitySolver(problem, None, steps_for(problem.osc, np.concatenate(orbits)), _MEMORY)
    try:
        for one in solver.solve((intensity,)):
            return _stages(one)
    except StructureError:
        with ThreadPoolExecutor(os.cpu_count()) as executor:
            one, _ = solver.explored(intensity, executor)
            return _stages(one)
    raise AssertionError("one intensity has one solution")


def _stages(one: AtIntensity) -> CommittorStages:
    logs = [known.log_values for known in one.committors.values()]
    if not logs or not isinstance(one.transition, Propagator):
        raise StructureError(f"no committor was found at D = {one.intensity:g}.")
    together = np.minimum(functools.reduce(np.logaddexp, logs), 0.0)
    floor = float(together.min()) - _BELOW
    found = one.transition.stages(one.found, one.cores, together, floor)
    known = found > floor + 0.5 * _BELOW
    flow = one.transition.flow
    return CommittorStages(one.grid, one.intensity, flow.leg_times, np.where(known, found, np.nan))
