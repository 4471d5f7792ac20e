"""Ctrl-C and SIGTERM during a run: the first asks the work to stop, and nothing is lost; a second Ctrl-C stops it."""

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

    @property
    def status(self) -> int:
        """Exit status after a signal, as shells have it: 130 after Ctrl-C, 143 after SIGTERM."""
        assert self.received is not None
        return 128 + self.received

    def stops(self, work: Work) -> None:
        """From now on, ask this work to stop."""
        self._work = work
        if self.requested:
            work.interrupt()

    def finishing(self) -> None:
        """Begin the second phase."""
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
