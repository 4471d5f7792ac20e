"""Search: the distinct exit paths that shooting found, their energies and errors."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.shooting.shots import Shots
from vibrokit.analyzers.shooting.tolerances import TOLERANCES
from vibrokit.kernels.single import record
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, GRAZED, LEFT_REGION, STALLED
from vibrokit.progress import TRAJECTORIES, put_off, stage
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound, ExitPath, upper_bound
from vibrokit.results.finding import Finding
from vibrokit.results.stoppable import Stoppable
from vibrokit.symbolic.flow_kind import Flow

FINDER = "action plot"
_PER_INTERVAL = 8  # states of a candidate in a section interval

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Branch:
    """One exit path."""

    index: int  # its place among the outcomes
    candidate: Candidate
    curve: tuple[Array, ...]  # for each phase, the path's (x, v) (count, 2)
    middle: tuple[Array, ...]  # those of them where most of the action accumulates

    def same(self, other: Branch) -> bool:
        """Whether half of the middle states are near the other path, each compared at its phase."""
        extent = np.max([np.ptp(here, axis=0) for here in self.middle if len(here)], axis=0, initial=1e-300)
        gaps = [
            cKDTree(there / extent).query(here / extent)[0]
            for here, there in zip(self.middle, other.curve, strict=True)
            if len(there)
        ]
        near = np.concatenate(gaps) if gaps else np.empty(0)
        return bool(near.size and np.median(near) <= TOLERANCES.same)


@dataclasses.dataclass(frozen=True, eq=False)
class Search:
    """What was found about one attractor."""

    shots: Shots
    branches: tuple[Branch, ...]  # distinct exit paths, the cheapest first
    findings: tuple[Finding, ...]
    complete: bool = True  # False if the work was stopped before its end

    @classmethod
    def of(cls, shots: Shots, refining: Stoppable) -> Search:
        """Find the distinct exit paths among shots whose refinement may have been stopped."""
        branches = list[Branch]()
        with refining:
            for branch in _branches(shots):
                branches.append(branch)
        findings = (*_findings(shots, branches), *refining.findings)
        return cls(shots, tuple(branches), findings, complete=not refining.stopped)

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The exit paths as guesses for polishing, the cheapest first; one that leaves at once is none."""
        return tuple(branch.candidate for branch in self.branches if len(branch.candidate.times) > 1)

    @property
    def best(self) -> tuple[Branch, ...]:
        """The cheapest path to each target."""
        found: dict[int, Branch] = {}
        for branch in self.branches:
            found.setdefault(branch.candidate.target, branch)
        return tuple(found.values())

    def energies(self) -> tuple[dict[Branch, ActivationEnergy], Stoppable]:
        """Return the energy of each path, and the stage of work that computed the numerical errors.

        If the search is complete, the best path to each target gets an error, which takes another integration.
        """
        with put_off():
            found = {branch: _energy(self.shots, branch) for branch in self.branches}
        work = Stoppable("errors of the action plot", self.shots.shooter.problem.source)
        if self.complete:
            with work, stage(work.doing, unit=TRAJECTORIES):
                for branch in self.best:
                    found[branch] = _with_error(self.shots, branch, found[branch])
        return found, work


def _branches(shots: Shots) -> Iterator[Branch]:
    """Yield the distinct paths among the cheapest minima: so many as polishing has time for."""
    found: list[Branch] = []
    for index in shots.minima()[: TOLERANCES.paths**2]:
        target, action = int(shots.outcomes.targets[index]), float(shots.outcomes.actions[index])
        known = [branch for branch in found if branch.candidate.target == target]
        dear = bool(known) and action > TOLERANCES.dearest * known[0].candidate.action
        if dear or len(known) == TOLERANCES.paths:
            continue
        branch = _branch(shots, int(index))
        if not any(branch.same(other) for other in known):
            found.append(branch)
            yield branch


