"""Attractors that states of the section lead to."""

from __future__ import annotations

import concurrent.futures
import dataclasses
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import Ensemble, Stop, run_ensemble
from vibrokit.kernels.staying import staying
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import DIVERGED, LEFT_BASIN, REACHED, STALLED
from vibrokit.oscillator import Oscillator
from vibrokit.progress import advance
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import ESCAPED, NOT_FOLLOWED, UNSETTLED, Basins, exits_of
from vibrokit.results.region import Region
from vibrokit.results.structure import Structure
from vibrokit.structure.along_x import shifted, turn_of, turns_to, wrapped
from vibrokit.structure.basins.landings import Landings, followed
from vibrokit.structure.basins.stop_cells import MARGIN, AttractorMask, core_of, is_extended, mask_of, wells
from vibrokit.structure.orbits import arrival_at
from vibrokit.symbolic.flow_kind import Flow

CELLS = "cells"
"""Unit of stages that classify cells: a classifier advances them."""

_CONFIRMED = 64  # sections that a trajectory must stay near an extended attractor

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class BasinClassifier:
    """Finds the attractor that a state of the section leads to.

    A periodic orbit or an equilibrium is reached within `settling` of one of its points; where motion only loses
    energy, an equilibrium also once there is too little of it to leave the well. An attractor that meets the section in
    a curve or a cloud (a limit cycle, quasiperiodic and chaotic motion) is marked on a fine grid; it is
    reached by a trajectory that enters a marked cell and stays near the attractor for 64 more sections.

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
    circle : bool
        Whether states a turn apart along x are one, where the force of the spring repeats. If not, a state may
        lead to a copy of an attractor that is not among the attractors.
    """

    osc: Oscillator
    attractors: Sequence[Attractor]
    region: Region
    settling: float
    budget: int
    stepper: Stepper
    executor: concurrent.futures.Executor | None = None
    core: Basins | None = None
    circle: bool = False

    @classmethod
    def of(
        cls,
        osc: Oscillator,
        structure: Structure,
        stepper: Stepper,
        executor: concurrent.futures.Executor | None = None,
    ) -> BasinClassifier:
        """Return the classifier with the attractors, the region and the budget of a structure."""
        return cls(
            osc, structure.attractors, structure.basins.region, structure.settling, structure.budget, stepper, executor,
            circle=structure.circle,
        )  # fmt: skip

    def labels(self, states: Array, start_time: float = 0.0) -> Whole:
        """Return the label of the attractor that each state (count, n), at a start time (s), leads to.

        It is UNSETTLED where the budget was spent inside the region, ESCAPED where it was spent outside, where the
        motion diverged, or where it came to a copy of an attractor. Motion that needs too many steps in a section
        interval spends its budget there.
        """
        found = np.full(len(states), NOT_FOLLOWED, dtype=np.int64)
        self.label(found, states, start_time)
        return exits_of(found)

    def label(self, found: Whole, states: Array, start_time: float = 0.0) -> int:
        """Write the labels of states into an array of NOT_FOLLOWED; an interrupt leaves those known so far in it.

        Those of motion that came to a copy of an attractor are AT_COPY.

        Returns the number of sections that all of them took together.
        """
        trajectories = _Trajectories(self, states, found)
        trajectories.to_section(start_time)
        # After a stretch, the trajectories still under way are packed together again. With an extended attractor the
        # sections of a stretch are kept in memory.
        longest = self.budget if self.mask is None else _CONFIRMED
        stretch, known = 8, 0
        while (active := np.flatnonzero(found == NOT_FOLLOWED)).size:
            trajectories.follow(active, stretch)
            stretch = min(4 * stretch, longest)
            trajectories.close()
            known, before = int(np.sum(found != NOT_FOLLOWED)), known
            advance(known - before, CELLS)
        return trajectories.sections

    def sharing(self, basins: Basins, margin: int = MARGIN) -> BasinClassifier:
        """Return a faster classifier, which uses a finished grid; see `vibrokit.structure.basins.stop_cells`."""
        core = core_of(self.osc, self.stepper, basins, margin, self.executor, circle=self.circle)
        trapped = wells(self.osc, self.attractors, self.region, basins.labels.shape)
        if trapped is not None:
            core = Basins(core.region, np.where(trapped.labels == UNSETTLED, core.labels, trapped.labels))
        return dataclasses.replace(self, core=core)

    @cached_property
    def points(self) -> Stop:
        """The test for having reached an orbit or an equilibrium."""
        points = [each.points[: 0 if is_extended(each) else None] for each in self.attractors]
        return arrival_at(dict(self.landings.samples(points)), self.settling * self.region.widths)

    @cached_property
    def landings(self) -> Landings:
        """The attractors as motion meets them that is moved back along x."""
        return Landings(self.osc, self.attractors, self.region, circle=self.circle)

    @cached_property
    def arriving(self) -> Stop:
        """The test for points and for cells of the core."""
        cells = self.core or wells(self.osc, self.attractors, self.region)
        return self.points if cells is None else self.points.or_in_cells(cells.region.bounds, cells.labels)

    @cached_property
    def mask(self) -> AttractorMask | None:
        """The cells around extended attractors; None if there are none."""
        return mask_of(self.landings, self.region, self.settling * self.region.widths)


