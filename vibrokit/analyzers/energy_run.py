"""EnergyRun: searches for exit paths at some values of a parameter, and follows them to the others."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.least_action import LeastAction
from vibrokit.analyzers.polishing.followed_path import FollowedPath
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.settings import settings_of
from vibrokit.errors import ParameterError, SceneError, StructureError, VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Work, advance, current, stage
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.energy_continuation import EnergyBranch, EnergyContinuation
from vibrokit.results.finding import Finding
from vibrokit.results.labels import goal_name, label_of
from vibrokit.results.stoppable import Stoppable
from vibrokit.results.structure import Structure
from vibrokit.scene_file import scene_data
from vibrokit.structure.find import find_structure
from vibrokit.structure.parameter_values import ParameterLine

Array = NDArray[np.float64]


@dataclasses.dataclass(eq=False)
class _Curve:
    """One path, at the values where it is known."""

    source: str
    target: str
    paths: dict[int, FollowedPath] = dataclasses.field(default_factory=dict)
    errors: dict[int, float] = dataclasses.field(default_factory=dict)
    slopes: dict[int, float] = dataclasses.field(default_factory=dict)
    step: float = np.inf  # longest one that may succeed

    def action(self, place: int) -> float:
        """Of the path at a value; NaN where it is not known."""
        return self.paths[place].found.action if place in self.paths else np.nan


@dataclasses.dataclass(eq=False)
class EnergyRun:
    """Searches for exit paths at some values, follows the cheapest of each exit to the others, and keeps both.

    Attributes
    ----------
    wanted : sequence of int, optional
        Indices of the values to search at. By default these are the one nearest to the scene's own, the first and the
        last at which a state exists, and then the middle of each stretch where a state has no energy. One is enough
        where the equations of exit paths do not depend on the parameter.
    structure_at : callable
        Returns the structure at a value, and the names of its attractors; by default it is searched for, and the names
        are its own.
    existing : mapping of str to collection of int, optional
        The places where each state exists, by its name; by default a state may exist everywhere. Others are not left.
    """

    osc: Oscillator
    line: ParameterLine
    values: Array
    analyzer: LeastAction
    wanted: Sequence[int] | None
    seed: int
    structure_at: Callable[[float], tuple[Structure, tuple[str, ...]]] | None = None
    existing: Mapping[str, Collection[int]] | None = None

    def __post_init__(self) -> None:
        self.still = not self.line.enters(self.osc, self.osc.model.hamiltonian)  # a path is the same at all values
        self.places: list[int] = []  # that were searched
        self.structures: dict[int, tuple[Structure, tuple[str, ...]]] = {}  # by place
        self.curves: list[_Curve] = []
        self.findings: list[Finding] = []
        self.work = Stoppable("searched values")

    def run(self) -> None:
        """Search at each of the places, and follow new paths from there."""
        waiting = list(self._first() if self.wanted is None else self.wanted)
        with self.work as work, stage("searched values", unit="values"):
            while waiting or (self.wanted is None and (waiting := self._further())):
                self.places.append(waiting.pop(0))
                self._search(self.places[-1])
                advance()
        self.findings += work.findings
        if not (self.curves or work.stopped):
            refused = [] if self.places else [self.line.refusal(self.osc, float(self.values[0]))]
            reasons = [*map(str, self.findings), *refused, "all paths lead from sets that are no orbits."]
            raise StructureError(f"no exit path was found at any searched value. {reasons[0]}")

    def _held(self) -> list[int]:
        """The places at which there is a scene."""
        return [place for place, value in enumerate(self.values) if not self.line.refusal(self.osc, float(value))]

    def _first(self) -> list[int]:
        """The places that are searched in any case, that nearest to the scene's own value first."""
        held = self._held() if self.existing is None else sorted({*itertools.chain(*self.existing.values())})
        nearest = sorted(held, key=lambda place: abs(self.values[place] - self.line.own))[:1]
        return list(dict.fromkeys(nearest if self.still else [*nearest, *held[:1], *held[-1:]]))

    def _further(self) -> list[int]:
        """The middle of a stretch where a state has no energy; none where searches at both of its ends found none."""
        existing, count = self.existing, len(self.values)
        if existing is None:
            existing = dict.fromkeys((curve.source for curve in self.curves), self._held())
        for source, places in existing.items():
            known = {place for curve in self.curves if curve.source == source for place in curve.paths}
            without = {-1, count, *self.places} - known
            missing = [place for place in range(count) if place in places and place not in known | without]
            for _, group in itertools.groupby(enumerate(missing), lambda pair: pair[1] - pair[0]):
                stretch = [place for _, place in group]
                if not {stretch[0] - 1, stretch[-1] + 1} <= without:
                    return [stretch[len(stretch) // 2]]
        return []

    def _search(self, place: int) -> None:
        """Find the paths at a value, and follow the cheapest of each exit unless it is known."""
        value = float(self.values[place])
        try:
            osc = self.line.at(self.osc, value)
            structure, names = self.structures[place] = self._structure(osc, value)
            source = None if self.analyzer.source is None else label_of(self.analyzer.source, names)
            result = dataclasses.replace(self.analyzer, source=source).run(osc, structure)
        except VibrokitError as error:
            self.findings.append(Finding.of(Code.NOTHING_AT, value=value, reason=str(error)))
            return
        least = dict[tuple[str, str], ActivationEnergy]()
        for branch in sorted(result.branches, key=lambda branch: (branch.source, branch.value)):
            exit_ = names[branch.source], goal_name(names, branch.target)
            if self.existing is None or exit_[0] in self.existing:
                least.setdefault(exit_, branch)
        with stage("exit paths", unit="paths", total=len(least)):
            for number, (exit_, branch) in enumerate(least.items()):
                if not any(branch.path is other.path for other in list(least.values())[:number]):
                    attractor = structure.attractors[branch.source]
                    problem = ExitProblem(osc, structure, attractor, self.analyzer.exit, self.analyzer.stepper)
                    self._add(place, exit_, problem, branch, follow=result.complete)
                advance()
        current().stop_again()

    def _structure(self, osc: Oscillator, value: float) -> tuple[Structure, tuple[str, ...]]:
        """The structure at a value, and the names of its attractors."""
        if self.structure_at is not None:
            found = self.structure_at(value)
        else:
            structure = find_structure(osc, manifolds=False, rng=self.seed)
            found = structure, structure.names
        current().stop_again()
        return found

    def _add(
        self, place: int, exit_: tuple[str, str], problem: ExitProblem, branch: ActivationEnergy, *, follow: bool
    ) -> None:
        """Add the curve of a path, unless it is known, and follow it unless there is no time left or it is known."""
        try:
            path = FollowedPath.of(problem, branch)
        except StructureError as error:
            self.findings.append(
                Finding.of(Code.NOTHING_AT, value=float(self.values[place]), reason=str(error))
            )  # fmt: skip
            return
        if any(place in curve.paths and path.is_same(curve.paths[place]) for curve in self.curves):
            return
        curve = _Curve(*exit_)
        self.curves.append(curve)
        self._keep(curve, place, path)
        for direction in (1, -1) if follow else ():
            here = place
            while 0 <= here + direction < len(self.values):
                if not self._followed(curve, here, here + direction):
                    break
                here += direction

    def _keep(self, curve: _Curve, place: int, path: FollowedPath) -> None:
        curve.paths[place] = path
        curve.slopes[place] = 0.0 if self.still else self.line.derivative(path.derivative)
        try:
            curve.errors[place] = path.error()
        except StructureError:
            curve.errors[place] = np.nan

    def _followed(self, curve: _Curve, here: int, there: int) -> bool:
        """Follow a curve from one value to the next; return whether that was possible."""
        at, end = float(self.values[here]), float(self.values[there])
        if reason := self.line.refusal(self.osc, end):
            nothing = Finding.of(Code.NOTHING_AT, value=end, reason=reason)
            self.findings += [] if nothing in self.findings else [nothing]
            return False
        if self.still:
            self._copy(curve, here, there)
            return True
        path, slope, least = curve.paths[here], curve.slopes[here], abs(end - at) / 64
        while at != end:
            length = min(curve.step, abs(end - at))
            ahead = end if length >= 0.99 * abs(end - at) else at + np.copysign(length, end - at)
            try:
                tried, tried_slope = self._step(path, slope, ahead - at, ahead)
            except (StructureError, ParameterError, SceneError) as error:
                curve.step = length / 2
                if curve.step < least:
                    curve.step = np.inf  # for the other direction
                    self._lost(curve, at, end, str(error))
                    return False
                continue
            path, slope, at, curve.step = tried, tried_slope, ahead, 2 * length
        try:
            path = path.completed()
            joined = self._joins(curve, here, there, path)
        except StructureError as error:
            self._lost(curve, float(self.values[here]), end, str(error))
            return False
        if joined:
            return False
        self._keep(curve, there, path)
        return True

    @staticmethod
    def _copy(curve: _Curve, here: int, there: int) -> None:
        curve.paths[there], curve.errors[there], curve.slopes[there] = curve.paths[here], curve.errors[here], 0.0

    def _joins(self, curve: _Curve, here: int, there: int, path: FollowedPath) -> bool:
        """Whether a curve goes on as one that began there; StructureError if the two differ before that."""
        for other in self.curves:
            if other is not curve and there in other.paths and path.is_same(other.paths[there]):
                if here in other.paths:  # nearby paths may be exchanged
                    raise StructureError("it coincides with another path from there on.")
                return True
        return False

    def _lost(self, curve: _Curve, value: float, following: float, reason: str) -> None:
        """Note that a curve ends between two values."""
        number = self.curves.index(curve)
        self.findings.append(
            Finding.of(
                Code.PATH_LOST, number, parameter=self.line.path, value=value, next=following, reason=reason
            )
        )  # fmt: skip

    def _step(self, path: FollowedPath, slope: float, change: float, value: float) -> tuple[FollowedPath, float]:
        """The path at another value, and the derivative of its action; StructureError if it may be another path."""
        ahead = path.at(self.line.at(self.osc, value))
        slope_ahead = self.line.derivative(ahead.derivative)
        moved = ahead.found.action - path.found.action
        predicted = change * (slope + slope_ahead) / 2
        # A tenth of the change is room for the trapezoidal rule, and 1e-6 of the action for rounding.
        allowed = 0.1 * max(abs(moved), abs(predicted)) + 1e-6 * path.found.action
        if not abs(moved - predicted) <= allowed:
            raise StructureError(
                f"the action changes by {moved:.3g} where its derivative predicts {predicted:.3g}: it is another path."
            )
        return ahead, slope_ahead

    def record(self, work: Work) -> EnergyContinuation:
        """Return the record of all that was found."""
        declared = self.line.entry.declared
        places = range(len(self.values))
        branches = tuple(
            EnergyBranch(
                source=curve.source,
                target=curve.target,
                action=np.array([curve.action(place) for place in places]),
                error=np.array([curve.errors.get(place, np.nan) for place in places]),
                derivative=np.array([curve.slopes.get(place, np.nan) for place in places]),
            )
            for curve in self.curves
        )
        settings = {
            "parameter": self.line.argument, "values": self.values.tolist(), "rng": self.seed,
            "search": [float(self.values[place]) for place in self.places], "analyzer": settings_of(self.analyzer),
        }  # fmt: skip
        count = Finding.of(
            Code.ENERGY_BRANCHES, branches=len(branches), values=len(self.values), parameter=self.line.path
        )
        found = EnergyContinuation(
            parameter=self.line.path,
            symbol=declared.symbol,
            unit=declared.unit,
            values=self.values,
            branches=branches,
            complete=not self.work.stopped,
            scene=scene_data(self.osc),
            settings=settings,
            findings=(count, *self.findings),
            stats=work.stats,
            seed=self.seed,
            seconds=work.seconds,
        )
        return dataclasses.replace(found, findings=(*found.findings, *_changes(found)))


def _changes(found: EnergyContinuation) -> list[Finding]:
    """Findings where another path becomes the cheapest."""
    exits = dict.fromkeys((branch.source, branch.target) for branch in found.branches)
    return [
        Finding.of(Code.LEAST_PATH_CHANGES, one.before, one.after, value=one.value, parameter=found.parameter)
        for source, target in exits
        for one in found.changes(source, target)
    ]
