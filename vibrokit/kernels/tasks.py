"""Carries out tasks, by the calling thread together with others of this process, or by any executor."""

from __future__ import annotations

import collections
import concurrent.futures as futures
import contextlib
import contextvars
import functools
import os
import sys
import threading
from collections.abc import Callable, Generator, Mapping
from typing import Any

from vibrokit.errors import StructureError, shown
from vibrokit.progress import Work, count, current, opened

_GLANCE = 0.2  # s between looks at the time limit while others work

Task = tuple[Any, ...]


def check_executor(executor: Any) -> None:
    """Raise StructureError unless something can do tasks, or is None."""
    if executor is not None and not isinstance(executor, futures.Executor):
        raise StructureError(
            f"executor must be a concurrent.futures.Executor, or None for threads, got {shown(executor)}."
        )


def carry(
    work: Callable[..., Any], tasks: list[Task], executor: futures.Executor | None = None
) -> Generator[Any, None, None]:
    """Yield ``work(*task)`` for each task, in order. Closing the generator starts no more tasks.

    Without an executor the caller does the tasks together with threads of this process. It does a single task, and
    those of a task of its own, alone: handing over costs more than most of them. A task that fails in an executor is
    submitted a second time: workers can be lost, also while they return a result.

    A time limit is seen also while a task is under way, and threads of this process are then asked to end theirs.
    """
    if executor is not None:
        found = _submitted(work, tasks, executor)
    elif len(tasks) == 1 or _inside.task:
        found = ((work(*task), {}) for task in tasks)
    else:
        found = _together(work, tasks)
    with contextlib.closing(found):
        for result, counts in found:
            count(**counts)
            yield result
            current().check()


def _submitted(
    work: Callable[..., Any], tasks: list[Task], executor: futures.Executor
) -> Generator[tuple[Any, Mapping[str, int]], None, None]:
    """The results and counts of tasks that an executor does."""
    pending = [executor.submit(_counted_apart, work, task) for task in tasks]
    try:
        for number, future in enumerate(pending):
            _await(future)
            if future.cancelled() or future.exception():
                pending[number] = future = executor.submit(_counted_apart, work, tasks[number])
                _await(future)
            yield future.result()
    finally:
        for future in pending:
            future.cancel()


def _together(work: Callable[..., Any], tasks: list[Task]) -> Generator[tuple[Any, Mapping[str, int]], None, None]:
    """The results and counts of tasks that the caller and other threads do, each the next one when it is free.

    The caller would else be woken for each result, which takes as long as many a task.
    """
    waiting = collections.deque(range(len(tasks)))
    results = [futures.Future[Any]() for _ in tasks]
    over, around = threading.Event(), current()

    def do_next(part: Work) -> bool:
        try:
            number = waiting.popleft()
        except IndexError:
            return False
        outer, _inside.task = _inside.task, True
        try:
            results[number].set_result(_counted_apart(work, tasks[number], part))
        except BaseException as error:
            results[number].set_exception(error)
            if not isinstance(error, Exception):  # an interrupt does not wait for its turn
                raise
        finally:
            _inside.task = outer
        return True

    def help_out() -> None:
        while do_next(_Part(over)):
            pass

    helpers = [_threads().submit(help_out) for _ in range(min(processors(), len(tasks)) - 1)]
    try:
        for result in results:
            while not result.done() and do_next(_Part(over, around)):
                pass
            _await(result)
            yield result.result()
    finally:
        waiting.clear()
        over.set()
        if not all(result.done() for result in results):
            futures.wait([helper for helper in helpers if not helper.cancel()])


class _Part(Work):
    """Work on one task, counted apart; it stops when the others are over, or when the work around it does."""

    def __init__(self, over: threading.Event, around: Work | None = None) -> None:
        super().__init__()
        self._over, self._around = over, around

    def check(self) -> None:
        """Raise KeyboardInterrupt if nobody waits for the task any more, and what the work around it raises."""
        if self._over.is_set():
            raise KeyboardInterrupt
        if self._around is not None:
            self._around.check()


def _await(future: futures.Future[Any]) -> None:
    """Wait until a task is done; a time limit of the work under way ends that."""
    while not future.done():
        futures.wait((future,), timeout=_GLANCE)
        current().check()


class _Inside(threading.local):
    """Whether this thread is doing a task."""

    task = False


_inside = _Inside()


@functools.cache
def processors() -> int:
    """Return the number of processors, which the system is asked for once: each time takes as long as a short task."""
    return os.cpu_count() or 1


@functools.cache
def _threads() -> futures.ThreadPoolExecutor:
    """Return the threads of this process, which are kept: starting them would take longer than most ensembles."""
    return futures.ThreadPoolExecutor(processors())


if sys.platform != "win32":
    os.register_at_fork(after_in_child=_threads.cache_clear)  # a child has none of its parent's threads


def _counted_apart(work: Callable[..., Any], task: Task, part: Work | None = None) -> tuple[Any, Mapping[str, int]]:
    """Do a task, in whatever thread or process; return its result and what it counted."""

    def counted() -> tuple[Any, Mapping[str, int]]:
        with opened(part or Work()) as own:
            return work(*task), dict(own.counts)

    return contextvars.Context().run(counted)  # it may run in the calling thread
