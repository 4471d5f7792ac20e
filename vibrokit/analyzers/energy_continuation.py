"""Continuation of activation energies in one parameter: exit paths are followed from value to value."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.least_action import LeastAction
from vibrokit.analyzers.polishing.followed_path import FollowedPath
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.settings import settings_of
from vibrokit.construction import called
from vibrokit.errors import ParameterError, StructureError, VibrokitError, shown
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, Work, advance, current, stage, working
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.energy_continuation import EnergyBranch, EnergyContinuation
from vibrokit.results.finding import Finding
from vibrokit.results.labels import goal_name
from vibrokit.results.stoppable import Stoppable
from vibrokit.scene_file import scene_data
from vibrokit.structure.find import find_structure
from vibrokit.structure.parameter_values import ParameterLine, ordered_values, parameter_line
from vibrokit.structure.validation import check_means, seed_of

_CALLER = "energy_continuation"
_SHORTEST = 1 / 64  # of the distance between two values: shortest step, after which a path counts as lost
_TRAPEZOID = 0.1  # of a step's change: difference from what the derivatives predict, of a path that is still the same
_ROUNDING_OF_VALUES = 1e-12  # relative, as of linspace
_ROUNDING = 1e-6  # of an action: the same, where the change is small

Array = NDArray[np.float64]


@called
def energy_continuation(
    osc: Oscillator,
    parameter: str | Mapping[str, float],
    values: Sequence[float],
    *,
    analyzer: LeastAction | None = None,
    search: Sequence[float] | None = None,
    rng: int | np.random.Generator = 0,
    progress: Progress = None,
    time_limit: float | None = None,
) -> EnergyContinuation:
    """Follow the exit paths of a scene, and so its activation energies, along values of one parameter.

    At a few values the structure and all exit paths are searched for. Each path is then followed to the other values:
    Newton's method solves for it from the path at the value before. A step is halved until the change of the action
    agrees with its derivative at both ends, so that a path is not exchanged for another one. Where paths cost the same,
    the least action passes from one to the other; a path that does not exist at any searched value is not found.

    On Ctrl-C, or when the time limit is reached, what was found so far is returned, marked incomplete.

    Parameters
    ----------
    osc : Oscillator
    parameter : str or dict of str to float
        A parameter that does not shape the equations: a key of ``osc.parameters``, or the end of exactly one; or the
        factors of several, as of `continuation`.
    values : sequence of float
        Finite and distinct; they are taken in ascending order.
    analyzer : LeastAction, optional
        Finds the paths, with its source and its exit; by default ``LeastAction()``.
    search : sequence of float, optional
        Those of the values at which paths are searched for; by default the one nearest to the parameter's own value,
        the first and the last.
    rng : int or numpy.random.Generator
        Seed of the structures.
    progress : bool or callable, optional
        True shows progress on standard error; a function is called with each `vibrokit.progress.Update`.
    time_limit : float, optional
        In seconds.

    Returns
    -------
    EnergyContinuation

    Raises
    ------
    ParameterError
        An unknown or ambiguous parameter, one that shapes the equations, or values that are not numbers.
    SceneError
        The scene has no noise.
    StructureError
        The analyzer is no `LeastAction`, or no exit path was found at any searched value.

    Examples
    --------
    >>> import vibrokit as vk
    >>> osc = vk.load_scene("hertz-0.570")
    >>> along = vk.energy_continuation(osc, "excitations.0.frequency", [0.56, 0.57, 0.58])  # doctest: +SKIP
    >>> along.energy("clear", "hammering")  # doctest: +SKIP
    """
    check_means(osc, None, None)
    line, numbers = parameter_line(_CALLER, osc, parameter), ordered_values(_CALLER, values)
    chosen = LeastAction() if analyzer is None else analyzer
    if not isinstance(chosen, LeastAction):
        raise StructureError(f"{_CALLER}: analyzer must be a LeastAction, got {shown(analyzer)}.")
    chosen.check(osc)
    places = _places(numbers, search, line.own)
    seed = seed_of(rng)
    with working(progress, time_limit) as work:
        run = _Run(osc, line, numbers, chosen, places, seed)
        run.run()
        declared = line.entry.declared
        return run.record(work, symbol=declared.symbol, unit=declared.unit)


def _places(values: Array, search: Any, own: float) -> list[int]:
    """Indices of the values to search at, the nearest to the scene's own value first."""
    if search is None:
        nearest = int(np.argmin(np.abs(values - own)))
        return list(dict.fromkeys([nearest, 0, len(values) - 1]))
    found = []
    for value in ordered_values(f"{_CALLER}: search", search):
        place = int(np.argmin(np.abs(values - value)))
        if not np.isclose(values[place], value, rtol=_ROUNDING_OF_VALUES, atol=0):
            raise ParameterError(f"{_CALLER}: search must contain some of the values, and {value:g} is none of them.")
        found.append(place)
    return sorted(found, key=lambda place: abs(values[place] - own))


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


