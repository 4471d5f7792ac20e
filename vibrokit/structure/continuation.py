"""Continuation of a scene's steady states in one parameter."""

from __future__ import annotations

import concurrent.futures
import contextlib
import dataclasses
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.errors import VibrokitError
from vibrokit.kernels.choice import single_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.tasks import carry
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, Work, advance, current, put_off, stage, working
from vibrokit.results.attractor import Attractor
from vibrokit.results.codes import Code
from vibrokit.results.continuation import Continuation, SteadyStates
from vibrokit.results.finding import Finding
from vibrokit.results.region import Region
from vibrokit.results.stoppable import Stoppable
from vibrokit.scene_file import scene_data
from vibrokit.structure.attractors.names import labelled, order_of
from vibrokit.structure.basins.grid import CELL_CODES, SETTLING, basin_fractions
from vibrokit.structure.basins.stop_cells import MARGIN
from vibrokit.structure.find import structure_of
from vibrokit.structure.parameter_values import ParameterLine, ordered_values, parameter_line
from vibrokit.structure.regions import frame_of
from vibrokit.structure.tracing.branches import Tracing, thinned, without_fraction
from vibrokit.structure.tracing.following import Follower
from vibrokit.structure.validation import Request, check_means, plain, seed_of, stepper_of
from vibrokit.symbolic.flow_kind import Flow

Array = NDArray[np.float64]


@called
def continuation(
    osc: Oscillator,
    parameter: str | Mapping[str, float],
    values: Sequence[float],
    *,
    region: Any = None,
    cells: tuple[int, int] | None = (100, 100),
    starts: tuple[int, int] = (24, 24),
    stepper: Stepper | str | None = None,
    rng: int | np.random.Generator = 0,
    executor: concurrent.futures.Executor | None = None,
    progress: Progress = None,
    time_limit: float | None = None,
) -> Continuation:
    """Follow the steady states of a scene along values of one parameter, and locate the bifurcations between.

    The steady states are searched for at each value independently. Every orbit, equilibrium and limit cycle is then
    followed to the next value by pseudo-arclength continuation of its equations, and those that were not reached are
    followed back. This joins them into branches, finds attractors that the search missed, and locates the bifurcations
    on the way. What cannot be followed in this way (chaotic sets, a period that has doubled) is joined by the smallest
    distance between the sets of points. Finally, basin fractions are found on a grid.

    On Ctrl-C, or when the time limit is reached, what was found so far is returned, marked incomplete; branches that
    were not followed yet are joined by distance. The findings of the value under way say what its starts were doing.

    Parameters
    ----------
    osc : Oscillator
    parameter : str or dict of str to float
        A parameter that does not shape the equations: a key of ``osc.parameters``, or the end of exactly one, such as
        ``"frequency"`` for ``"excitations.0.frequency"``. The record has the full path. Several parameters are tied by
        their factors: with ``{"barriers.0.position": 1, "barriers.1.position": -1}`` a value is the gap on both sides.
    values : sequence of float
        Finite and distinct; they are taken in ascending order.
    region : Region or ((x_min, x_max), (v_min, v_max)), optional
        Region of the searches and of the basin fractions, the same at all values so that these can be compared. By
        default each search chooses its own region, and the fractions refer to the smallest region that contains
        the steady states of all values and the stops, with a margin around them.
    cells : (int, int), optional
        Cells of the basin grid in x and v; None for no basin fractions, which saves most of the time where basins are
        intricate.
    starts : (int, int)
        Starts of each search in x and v.
    stepper : Stepper or str, optional
        For everything, or its text; by default as for `find_structure`.
    rng : int or numpy.random.Generator
        All values have the same seed.
    executor : concurrent.futures.Executor, optional
        Does the searches, then the basins, each value as one task; by default they are done one after another. The
        result is the same to the last bit.
    progress : bool or callable, optional
        True shows progress on standard error; a function is called with each `vibrokit.progress.Update`.
    time_limit : float, optional
        In seconds.

    Returns
    -------
    Continuation
        A value at which the scene is refused, or nothing is found, has a finding with the reason.
        Its `settings` are these arguments: ``continuation(osc, **record.settings)`` repeats the call.

    Raises
    ------
    ParameterError
        An unknown or ambiguous parameter, one that shapes the equations, or values that are not numbers.
    StructureError
        The region or the counts are not allowed.
    """
    chosen = stepper_of(stepper)
    check_means(osc, chosen, executor)
    line, numbers = parameter_line("continuation", osc, parameter), ordered_values("continuation", values)
    request = request_of(region, starts, seed_of(rng), cells=cells, stepper=chosen)
    with working(progress, time_limit) as work:
        run = ContinuationRun(osc, line, numbers.tolist(), request, executor)
        run.run()
        with put_off():
            return run.record(work)


