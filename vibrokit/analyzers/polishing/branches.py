"""Branches: all candidates of one attractor polished, each way out once, ranked and certified."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Sequence

import numpy as np

from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.exits import Exit
from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.certify import certify
from vibrokit.analyzers.polishing.course import course_of
from vibrokit.analyzers.polishing.destinations import Destination, Goal
from vibrokit.analyzers.polishing.ends import linear_end
from vibrokit.analyzers.polishing.heteroclinic import Polisher
from vibrokit.analyzers.polishing.newton import Extremum
from vibrokit.analyzers.polishing.trace import traced
from vibrokit.errors import StructureError
from vibrokit.kernels.choice import single_stepper
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy, ExitPath
from vibrokit.results.structure import Structure
from vibrokit.structure.orbits import Orbit
from vibrokit.symbolic.flow_kind import Flow

METHOD = "least action"
_BEYOND = 32  # section intervals that a candidate is followed without noise
_NEAR = 3.0  # times the distance to the nearest saddle: others so near are tried too
_PIECES = (8, 16)  # in a section interval: the finer ones where the coarser ones do not converge
_EQUAL = 1e-6  # relative difference of the actions of one path, found twice
_SAME = 0.05  # of its extent, at samples of the path
_ROUNDS = 4  # how often a path is ended at an earlier touch
_WORTH = 1.25  # times the least action known
_CHEAPER = 1e-3  # of it
_TRIES = 2  # candidates for a goal that the cheaper ones do not come to
_FLAT, _ALIKE = 1e-3, 0.01
_ROUNDING = 1e-12  # of an action, which is a sum of thousands

_Solved = tuple[Goal, Carrier, Extremum, ExitPath]


@dataclasses.dataclass(frozen=True, eq=False)
class Polished:
    """What came of the candidates of one attractor.

    Attributes
    ----------
    branches : tuple of ActivationEnergy
        Each way out once, the cheapest first, with path, saddle and certificate.
    words : tuple of str
        What could not be polished and why, and what is to be known of the branches, as sentences.
    """

    branches: tuple[ActivationEnergy, ...]
    words: tuple[str, ...]


class _Goals:
    """The goals of one attractor, each with what has to be prepared for it once."""

    def __init__(self, osc: Oscillator, goals: Sequence[Goal], point: np.ndarray, period: int, stepper: Stepper | None):
        self.osc, self.goals, self.point, self.period, self.stepper = osc, goals, point, period, stepper
        self._known: dict[tuple[int, int], tuple[Polisher, Destination]] = {}

    def prepared(self, number: int, pieces: int) -> tuple[Polisher, Destination]:
        """What polishes paths to a goal, and the goal as their destination."""
        if (number, pieces) not in self._known:
            scene = self.goals[number].scene(self.osc)
            stepper = self.stepper or single_stepper(scene, Flow.HAMILTONIAN_VARIATIONAL)
            carrier = Carrier(scene, stepper, pieces)
            source = linear_end(carrier, self.point, self.period)
            self._known[number, pieces] = Polisher(carrier, source), self.goals[number].destination(carrier)
        return self._known[number, pieces]

    def near(self, candidate: Candidate) -> list[int]:
        """The goals that a candidate comes near, the nearest first."""
        distances = []
        for number in range(len(self.goals)):
            polisher, destination = self.prepared(number, _PIECES[0])
            distances.append(destination.distance(course_of(polisher.carrier, candidate, _BEYOND)))
        order = [int(number) for number in np.argsort(distances) if np.isfinite(distances[number])]
        return [number for number in order if distances[number] <= _NEAR * distances[order[0]]]

    def solve(self, number: int, candidate: Candidate, known: Sequence[_Solved]) -> _Solved:
        """Polish a candidate towards a goal, with finer pieces if need be; more is tried for one that is cheaper."""
        least = min((found.action for goal, _, found, _ in known if goal is self.goals[number]), default=np.inf)
        for pieces in _PIECES:
            try:
                return self._solve(number, candidate, pieces, (1 - _CHEAPER) * least)
            except StructureError as error:
                failure = error
        raise failure

    def _solve(self, number: int, candidate: Candidate, pieces: int, worth: float) -> _Solved:
        polisher, destination = self.prepared(number, pieces)
        carrier = polisher.carrier
        for _ in range(_ROUNDS):
            found = polisher.polished(destination.cuts(course_of(carrier, candidate, _BEYOND)), worth)
            if not found.action > 0:
                raise StructureError(f"the path it leads to has the action {found.action:.3g}, so it does not leave.")
            path = traced(carrier, found)
            end = destination.earlier(path)
            if end is None:
                return self.goals[number], carrier, found, path
            candidate = dataclasses.replace(candidate, times=path.t[: end + 1], states=path.q[: end + 1])
        raise StructureError(f"ended {_ROUNDS} times where it first was at its goal, it still comes there before.")


def polish_all(
    osc: Oscillator,
    structure: Structure,
    label: int,
    candidates: Sequence[Candidate],
    exit: Exit,  # noqa: A002 - the word of all analyzers
    stepper: Stepper | None = None,
    progress: Progress | None = None,
    *,
    orbit: Orbit | None = None,
) -> Polished:
    """Polish candidates to certified exit paths.

    Parameters
    ----------
    osc : Oscillator
    structure : Structure
    label : int
        Of the attractor that is left.
    candidates : sequence of Candidate
    exit : Exit
        What counts as leaving, which says what a path ends on.
    stepper : Stepper, optional
        By default one that locates contacts.
    progress : callable, optional
        Called with (candidates done, candidates in all).
    orbit : Orbit, optional
        The orbit to leave: for an attractor that is none itself, an unstable one inside it. An exit from there costs
        at least what it costs to leave the attractor.

    Returns
    -------
    Polished

    Raises
    ------
    StructureError
        The attractor is no orbit and none is given, or the orbit is not hyperbolic.
    StepperError
        The stepper cannot follow Hamilton's equations of this scene.
    """
    attractor = structure.attractor(label)
    goals, words = exit.goals(osc, structure, label)
    at_once = [goal for goal in goals if goal.reached(attractor)]
    if at_once:
        return Polished((_free(label, at_once[0]),), (f"Attractor {label} is at the exit without noise.",))
    point, period = _start(attractor, orbit)
    work = _Goals(osc, goals, point, period, stepper)
    solved: list[_Solved] = []
    said, left = list(words), 0
    for done, candidate in enumerate(sorted(candidates, key=lambda each: each.action), start=1):
        if _too_dear(candidate, solved):
            left += 1
        else:
            found, failures = _polish_one(work, candidate, solved)
            solved += [each for each in found if not any(_same(each, known) for known in solved)]
            said += [] if found else [_failed(candidate, failures)]
        if progress is not None:
            progress(done, len(candidates))
    if left:
        said.append(
            f"Attractor {label}: {left} of {len(candidates)} candidates cost over {_WORTH:g} times the least path "
            "known and were not polished."
        )
    solved += _the_rest(work, candidates, solved)
    branches, unsure = _certified(label, solved)
    return Polished(branches, (*said, *unsure, *_valleys(branches)))


def _start(attractor: Attractor, orbit: Orbit | None) -> tuple[np.ndarray, int]:
    if orbit is not None:
        return orbit.point, orbit.period
    if not attractor.is_fixed:
        raise StructureError(
            f"attractor {attractor.label} is {attractor.kind}, and a path is polished from an orbit or an equilibrium; "
            "give an unstable orbit inside it."
        )
    return attractor.points[0], attractor.period


def _polish_one(work: _Goals, candidate: Candidate, known: Sequence[_Solved]) -> tuple[list[_Solved], list[str]]:
    """What a candidate leads to: the paths, and why there are none."""
    found, failures = [], []
    try:
        for number in work.near(candidate):
            try:
                found.append(work.solve(number, candidate, known))
            except StructureError as error:
                failures.append(str(error))
    except StructureError as error:
        failures.append(str(error))
    return found, failures or ["it comes to no goal."]


def _the_rest(work: _Goals, candidates: Sequence[Candidate], solved: list[_Solved]) -> list[_Solved]:
    """Paths to goals that no candidate came to, tried from those that come near them and from the cheapest one."""
    found: list[_Solved] = []
    reached = [each[0] for each in solved]
    ranked = sorted(candidates, key=lambda each: each.action)
    for number, goal in enumerate(work.goals):
        if goal in reached:
            continue
        near = [candidate for candidate in ranked if _comes_near(work, number, candidate)]
        for candidate in [*near[:_TRIES], *ranked[:1]]:
            try:
                found.append(work.solve(number, candidate, ()))
                break
            except StructureError:
                continue
    return found


def _comes_near(work: _Goals, number: int, candidate: Candidate) -> bool:
    with contextlib.suppress(StructureError):
        return number in work.near(candidate)
    return False


def _too_dear(candidate: Candidate, solved: list[_Solved]) -> bool:
    """Whether a path to the same target is known that costs far less."""
    known = [found.action for goal, _, found, _ in solved if candidate.target in goal.targets]
    return bool(known) and candidate.action > _WORTH * min(known)


def _failed(candidate: Candidate, failures: list[str]) -> str:
    return f"A candidate of the {candidate.finder} with action {candidate.action:.4g} led to no path: {failures[0]}"


def _certified(label: int, solved: list[_Solved]) -> tuple[tuple[ActivationEnergy, ...], list[str]]:
    branches, words = [], []
    for goal, carrier, found, path in solved:
        try:
            certificate = certify(carrier, found)
        except StructureError as error:
            words.append(f"A path of action {found.action:.6g} was found that has no certificate: {error}")
            continue
        unsure = certificate.error + _ROUNDING * found.action
        if found.source.held:
            words.append(
                f"The path of action {found.action:.6g} starts on the orbit itself, {certificate.periods:.0f} periods "
                "before its end: motion is linear nowhere near. The least action is at most that."
            )
        branches += [
            ActivationEnergy(
                source=label,
                target=target,
                value=found.action,
                lower=max(0.0, found.action - unsure),
                upper=found.action + unsure,
                method=METHOD,
                residual=certificate.residual,
                path=path,
                saddle=goal.saddle,
                certificate=certificate,
            )
            for target in goal.targets
        ]
    return tuple(sorted(branches, key=lambda branch: branch.value)), words


def _free(label: int, goal: Goal) -> ActivationEnergy:
    return ActivationEnergy(label, goal.targets[0], 0.0, 0.0, 0.0, METHOD, 0.0, saddle=goal.saddle)


def _same(one: _Solved, other: _Solved) -> bool:
    """Whether two paths are one, shifted in time: they cost the same, and where half is paid they are at one place."""
    first, second = one[2], other[2]
    if one[0] is not other[0] or abs(first.action - second.action) > _EQUAL * first.action:
        return False
    path, known = one[3], other[3]
    middle = min(int(np.searchsorted(path.action, 0.5 * first.action)), len(path.t) - 1)
    place = np.concatenate([path.q[middle], path.p[middle]])
    apart = np.abs((np.hstack([known.q, known.p]) - place) / first.scale).max(axis=1)
    return bool(apart.min() < _SAME)


def _valleys(branches: Sequence[ActivationEnergy]) -> list[str]:
    """Say where the least action is not sharply one path's."""
    words = []
    if branches:
        best = branches[0]
        alike = [branch.value for branch in branches[1:] if branch.value <= (1 + _ALIKE) * best.value]
        if alike:
            ways = "1 more way out costs" if len(alike) == 1 else f"{len(alike)} more ways out cost"
            words.append(
                f"Attractor {best.source}: {ways} at most {100 * _ALIKE:g} % more than the "
                f"least, {best.value:.6g}: {', '.join(f'{value:.6g}' for value in alike)}."
            )
        angle = 1.0 if best.certificate is None else best.certificate.transversality
        if angle < _FLAT:
            words.append(
                f"Attractor {best.source}: the manifolds meet at a sine of {angle:.1e} only, so the action hardly "
                "changes along a family of paths; small noise takes all of them."
            )
    return words
