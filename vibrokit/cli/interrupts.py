"""Ctrl-C during a run: the first one asks the work to stop, which loses nothing; a second one stops it at once."""

from __future__ import annotations

import contextlib
import os
import signal
from types import FrameType
from typing import Any

from vibrokit.progress import Work

_NOTICE = b"\nvibrokit: stopping; what was found is kept. Press Ctrl-C again to stop at once.\n"
_STANDARD_ERROR = 2  # its descriptor: Python's own stream may be in use when a signal arrives


class Interrupts:
    """Handles Ctrl-C while it is open.

    Python raises KeyboardInterrupt between any two steps, also between the end of a piece of work and the statement
    that keeps its result. Here the first Ctrl-C raises nothing: it is remembered, and the work itself raises it at its
    next report. What was found is saved and printed in a second phase, which a Ctrl-C does not disturb. A second Ctrl-C
    in either phase raises KeyboardInterrupt at once.
    """

    def __init__(self) -> None:
        self.requested = False  # whether Ctrl-C was pressed
        self._work: Work | None = None
        self._presses = 0  # in this phase
        self._finishing = False

    def __enter__(self) -> Interrupts:
        self._previous: Any = signal.signal(signal.SIGINT, self._received)
        return self

    def __exit__(self, *error: object) -> None:
        signal.signal(signal.SIGINT, self._previous)

    def stops(self, work: Work) -> None:
        """From now on, ask this work to stop."""
        self._work = work
        if self.requested:
            work.interrupt()

    def finishing(self) -> None:
        """Begin the second phase."""
        self._finishing, self._work, self._presses = True, None, 0

    def _received(self, number: int, frame: FrameType | None) -> None:
        self.requested = True
        self._presses += 1
        if self._presses % 2 == 0:
            raise KeyboardInterrupt
        if self._work is not None:
            self._work.interrupt()
        if not self._finishing:
            with contextlib.suppress(OSError):
                os.write(_STANDARD_ERROR, _NOTICE)
