"""Results of conformance checks."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable
from typing import NamedTuple

from vibrokit.errors import VibrokitError


class ConformanceError(AssertionError):
    """A part fails a conformance check; the message says which requirement it violates."""


class Check(NamedTuple):
    """One check of one part: its name, and the function that performs it.

    The function returns a remark (a measured value), or raises ConformanceError.
    """

    name: str
    perform: Callable[[], str]


@dataclasses.dataclass(frozen=True)
class Outcome:
    """Result of one check.

    Attributes
    ----------
    subject : str
        The checked part.
    name : str
    passed : bool
    text : str
        The remark of the check, or the reason of its failure.
    """

    subject: str
    name: str
    passed: bool
    text: str

    @property
    def line(self) -> str:
        """One line for a table."""
        return f"{'ok    ' if self.passed else 'FAILED'}  {self.name}" + (f": {self.text}" if self.text else "")


@dataclasses.dataclass(frozen=True)
class Report:
    """Results of all checks of one part, or of all parts of one name.

    Attributes
    ----------
    outcomes : tuple of Outcome
    """

    outcomes: tuple[Outcome, ...]

    @property
    def passed(self) -> bool:
        """True if every check passed."""
        return all(outcome.passed for outcome in self.outcomes)

    @property
    def lines(self) -> tuple[str, ...]:
        """A heading for each checked part, followed by one line per check."""
        lines: list[str] = []
        subject = None
        for outcome in self.outcomes:
            if outcome.subject != subject:
                subject = outcome.subject
                lines.append(subject)
            lines.append(f"  {outcome.line}")
        return tuple(lines)

    def __str__(self) -> str:
        return "\n".join(self.lines)


def guarded(perform: Callable[[], str]) -> Callable[[], str]:
    """Return a check that raises ConformanceError whatever exception the part raises."""

    @functools.wraps(perform)
    def performed() -> str:
        try:
            return perform()
        except ConformanceError:
            raise
        except VibrokitError as error:
            raise ConformanceError(str(error)) from error
        except Exception as error:
            raise ConformanceError(f"The part raised {type(error).__name__}: {error}.") from error

    return performed


def run_checks(subject: str, checks: Iterable[Check]) -> Report:
    """Perform every check; a failure with the same message as an earlier one refers to that one."""
    outcomes: list[Outcome] = []
    first_with: dict[str, str] = {}
    for name, perform in checks:
        try:
            outcomes.append(Outcome(subject, name, True, perform()))
        except ConformanceError as error:
            first = first_with.setdefault(str(error), name)
            text = str(error) if first == name else f"not checked, because {first!r} failed."
            outcomes.append(Outcome(subject, name, False, text))
    return Report(tuple(outcomes))


def raise_failures(report: Report) -> Report:
    """Return a report if every check passed; otherwise raise ConformanceError with all failures."""
    failed = [f"{outcome.name}: {outcome.text}" for outcome in report.outcomes if not outcome.passed]
    if failed:
        count = f"{len(failed)} of {len(report.outcomes)} checks"
        raise ConformanceError("\n".join([f"{report.outcomes[0].subject}, fails {count}.", *failed]))
    return report
