"""Road: the stages of one assessment, and what they have found."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from typing import Any

import numpy as np

from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.assessment.assessment import Assessment
from vibrokit.assessment.known import Known, Part
from vibrokit.errors import VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Work, stage
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.one_scene import merged, part_of
from vibrokit.results.rated import RatedResult
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.scene_file import scene_data
from vibrokit.structure.find import find_structure
from vibrokit.structure.validation import check_belongs

_RATIOS = 4.0, 7.0, 12.0
"""ΔU/D at which rates are computed: direct simulation is cheap up to 7, splitting and densities are up to about 15.

A fourth at 20 would take two thirds of the time at an accuracy of 0.03, on a double well of damping 0.2.
"""
_SIMULATED = (0.25, 25.0)  # ΔU/D between which the scene's own intensity is added: below, no state is metastable


@dataclasses.dataclass(eq=False)
class Road:
    """Runs the stages of one assessment and keeps their results."""

    osc: Oscillator
    accuracy: float
    time_limit: float | None
    source: int | str | None
    analyzers: dict[str, Analyzer]
    seed: int
    executor: Executor | None
    work: Work
    known: Known
    structure: Structure | None = None
    parts: dict[tuple[str, int], Part] = dataclasses.field(default_factory=dict)  # by analyzer and by source
    left: list[Finding] = dataclasses.field(default_factory=list)
    complete: bool = False

    def __post_init__(self) -> None:
        """Take what is known; raises StructureError if that is of another scene or another exit."""
        self.known.check(self.osc, next(iter(self.analyzers.values())).exit)
        for one in self.known.structures:
            check_belongs(self.osc, one)
            self.structure = one

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
            share = 0.4 if rated else 1.0 / (len(others) - number)
            ran &= self._run(name, paths, labels, share)
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


def barrier(energies: Sequence[float], intensity: float) -> float:
    """Return the least ΔU of a state's exits that its noise takes time to climb, or of all; infinite without any.

    What is passed at once leads to no other state, so that mean times at still weaker noise are no answer.
    """
    held = [energy for energy in energies if energy >= _SIMULATED[0] * intensity]
    return min(held or energies, default=math.inf)


def ladder(energy: float, intensity: float) -> tuple[float, ...]:
    """Return the noise intensities for one state, descending (m² s⁻³); that of the scene is one if in their range."""
    ratios: tuple[float, ...] = _RATIOS
    own = energy / intensity
    if _SIMULATED[0] <= own <= _SIMULATED[1]:
        apart = math.log(1.25)  # nearer intensities count as one
        ratios = (*(one for one in ratios if abs(math.log(one / own)) > apart), own)
    return tuple(intensity if ratio == own else energy / ratio for ratio in sorted(ratios))
