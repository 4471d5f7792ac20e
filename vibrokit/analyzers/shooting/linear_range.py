"""How far from an attractor extremal paths start: near enough for the quadratic form, and no nearer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.domain import FundamentalDomain, Shell, shells_around
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.symbolic.flow_kind import Flow

_LARGEST = 0.01  # relative radius; the quadratic form then misses 1e-6 of the action
_SMALLEST = 1e-7
_SHRINK = 0.25
_NONLINEAR = 0.02  # largest relative difference of an action from the quadratic form one shell later
_SAMPLED = 64  # directions at which the difference is sampled
_TINY = 1e-300

Array = NDArray[np.float64]


def fitted_domain(problem: ExitProblem, stepper: Stepper) -> FundamentalDomain:
    """Return the fundamental domain with the largest inner edge in the linear range, at most 1 % of the exit distance.

    The quadratic form misses a cubic term, so a start at the relative radius ε misses ε³ of the action to be found,
    1e-6 at one hundredth; the duration of a path grows only with log(1/ε). An attractor that nearly touches a stop has
    a smaller linear range than its basin: the edge shrinks until paths from all over the domain, one shell later, have
    the action of the quadratic form there to within 2 %.

    Raises StructureError if no edge down to the relative radius 1e-7 is in the linear range.
    """
    shells = shells_around(problem, stepper)
    distance = exit_distance(problem, shells[0])
    rates = -np.log(np.maximum(np.abs(problem.attractor.multipliers), _TINY))
    ratio = float(rates.max() / rates.min())
    relative, error = _LARGEST, np.inf
    while relative >= _SMALLEST:
        domain = FundamentalDomain(shells, relative * distance, relative, ratio, problem.scene.autonomous)
        error = nonlinearity(problem, domain, stepper)
        if error <= _NONLINEAR:
            return domain
        relative *= _SHRINK
    raise StructureError(
        f"the quadratic quasi-potential is off by {error:.2g} (relative) even at {_SMALLEST:g} of the distance to the "
        "exit: the attractor grazes a stop, or the stepper is too coarse. Take a finer stepper, or give a radius."
    )


def exit_distance(problem: ExitProblem, shell: Shell) -> float:
    """Return the least distance, in whitened coordinates, from the attractor to a basin cell outside the exit.

    If no cell is outside, return the distance to the nearest edge of the region.
    """
    basins = problem.structure.basins
    cells = basins.region.cell_centres(basins.labels.shape)
    labels = basins.labels.ravel()
    outside = ((labels >= 0) & (labels != problem.source)) | problem.is_out(cells)
    covariance = (shell.root @ shell.root.T)[:2, :2]  # extra states of the noise take their most likely values
    if outside.any():
        offset = cells[outside] - shell.point[:2]
        return float(np.sqrt(np.sum(offset * np.linalg.solve(covariance, offset.T).T, axis=1).min()))
    gaps = np.abs(basins.region.bounds - shell.point[:2, None]).min(axis=1)
    return float((gaps / np.sqrt(np.diag(covariance))).min())


def nonlinearity(problem: ExitProblem, domain: FundamentalDomain, stepper: Stepper) -> float:
    """Return the largest relative difference of actions, one shell later, from the quadratic form there."""
    osc, shells = problem.scene, domain.shells
    duration = osc.section_interval * problem.attractor.period / len(shells)
    size = len(shells[0].point)
    places = np.random.default_rng(0).random((_SAMPLED, size))
    worst = 0.0
    for number, (shell, after) in enumerate(zip(shells, (*shells[1:], shells[0]), strict=True)):
        across = (number + places[:, -1:]) / len(shells)
        inside = places[:, :-1] if domain.edge_only else np.hstack([places[:, :-1], across])
        ended = run_ensemble(
            osc, Flow.HAMILTONIAN, stepper, domain.states(inside)[0],
            start_time=shell.time % osc.section_interval, interval=duration,
        )  # fmt: skip
        place = np.linalg.solve(after.root, (ended.states[:, :size] - after.point).T).T
        expected = 0.5 * np.sum(place**2, axis=1)
        error = np.abs(ended.states[:, -1] - expected) / np.abs(expected)
        worst = max(worst, float(np.where(np.isfinite(error), error, np.inf).max()))
    return worst
