"""Search: the distinct exit paths that shooting found, their energies and errors."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.shooting.outcomes import Outcomes, Shooter
from vibrokit.analyzers.shooting.shots import Shots
from vibrokit.kernels.single import record
from vibrokit.progress import TRAJECTORIES, put_off, stage
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound, ExitPath, upper_bound
from vibrokit.results.finding import Finding
from vibrokit.results.stoppable import Stoppable
from vibrokit.symbolic.flow_kind import Flow

FINDER = "action plot"
_PER_INTERVAL = 8  # states of a candidate
_PER_TURN = 64  # without forcing: states close enough to stand for a curve
_MIDDLE = (0.2, 0.8)  # of the action: outside, paths share the attractor's or the saddle's neighbourhood
_APART = 0.03  # of the extent of the path's middle
_MOST = 8  # of each target
_COSTLY = 3.0  # times the least action of a target, above which paths are not kept
_TINY = 1e-300
_TRIED = 64  # local minima, the cheapest, that are compared as paths
_SAMPLES = 128  # of a path, in a section interval, at least
_QUARTERS = 4
# The search near one path with finer steps: boxes along each side of a first box and its neighbours, by dimension.
_WINDOW = (200, 25, 7)
_WINDOW_ROUNDS = 12
_WINDOW_TOLERANCE = 1e-5

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Branch:
    """One exit path."""

    index: int  # its place among the outcomes
    candidate: Candidate
    curve: tuple[Array, ...]  # for each phase, the path's (x, v) (count, 2)
    middle: tuple[Array, ...]  # those of them where most of the action accumulates

    def same(self, other: Branch) -> bool:
        """Whether this path passes states of the other at the same phases."""
        extent = np.max([np.ptp(here, axis=0) for here in self.middle if len(here)], axis=0, initial=_TINY)
        gaps = [
            cKDTree(there / extent).query(here / extent)[0]
            for here, there in zip(self.middle, other.curve, strict=True)
            if len(there)
        ]
        near = np.concatenate(gaps) if gaps else np.empty(0)
        return bool(near.size and np.median(near) <= _APART)


def branches_of(shooter: Shooter, outcomes: Outcomes, ranked: Iterable[int]) -> Iterator[Branch]:
    """Yield the distinct paths among some confirmed exits, given in the order of their actions.

    Of each target, at most 8 that cost at most three times the least action are kept.
    """
    found: list[Branch] = []
    for index in ranked:
        target, action = int(outcomes.targets[index]), float(outcomes.actions[index])
        known = [branch for branch in found if branch.candidate.target == target]
        if len(known) == _MOST or (known and action > _COSTLY * known[0].candidate.action):
            continue
        branch = _branch(shooter, outcomes, int(index))
        if not any(branch.same(other) for other in known):
            found.append(branch)
            yield branch


def sampled(shooter: Shooter, outcomes: Outcomes, index: int, per_interval: int) -> tuple[Array, Array]:
    """Return times (s) and (q, p, S) of a path from its first section to the exit test at which it was out."""
    osc = shooter.problem.scene
    count = math.ceil(int(outcomes.checks[index]) * per_interval / shooter.problem.checks)
    spacing = osc.section_interval / per_interval
    path = record(osc, Flow.HAMILTONIAN, shooter.stepper, outcomes.begun[index], 0.0, spacing, count)
    return osc.section_interval * (int(outcomes.section[index]) + np.arange(len(path)) / per_interval), path


def _branch(shooter: Shooter, outcomes: Outcomes, index: int) -> Branch:
    autonomous = shooter.problem.scene.autonomous
    fine = _PER_TURN if autonomous else _PER_INTERVAL
    times, path = sampled(shooter, outcomes, index, fine)
    part = path[:, -1] / path[-1, -1]
    inside = (part >= _MIDDLE[0]) & (part <= _MIDDLE[1])
    inside[np.argmin(np.abs(part - 0.5))] = True  # behind strong damping all action accumulates between two states
    phase = np.zeros(len(path)) if autonomous else np.arange(len(path)) % fine
    phases = range(1 if autonomous else fine)
    kept = slice(None, None, fine // _PER_INTERVAL)
    n = (path.shape[1] - 1) // 2
    candidate = Candidate(
        source=shooter.problem.source,
        target=int(outcomes.targets[index]),
        times=times[kept],
        states=path[kept, :n].copy(),
        action=float(outcomes.actions[index]),
        finder=FINDER,
        momenta=path[kept, n : 2 * n].copy(),
    )
    return Branch(
        index,
        candidate,
        tuple(path[phase == number, :2] for number in phases),
        tuple(path[inside & (phase == number), :2] for number in phases),
    )


@dataclasses.dataclass(frozen=True, eq=False)
class Search:
    """What was found about one attractor."""

    shots: Shots
    branches: tuple[Branch, ...]  # distinct exit paths, the cheapest first
    findings: tuple[Finding, ...]
    complete: bool = True  # False if the work was stopped before its end

    @classmethod
    def of(cls, shots: Shots, refining: Stoppable) -> Search:
        """Find the distinct exit paths among some shots, and whether these are all that were wanted."""
        problem = shots.shooter.problem
        branches = list[Branch]()
        with refining:  # whether or not it was stopped already
            for branch in branches_of(shots.shooter, shots.outcomes, shots.minima()[:_TRIED]):
                branches.append(branch)
        findings = [Finding.of(Code.SHOTS, problem.source, branches=len(branches), **shots.counts())]
        if shots.unfinished:
            count, paths = shots.unfinished, len(shots.outcomes.status)
            findings.append(Finding.of(Code.SHOTS_UNFINISHED, problem.source, count=count, paths=paths))
        if not branches:
            findings.append(Finding.of(Code.NO_EXIT_FOUND, problem.source))
        elif shots.rounds and math.isinf(shots.change):
            findings.append(Finding.of(Code.REFINEMENT_TOO_SHORT, problem.source, rounds=shots.rounds))
        elif shots.rounds:
            values = {"last": shots.starts.patience, "rounds": shots.rounds, "change": shots.change}
            findings.append(Finding(Code.REFINEMENT, problem.source, values=values))
        return cls(shots, tuple(branches), (*findings, *refining.findings), complete=not refining.stopped)

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The exit paths as guesses for polishing, the cheapest first."""
        return tuple(branch.candidate for branch in self.branches)

    @cached_property
    def rated(self) -> tuple[tuple[ActivationEnergy, ...], Stoppable]:
        """The best energy of each target, with a numerical error if the search is complete, and whether all have one.

        The error takes another integration, so it is computed when it is first asked for.
        """
        best: dict[int, Branch] = {}
        for branch in self.branches:
            best.setdefault(branch.candidate.target, branch)
        with put_off():
            found = {branch: _energy(self.shots, branch) for branch in best.values()}
        work = Stoppable("errors of the action plot", self.shots.shooter.problem.source)
        if self.complete:
            with work, stage(work.doing, unit=TRAJECTORIES):
                for branch, energy in found.items():
                    found[branch] = _with_error(self.shots, branch, energy)
        return tuple(found.values()), work

    @property
    def estimates(self) -> tuple[ActivationEnergy, ...]:
        """The best energy of each target."""
        return self.rated[0]

    @property
    def energies(self) -> tuple[ActivationEnergy, ...]:
        """All exit paths, the cheapest first; those that are not the best of their target have no numerical error."""
        known = {(energy.target, energy.value): energy for energy in self.estimates}
        found = ((branch, known.get((branch.candidate.target, branch.candidate.action))) for branch in self.branches)
        with put_off():
            return tuple(energy or _energy(self.shots, branch) for branch, energy in found)