class _Run:
    """Searches, follows, and keeps what each has found."""

    def __init__(
        self, osc: Oscillator, line: ParameterLine, values: Array, analyzer: LeastAction, places: list[int], seed: int
    ) -> None:
        self.osc, self.line, self.values, self.analyzer = osc, line, values, analyzer
        self.places, self.seed = places, seed
        self.curves: list[_Curve] = []
        self.findings: list[Finding] = []
        self.work = Stoppable("searched values")

    def run(self) -> None:
        """Search at each of the places, and follow what is new from there."""
        with self.work as work, stage("searched values", unit="values", total=len(self.places)):
            for place in self.places:
                self._search(place)
                advance()
        self.findings += work.findings
        if not (self.curves or work.stopped):
            reasons = [str(finding) for finding in self.findings] or ["all paths lead from sets that are no orbits."]
            raise StructureError(f"{_CALLER}: no exit path was found at any searched value. {reasons[0]}")

    def _search(self, place: int) -> None:
        """Find the paths at a value, and follow those that are not known yet."""
        value = float(self.values[place])
        try:
            osc = self.line.at(self.osc, value)
            structure = find_structure(osc, manifolds=False, rng=self.seed)
            current().stop_again()
            result = self.analyzer.run(osc, structure)
        except VibrokitError as error:
            self.findings.append(Finding.of(Code.NOTHING_AT, value=value, reason=str(error)))
            return
        branches = result.branches
        with stage("exit paths", unit="paths", total=len(branches)):
            for number, branch in enumerate(branches):
                if not any(branch.path is other.path for other in branches[:number]):
                    attractor = structure.attractors[branch.source]
                    problem = ExitProblem(osc, structure, attractor, self.analyzer.exit, self.analyzer.stepper)
                    self._add(place, problem, branch, follow=result.complete)
                advance()
        current().stop_again()

    def _add(self, place: int, problem: ExitProblem, branch: ActivationEnergy, *, follow: bool) -> None:
        """Add the curve of a path, unless it is known, and follow it unless there is no time left."""
        try:
            path = FollowedPath.of(problem, branch)
        except StructureError:
            return
        if any(place in curve.paths and path.is_same(curve.paths[place]) for curve in self.curves):
            return
        names = problem.structure.names
        curve = _Curve(names[branch.source], goal_name(names, branch.target))
        self.curves.append(curve)
        self._keep(curve, place, path)
        for direction in (1, -1) if follow else ():
            here = place
            while 0 <= here + direction < len(self.values):
                if not self._followed(curve, here, here + direction):
                    break
                here += direction

    def _keep(self, curve: _Curve, place: int, path: FollowedPath) -> None:
        curve.paths[place], curve.slopes[place] = path, self.line.derivative(path.derivative)
        try:
            curve.errors[place] = path.error()
        except StructureError:
            curve.errors[place] = np.nan

    def _followed(self, curve: _Curve, here: int, there: int) -> bool:
        """Follow a curve from one value to the next; return whether that was possible."""
        at, end = float(self.values[here]), float(self.values[there])
        path, slope, least = curve.paths[here], curve.slopes[here], _SHORTEST * abs(end - at)
        while at != end:
            length = min(curve.step, abs(end - at))
            ahead = end if length >= 0.99 * abs(end - at) else at + np.copysign(length, end - at)
            try:
                tried, tried_slope = self._step(path, slope, ahead - at, ahead)
            except StructureError as error:
                curve.step = length / 2
                if curve.step < least:
                    curve.step = np.inf  # for the other direction
                    self._lost(curve, at, end, error)
                    return False
                continue
            path, slope, at, curve.step = tried, tried_slope, ahead, 2 * length
        try:
            path = path.completed()
            self._check_distinct(curve, here, there, path)
        except StructureError as error:
            self._lost(curve, float(self.values[here]), end, error)
            return False
        self._keep(curve, there, path)
        return True

    def _check_distinct(self, curve: _Curve, here: int, there: int, path: FollowedPath) -> None:
        """Raise StructureError if a curve has become one that it differed from: nearby paths may be exchanged."""
        for other in self.curves:
            if other is not curve and {here, there} <= set(other.paths) and path.is_same(other.paths[there]):
                raise StructureError("it coincides with another path from there on.")

    def _lost(self, curve: _Curve, value: float, following: float, error: StructureError) -> None:
        """Note that a curve ends between two values."""
        number = self.curves.index(curve)
        self.findings.append(
            Finding.of(
                Code.PATH_LOST, number, parameter=self.line.path, value=value, next=following, reason=str(error)
            )
        )  # fmt: skip

    def _step(self, path: FollowedPath, slope: float, change: float, value: float) -> tuple[FollowedPath, float]:
        """The path at another value, and the derivative of its action; StructureError if it may be another path."""
        ahead = path.at(self.line.at(self.osc, value))
        slope_ahead = self.line.derivative(ahead.derivative)
        moved = ahead.found.action - path.found.action
        predicted = change * (slope + slope_ahead) / 2
        allowed = _TRAPEZOID * max(abs(moved), abs(predicted)) + _ROUNDING * path.found.action
        if not abs(moved - predicted) <= allowed:
            raise StructureError(
                f"the action changes by {moved:.3g} where its derivative predicts {predicted:.3g}: it is another path."
            )
        return ahead, slope_ahead

    def record(self, work: Work, *, symbol: str, unit: str | None) -> EnergyContinuation:
        """Return the record of all that was found."""
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
            symbol=symbol,
            unit=unit,
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
