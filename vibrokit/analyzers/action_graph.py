"""ActionGraph: the quasi-potential on the whole section, as a shortest path over time and space."""

from __future__ import annotations

from typing import ClassVar

from vibrokit.analyzers.analyzer import Analysis, Analyzer, at_exit
from vibrokit.analyzers.graph.search import GraphSearch
from vibrokit.analyzers.graph.solution import ExitCosts
from vibrokit.analyzers.graph.tracing import METHOD
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.oscillator import Oscillator
from vibrokit.results.energy import Bound
from vibrokit.results.least_action import ActionGraphResult
from vibrokit.results.result import Result
from vibrokit.results.stoppable import Stoppable


class ActionGraph(GraphSearch, Analyzer):
    """Quasi-potential of an attractor on the section, and the least action of its exits.

    `GraphSearch` describes the method and its settings; `Analyzer` has those that all methods share.
    """

    result: ClassVar[type[Result]] = ActionGraphResult

    def check(self, osc: Oscillator) -> None:
        """Refuse also noise with states of its own."""
        super().check(osc)
        self.check_noise(osc)

    def analyze(self, problem: ExitProblem) -> Analysis:
        """Search the exits of one attractor; errors as of `search`.

        If the work is stopped after a first solution, that is returned, marked incomplete.
        """
        problem.check_path_begins()
        if problem.at_exit:
            return at_exit(problem, METHOD, Bound.ESTIMATE)
        costs: ExitCosts | None = None
        with Stoppable("graph", problem.source) as work:
            costs = self.begin(problem)
            while not costs.finished:
                costs.refine()
        if costs is None or not costs.solved:
            return Analysis(findings=work.findings, complete=False)
        found = costs.solution().bounded(problem)
        findings, complete = (*found.findings, *work.findings), found.complete and not work.stopped
        return Analysis(found.estimates, found.dataset(), findings, found.energies, complete)