def request_of(region: Any, starts: Any, seed: int, *, cells: Any = None, stepper: Stepper | None = None) -> Request:
    """Return what a continuation asks for at each value; without cells, it finds no basin fractions."""
    return Request(region, cells, 0, MARGIN, starts, SETTLING, None, None, False, False, stepper, seed)


@dataclasses.dataclass(eq=False)
class ContinuationRun:
    """Goes through the stages and keeps what each has found; arguments as of `continuation`."""

    osc: Oscillator
    line: ParameterLine
    values: list[float]
    request: Request
    executor: concurrent.futures.Executor | None = None

    def __post_init__(self) -> None:
        self.region = self.request.region
        self.still = not self.line.enters(self.osc, self.osc.model.drift)  # motion is the same at all values
        self.found: list[SearchedValue] = []
        self.cell_findings: dict[float, tuple[Finding, ...]] = {}
        self.work = Stoppable("values")

    def run(self) -> None:
        """Go through the stages; an interrupt ends them, and what is known by then is kept."""
        with self.work as work:
            self._search()
            work.doing = "branches"
            self.tracing.run()
            work.doing = "basin fractions"
            if self.request.cells is not None:
                self._find_fractions()
        if work.stopped:
            with put_off():
                self.tracing.pair_off()

    def record(self, work: Work) -> Continuation:
        """Return the record of all that was found."""
        tracing, declared, request = self.tracing, self.line.entry.declared, self.request
        states = tuple(self._states())
        states += tuple(self._copies(states[-1])) if self.still and states and not self.work.stopped else ()
        arguments = {name: getattr(request, name) for name in ("region", "cells", "starts", "stepper", "rng")}
        arguments |= {"parameter": self.line.argument, "values": tuple(self.values)}
        nothing = [finding for at in states for finding in at.findings if finding.code is Code.NOTHING_AT]
        return Continuation(
            parameter=self.line.path,
            symbol=declared.symbol,
            unit=declared.unit,
            region=self.region,
            states=states,
            branch_names=tracing.names,
            bifurcations=tracing.bifurcations,
            complete=not self.work.stopped,
            scene=scene_data(self.osc),
            settings=plain(arguments),
            findings=(*tracing.findings(len(states)), *nothing, *self.work.findings),
            stats=work.stats,
            seed=request.rng,
            seconds=work.seconds,
        )

    def _search(self) -> None:
        """Search for the steady states at each value."""
        tasks = [(self.osc, self.line, value, self.request) for value in self.values]
        with stage("values", unit="values", total=len(tasks)), self._each(searched_value, tasks) as every:
            for found in every:
                self.found.append(found)
                current().stop_again()
                advance()
                if self.still and not found.refused:
                    break

    @cached_property
    def tracing(self) -> Tracing:
        """The branches through what was found; they may end on the way to a value where nothing was."""
        held = [at for at in self.found if not at.refused]
        frame = _union([at.region for at in held if at.region is not None])
        size = np.ones(2) if frame is None else np.diff(frame.bounds)[:, 0]
        stepper = self.request.stepper or single_stepper(self.osc, Flow.STATE_VARIATIONAL)
        attractors = [[without_fraction(attractor) for attractor in at.attractors] for at in held]
        follower = Follower(self.osc, self.line, size, stepper)
        return Tracing(follower, [at.value for at in held], attractors)

    def _find_fractions(self) -> None:
        """Find the basin fractions of all attractors at each value."""
        tracing = self.tracing
        places = [place for place, attractors in enumerate(tracing.found) if attractors]
        held = [(tracing.values[place], tracing.found[place]) for place in places]
        self.region = self.region or _union([frame_of(tracing.at(value), attractors) for value, attractors in held])
        longest = max((found.budget for found in self.found), default=0)
        budgets = {found.value: found.budget or longest for found in self.found}
        tasks = [
            (
                tracing.at(value), labelled(attractors, has_stops=bool(self.osc.barriers)),
                self.region, self.request.cells, budgets[value], self.request.stepper,
            )
            for value, attractors in held
        ]  # fmt: skip
        with stage("basin fractions", unit="values", total=len(tasks)), self._each(basin_fractions, tasks) as every:
            for index, (attractors, findings) in zip(places, every, strict=True):
                tracing.found[index] = list(attractors)
                self.cell_findings[tracing.values[index]] = findings
                advance()

    def _copies(self, states: SteadyStates) -> Generator[SteadyStates, None, None]:
        """Yield states that are the same at every value, at those values that were not searched."""
        for value in self.values[len(self.found) :]:
            reason = self.line.refusal(self.osc, value)
            nothing = SteadyStates(value, (), (), (_nothing_at(value, reason),))
            yield nothing if reason else dataclasses.replace(states, value=value)

    def _states(self) -> Generator[SteadyStates, None, None]:
        """Yield the steady states at each value that was searched."""
        places = {value: index for index, value in enumerate(self.tracing.values)}
        for at in self.found:
            index = places.get(at.value)
            tracing = self.tracing
            both = () if index is None else zip(tracing.found[index], tracing.numbered[index], strict=True)
            pairs = sorted(both, key=lambda pair: order_of(pair[0]))  # as find_structure does, for the same names
            named = labelled([attractor for attractor, _ in pairs], has_stops=bool(self.osc.barriers))
            yield SteadyStates(
                at.value,
                tuple(thinned(attractor) for attractor in named),
                tuple(branch for _, branch in pairs),
                (*at.findings, *self.cell_findings.get(at.value, ())),
            )

    def _each(
        self, work: Callable[..., Any], tasks: list[tuple[Any, ...]]
    ) -> contextlib.AbstractContextManager[Iterable[Any]]:
        """Do each task as it is asked for, one after another or by the executor."""
        one_by_one = (work(*task) for task in tasks)
        return contextlib.closing(one_by_one if self.executor is None else carry(work, tasks, self.executor))


