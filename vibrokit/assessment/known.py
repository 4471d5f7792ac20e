"""Known: a structure and results that exist already, as objects or files, and what they say of each attractor."""

from __future__ import annotations

import dataclasses
import itertools
import os
from collections.abc import Iterable
from typing import Any

from vibrokit.analyzers.exits import Exit
from vibrokit.analyzers.settings import exit_data
from vibrokit.assessment.assessment import Assessment
from vibrokit.errors import StructureError, shown
from vibrokit.oscillator import Oscillator
from vibrokit.results.comparable import check_comparable, check_scene, differences
from vibrokit.results.files import load_result
from vibrokit.results.merging import analyzed_labels, part_of
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.section import Section
from vibrokit.results.structure import Structure
from vibrokit.scene_file import scene_data


@dataclasses.dataclass(frozen=True, eq=False)
class Known:
    """What is known before an assessment.

    Attributes
    ----------
    structures : tuple of Structure
    results : tuple of Result
        Those of an assessment of less accuracy than is wanted are marked incomplete.
    """

    structures: tuple[Structure, ...]
    results: tuple[Result, ...]

    @classmethod
    def of(cls, given: Iterable[Any], accuracy: float) -> Known:
        """Sort records and paths of files; raises a VibrokitError for what is neither."""
        structures, results = [], []
        for one in given:
            record = load_result(one) if isinstance(one, str | os.PathLike) else one
            match record:
                case Assessment():
                    structures.append(record.structure)
                    results += [_at(part, record, accuracy) for name in record.results for part in record.parts(name)]
                case Structure():
                    structures.append(record)
                case Result():
                    results.append(record)
                case _:
                    raise StructureError(
                        "what is known must be a structure, a result or an assessment, or the file of one, got "
                        f"{f'a record of kind {record.kind!r}' if isinstance(record, Record) else shown(record)}."
                    )
        return cls(tuple(structures), tuple(results))

    def check(self, osc: Oscillator, exit: Exit) -> None:  # noqa: A002 - the name that analyzers use
        """Raise StructureError for a record of another scene, or a result of another exit."""
        for structure in self.structures:
            check_scene("the known structure", structure, scene_data(osc))
        for known in self.results:
            name = str(known.settings.get("analyzer") or known.kind)
            check_scene(f"the known result of {name}", known, scene_data(osc))
            _check_exit(name, known, exit)

    def parts(self, osc: Oscillator, structure: Structure, exit: Exit) -> dict[tuple[str, int], Result]:  # noqa: A002
        """Return the results by analyzer and label; raises StructureError for those of another scene, states or exit.

        A second result of the same analyzer and attractor is beside the first, with a number in its name.
        """
        parts: dict[tuple[str, int], Result] = {}
        for known in self.results:
            name = str(known.settings.get("analyzer") or known.kind)
            check_comparable(f"the known result of {name}", known, scene_data(osc), Section.of(structure))
            _check_exit(name, known, exit)
            for label in analyzed_labels(known):
                part = part_of(known, label)
                keys = itertools.chain([name], (f"{name} {number}" for number in itertools.count(2)))
                key = next(one for one in keys if (one, label) not in parts or _same(parts[one, label], part))
                parts.setdefault((key, label), part)
        return parts


def _at(part: Result, known: Assessment, accuracy: float) -> Result:
    return part if known.settings["accuracy"] <= accuracy else dataclasses.replace(part, complete=False)


def _check_exit(name: str, known: Result, exit: Exit) -> None:  # noqa: A002 - the name that analyzers use
    counted = known.settings.get("exit")
    changed = "" if counted is None else differences(exit_data(exit), counted, "exit")
    if changed:
        raise StructureError(
            f"the known result of {name} counts other exits than those that are asked for: {changed}. Ask for the same "
            "exit, or leave the result out."
        )


def _same(one: Result, other: Result) -> bool:
    """Whether two results have the same numbers."""
    first, second = ([(e.source, e.target, e.value) for e in each.energies] for each in (one, other))
    return first == second and one.rates == other.rates
