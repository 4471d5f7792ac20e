"""Shows the progress of long work on standard error."""

from __future__ import annotations

import dataclasses
import math
import os
import sys
import time
from collections.abc import Callable
from typing import Annotated, TextIO

from vibrokit.documented import documented

_PATIENCE = 1.0  # seconds after which a stage is shown
_PAUSE = 0.2  # seconds between two changes of the line
_WIDTH = 80  # columns of a terminal that does not tell


@documented
@dataclasses.dataclass(frozen=True)
class Update:
    """What a listener is told."""

    stage: Annotated[str, 'what is being done, such as "basins" or "graph"']
    subject: Annotated[str, "the attractor or other thing that the work is about; may be empty"]
    done: Annotated[int, "how many units are done"]
    total: Annotated[int | None, "how many there are; None where that is not known beforehand"]
    unit: Annotated[str, "what is counted, in the plural"]
    elapsed: Annotated[float, "time since the stage began", "s"]
    remaining: Annotated[float | None, "estimated time until it ends; it never grows, and None is unknown", "s"]
    compiling: Annotated[bool, "whether a kernel is being compiled"] = False
    finished: Annotated[bool, "whether the stage has ended"] = False


class Display:
    """A live line on a terminal; elsewhere one line for each stage that took a while, once it has ended.

    The stream is by default standard error; the clock returns the time (s).
    """

    def __init__(self, stream: TextIO | None = None, clock: Callable[[], float] = time.perf_counter) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._clock = clock
        self._live = self._stream.isatty()
        self._changed = -math.inf
        self._length = 0  # of the line that is shown

    def __call__(self, update: Update) -> None:
        """Show an update."""
        if self._live:
            self._draw(update)
        elif update.finished and update.unit and update.elapsed >= _PATIENCE:
            self._write(f"{_title(update)}: {_done(update)}{_duration(update.elapsed)}\n")

    def _draw(self, update: Update) -> None:
        if update.finished:
            self._show("")
        elif update.compiling or (update.elapsed >= _PATIENCE and self._clock() - self._changed >= _PAUSE):
            self._changed = self._clock()
            self._show(_line(update)[: self._width() - 1])

    def _show(self, line: str) -> None:
        """Replace the line that is shown."""
        if line or self._length:
            self._write(f"\r{line:<{self._length}}" + ("" if line else "\r"))
        self._length = len(line)

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()

    def _width(self) -> int:
        try:
            return os.get_terminal_size(self._stream.fileno()).columns or _WIDTH
        except OSError:
            return _WIDTH


def _title(update: Update) -> str:
    return f"{update.stage}, {update.subject}" if update.subject else update.stage


def _done(update: Update) -> str:
    return f"{update.done} {update.unit}, " if update.unit and update.done else ""


def _line(update: Update) -> str:
    if update.compiling:
        return f"{_title(update)}: compiling"
    if not update.total:
        return f"{_title(update)}: {_done(update)}{_duration(update.elapsed)} so far, duration unknown"
    done = f"{update.done} of {update.total} {update.unit}".rstrip()
    left = "" if update.remaining is None else f", about {_duration(update.remaining)} left"
    return f"{_title(update)}: {done}, {_duration(update.elapsed)} so far{left}"


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
