"""Energies of exit paths that were shot, and their errors."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from vibrokit.analyzers.shooting.branches import Branch, sampled
from vibrokit.analyzers.shooting.shots import Shots
from vibrokit.results.energy import ActivationEnergy, Bound, ExitPath

_SAMPLES = 128  # of a path, in a section interval, at least
_QUARTERS = 4
# The search near one path with finer steps: boxes along each side of a first box and its neighbours, by dimension.
_WINDOW = (200, 25, 7)
_WINDOW_ROUNDS = 12
_WINDOW_TOLERANCE = 1e-5


def energy_of(shots: Shots, branch: Branch, *, with_error: bool) -> ActivationEnergy:
    """Return the energy of one exit path; without a numerical error it is NaN.

    The error, which takes a second integration, is the sum of what further refinement (for the ring: more points) and
    finer steps may change, and of the action between the last two exit tests, because the path leaves between them.
    """
    problem = shots.shooter.problem
    per_check = math.ceil(_SAMPLES / problem.checks)
    times, z = sampled(shots.shooter, shots.outcomes, branch.index, per_check * problem.checks)
    size = (z.shape[1] - 1) // 2
    section = per_check * (1 if problem.scene.autonomous else problem.checks)
    path = ExitPath(times, z[:, :size], z[:, size : 2 * size], z[:, -1], np.arange(0, len(z), section))
    value, error = branch.candidate.action, math.nan
    if with_error:
        error = _search_error(shots, branch) + _step_error(shots, branch) + _check_error(shots, path, value, per_check)
    return ActivationEnergy(
        source=problem.source,
        target=branch.candidate.target,
        value=value,
        lower=0.0,
        upper=value + error if with_error else value,
        method=shots.starts.method,
        bound=Bound.UPPER,
        numerical_error=error,
        path=path,
    )


def _search_error(shots: Shots, branch: Branch) -> float:
    """Change over the last refinement rounds; without refinement, what a quarter of the points misses."""
    action = branch.candidate.action
    if shots.rounds:
        return action * min(1.0, shots.change)
    exits = np.where(shots.outcomes.targets == branch.candidate.target, shots.exit_actions, np.nan)
    quarters = [exits[k::_QUARTERS] for k in range(_QUARTERS)]
    return max(float(np.nanmin(some)) - action if np.isfinite(some).any() else action for some in quarters)


def _step_error(shots: Shots, branch: Branch) -> float:
    """Change of the least action near a branch with finer steps.

    The search covers one box of the first grid to each side, because sensitive paths move between integrations.
    """
    shooter = dataclasses.replace(shots.shooter, stepper=shots.shooter.stepper.refined())
    starts = shots.starts.with_stepper(shooter.problem, shooter.stepper)
    finer = Shots.over(starts, shooter, shots.boxes.around(branch.index, _WINDOW))
    for refined in finer.refinements(_WINDOW_ROUNDS, _WINDOW_TOLERANCE):
        finer = refined
    action, again = branch.candidate.action, float(finer.least[branch.candidate.target])
    return abs(action - again) if math.isfinite(again) else action


def _check_error(shots: Shots, path: ExitPath, value: float, per_check: int) -> float:
    """Action since the test before the last.

    Where position decides, a cheaper path may also touch the face and turn back between two tests, τ apart; it stops
    short of this one by ½ |q″| (τ/2)², which saves that times p.
    """
    error = max(0.0, value - float(path.action[max(0, len(path.action) - 1 - per_check)]))
    if shots.shooter.problem.exit.by_position:
        bend = np.abs(np.diff(path.q[-3:, :2], n=2, axis=0)).sum(axis=0)  # q″ times the square of the sample spacing
        error += float(np.abs(path.p[-1, :2]) @ bend) * per_check**2 / 8
    return error
