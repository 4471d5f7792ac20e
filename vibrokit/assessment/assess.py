"""assess: runs all analyzers on one scene within a time limit; each stage improves the answers."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from typing import Any

import numpy as np

from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.exits import Exit, LeaveBasin
from vibrokit.arguments import members
from vibrokit.assessment.assessment import Assessment
from vibrokit.assessment.known import Known, Part
from vibrokit.assessment.ladder import barrier, ladder
from vibrokit.assessment.request import Request
from vibrokit.construction import called
from vibrokit.errors import StructureError, VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, Work, stage, working
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
from vibrokit.structure.validation import check_belongs

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
    request = Request.of(
        osc, accuracy=accuracy, time_limit=time_limit, methods=methods, source=source, exit=exit or LeaveBasin(),
        rng=rng, executor=executor,
    )  # fmt: skip
    with working(progress, request.time_limit) as work:
        return assessed(osc, request, work, known, checkpoint)


def assessed(
    osc: Oscillator,
    request: Request,
    work: Work,
    known: Any = (),
    checkpoint: str | os.PathLike[str] | None = None,
) -> Assessment:
    """Return the last assessment that was reached, and save it after each stage.

    `work` is the work under way. If it is stopped before there is an assessment, its KeyboardInterrupt is raised.
    """
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
    with Stoppable("the assessment") as road:
        for assessment in _Road(osc, request, work, given).stages():
            if kept is not None:
                assessment.save(kept)
            last = assessment
    if last is None:  # the first stage yields one, or is stopped
        work.stop_again()
    assert last is not None
    return dataclasses.replace(
        last, complete=last.complete and not road.stopped, findings=(*last.findings, *road.findings)
    )


class _Road:
    """Runs the stages of one assessment and keeps their results."""

    def __init__(self, osc: Oscillator, request: Request, work: Work, known: Sequence[Any]) -> None:
        self.osc, self.request, self.work = osc, request, work
        self.structure: Structure | None = None
        self.parts: dict[tuple[str, int], Part] = {}  # by analyzer and by source
        self.left: list[Finding] = []
        self.complete = False
        self.known = Known.of(known, request.accuracy)
        self.known.check(osc, next(iter(request.analyzers.values())).exit)
        for one in self.known.structures:
            check_belongs(osc, one)
            self.structure = one

    def stages(self) -> Iterator[Assessment]:
        """Run what is wanted and not known, and yield the assessment after each stage."""
        wanted = self.request
        if self.structure is None or not self.structure.complete:
            with stage("which states are there"):
                self.structure = find_structure(self.osc, rng=wanted.rng)
        structure = self.structure
        if not structure.complete or not structure.attractors:
            yield self._assessment()
            return
        self.parts = self.known.parts(self.osc, structure, next(iter(wanted.analyzers.values())).exit)
        yield self._assessment()
        for analyzer in wanted.analyzers.values():
            analyzer.exit.check(self.osc, structure)
        labels = (
            range(len(structure.attractors)) if wanted.source is None else [structure.attractor(wanted.source).label]
        )
        rated = {name: one for name, one in wanted.analyzers.items() if one.takes_intensities}
        others = [name for name in wanted.analyzers if name not in rated]
        ran = True
        for number, name in enumerate(others):
            paths = dataclasses.replace(wanted.analyzers[name], source=wanted.source)
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
        asked = ((name, label) for name, label in self.parts if name in wanted.analyzers and label in labels)
        self.complete = ran and all(self._is_known(name, label) for name, label in asked)
        yield self._assessment()

    def _open(self, runs: Sequence[tuple[str, int]]) -> list[tuple[str, int]]:
        """Runs that the limit ended, if each can now have more time than it had."""
        if self.request.time_limit is None:
            return []
        left = self.request.time_limit - self.work.seconds
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
        limit = None if self.request.time_limit is None else share * (self.request.time_limit - self.work.seconds)
        try:
            with stage("how it is left" if not subject else "how long it lasts", subject=subject):
                found = analyzer.run(self.osc, self.structure, executor=self.request.executor, time_limit=limit)
        except VibrokitError as error:
            self._leave(name, subject, str(error))
            return True
        for label in labels:
            known, part = self.parts.get((name, label)), part_of(found, label)
            if part.complete:
                self.parts[name, label] = part, self.request.accuracy
            elif known is None or (math.isinf(known[1]) and _content(part) > _content(known[0])):
                self.parts[name, label] = part, math.inf
        return True

    def _is_known(self, name: str, label: int) -> bool:
        """Whether an analysis came to its end for the accuracy that is wanted."""
        return (name, label) in self.parts and self.parts[name, label][1] <= self.request.accuracy

    def _leave(self, name: str, subject: str, reason: str) -> None:
        which = f"{name} of {subject}" if subject else name
        self.left.append(Finding.of(Code.ANALYZER_NOT_RUN, analyzer=which, reason=reason))

    def _intensities(self, label: int) -> tuple[float, ...] | None:
        """Noise intensities for one state; without an energy None, for those that analyzers have by default."""
        assert self.osc.noise is not None
        energy, own = self._energy(label), self.osc.noise.intensity
        if math.isinf(energy) or not energy > 0:
            return None
        return ladder(energy, own)

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
        wanted = self.request
        return Assessment(
            scene=scene_data(self.osc),
            settings={
                "accuracy": wanted.accuracy,
                "time_limit": wanted.time_limit,
                "methods": list(wanted.analyzers),
            },
            findings=tuple(self.left),
            stats=self.work.stats,
            complete=self.complete,
            seed=wanted.rng,
            seconds=self.work.seconds,
            structure=self.structure,
            results=results,
            reached=reached,
        )


def _content(found: Result) -> int:
    """Number of energies and rates: of two incomplete results, the one with more is kept."""
    return len(found.energies) + len(found.rates)
