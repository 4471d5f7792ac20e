"""Helpers of commands with long work: files are checked first, progress is shown, a limit or Ctrl-C stops it."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

from vibrokit.progress import Work, working
from vibrokit.results.atomic import checked_picture, checked_target

_NOTICE = b"\nvibrokit: stopping; the results so far are kept. Press Ctrl-C again to stop at once.\n"
_STANDARD_ERROR = 2  # its descriptor: Python's own stream may be in use when a signal arrives


def check_targets(*files: Path | None, picture: Path | None = None) -> None:
    """Refuse, before any work is done, files and a picture that cannot be written; None stands for no file."""
    for target in (*files, picture):
        if target is not None:
            checked_target(target)
    if picture is not None:
        checked_picture(picture)


def scene_stem(scene: str) -> str:
    """Return the name of a scene without its folder and ending."""
    return Path(scene).name.removesuffix(".toml")


def source_of(text: str | None) -> int | str | None:
    """Return the label or the name of an attractor, or None for all."""
    return int(text) if text is not None and text.isdecimal() else text


class Interrupts:
    """Handles Ctrl-C and SIGTERM, which batch queues send, while it is open.

    Python raises KeyboardInterrupt between any two steps, also between the end of a piece of work and the statement
    that keeps its result. Here the first signal raises nothing: it is remembered, and the work itself raises it at its
    next report. What was found is saved and printed in a second phase, which a signal does not disturb. A second Ctrl-C
    in either phase raises KeyboardInterrupt at once. SIGTERM never does: programs send it more than once in a row.
    """

    def __init__(self) -> None:
        self.received: int | None = None  # the first signal
        self._work: Work | None = None
        self._presses = 0  # in this phase
        self._finishing = False

    def __enter__(self) -> Interrupts:
        self._previous: dict[int, Any] = {
            number: signal.signal(number, self._receive) for number in (signal.SIGINT, signal.SIGTERM)
        }
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    @property
    def requested(self) -> bool:
        """Whether a signal was received."""
        return self.received is not None

    def status(self, own: int) -> int:
        """Return the exit status: after a signal as shells have it, 130 or 143, and otherwise that of the work."""
        return own if self.received is None else 128 + self.received

    @contextlib.contextmanager
    def working(self, time_limit: float | None) -> Iterator[Work]:
        """Open work that shows its progress and that a signal asks to stop; its end begins the second phase."""
        try:
            with working(True, time_limit) as work:
                self._work = work
                if self.requested:
                    work.interrupt()
                yield work
        finally:
            self._finishing, self._work, self._presses = True, None, 0

    def _receive(self, number: int, frame: FrameType | None) -> None:
        again = self._presses > 0
        self.received = number if self.received is None else self.received
        self._presses = max(1, self._presses) if number == signal.SIGTERM else self._presses + 1
        if number == signal.SIGINT and self._presses % 2 == 0:
            raise KeyboardInterrupt
        if self._work is not None:
            self._work.interrupt()
        if not self._finishing and not again:
            with contextlib.suppress(OSError):
                os.write(_STANDARD_ERROR, _NOTICE)