@dataclasses.dataclass(frozen=True, eq=False)
class SearchedValue:
    """Steady states found at one value, each by itself."""

    value: float
    attractors: tuple[Attractor, ...] = ()
    region: Region | None = None
    budget: int = 0
    findings: tuple[Finding, ...] = ()
    refused: bool = False  # whether there is no such scene, or none that can have attractors


def searched_value(osc: Oscillator, line: ParameterLine, value: float, request: Request) -> SearchedValue:
    """Search for the steady states at a value; basins are found once all attractors are known."""
    refused = True
    try:
        there = line.at(osc, value)
        refused = there.model.undamped
        structure = structure_of(there, dataclasses.replace(request, cells=None), basins=False)
    except VibrokitError as error:
        return SearchedValue(value, findings=(_nothing_at(value, error),), refused=refused)
    findings = tuple(one for one in structure.findings if one.code not in (*CELL_CODES, Code.STOPPED))
    return SearchedValue(value, structure.attractors, structure.basins.region, structure.budget, findings)


def _nothing_at(value: float, reason: object) -> Finding:
    return Finding.of(Code.NOTHING_AT, value=value, reason=str(reason))


def _union(regions: list[Region]) -> Region | None:
    """Return the smallest region that contains some regions; None if there are none."""
    corners = [region.bounds.T for region in regions]
    return Region.around(np.concatenate(corners), margin=0.0) if corners else None
