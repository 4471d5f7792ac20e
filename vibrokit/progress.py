"""Progress and statistics of long work: stages, counts, and a time limit.

A public call opens a `Work`; everything that runs inside it, at any depth, counts into it and reports to it through the
functions of this module. So no function takes a progress argument that it only hands on.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from typing import Annotated, Any

import numpy as np
from threadpoolctl import threadpool_limits

from vibrokit.arguments import real
from vibrokit.display import Display
from vibrokit.display import Update as Update
from vibrokit.documented import documented
from vibrokit.errors import OutOfTime, StructureError, shown

TRAJECTORIES = "trajectories"
"""Unit of stages that integrate many starts: `run_ensemble` advances them."""

AFTERWARDS = 1.0
"""Seconds in which work that was stopped may still make use of what it has found; then it is stopped again.

A call with a time limit so returns within two seconds of it.
"""

_SECONDS = 'time spent in each stage (s), without the stages inside it; "compiling" is one of them'
_SETTLED = 1.0  # seconds of a stage after which its pace is known well enough to estimate the time left


class Deadline(KeyboardInterrupt):
    """The time limit is reached; work stops as on Ctrl-C, and what was found is kept.

    No handler of errors inside the work may take it for one. If nothing was found, users see it as `OutOfTime`.
    """


Seconds = Mapping[str, float]
Listener = Callable[[Update], None]
Progress = bool | Listener | None
"""What public calls take: True for a display on standard error, a function of an `Update`, or None."""


@documented
@dataclasses.dataclass(frozen=True)
class Stats:
    """How much work a result took."""

    trajectories: Annotated[int, "trajectories integrated"] = 0
    intervals: Annotated[int, "section intervals integrated, over all trajectories"] = 0
    steps: Annotated[int, "steps of fixed size taken; steppers that choose their own steps do not count them"] = 0
    newton_iterations: Annotated[int, "iterations of Newton's method"] = 0
    seconds: Annotated[Seconds, _SECONDS] = dataclasses.field(default_factory=dict)

    def __add__(self, other: Stats) -> Stats:
        """The work of two results together."""
        counts = {name: getattr(self, name) + getattr(other, name) for name in _COUNTED}
        one, another = self.seconds, other.seconds
        seconds = {name: one.get(name, 0.0) + another.get(name, 0.0) for name in {**one, **another}}
        return Stats(**counts, seconds=seconds)

    def part(self, number: int, count: int) -> Stats:
        """One of some equal parts, up to whole numbers: all parts together are the whole."""
        wholes = {name: getattr(self, name) for name in _COUNTED}
        counts = {name: (number + 1) * whole // count - number * whole // count for name, whole in wholes.items()}
        return Stats(**counts, seconds={name: seconds / count for name, seconds in self.seconds.items()})


_COUNTED = tuple(field.name for field in dataclasses.fields(Stats) if field.name != "seconds")


class _Stage:
    """One stage under way."""

    def __init__(self, name: str, subject: str, unit: str, total: int | None) -> None:
        self.name, self.subject, self.unit, self.total = name, subject, unit, total
        self.done = 0
        self.began = time.perf_counter()
        self.inner = 0.0
        self.remaining = math.inf

    def update(self, *, compiling: bool = False, finished: bool = False) -> Update:
        elapsed = time.perf_counter() - self.began
        if self.total and self.done and elapsed >= _SETTLED:
            self.remaining = min(self.remaining, elapsed * max(0, self.total - self.done) / self.done)
        known = None if math.isinf(self.remaining) else self.remaining
        described = self.name, self.subject, self.done, self.total, self.unit
        return Update(*described, elapsed, known, compiling, finished)


class Work:
    """One piece of work that a user asked for: its stages, its counts, its time limit (s).

    The listener is by default that of the work around it, `outer`. The time limit of that stays in force, and what is
    counted here counts there too.
    """

    def __init__(
        self, listener: Listener | None = None, time_limit: float | None = None, outer: Work | None = None
    ) -> None:
        self.listener: Listener | None = listener or (outer.listener if outer else None)
        self.outer = outer
        self.began = time.perf_counter()
        self.deadline = math.inf if time_limit is None else self.began + time_limit
        self.interrupted = self.held = False
        self._stopped_by: type[KeyboardInterrupt] | None = None
        self.counts: Counter[str] = Counter()
        self.spent: defaultdict[str, float] = defaultdict(float)  # s, by stage
        self.stages: list[_Stage] = []

    @property
    def seconds(self) -> float:
        """Time since the work began (s)."""
        return time.perf_counter() - self.began

    @property
    def stats(self) -> Stats:
        """What was counted so far."""
        return Stats(**{name: self.counts[name] for name in _COUNTED}, seconds=dict(self.spent))

    @property
    def inside(self) -> _Stage | None:
        """The innermost stage, of this work or of that around it."""
        return self.stages[-1] if self.stages else self.outer.inside if self.outer else None

    @property
    def over(self) -> bool:
        """Whether the work was stopped, or is to be at its next report."""
        own = self.interrupted or time.perf_counter() > self.deadline
        return own or self._stopped_by is not None or (self.outer is not None and self.outer.over)

    def stop_again(self) -> None:
        """Raise again what has stopped this work while work inside it was under way, which kept what it had found."""
        if self._stopped_by is not None:
            raise self._stopped_by
        if self.outer is not None:
            self.outer.stop_again()

    def interrupt(self) -> None:
        """Ask the work to stop: KeyboardInterrupt is raised at its next report, where nothing is lost."""
        self.interrupted = True

    def tell(self, *, compiling: bool = False, finished: bool = False) -> None:
        """Tell the listener about the innermost stage; raises as `check` does."""
        if self.stages and self.listener is not None:
            self.listener(self.stages[-1].update(compiling=compiling, finished=finished))
        if not finished:
            self.check()

    def check(self) -> None:
        """Raise Deadline after a time limit, and interrupts that were asked for; again `AFTERWARDS` later."""
        if self.held:
            return
        if self.interrupted:
            self.interrupted = False
            self.wind_up()
            raise KeyboardInterrupt
        now = time.perf_counter()
        if now > self.deadline:
            self.deadline, self._stopped_by = now + AFTERWARDS, self._stopped_by or Deadline
            raise self._stopped_by
        if self.outer is not None:
            self.outer.check()

    def wind_up(self) -> None:
        """Note Ctrl-C, which leaves this work and that around it `AFTERWARDS`."""
        self.deadline, self._stopped_by = min(self.deadline, time.perf_counter() + AFTERWARDS), KeyboardInterrupt
        if self.outer is not None:
            self.outer.wind_up()

    def close(self) -> None:
        """Add what was counted to the work around this one."""
        if self.outer is not None:
            self.outer.counts.update(self.counts)
            for name, seconds in self.spent.items():
                self.outer.spent[name] += seconds


_CURRENT: ContextVar[Work | None] = ContextVar("work", default=None)


def current() -> Work:
    """Return the work under way; one that nobody listens to if none was opened."""
    return _CURRENT.get() or Work()


@contextlib.contextmanager
def working(progress: Progress = None, time_limit: float | None = None) -> Iterator[Work]:
    """Open a piece of work; inside another one, the listener and the time limit of that stay in force.

    Raises OutOfTime if the time limit ends the outermost work, which then returns nothing.
    """
    work = Work(_listener(progress), checked_time_limit(time_limit), _CURRENT.get())
    if work.outer is not None:
        with opened(work):
            yield work
        return
    try:
        # One thread of BLAS: others would compete with those that integrate trajectories, and a sum over several
        # threads depends on their number, so that results would differ from machine to machine.
        # What overflows or is no number is tested where it arises; NumPy's warnings would tell a user nothing more.
        with threadpool_limits(limits=1, user_api="blas"), np.errstate(all="ignore"), opened(work):
            yield work
    except Deadline:
        raise OutOfTime("the time limit was reached before there was a result; raise time_limit.") from None


@contextlib.contextmanager
def opened(work: Work) -> Iterator[Work]:
    """Make a piece of work the current one, and close it at the end."""
    token = _CURRENT.set(work)
    try:
        yield work
    finally:
        _CURRENT.reset(token)
        work.close()


@contextlib.contextmanager
def put_off() -> Iterator[None]:
    """Put off interrupts and time limits to the end of what is short and without which nothing can be returned."""
    work = current()
    work.held = True
    try:
        yield
    finally:
        work.held = False


@contextlib.contextmanager
def stage(name: str, *, subject: str = "", unit: str = "", total: int | None = None) -> Iterator[None]:
    """Open a stage of the work under way; arguments as for `Update`.

    The subject is by default that of the stage around it.
    """
    work = current()
    around = work.inside
    own = _Stage(name, subject or (around.subject if around else ""), unit, total)
    work.stages.append(own)
    try:
        work.tell()
        yield
    finally:
        elapsed = time.perf_counter() - own.began
        try:
            work.tell(finished=True)
        finally:
            work.stages.pop()
            work.spent[name] += elapsed - own.inner
            if around is not None:
                around.inner += elapsed


def advance(count: int = 1, unit: str | None = None) -> None:
    """Add to what is done in the innermost stage; with a unit, only if the stage counts that."""
    work = current()
    if work.stages and unit in (None, work.stages[-1].unit):
        work.stages[-1].done += count
    work.tell()


def report(done: int, total: int | None = None) -> None:
    """Set what is done in the innermost stage, and how much there is."""
    work = current()
    if work.stages:
        own = work.stages[-1]
        own.done, own.total = done, own.total if total is None else total
    work.tell()


def count(**counts: int) -> None:
    """Add to the counts of `Stats`."""
    current().counts.update(counts)


@contextlib.contextmanager
def compiling() -> Iterator[None]:
    """Mark a compilation, which may take long."""
    work, began = current(), time.perf_counter()
    work.tell(compiling=True)
    try:
        yield
    finally:
        elapsed = time.perf_counter() - began
        work.spent["compiling"] += elapsed
        if work.stages:
            work.stages[-1].inner += elapsed


def checked_time_limit(seconds: Any) -> float | None:
    """Return a time limit (s) or None; raises StructureError for anything else."""
    if seconds is None:
        return None
    if not 0 < real(seconds) < math.inf:
        raise StructureError(f"time_limit must be a positive number of seconds or None, got {shown(seconds)}.")
    return real(seconds)


def _listener(progress: Progress) -> Listener | None:
    if progress is None or progress is False:
        return None
    if progress is True:
        return Display()
    if callable(progress):
        return progress
    raise StructureError(f"progress must be True, None or a function of one Update, got {shown(progress)}.")
