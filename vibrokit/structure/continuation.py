"""Continuation of a scene's steady states in one parameter."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
import time
from collections.abc import Callable, Iterator, Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import ParameterError, VibrokitError, nearest, shown
from vibrokit.kernels.choice import single_stepper
from vibrokit.kernels.ensemble import Progress, carry
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator, seed_from
from vibrokit.parts.scene import Entry
from vibrokit.results.attractor import Attractor
from vibrokit.results.continuation import Continuation
from vibrokit.results.region import Region
from vibrokit.structure.find import find_structure
from vibrokit.structure.regions import frame_of
from vibrokit.structure.request import Request, check_means
from vibrokit.structure.shares import share_out
from vibrokit.structure.status import fates_of
from vibrokit.structure.tracing.branches import Tracing, unshared
from vibrokit.structure.tracing.continuation_record import recorded
from vibrokit.symbolic.flow_kind import Flow

_FEW = (2, 2)  # cells where only the attractors are wanted

Array = NDArray[np.float64]


def continuation(
    osc: Oscillator,
    path: str,
    values: Sequence[float],
    *,
    region: Any = None,
    cells: tuple[int, int] = (100, 100),
    starts: tuple[int, int] = (24, 24),
    stepper: Stepper | None = None,
    rng: int | np.random.Generator = 0,
    executor: concurrent.futures.Executor | None = None,
    progress: Progress | None = None,
) -> Continuation:
    """Follow the steady states of a scene along values of one parameter, and locate the bifurcations between.

    At each value the steady states are searched for anew, so that nothing is lost with what was lost before. Every
    orbit, equilibrium and limit cycle is then followed to the next value by pseudo-arclength continuation of its
    equations, and those that nothing led to are followed back; this says which belong to one branch, finds attractors
    that the search missed, and locates the bifurcations on the way. What cannot be followed so (chaotic sets, a period
    that has doubled) is joined by the least distance between the sets of points. Last, basin fractions are found on a
    grid.

    Parameters
    ----------
    osc : Oscillator
    path : str
        Any key of ``osc.parameters`` that does not shape the equations.
    values : sequence of float
        Finite and distinct; they are taken in ascending order.
    region : Region or ((x_min, x_max), (v_min, v_max)), optional
        Where to look, and what basin fractions are shares of, the same at all values so that they compare. By default
        each search chooses for itself where to look, and the fractions are shares of the smallest region that holds
        the steady states of all values, and the stops, with room around them.
    cells : (int, int)
        Cells of the basin grid in x and v.
    starts : (int, int)
        Starts of each search in x and v.
    stepper : Stepper, optional
        For everything; by default as for `find_structure`.
    rng : int or numpy.random.Generator
        Every value gets the same seed.
    executor : concurrent.futures.Executor, optional
        Carries the searches, then the basins, each value as one task; by default they are done one after the other. The
        result is the same to the last bit.
    progress : callable, optional
        Called with (tasks done, tasks in all), two for each value.

    Returns
    -------
    Continuation
        A value at which the scene is refused or nothing is found stands in it with the reason. If the work is stopped
        (Ctrl-C), it holds what was found so far, and is marked incomplete.

    Raises
    ------
    ParameterError
        A path or values that cannot be continued in.
    StructureError
        A region, or counts, that are not what they must be.
    """
    began = time.perf_counter()
    check_means(osc, stepper, executor, progress)
    entry, numbers = _entry(osc, path), _checked(values)
    request = Request(cells, 0, None, starts, 0.5, None)
    seed = int(rng) if isinstance(rng, Integral) and not isinstance(rng, bool) else seed_from(rng)
    frame = None if region is None else Region.of(region)
    work = _Work(osc, path, numbers.tolist(), stepper, executor, progress)
    try:
        work.search({"region": frame, "starts": request.starts, "stepper": stepper, "rng": seed})
        work.trace()
        frame = frame or work.common_region()
        work.share_out(frame, request.cells)
    except KeyboardInterrupt:
        work.stopped = True
        work.trace()
    record = recorded(work.tracing, work.states(), len(numbers), complete=not work.stopped)
    return dataclasses.replace(
        record, symbol=entry.declared.symbol, unit=entry.declared.unit, region=frame, seed=seed,
        seconds=time.perf_counter() - began,
    )  # fmt: skip


@dataclasses.dataclass(frozen=True, eq=False)
class _Found:
    """What the search found at one value."""

    value: float
    attractors: tuple[Attractor, ...]
    region: Region | None
    budget: int
    complete: bool
    status: str


class _Work:
    """Goes through the stages and keeps what each has found."""

    def __init__(
        self,
        osc: Oscillator,
        path: str,
        values: list[float],
        stepper: Stepper | None,
        executor: concurrent.futures.Executor | None,
        progress: Progress | None,
    ) -> None:
        self.osc, self.path, self.values = osc, path, values
        self.stepper, self.executor, self.progress = stepper, executor, progress
        self.found: list[_Found] = []
        self.tracing = self._tracing()
        self.fates: dict[float, tuple[str, ...]] = {}
        self.stopped = False

    def search(self, settings: dict[str, Any]) -> None:
        """Look for the steady states at each value."""
        for found in self._carried(_search, [(self.osc, self.path, value, settings) for value in self.values], 0):
            self.found.append(found)
            if not found.complete:
                raise KeyboardInterrupt

    def trace(self) -> None:
        """Join what was found into branches; another Ctrl-C leaves the families and has it done by distances alone."""
        if self.tracing.values:
            return
        self.tracing = self._tracing()
        try:
            self.tracing.run()
        except KeyboardInterrupt:
            self.stopped = True
            self.tracing.pair_off()

    def common_region(self) -> Region | None:
        """The smallest region that holds what is seen at every value; None if nothing was found."""
        tracing = self.tracing
        frames = [
            frame_of(self.osc.replace({self.path: value}), attractors).bounds
            for value, attractors in zip(tracing.values, tracing.found, strict=True)
        ]
        return _union(frames)

    def share_out(self, region: Region | None, cells: tuple[int, int]) -> None:
        """Find the basin fractions of all attractors at each value."""
        if region is None or self.stopped:
            return
        budgets = {found.value: found.budget for found in self.found}
        tasks = [
            (self.osc.replace({self.path: value}), attractors, region, cells, budgets[value], self.stepper)
            for value, attractors in zip(self.tracing.values, self.tracing.found, strict=True)
        ]
        for index, shared in enumerate(self._carried(share_out, tasks, len(self.values))):
            self.tracing.found[index] = list(shared.attractors)
            self.fates[self.tracing.values[index]] = shared.words
            if not shared.complete:
                raise KeyboardInterrupt

    def states(self) -> list[tuple[float, str]]:
        """Every value that was looked at, and what there is to say of it."""
        return [(at.value, " ".join([at.status, *self.fates.get(at.value, ())])) for at in self.found]

    def _carried(self, stage: Callable[..., Any], tasks: list[tuple[Any, ...]], before: int) -> Iterator[Any]:
        results = (stage(*task) for task in tasks) if self.executor is None else carry(stage, tasks, self.executor)
        for done, result in enumerate(results, start=before + 1):
            yield result
            if self.progress is not None:
                self.progress(done, 2 * len(self.values))

    def _tracing(self) -> Tracing:
        held = [at for at in self.found if at.attractors]
        frame = _union([at.region.bounds for at in held if at.region is not None])
        size = np.ones(2) if frame is None else np.diff(frame.bounds)[:, 0]
        exact = self.stepper or single_stepper(self.osc, Flow.STATE_VARIATIONAL)
        attractors = [[unshared(attractor) for attractor in at.attractors] for at in held]
        return Tracing(self.osc, self.path, [at.value for at in held], attractors, size, exact)


def _search(osc: Oscillator, path: str, value: float, settings: dict[str, Any]) -> _Found:
    try:
        there = osc.replace({path: value})
        structure = find_structure(there, cells=_FEW, saddles=False, manifolds=False, **settings)
    except VibrokitError as error:
        return _Found(value, (), None, 0, True, str(error))
    # The few cells of this grid say nothing of the basins, which are found once all attractors are known.
    status = structure.status
    for sentence in fates_of(structure.basins):
        status = status.replace(f" {sentence}", "")
    region, budget = structure.basins.region, structure.budget
    return _Found(value, structure.attractors, region, budget, structure.complete, status)


def _union(bounds: list[Array]) -> Region | None:
    if not bounds:
        return None
    low, high = np.min(bounds, axis=0)[:, 0], np.max(bounds, axis=0)[:, 1]
    return Region.of(np.stack([low, high], axis=1).tolist())


def _entry(osc: Oscillator, path: Any) -> Entry:
    entries = {entry.path: entry for entry in osc.entries()}
    if not isinstance(path, str) or path not in entries:
        open_ones = [name for name, entry in entries.items() if not entry.declared.structural]
        raise ParameterError(f"continuation: the scene has no parameter {shown(path)}{nearest(str(path), open_ones)}")
    if entries[path].declared.structural:
        raise ParameterError(
            f"continuation: {path} is {shown(entries[path].value)}, which shapes the equations, and no motion can be "
            "followed from one value to the next; find the structure at each value instead."
        )
    return entries[path]


def _checked(values: Any) -> Array:
    listed = list(values) if isinstance(values, Sequence | np.ndarray) and not isinstance(values, str) else []
    if not listed:
        raise ParameterError(f"continuation: values is {shown(values)}; give a sequence of numbers, one or more.")
    for value in listed:
        if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
            raise ParameterError(f"continuation: values has {shown(value)}; give finite numbers.")
    numbers = np.sort(np.array(listed, dtype=float))
    twice = numbers[:-1][np.diff(numbers) == 0]
    if twice.size:
        raise ParameterError(f"continuation: values has {twice[0]:g} more than once; give distinct numbers.")
    return numbers
