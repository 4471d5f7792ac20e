"""Search: what shooting found about one attractor."""

from __future__ import annotations

import dataclasses
import math
from functools import cached_property

import xarray

from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.branches import FINDER, Branch, branches_of
from vibrokit.analyzers.shooting.energies import energy_of
from vibrokit.analyzers.shooting.shots import Shots
from vibrokit.progress import TRAJECTORIES, stage
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Code, Finding

_TRIED = 64  # local minima, the cheapest, that are compared as paths


@dataclasses.dataclass(frozen=True, eq=False)
class Search:
    """What was found about one attractor."""

    problem: ExitProblem
    findings: tuple[Finding, ...]
    shots: Shots | None = None  # none if the attractor already satisfies the exit condition
    branches: tuple[Branch, ...] = ()  # distinct exit paths, the cheapest first
    complete: bool = True  # False if the work was stopped before its end

    @classmethod
    def at_exit(cls, problem: ExitProblem) -> Search:
        """Return the search from an attractor that already satisfies the exit condition."""
        return cls(problem, (Finding.of(Code.AT_EXIT, problem.source),))

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
        return cls(problem, tuple(findings), shots, branches)

    def stopped(self, interrupt: KeyboardInterrupt) -> Search:
        """Return the same search, marked as stopped before its end."""
        finding = Finding.stopped(FINDER, interrupt, self.problem.source)
        return dataclasses.replace(self, findings=(*self.findings, finding), complete=False)

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The exit paths as guesses for polishing, the cheapest first."""
        return tuple(branch.candidate for branch in self.branches)

    def dataset(self) -> xarray.Dataset:
        """Return the arrays of `ActionPlotResult.data`, without the dimension ``source``."""
        return xarray.Dataset() if self.shots is None else self.shots.dataset()

    @cached_property
    def estimates(self) -> tuple[ActivationEnergy, ...]:
        """The best energy of each target, with a numerical error if the search is complete.

        The error takes another integration, so it is computed when it is first asked for.
        """
        if self.shots is None:
            zero = ActivationEnergy(self.problem.source, -1, 0.0, 0.0, 0.0, FINDER, Bound.UPPER, numerical_error=0.0)
            return (zero,)
        best: dict[int, Branch] = {}
        for branch in self.branches:
            best.setdefault(branch.candidate.target, branch)
        with stage("errors of the action plot", unit=TRAJECTORIES):
            return tuple(energy_of(self.shots, branch, with_error=self.complete) for branch in best.values())

    @property
    def energies(self) -> tuple[ActivationEnergy, ...]:
        """All exit paths, the cheapest first; those that are not the best of their target have no numerical error."""
        if self.shots is None:
            return self.estimates
        known = {(energy.target, energy.value): energy for energy in self.estimates}
        found = ((branch, known.get((branch.candidate.target, branch.candidate.action))) for branch in self.branches)
        return tuple(energy or energy_of(self.shots, branch, with_error=False) for branch, energy in found)
