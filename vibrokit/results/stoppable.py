"""Stoppable: a stage of work that Ctrl-C or a time limit may end, and the work around it goes on."""

from __future__ import annotations

from types import TracebackType

from vibrokit.errors import OutOfTime
from vibrokit.progress import Deadline, current
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding


class Stoppable:
    """A stage of which nothing that was found is lost if it is stopped.

    ``with Stoppable("graph", source) as search:`` ends where the work is stopped. The work around it then has
    `vibrokit.progress.AFTERWARDS` seconds to make use of what was found.

    Parameters
    ----------
    doing : str
        The stage, as its finding names it; it may change on the way.
    source : int, optional
        Label of the attractor that it is about.

    Attributes
    ----------
    findings : tuple of Finding
        That it was stopped; empty if it was not.
    """

    def __init__(self, doing: str, source: int | None = None) -> None:
        self.doing, self.source = doing, source
        self.findings: tuple[Finding, ...] = ()

    @property
    def stopped(self) -> bool:
        """Whether it was stopped before its end."""
        return bool(self.findings)

    def __enter__(self) -> Stoppable:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> bool:
        if not isinstance(error, KeyboardInterrupt | OutOfTime):
            return False
        limited = isinstance(error, Deadline | OutOfTime)
        if not limited:
            current().wind_up()
        reason = "time limit" if limited else "interrupt"
        self.findings = (Finding.of(Code.STOPPED, self.source, stage=self.doing, reason=reason),)
        return True
