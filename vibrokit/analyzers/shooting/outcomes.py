"""Integrates extremal paths to their exits, and confirms exits by the attractors that they lead to."""

from __future__ import annotations

import dataclasses
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.ensemble import Ensemble, Stop, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, LEFT_BASIN, LEFT_REGION
from vibrokit.progress import stage
from vibrokit.results.basins import ESCAPED, UNSETTLED
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.symbolic.flow_kind import Flow

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class Outcomes:
    """How some paths ended."""

    begun: Array  # (count, 2n + 1): (q, p, S) at the first section
    section: Whole  # (count,): number of that section, counted from the attractor's first point
    states: Array  # (count, 2n + 1): last (q, p, S)
    status: Whole  # (count,): constants of `vibrokit.kernels.stopping`
    checks: Whole  # (count,): exit tests from the first section to the end
    targets: Whole  # (count,): label of the exit's cell, or once confirmed what is reached; −1 if unknown
    confirmed: NDArray[np.bool_]  # (count,): whether the path certainly exits
    returns: Whole  # (count,): how many apparent exits led, without noise, to an attractor that is no target

    @property
    def actions(self) -> Array:
        """Action of each path at its end."""
        return self.states[:, -1]

    def least(self, targets: int) -> Array:
        """Return the least confirmed action by target, infinite without one.

        The last two are those of escape and of unknown targets, so that their labels, −2 and −1, are indices too.
        """
        least = np.full(targets + 2, np.inf)
        np.minimum.at(least, self.targets[self.confirmed], self.actions[self.confirmed])
        return least

    def joined(self, more: Outcomes) -> Outcomes:
        """Return these and some more, as new arrays."""
        names = [field.name for field in dataclasses.fields(self)]
        return Outcomes(*(np.concatenate([getattr(self, name), getattr(more, name)]) for name in names))


@dataclasses.dataclass(frozen=True, eq=False)
class Shooter:
    """Integrates paths away from one attractor."""

    problem: ExitProblem
    stepper: Stepper
    budget: int  # maximum number of section intervals of a path

    def shoot(self, starts: Array, times: Array) -> Outcomes:
        """Integrate starts (count, 2n + 1) at some times (s) to their exits; exits from a basin are not confirmed."""
        problem = self.problem
        begun, section = self._to_section(starts, times)
        ended = self._integrated(begun, self.budget * problem.checks, self._stop)
        confirmed = (ended.status == problem.exit_status) & problem.exit.by_position
        return Outcomes(
            begun, section, ended.states, ended.status, ended.intervals, ended.label, confirmed, 0 * section
        )

    def confirm(self, outcomes: Outcomes, factor: float = 1.0) -> None:
        """Confirm exits, in place, until all below `factor` times the least action of their target are certain.

        First the cheapest ones settle in batches until the best one to each target is certain, because most of them
        are never needed; then all others settle at once, because a few take as long as many.
        """
        for up_to in sorted({1.0, factor}):
            while len(doubtful := self._doubtful(outcomes, up_to)):
                ranked = doubtful[np.argsort(outcomes.actions[doubtful], kind="stable")]
                some = max(256, len(ranked) // 8) if up_to == 1.0 else len(ranked)
                self._settle(outcomes, ranked[:some])

    def _doubtful(self, outcomes: Outcomes, factor: float) -> Whole:
        """The exits below `factor` times the least action of their target that are not confirmed."""
        open_ = np.flatnonzero(np.isin(outcomes.status, (LEFT_BASIN, LEFT_REGION)) & ~outcomes.confirmed)
        least = outcomes.least(len(self.problem.structure.attractors))
        ceilings = factor * np.append(least[:-1], least.min())
        return open_[outcomes.actions[open_] < ceilings[outcomes.targets[open_]]]

    def _settle(self, outcomes: Outcomes, which: Whole) -> None:
        """Let the motion without noise decide about some exits, in place.

        If it settles on a target, the exit is confirmed. If it settles on another attractor, the path only touched
        coarse cells of the basin boundary and is continued, each time for twice as long before it is tested again. If
        it settles nowhere, the path is no exit.
        """
        states = outcomes.states[which]
        reached = self._classifier.labels(states[:, : (states.shape[1] - 1) // 2])
        goals = [target.label for target in self.problem.targets]
        exits = np.isin(reached, goals) | ((reached == ESCAPED) & self.problem.ends_by_escape)
        returned = (reached >= 0) & ~exits
        outcomes.targets[which[exits]] = reached[exits]
        outcomes.confirmed[which[exits]] = True
        outcomes.status[which[exits]] = LEFT_BASIN
        outcomes.status[which[reached == UNSETTLED]] = COMPLETED
        outcomes.status[which[~exits & (reached == ESCAPED)]] = DIVERGED
        again = which[returned]
        left = np.maximum(self.budget * self.problem.checks - outcomes.checks[again], 0)
        burst = max(1, self.budget * self.problem.checks // 512)  # few tests against all of a path
        untested = np.minimum(burst * 2 ** outcomes.returns[again] - 1, left)
        beyond = self._integrated(states[returned], untested, Stop())
        more = self._integrated(beyond.states, left - untested, self._stop)
        outcomes.states[again], outcomes.status[again], outcomes.targets[again] = more.states, more.status, more.label
        outcomes.checks[again] += untested + more.intervals
        outcomes.returns[again] += 1

    @cached_property
    def _classifier(self) -> BasinClassifier:
        known = self.problem.structure
        with stage("cells of the basins"):
            return BasinClassifier.of(self.problem.osc, known, self.stepper).sharing(known.basins)

    @cached_property
    def _stop(self) -> Stop:
        """The test of the problem; cells from which motion escapes have the next free label, if that is an exit."""
        known, stop = self.problem.structure, self.problem.stop
        if not self.problem.ends_by_escape:
            return stop
        return dataclasses.replace(
            stop, labels=np.where(known.basins.exits == ESCAPED, len(known.attractors), stop.labels)
        )

    def _integrated(self, states: Array, budget: int | Whole, stop: Stop) -> Ensemble:
        problem = self.problem
        ended = run_ensemble(
            problem.scene, Flow.HAMILTONIAN, self.stepper, states, budget,
            stop=stop, interval=problem.scene.section_interval / problem.checks,
        )  # fmt: skip
        escaped = ended.label == len(problem.structure.attractors)
        return dataclasses.replace(ended, label=np.where(escaped, ESCAPED, ended.label))

    def _to_section(self, starts: Array, times: Array) -> tuple[Array, Whole]:
        """Integrate starts between two sections to the next."""
        osc = self.problem.scene
        unit = osc.section_interval
        section = np.ceil(times / unit - 1e-9).astype(np.int64)
        missing, begun = section * unit - times, starts.copy()
        for rest in np.unique(missing[missing > 1e-9 * unit]):
            here = missing == rest
            begun[here] = run_ensemble(
                osc, Flow.HAMILTONIAN, self.stepper, starts[here], start_time=unit - rest, interval=float(rest)
            ).states
        return begun, section
