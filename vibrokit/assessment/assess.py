"""assess: runs all analyzers on one scene within a time limit; each stage improves the answers."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from numbers import Integral
from typing import Any

import numpy as np

from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.exits import Exit, LeaveBasin
from vibrokit.arguments import members, real
from vibrokit.assessment.assessment import Assessment
from vibrokit.assessment.known import Known, Part
from vibrokit.assessment.ladder import barrier, ladder
from vibrokit.construction import called
from vibrokit.errors import ParameterError, SceneError, StructureError, VibrokitError, shown
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, Work, checked_time_limit, stage, working
from vibrokit.registry import Group, load
from vibrokit.results.atomic import checked_target
from vibrokit.results.codes import Code
from vibrokit.results.files import load_result
from vibrokit.results.finding import Finding
from vibrokit.results.merging import merged, part_of
from vibrokit.results.rated import RatedResult
from vibrokit.results.result import Result
from vibrokit.results.stoppable import Stoppable
from vibrokit.results.structure import Structure
from vibrokit.scene_file import scene_data
from vibrokit.structure.find import find_structure
from vibrokit.structure.validation import check_belongs, check_means, seed_of

METHODS = ("least-action", "mfet", "sgcm")
"""Analyzers that an assessment runs, in this order, by their registered names."""
TIME_LIMIT = 300.0
"""Default budget (s)."""

_PATHS = 0.4  # share of the time left that least action may take when rates are wanted too


@called
def assess(
    osc: Oscillator,
    *,
    accuracy: float = 0.1,
    time_limit: float | None = TIME_LIMIT,
    methods: Sequence[str] | None = None,
    source: int | str | None = None,
    exit: Exit | None = None,  # noqa: A002 - the name that analyzers use
    known: Any = (),
    checkpoint: str | os.PathLike[str] | None = None,
    rng: int = 0,
    executor: Executor | None = None,
    progress: Progress = None,
) -> Assessment:
    """Find the steady states of a scene and how long each lasts by several methods, and compare these methods.

    Steady states are found first, then paths of least action, then the exit rates of each state. Rates are computed at
    several noise intensities, at which simulation, splitting and densities overlap, and at that of the scene if it is
    in their range. On Ctrl-C, or when the time limit is reached, the assessment so far is returned, marked incomplete.

    Parameters
    ----------
    osc : Oscillator
    accuracy : float
        Relative error that is wanted of the bounds of ΔU, and of simulated mean times (half of their 95 % interval);
        above 0 and below 1. The intervals of the answers are the accuracy that was reached.
    time_limit : float, optional
        In seconds, 300 by default; None for as long as it takes.
    methods : sequence of str, optional
        Registered names of analyzers, by default ``("least-action", "mfet", "sgcm")``.
    source : int or str, optional
        Label or name of the state to leave; by default all.
    exit : Exit, optional
        What counts as leaving; by default `LeaveBasin`.
    known : Record, path, or iterable of these, optional
        A structure, results or assessments of this scene and this exit, as objects or as files. Those that are complete
        are not computed again. Results of an assessment of less accuracy count as incomplete.
    checkpoint : path, optional
        A file in which the assessment is saved after each of its stages. If it exists, it must hold an assessment, and
        is taken as known.
    rng : int
        Seed of the random starts of the search for steady states.
    executor : concurrent.futures.Executor, optional
        As for `Analyzer.run`.
    progress : bool or callable, optional

    Returns
    -------
    Assessment

    Raises
    ------
    ParameterError
        The accuracy, the methods, the source or the seed are not allowed.
    SceneError
        The scene has no noise.
    StructureError
        No state can be left in this way, a known record is of another scene, or the checkpoint holds another record.
    OutOfTime
        The time limit was reached before the steady states were found.
    """
    check_means(osc, None, executor)
    _check(accuracy, source)
    analyzers, seed = _analyzers(osc, methods, exit or LeaveBasin(), real(accuracy)), seed_of(rng)
    limit = checked_time_limit(time_limit)
    kept = None if checkpoint is None else checked_target(checkpoint)
    listed = members(known)
    given = (known,) if listed is None else listed
    if kept is not None and kept.exists():
        before = load_result(kept)
        if not isinstance(before, Assessment):
            raise StructureError(
                f"{kept} holds a record of kind {before.kind!r}, which an assessment would replace; give another file "
                "as the checkpoint, and this one as known."
            )
        given = (*given, before)
    last: Assessment | None = None
    with working(progress, limit) as work:
        road = _Road(osc, real(accuracy), limit, source, analyzers, seed, executor, work)
        road.take(Known.of(given, real(accuracy)))
        with Stoppable("the assessment") as stages:
            for assessment in road.stages():
                if kept is not None:
                    assessment.save(kept)
                last = assessment
        if last is None:  # the first stage yields one, or is stopped
            work.stop_again()
    assert last is not None
    return dataclasses.replace(
        last, complete=last.complete and not stages.stopped, findings=(*last.findings, *stages.findings)
    )


def _check(accuracy: Any, source: Any) -> None:
    if not 0 < real(accuracy) < 1:
        raise ParameterError(f"accuracy must be above 0 and below 1, got {shown(accuracy)}.")
    if source is not None and (not isinstance(source, str | Integral) or isinstance(source, bool) or source == ""):
        raise ParameterError(f"source must be the label or the name of a state, got {shown(source)}.")


def _analyzers(osc: Oscillator, methods: Any, exit: Exit, accuracy: float) -> dict[str, Analyzer]:  # noqa: A002
    """Return analyzers that are fitted to an accuracy, by their registered names."""
    names = METHODS if methods is None else members(methods)
    if not names:
        raise ParameterError(f"methods must be names of analyzers, such as {METHODS!r}, got {shown(methods)}.")
    if osc.noise is not None and not osc.noise.intensity > 0:
        raise SceneError("the noise of the scene has the intensity 0, so nothing is left; give it a positive one.")
    found = {name: load(Group.ANALYZERS, name, Analyzer)(exit=exit).for_accuracy(accuracy) for name in names}
    for one in found.values():
        one.check(osc)
    return found


@dataclasses.dataclass(eq=False)
class _Road:
    """Runs the stages of one assessment and keeps their results."""

    osc: Oscillator
    accuracy: float
    time_limit: float | None
    source: int | str | None
    analyzers: dict[str, Analyzer]
    seed: int
    executor: Executor | None
    work: Work
    structure: Structure | None = None
    parts: dict[tuple[str, int], Part] = dataclasses.field(default_factory=dict)  # by analyzer and by source
    left: list[Finding] = dataclasses.field(default_factory=list)
    complete: bool = False

    def take(self, known: Known) -> None:
        """Take what is known; raises StructureError if that is of another scene or another exit."""
        self.known = known
        known.check(self.osc, self._exit)
        for one in known.structures:
            check_belongs(self.osc, one)
            self.structure = one

    @property
    def _exit(self) -> Exit:
        return next(iter(self.analyzers.values())).exit

    def stages(self) -> Iterator[Assessment]:
        """Run what is wanted and not known, and yield the assessment after each stage."""
        if self.structure is None or not self.structure.complete:
            with stage("which states are there"):
                self.structure = find_structure(self.osc, rng=self.seed)
        structure = self.structure
        if not structure.complete or not structure.attractors:
            yield self._assessment()
            return
        self.parts = self.known.parts(self.osc, structure)
        yield self._assessment()
        for analyzer in self.analyzers.values():
            analyzer.exit.check(self.osc, structure)
        labels = range(len(structure.attractors)) if self.source is None else [structure.attractor(self.source).label]
        rated = {name: one for name, one in self.analyzers.items() if one.takes_intensities}
        others = [name for name in self.analyzers if name not in rated]
        ran = True
        for number, name in enumerate(others):
            paths = dataclasses.replace(self.analyzers[name], source=self.source)
            ran &= self._run(name, paths, labels, _PATHS if rated else 1.0 / (len(others) - number))
            yield self._assessment()
        order = sorted(labels, key=self._energy)
        runs = [(name, label) for label in order for name in rated]
        waiting, repeated = list(runs), False
        while waiting:
            name, label = waiting.pop(0)
            chosen: dict[str, Any] = {"source": label, "intensities": self._intensities(label)}
            rates = dataclasses.replace(rated[name], **chosen)
            ran &= self._run(name, rates, [label], 1.0 / (len(waiting) + 1))
            if not (waiting or repeated or self.work.over):
                waiting, repeated = self._open(runs), True
            yield self._assessment()
        asked = ((name, label) for name, label in self.parts if name in self.analyzers and label in labels)
        self.complete = ran and all(self._is_known(name, label) for name, label in asked)
        yield self._assessment()

    def _open(self, runs: Sequence[tuple[str, int]]) -> list[tuple[str, int]]:
        """Runs that the limit ended, if each can now have more time than it had."""
        if self.time_limit is None:
            return []
        left = self.time_limit - self.work.seconds
        ended = [run for run in runs if run in self.parts and not self.parts[run][0].complete]
        return [run for run in ended if self.parts[run][0].seconds < left / len(ended)]

    def _run(self, name: str, analyzer: Analyzer, labels: Sequence[int], share: float) -> bool:
        """Run one analyzer in a share of the time left, unless as much is known; return whether there was time."""
        assert self.structure is not None
        if all(self._is_known(name, label) for label in labels):
            return True
        subject = "" if analyzer.source is None else self.structure.names[labels[0]]
        if self.work.over:
            self._leave(name, subject, "the work was stopped before.")
            return False
        limit = None if self.time_limit is None else share * (self.time_limit - self.work.seconds)
        try:
            with stage("how it is left" if not subject else "how long it lasts", subject=subject):
                found = analyzer.run(self.osc, self.structure, executor=self.executor, time_limit=limit)
        except VibrokitError as error:
            self._leave(name, subject, str(error))
            return True
        for label in labels:
            known, part = self.parts.get((name, label)), part_of(found, label)
            if part.complete:
                self.parts[name, label] = part, self.accuracy
            elif known is None or (math.isinf(known[1]) and _content(part) > _content(known[0])):
                self.parts[name, label] = part, math.inf
        return True

    def _is_known(self, name: str, label: int) -> bool:
        """Whether an analysis came to its end for the accuracy that is self."""
        return (name, label) in self.parts and self.parts[name, label][1] <= self.accuracy

    def _leave(self, name: str, subject: str, reason: str) -> None:
        which = f"{name} of {subject}" if subject else name
        self.left.append(Finding.of(Code.ANALYZER_NOT_RUN, analyzer=which, reason=reason))

    def _intensities(self, label: int) -> tuple[float, ...] | None:
        """Noise intensities for one state; without an energy None, for those that analyzers have by default."""
        assert self.osc.noise is not None
        energy = self._energy(label)
        return ladder(energy, self.osc.noise.intensity) if 0 < energy < math.inf else None

    def _energy(self, label: int) -> float:
        """ΔU of the exit that decides how long a state lasts, by methods without rates; infinite if none is known.

        An energy that follows from rates would give each method another ladder, and no intensity in common. One with an
        error as large as itself tells no intensity.
        """
        known = (one for (_, source), (one, _) in self.parts.items() if source == label)
        own = (e for one in known if not isinstance(one, RatedResult) for e in one.energies if e.source == label)
        assert self.osc.noise is not None
        return barrier([e.value for e in own if not e.numerical_error >= e.value], self.osc.noise.intensity)

    def _assessment(self) -> Assessment:
        assert self.structure is not None
        results, reached = {}, {}
        for name in dict.fromkeys(name for name, _ in self.parts):
            own = {label: part for (other, label), part in sorted(self.parts.items()) if other == name}
            results[name] = merged([part for part, _ in own.values()])
            reached[name] = np.full(len(self.structure.names), np.inf)
            reached[name][list(own)] = [accuracy for _, accuracy in own.values()]
        return Assessment(
            scene=scene_data(self.osc),
            settings={"accuracy": self.accuracy, "time_limit": self.time_limit, "methods": list(self.analyzers)},
            findings=tuple(self.left),
            stats=self.work.stats,
            complete=self.complete,
            seed=self.seed,
            seconds=self.work.seconds,
            structure=self.structure,
            results=results,
            reached=reached,
        )


def _content(found: Result) -> int:
    """Number of energies and rates: of two incomplete results, the one with more is kept."""
    return len(found.energies) + len(found.rates)