def _energy(shots: Shots, branch: Branch) -> ActivationEnergy:
    """Return the energy of one exit path, whose numerical error is not known."""
    problem, per_check = shots.shooter.problem, _per_check(shots)
    times, z = sampled(shots.shooter, shots.outcomes, branch.index, per_check * problem.checks)
    size = (z.shape[1] - 1) // 2
    section = per_check * (1 if problem.scene.autonomous else problem.checks)
    path = ExitPath(times, z[:, :size], z[:, size : 2 * size], z[:, -1], np.arange(0, len(z), section))
    return ActivationEnergy(
        source=problem.source,
        target=branch.candidate.target,
        value=branch.candidate.action,
        lower=0.0,
        upper=branch.candidate.action,
        method=shots.starts.method,
        bound=Bound.UPPER,
        numerical_error=math.nan,
        path=path,
    )


def _with_error(shots: Shots, branch: Branch, energy: ActivationEnergy) -> ActivationEnergy:
    """Return the energy of an exit path with its numerical error, which takes a second integration.

    It is the sum of what further refinement (for the ring: more points) and finer steps may change, and of the action
    between the last two exit tests, because the path leaves between them.
    """
    assert energy.path is not None
    checked = _check_error(shots, energy.path, energy.value, _per_check(shots))
    error = _search_error(shots, branch) + _step_error(shots, branch) + checked
    return dataclasses.replace(energy, upper=upper_bound(energy.value, error), numerical_error=error)


def _per_check(shots: Shots) -> int:
    """Samples of a path from one exit test to the next."""
    return math.ceil(_SAMPLES / shots.shooter.problem.checks)


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
