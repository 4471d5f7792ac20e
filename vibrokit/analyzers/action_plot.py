"""ActionPlot: the cheapest of many extremal paths that leave an attractor."""

from __future__ import annotations

from typing import ClassVar

from vibrokit.analyzers.analyzer import Analysis, Analyzer, at_exit
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.search import FINDER
from vibrokit.analyzers.shooting.shooting import Shooting
from vibrokit.results.energy import Bound
from vibrokit.results.least_action import ActionPlotResult
from vibrokit.results.result import Result


class ActionPlot(Shooting, Analyzer):
    """Actions of extremal paths that leave an attractor, as upper bounds of its activation energies.

    `Shooting` describes the method and its settings; `Analyzer` has those that all methods share. The `tolerance` is
    1e-4 by default, since the actions are not polished.

    Each energy is the least action found for its target, bounded above by the value and its numerical error. The error
    is the sum of the change over the last refinement rounds (without refinement: with a quarter of the starts), the
    change with finer steps, and the action between the last two exit tests. The lower bound is 0, because shooting
    excludes no cheaper path.
    """

    result: ClassVar[type[Result]] = ActionPlotResult

    tolerance: float = 1e-4

    def analyze(self, problem: ExitProblem) -> Analysis:
        """Search the exit paths from one attractor."""
        problem.check_path_begins()
        if problem.at_exit:
            return at_exit(problem, FINDER, Bound.UPPER)
        found = self.search(problem)
        energies, errors = found.energies()
        return Analysis(
            tuple(energies[branch] for branch in found.best),
            found.shots.dataset(),
            (*found.findings, *errors.findings),
            tuple(energies.values()),
            complete=found.complete and not errors.stopped,
        )
