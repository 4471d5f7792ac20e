"""Analyzer: a way to find activation energies."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np

from vibrokit.analyzers.exits import Exit
from vibrokit.errors import SceneError, StructureError, shown
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.structure.orbits import refine_orbit
from vibrokit.structure.request import check_belongs, check_means
from vibrokit.symbolic.flow_kind import Flow

_FINER = 5

Found = TypeVar("Found")


@dataclasses.dataclass(frozen=True)
class Analyzer(ABC):
    """One method behind a common face: configuration in the fields, no hidden state. Abstract.

    For developers
    --------------
    Write `run`, return a `Result`, and register the class under the entry-point group ``vibrokit.analyzers``: then
    ``vibrokit run SCENE --analyzer NAME`` knows it.
    """

    @abstractmethod
    def run(self, osc: Oscillator, structure: Structure, *, progress: Progress | None = None) -> Result:
        """Analyze a scene whose structure is known.

        Parameters
        ----------
        osc : Oscillator
        structure : Structure
        progress : callable, optional
            Called with (work done, work in all).
        """


def checked_sources(
    osc: Oscillator,
    structure: Structure,
    exit: Any,  # noqa: A002 - the word of all analyzers
    source: int | None,
    stepper: Any,
    progress: Any,
) -> tuple[Attractor, ...]:
    """Check what every search for exits is given, before any work is done, and return the attractors to leave.

    Raises
    ------
    SceneError
        The scene has no noise.
    StructureError
        The structure is of another scene, the exit cannot be asked for in it, or the source is unknown.
    """
    check_means(osc, stepper, None, progress)
    check_belongs(osc, structure)
    if osc.noise is None:
        raise SceneError("the scene has no noise, and nothing leaves an attractor without; give it a noise model.")
    if not isinstance(exit, Exit):
        raise StructureError(f"exit is {shown(exit)}, which is none; give LeaveBasin() or FirstContact().")
    exit.check(osc, structure)
    if isinstance(source, bool):
        raise StructureError(f"source is {source}; give the label of an attractor, or None for each in turn.")
    return structure.attractors if source is None else (structure.attractor(source),)


def stepper_for(osc: Oscillator, attractor: Attractor, flow: Flow, stepper: Stepper | None) -> Stepper:
    """Return the stepper given, or the default one for ensembles, with finer steps until it has the attractor's orbit.

    Steps across a contact that is short or all but grazes can be too coarse for an orbit that located contacts show, or
    for its stability.
    """
    if stepper is not None:
        return stepper
    chosen = tried = ensemble_stepper(osc, flow)
    if not attractor.is_fixed:
        return chosen
    for _ in range(_FINER):
        try:
            orbit = refine_orbit(osc, attractor.points[0], attractor.period, tried)
            if np.abs(np.linalg.eigvals(orbit.monodromy)).max() < 1:
                return tried
        except StructureError:
            pass
        tried = tried.refined()
    return chosen


def part_of(progress: Progress | None, number: int, count: int) -> Progress | None:
    """Progress of one of several pieces of work that count alike."""
    if progress is None:
        return None
    grain = 1000
    return lambda done, total: progress(number * grain + grain * done // max(1, total), count * grain)


def each_searched(
    sources: Sequence[Attractor],
    search: Callable[[Attractor, Progress | None], Found],
    words: list[str],
    progress: Progress | None,
) -> Iterator[tuple[Attractor, Found]]:
    """Search from each attractor in turn; of those that cannot be searched from, the reason is added to the words."""
    for number, attractor in enumerate(sources):
        try:
            found = search(attractor, part_of(progress, number, len(sources)))
        except StructureError as error:
            words.append(f"Attractor {attractor.label} was left out: {error}")
        else:
            yield attractor, found


def plain_settings(analyzer: Any) -> dict[str, Any]:
    """Return the configuration of an analyzer as plain data."""
    return {
        field.name: value
        if isinstance(value := getattr(analyzer, field.name), int | float | str | None)
        else repr(value)
        for field in dataclasses.fields(analyzer)
    }
