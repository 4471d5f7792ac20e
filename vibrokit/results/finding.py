"""Findings: what an analysis reports besides its numbers, as data."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from vibrokit.construction import Constructed
from vibrokit.errors import counted, shown
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Code, Severity

Value = float | int | str | bool | None | Sequence[float] | Sequence[int] | Sequence[str]


@dataclasses.dataclass(frozen=True)
class Finding(metaclass=Constructed):
    """One thing that an analysis found; ``str(finding)`` is its sentence.

    Attributes
    ----------
    code : Code
    source, target : int or None
        Labels of the attractors that it is about: the one left and the one reached, or the two on either side of a
        basin boundary. −1 stands for an exit that is not an attractor, `ESCAPED` for motion that leaves the region. In
        a continuation the numbers of branches take the place of labels.
    values : dict
        Numbers and short texts by name, as the code's sentence uses them.

    Raises
    ------
    TypeError
        Values that the code's sentence needs are missing or cannot be shown in it.
    """

    code: Code
    source: int | None = None
    target: int | None = None
    values: Mapping[str, Value] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.code, Code):
            raise TypeError(f"a finding needs a Code, such as Code.REMARK, got {shown(self.code)}.")
        object.__setattr__(self, "values", dict(self.values))
        try:
            self.sentence()
        except (LookupError, ValueError, TypeError, AttributeError, ArithmeticError) as error:
            raise TypeError(
                f"finding {self.code.value!r} has values that do not fit its sentence ({type(error).__name__}: "
                f"{error}); the sentence is {self.code.sentence!r}."
            ) from error

    @classmethod
    def of(cls, code: Code, source: int | None = None, target: int | None = None, **values: Value) -> Finding:
        """Make a finding from its values."""
        return cls(code, source, target, values)

    @property
    def severity(self) -> Severity:
        """How much it matters."""
        return self.code.severity

    @property
    def advice(self) -> str:
        """What to do; empty if nothing is needed."""
        return self.code.advice

    def sentence(self, names: Sequence[str] = ()) -> str:
        """Return the sentence, with attractors by name where names are given, in the order of labels."""
        words = {"state": _named(self.source, names), "goal": _named(self.target, names)}
        text = self.code.sentence.format(**words, **{name: _listed(value) for name, value in self.values.items()})
        return text[:1].upper() + text[1:]

    def __str__(self) -> str:
        return self.sentence()


def check_findings(findings: Any) -> None:
    """Raise TypeError unless all of these are findings."""
    for one in findings if isinstance(findings, list | tuple) else (findings,):
        if not isinstance(one, Finding):
            raise TypeError(
                f"findings must be a tuple of Finding, got {shown(one)}; for a text of your own, make "
                "Finding.of(Code.REMARK, source, text=...)."
            )


def _named(label: int | None, names: Sequence[str]) -> str:
    if label is None or label < 0:
        return "motion that leaves the region" if label == ESCAPED else "the exit"
    return names[label] if label < len(names) else f"attractor {label}"


def together(findings: Iterable[Finding]) -> list[Finding]:
    """Return findings to show, each sentence once.

    Those that differ in numbers only, at several noise intensities, become one with ranges.
    """
    groups: dict[str, list[Finding]] = {}
    for one in findings:
        ranged = "intensity" in one.values
        fixed = {name: value for name, value in one.values.items() if not (ranged and _is_number(value))}
        groups.setdefault(repr((one.code, one.source, one.target, fixed)), []).append(one)
    return list({one.sentence(): one for one in map(_with_ranges, groups.values())}.values())


def _with_ranges(group: Sequence[Finding]) -> Finding:
    values: dict[str, Any] = dict(group[0].values)
    for name in (name for name, value in values.items() if _is_number(value)):
        numbers: list[Any] = [one.values[name] for one in group]
        values[name] = _Range(min(numbers), max(numbers))
    return dataclasses.replace(group[0], values=values)


def _is_number(value: Value) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


@dataclasses.dataclass(frozen=True)
class _Range:
    """The least and the largest of some numbers; shown as one number if both read the same."""

    least: float
    largest: float

    def __format__(self, form: str) -> str:
        least, largest = (format(_listed(end), form) for end in (self.least, self.largest))
        return least if least == largest else f"{least} to {largest}"


class _Count(int):
    """A whole number, shown with a noun if that is its format: ``{count:start}``, ``{count:branch/branches}``."""

    def __format__(self, form: str) -> str:
        return counted(self, *form.split("/")) if form[:2].isalpha() and len(form) > 1 else super().__format__(form)


def _listed(value: Value) -> Value:
    if isinstance(value, int) and not isinstance(value, bool):
        return _Count(value)
    if isinstance(value, list | tuple):
        return ", ".join(f"{entry:.6g}" if isinstance(entry, float) else str(entry) for entry in value) or "none"
    return value
