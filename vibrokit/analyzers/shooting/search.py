"""Search: the exit paths that shooting found, their energies and errors."""

from __future__ import annotations

import dataclasses
import math
from functools import cached_property

import numpy as np

from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.shooting.branches import FINDER, Branch, branches_of, sampled
from vibrokit.analyzers.shooting.shots import Shots
from vibrokit.progress import TRAJECTORIES, stage
from vibrokit.results.energy import ActivationEnergy, Bound, ExitPath
from vibrokit.results.finding import Code, Finding

_TRIED = 64  # local minima, the cheapest, that are compared as paths
_SAMPLES = 128  # of a path, in a section interval, at least
_QUARTERS = 4
# The search near one path with finer steps: boxes along each side of a first box and its neighbours, by dimension.
_WINDOW = (200, 25, 7)
_WINDOW_ROUNDS = 12
_WINDOW_TOLERANCE = 1e-5


@dataclasses.dataclass(frozen=True, eq=False)
class Search:
    """What was found about one attractor."""

    shots: Shots
    branches: tuple[Branch, ...]  # distinct exit paths, the cheapest first
    findings: tuple[Finding, ...]
    complete: bool = True  # False if the work was stopped before its end

    @classmethod
    def of(cls, shots: Shots) -> Search:
        """Find the distinct exit paths among some shots."""
        problem = shots.shooter.problem
        branches = branches_of(shots.shooter, shots.outcomes, shots.minima()[:_TRIED])
        findings = [Finding.of(Code.SHOTS, problem.source, branches=len(branches), **shots.counts())]
        if not branches:
            findings.append(Finding.of(Code.NO_EXIT_FOUND, problem.source))
        elif shots.rounds and math.isinf(shots.change):
            findings.append(Finding.of(Code.REFINEMENT_TOO_SHORT, problem.source, rounds=shots.rounds))
        elif shots.rounds:
            values = {"last": shots.starts.patience, "rounds": shots.rounds, "change": shots.change}
            findings.append(Finding(Code.REFINEMENT, problem.source, values=values))
        return cls(shots, branches, tuple(findings))

    def stopped(self, interrupt: KeyboardInterrupt) -> Search:
        """Return the same search, marked as stopped before its end."""
        finding = Finding.stopped(FINDER, interrupt, self.shots.shooter.problem.source)
        return dataclasses.replace(self, findings=(*self.findings, finding), complete=False)

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The exit paths as guesses for polishing, the cheapest first."""
        return tuple(branch.candidate for branch in self.branches)

    @cached_property
    def estimates(self) -> tuple[ActivationEnergy, ...]:
        """The best energy of each target, with a numerical error if the search is complete.

        The error takes another integration, so it is computed when it is first asked for.
        """
        best: dict[int, Branch] = {}
        for branch in self.branches:
            best.setdefault(branch.candidate.target, branch)
        with stage("errors of the action plot", unit=TRAJECTORIES):
            return tuple(_energy(self.shots, branch, with_error=self.complete) for branch in best.values())

    @property
    def energies(self) -> tuple[ActivationEnergy, ...]:
        """All exit paths, the cheapest first; those that are not the best of their target have no numerical error."""
        known = {(energy.target, energy.value): energy for energy in self.estimates}
        found = ((branch, known.get((branch.candidate.target, branch.candidate.action))) for branch in self.branches)
        return tuple(energy or _energy(self.shots, branch, with_error=False) for branch, energy in found)


def _energy(shots: Shots, branch: Branch, *, with_error: bool) -> ActivationEnergy:
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
