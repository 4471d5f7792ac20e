"""Attractors that states of the section lead to."""

from __future__ import annotations

import concurrent.futures
import dataclasses
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import Ensemble, Stop, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import DIVERGED, LEFT_BASIN, LEFT_REGION, REACHED, STALLED
from vibrokit.oscillator import Oscillator
from vibrokit.progress import advance
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import ESCAPED, NOT_FOLLOWED, UNSETTLED, Basins
from vibrokit.results.region import Region
from vibrokit.structure.basins.stop_cells import AttractorMask, core_of, is_extended, mask_of
from vibrokit.structure.orbits import arrival_at
from vibrokit.symbolic.flow_kind import Flow

CELLS = "cells"
"""Unit of stages that classify cells: a classifier advances them."""

_FIRST_STRETCH = 8  # sections after which the trajectories still under way are packed together again
_CONFIRMED = 64  # sections that a trajectory must stay near an extended attractor
_MISSES = 6  # of these sections that may fall into gaps of the attractor's sample
_LONGEST_DETOUR = 6  # as a power of 2

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class BasinClassifier:
    """Finds the attractor that a state of the section leads to.

    A periodic orbit or an equilibrium is reached within `settling` of one of its points. An attractor that meets the
    section in a curve or a cloud (a limit cycle, quasiperiodic and chaotic motion) is marked on a fine grid; a
    trajectory that enters a marked cell must stay near the attractor for 64 more sections, or is followed further.

    Attributes
    ----------
    osc : Oscillator
    attractors : sequence of Attractor
        A label is a place in this sequence.
    region : Region
        Distinguishes trajectories that left it from those that did not settle. A trajectory may leave it and return.
    settling : float
        Distance at which a point counts as reached, as a fraction of the region's widths in x and v.
    budget : int
        Largest number of sections; those that confirm an extended attractor may come on top.
    stepper : Stepper
    executor : concurrent.futures.Executor, optional
    core : Basins, optional
        Cells that classify trajectories which are in them at a section; negative labels for cells that do not.
    """

    osc: Oscillator
    attractors: Sequence[Attractor]
    region: Region
    settling: float
    budget: int
    stepper: Stepper
    executor: concurrent.futures.Executor | None = None
    core: Basins | None = None

    def labels(self, states: Array, start_time: float = 0.0) -> Whole:
        """Return the label of the attractor that each state (count, n), at a start time (s), leads to.

        It is UNSETTLED where the budget was spent inside the region, ESCAPED where it was spent outside or the motion
        diverged.
        """
        found = np.full(len(states), NOT_FOLLOWED, dtype=np.int64)
        self.label(found, states, start_time)
        return found

    def label(self, found: Whole, states: Array, start_time: float = 0.0) -> int:
        """Write the labels of states into an array of NOT_FOLLOWED; an interrupt leaves those known so far in it.

        Returns the number of sections that all of them took together.
        """
        trajectories = _Trajectories(self, states, found)
        trajectories.to_section(start_time)
        stretch, known = _FIRST_STRETCH, 0
        while (active := trajectories.active()).size:
            ended = trajectories.integrate(active, stretch, self.entering)
            entered = np.where((ended.status == LEFT_BASIN) & (found[active] == NOT_FOLLOWED), ended.label, -1)
            for place, stop in self.leaving.items():
                trajectories.confirm(active[entered == place + len(self.attractors)], place, stop)
            trajectories.wander(active[(entered >= 0) | (ended.status == LEFT_REGION)])
            trajectories.close()
            stretch = min(4 * stretch, self.budget)
            known, before = int(np.sum(found != NOT_FOLLOWED)), known
            advance(known - before, CELLS)
        return trajectories.sections

    def sharing(self, basins: Basins, margin: int) -> BasinClassifier:
        """Return a faster classifier, which uses a finished grid; see `vibrokit.structure.basins.stop_cells`."""
        return dataclasses.replace(self, core=core_of(self.osc, self.stepper, basins, margin, self.executor))

    @cached_property
    def points(self) -> Stop:
        """The test for having reached an orbit or an equilibrium."""
        orbits = {place: a.points for place, a in enumerate(self.attractors) if not is_extended(a)}
        return arrival_at(orbits, self.settling * self.region.widths)

    @cached_property
    def entering(self) -> Stop:
        """The test for points, for cells of the core, and for marked cells, whose labels follow the attractors'."""
        if self._mask is not None:
            labels = self._mask.labels(self.core, len(self.attractors))
            return self.points.with_cells(self._mask.frame.bounds, labels)
        if self.core is not None:
            return self.points.with_cells(self.core.region.bounds, self.core.labels)
        return self.points

    @cached_property
    def leaving(self) -> dict[int, Stop]:
        """For each extended attractor, by place, the test for being away from it."""
        mask = self._mask
        if mask is None:
            return {}
        return {place: self.points.with_cells(mask.frame.bounds, mask.away(place)) for place in mask.near}

    @cached_property
    def _mask(self) -> AttractorMask | None:
        return mask_of(self.attractors, self.region, self.settling * self.region.widths)