def _branch(shots: Shots, index: int) -> Branch:
    problem, outcomes = shots.shooter.problem, shots.outcomes
    # Without forcing there is one phase, and 64 states in an interval are dense enough to stand for a curve.
    fine, phases = (64, 1) if problem.scene.autonomous else (_PER_INTERVAL, _PER_INTERVAL)
    times, path = _sampled(shots, index, fine)
    part = path[:, -1] / path[-1, -1]
    # At both ends all paths are close to each other, because they share an attractor or a saddle.
    inside = (part >= 0.2) & (part <= 0.8)
    inside[np.argmin(np.abs(part - 0.5))] = True  # behind strong damping all action accumulates between two states
    phase = np.arange(len(path)) % phases
    kept = slice(None, None, fine // _PER_INTERVAL)
    n = (path.shape[1] - 1) // 2
    candidate = Candidate(
        source=problem.source,
        target=int(outcomes.targets[index]),
        times=times[kept],
        states=path[kept, :n].copy(),
        action=float(outcomes.actions[index]),
        finder=FINDER,
        momenta=path[kept, n : 2 * n].copy(),
    )
    curve = tuple(path[phase == number, :2] for number in range(phases))
    return Branch(index, candidate, curve, tuple(path[inside & (phase == number), :2] for number in range(phases)))


def _sampled(shots: Shots, index: int, per_interval: int) -> tuple[Array, Array]:
    """Times (s) and (q, p, S) of a path from its first section to the exit test at which it was out."""
    problem, outcomes = shots.shooter.problem, shots.outcomes
    interval = problem.scene.section_interval
    count = math.ceil(int(outcomes.checks[index]) * per_interval / problem.checks)
    path = record(
        problem.scene, Flow.HAMILTONIAN, shots.shooter.stepper, outcomes.begun[index],
        0.0, interval / per_interval, count,
    )  # fmt: skip
    return interval * (int(outcomes.section[index]) + np.arange(len(path)) / per_interval), path


def _findings(shots: Shots, branches: Sequence[Branch]) -> Iterator[Finding]:
    """Yield how the paths ended, and how far the refinement came."""
    problem, status = shots.shooter.problem, shots.outcomes.status
    escaped, source = status == problem.exit_status, problem.source
    yield Finding.of(
        Code.SHOTS, source,
        branches=len(branches),
        paths=len(status),
        escaped=int(np.sum(escaped)),
        left_region=int(np.sum((status == LEFT_REGION) & ~escaped)),
        remaining=int(np.sum(status == COMPLETED)),
        diverged=int(np.sum(status == DIVERGED)),
    )  # fmt: skip
    unfinished = int(np.sum(np.isin(status, (STALLED, GRAZED))))
    if unfinished:
        yield Finding.of(Code.SHOTS_UNFINISHED, source, count=unfinished, paths=len(status))
    if not branches:
        yield Finding.of(Code.NO_EXIT_FOUND, source)
    elif shots.rounds and math.isinf(shots.change):
        yield Finding.of(Code.REFINEMENT_TOO_SHORT, source, rounds=shots.rounds)
    elif shots.rounds:
        yield Finding.of(
            Code.REFINEMENT, source, last=shots.starts.patience, rounds=shots.rounds, change=shots.change
        )  # fmt: skip


def _per_check(shots: Shots) -> int:
    """Samples of a path from one exit test to the next, at least 128 in a section interval."""
    return math.ceil(128 / shots.shooter.problem.checks)


def _energy(shots: Shots, branch: Branch) -> ActivationEnergy:
    """The energy of one exit path, without its numerical error."""
    problem = shots.shooter.problem
    times, z = _sampled(shots, branch.index, _per_check(shots) * problem.checks)
    size = (z.shape[1] - 1) // 2
    section = _per_check(shots) * (1 if problem.scene.autonomous else problem.checks)
    return ActivationEnergy(
        source=problem.source,
        target=branch.candidate.target,
        value=branch.candidate.action,
        lower=0.0,
        upper=branch.candidate.action,
        method=shots.starts.method,
        bound=Bound.UPPER,
        numerical_error=math.nan,
        path=ExitPath(times, z[:, :size], z[:, size : 2 * size], z[:, -1], np.arange(0, len(z), section)),
    )


def _with_error(shots: Shots, branch: Branch, energy: ActivationEnergy) -> ActivationEnergy:
    """An energy with its numerical error: the sum of those of the search, of the steps and of the exit tests."""
    assert energy.path is not None
    error = _search_error(shots, branch) + _step_error(shots, branch) + _check_error(shots, energy.path, energy.value)
    return dataclasses.replace(energy, upper=upper_bound(energy.value, error), numerical_error=error)


def _search_error(shots: Shots, branch: Branch) -> float:
    """The change over the last refinement rounds; without refinement, the largest with a quarter of the starts."""
    action = branch.candidate.action
    if shots.rounds:
        return action * min(1.0, shots.change)
    exits = np.where(shots.outcomes.targets == branch.candidate.target, shots.exit_actions, np.nan)
    quarters = [exits[k::4] for k in range(4)]
    return max(float(np.nanmin(some)) - action if np.isfinite(some).any() else action for some in quarters)


def _step_error(shots: Shots, branch: Branch) -> float:
    """The change of the least action near a path with finer steps.

    The search covers one box of the first grid to each side, because sensitive paths move between integrations.
    """
    shooter = dataclasses.replace(shots.shooter, stepper=shots.shooter.stepper.refined())
    starts = shots.starts.with_stepper(shooter.problem, shooter.stepper)
    finer = Shots.over(starts, shooter, shots.boxes.around(branch.index))
    for refined in finer.refinements(rounds=12, tolerance=TOLERANCES.steps):
        finer = refined
    action, again = branch.candidate.action, float(finer.least[branch.candidate.target])
    return abs(action - again) if math.isfinite(again) else action


def _check_error(shots: Shots, path: ExitPath, value: float) -> float:
    """The action since the exit test before the last, because the path leaves between the two.

    Where position decides, a cheaper path may also touch the face and turn back between two tests, τ apart; it stops
    short of this one by ½ |q″| (τ/2)², which saves that times p.
    """
    per_check = _per_check(shots)
    error = max(0.0, value - float(path.action[max(0, len(path.action) - 1 - per_check)]))
    if shots.shooter.problem.exit.by_position:
        bend = np.abs(np.diff(path.q[-3:, :2], n=2, axis=0)).sum(axis=0)  # q″ times the square of the sample spacing
        error += float(np.abs(path.p[-1, :2]) @ bend) * per_check**2 / 8
    return error
