"""assess: runs all analyzers on one scene within a time limit; each stage improves the answers."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from concurrent.futures import Executor
from numbers import Integral
from pathlib import Path
from typing import Any

from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.exits import Exit, LeaveBasin
from vibrokit.arguments import members, real
from vibrokit.assessment.assessment import Assessment
from vibrokit.assessment.known import Known
from vibrokit.assessment.road import Road
from vibrokit.construction import called
from vibrokit.errors import ParameterError, SceneError, StructureError, shown
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, checked_time_limit, working
from vibrokit.registry import Group, load
from vibrokit.results.atomic import checked_target
from vibrokit.results.files import load_result
from vibrokit.results.stoppable import Stoppable
from vibrokit.structure.validation import check_means, seed_of

METHODS = ("least-action", "mfet", "sgcm")
"""Analyzers that an assessment runs, in this order, by their registered names."""
TIME_LIMIT = 300.0
"""Default budget (s)."""


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
    last: Assessment | None = None
    with working(progress, limit) as work:
        given = Known.of(_given(known, kept), real(accuracy))
        road = Road(osc, real(accuracy), limit, source, analyzers, seed, executor, work, given)
        with Stoppable("the assessment") as stages:
            for last in road.stages():
                if kept is not None:
                    last.save(kept)
        if last is None:  # the first stage yields one, or is stopped
            work.stop_again()
    assert last is not None
    return dataclasses.replace(
        last, complete=last.complete and not stages.stopped, findings=(*last.findings, *stages.findings)
    )


def _given(known: Any, checkpoint: Path | None) -> tuple[Any, ...]:
    """What is known before: records and files, and the checkpoint if it exists."""
    listed = members(known)
    given = (known,) if listed is None else listed
    if checkpoint is None or not checkpoint.exists():
        return given
    before = load_result(checkpoint)
    if not isinstance(before, Assessment):
        raise StructureError(
            f"{checkpoint} holds a record of kind {before.kind!r}, which an assessment would replace; give another "
            "file as the checkpoint, and this one as known."
        )
    return (*given, before)


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