class _Trajectories:
    """Trajectories under way: their states, their remaining sections, and the labels that are known."""

    def __init__(self, classifier: BasinClassifier, states: Array, found: Whole) -> None:
        self.classifier = classifier
        self.states = np.array(states, dtype=float)
        self.remaining = np.full(len(states), classifier.budget, dtype=np.int64)
        self.found = found
        self.detours = np.zeros(len(states), dtype=np.int64)
        self.sections = 0  # of all together

    def active(self) -> Whole:
        return np.flatnonzero(self.found == NOT_FOLLOWED)

    def to_section(self, start_time: float) -> None:
        """Integrate states between two sections to the next one."""
        osc = self.classifier.osc
        phase = 0.0 if osc.autonomous else start_time % osc.section_interval
        if phase > 0 and len(self.states):
            rest = osc.section_interval - phase
            ended = run_ensemble(
                osc, Flow.STATE, self.classifier.stepper, self.states, start_time=phase, interval=rest,
                executor=self.classifier.executor,
            )  # fmt: skip
            self.states = ended.states
            self.found[ended.status == DIVERGED] = ESCAPED

    def integrate(self, which: Whole, most: int | Whole, stop: Stop) -> Ensemble:
        """Integrate some trajectories by at most so many sections, and note what they reach for certain."""
        classifier = self.classifier
        budget = np.minimum(self.remaining[which], most)
        ended = run_ensemble(
            classifier.osc, Flow.STATE, classifier.stepper, self.states[which], budget,
            stop=stop, executor=classifier.executor,
        )  # fmt: skip
        self.states[which] = ended.states
        self.sections += int(ended.intervals.sum())
        self.remaining[which] -= ended.intervals
        self.remaining[which[ended.status == STALLED]] = 0
        self.found[which[ended.status == DIVERGED]] = ESCAPED
        in_core = (ended.status == LEFT_BASIN) & (ended.label < len(classifier.attractors))
        certain = (ended.status == REACHED) | (in_core & (stop is classifier.entering))
        self.found[which[certain]] = ended.label[certain]
        return ended

    def confirm(self, which: Whole, place: int, stop: Stop) -> None:
        """Give the label of an extended attractor to trajectories that stay near it."""
        self.remaining[which] += _CONFIRMED
        stayed, misses = np.zeros(len(which), dtype=np.int64), np.zeros(len(which), dtype=np.int64)
        undecided = np.arange(len(which))
        while undecided.size:
            ended = self.integrate(which[undecided], _CONFIRMED - stayed[undecided], stop)
            stayed[undecided] += ended.intervals
            misses[undecided] += (ended.status == LEFT_BASIN) | (ended.status == LEFT_REGION)
            still = (self.found[which] == NOT_FOLLOWED) & (stayed < _CONFIRMED) & (misses <= _MISSES)
            undecided = undecided[still[undecided] & (ended.intervals > 0)]
        certain = (self.found[which] == NOT_FOLLOWED) & (stayed >= _CONFIRMED) & (misses <= _MISSES)
        self.found[which[certain]] = place
        self.remaining[which] -= _CONFIRMED

    def wander(self, which: Whole) -> None:
        """Integrate trajectories outside, or near no attractor after all, for a while that doubles each time."""
        which = which[(self.found[which] == NOT_FOLLOWED) & (self.remaining[which] > 0)]
        if which.size:
            self.integrate(which, 2 ** np.minimum(self.detours[which], _LONGEST_DETOUR), self.classifier.points)
            self.detours[which] += 1

    def close(self) -> None:
        """Label the trajectories whose budget is spent."""
        over = np.flatnonzero((self.found == NOT_FOLLOWED) & (self.remaining <= 0))
        self.found[over] = np.where(self.classifier.region.contains(self.states[over]), UNSETTLED, ESCAPED)