class _Trajectories:
    """Trajectories under way: their states, their remaining sections, and the labels that are known."""

    def __init__(self, classifier: BasinClassifier, states: Array, found: Whole) -> None:
        self.classifier = classifier
        self.middle = classifier.landings.middle
        self.turns = turns_to(classifier.osc, np.asarray(states), self.middle).astype(np.int64)  # that were taken back
        self.states = wrapped(classifier.osc, np.array(states, dtype=float), self.middle)
        extended = 0 if classifier.mask is None else len(classifier.mask.places)
        self.remaining = np.full(len(states), classifier.budget + _CONFIRMED * bool(extended), dtype=np.int64)
        self.found = found
        # By extended attractor: sections since a marked cell was entered (0: not yet), and how many were not near.
        self.stayed, self.missed = np.zeros((2, len(states), extended), dtype=np.int64)
        self.sections = 0  # of all together

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
            self.turns += turns_to(osc, ended.states, self.middle).astype(np.int64)
            self.states = wrapped(osc, ended.states, self.middle)
            self.found[ended.status == DIVERGED] = ESCAPED
            self.remaining[ended.status == STALLED] = 0
            self.close()

    def follow(self, which: Whole, most: int) -> None:
        """Integrate some trajectories by at most so many sections, and note what they reach."""
        classifier, mask = self.classifier, self.classifier.mask
        ended, turns = followed(
            classifier.osc, classifier.stepper, self.states[which], np.minimum(self.remaining[which], most),
            classifier.arriving, middle=self.middle, visits=0 if mask is None else most, executor=classifier.executor,
        )  # fmt: skip
        self.states[which] = ended.states
        self.turns[which] += turns
        self.sections += int(ended.intervals.sum())
        self.remaining[which] -= ended.intervals
        self.remaining[which[ended.status == STALLED]] = 0
        self.found[which[ended.status == DIVERGED]] = ESCAPED
        reached = np.isin(ended.status, (REACHED, LEFT_BASIN))
        self._arrive(which[reached], ended.label[reached])
        if mask is not None:
            self._stay(which, ended, mask)

    def _arrive(self, which: Whole, labels: Whole) -> None:
        """Note what some trajectories have reached, by the labels of the test."""
        self.found[which] = self.classifier.landings.labels(labels, self.turns[which])

    def _stay(self, which: Whole, ended: Ensemble, mask: AttractorMask) -> None:
        """Note which trajectories have stayed near an extended attractor, by the sections that they passed."""
        stayed, missed = self.stayed[which], self.missed[which]
        misses = 6  # may fall into gaps of the attractor's sample
        found = staying(
            ended.visits, ended.intervals, mask.frame.bounds, mask.entered, mask.near, _CONFIRMED, misses, stayed,
            missed,
        )  # fmt: skip
        self.stayed[which], self.missed[which] = stayed, missed
        confirmed = (found >= 0) & (self.found[which] == NOT_FOLLOWED)
        self._arrive(which[confirmed], mask.places[found[confirmed]])

    def close(self) -> None:
        """Label the trajectories whose budget is spent."""
        over = np.flatnonzero((self.found == NOT_FOLLOWED) & (self.remaining <= 0))
        classifier = self.classifier
        away: Array = (not classifier.circle) * turn_of(classifier.osc) * self.turns[over].astype(float)
        inside = classifier.region.contains(shifted(self.states[over], away))
        self.found[over] = np.where(inside, UNSETTLED, ESCAPED)
