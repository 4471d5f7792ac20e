"""What a conformance check says: one sentence for each thing that does not hold."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable
from typing import NamedTuple

from vibrokit.errors import VibrokitError


class ConformanceError(AssertionError):
    """A part does not behave as parts must; the text says in sentences what does not hold."""


class Check(NamedTuple):
    """One check of one part, a pair: its name, and a function that makes it.

    The function returns a remark (what was measured), or raises ConformanceError.
    """

    name: str
    make: Callable[[], str]


@dataclasses.dataclass(frozen=True)
class Finding:
    """What came of one check.

    Attributes
    ----------
    subject : str
        The part that was checked.
    name : str
    passed : bool
    text : str
        What was measured, or what does not hold.
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
    """What came of all checks of one part, or of several of one name.

    Attributes
    ----------
    findings : tuple of Finding
    """

    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """True if everything held."""
        return all(finding.passed for finding in self.findings)

    @property
    def lines(self) -> tuple[str, ...]:
        """Each part that was checked, and under it one line for each check."""
        lines: list[str] = []
        subject = None
        for finding in self.findings:
            if finding.subject != subject:
                subject = finding.subject
                lines.append(subject)
            lines.append(f"  {finding.line}")
        return tuple(lines)

    def __str__(self) -> str:
        return "\n".join(self.lines)


def told(make: Callable[[], str]) -> Callable[[], str]:
    """Return a check that fails with a sentence, whatever the part does."""

    @functools.wraps(make)
    def made() -> str:
        try:
            return make()
        except ConformanceError:
            raise
        except VibrokitError as error:
            raise ConformanceError(str(error)) from error
        except Exception as error:
            raise ConformanceError(f"The part raised {type(error).__name__}: {error}.") from error

    return made


def make_all(subject: str, checks: Iterable[Check]) -> Report:
    """Make every check; one failure does not hide the others, but its consequences are not told twice."""
    findings: list[Finding] = []
    told: dict[str, str] = {}
    for name, make in checks:
        try:
            findings.append(Finding(subject, name, True, make()))
        except ConformanceError as error:
            first = told.setdefault(str(error), name)
            text = str(error) if first == name else f"cannot be told before {first!r} holds."
            findings.append(Finding(subject, name, False, text))
    return Report(tuple(findings))


def raise_failures(report: Report) -> Report:
    """Return a report in which everything held, or raise ConformanceError with what did not."""
    failed = [f"{finding.name}: {finding.text}" for finding in report.findings if not finding.passed]
    if failed:
        count = f"{len(failed)} of {len(report.findings)} checks"
        raise ConformanceError("\n".join([f"{report.findings[0].subject}, fails {count}.", *failed]))
    return report
