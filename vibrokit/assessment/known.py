"""Known: a structure and results that exist already, as objects or files, and what they say of each attractor."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Iterable
from typing import Any

from vibrokit.analyzers.exits import Exit
from vibrokit.analyzers.settings import exit_data
from vibrokit.assessment.assessment import Assessment
from vibrokit.comparison.reconcile import numbered
from vibrokit.errors import StructureError, shown
from vibrokit.oscillator import Oscillator
from vibrokit.results.files import load_result
from vibrokit.results.one_scene import analyzed_labels, check_comparable, check_scene, differences, part_of
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.section import Section
from vibrokit.results.structure import Structure
from vibrokit.scene_file import scene_data

Part = tuple[Result, float]
"""A result on one attractor, and the accuracy for which its analysis came to its end; infinite if it did not."""


@dataclasses.dataclass(frozen=True, eq=False)
class Known:
    """What is known before an assessment."""

    structures: tuple[Structure, ...]
    results: tuple[Part, ...]

    @classmethod
    def of(cls, given: Iterable[Any], accuracy: float) -> Known:
        """Sort records and paths of files; a result of its own counts as of the accuracy that is wanted.

        Raises a VibrokitError for an object that is neither.
        """
        structures, results = [], []
        for one in given:
            record = load_result(one) if isinstance(one, str | os.PathLike) else one
            match record:
                case Assessment():
                    structures.append(record.structure)
                    results += [part for name in record.results for part in record.parts(name).values()]
                case Structure():
                    structures.append(record)
                case Result():
                    results.append((record, accuracy if record.complete else math.inf))
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
        for known, _ in self.results:
            check_scene(f"the known result of {known.made_by}", known, scene_data(osc))
            counted = known.settings.get("exit")
            if counted is not None and (changed := differences(exit_data(exit), counted, "exit")):
                raise StructureError(
                    f"the known result of {known.made_by} counts other exits than those that are asked for: {changed}. "
                    "Ask for the same exit, or leave the result out."
                )

    def parts(self, osc: Oscillator, structure: Structure) -> dict[tuple[str, int], Part]:
        """Return the results by analyzer and label, and the accuracy of each.

        A second result of the same analyzer and attractor is beside the first, with a number in its name. Raises
        StructureError for results of other states.
        """
        parts: dict[tuple[str, int], Part] = {}
        for known, accuracy in self.results:
            name = known.made_by
            check_comparable(f"the known result of {name}", known, scene_data(osc), Section.of(structure))
            for label in analyzed_labels(known):
                part = part_of(known, label)
                free = (one for one in numbered(name) if (one, label) not in parts or _same(parts[one, label][0], part))
                key = next(free)
                parts.setdefault((key, label), (part, accuracy))
        return parts


def _same(one: Result, other: Result) -> bool:
    """Whether two results have the same numbers."""
    first, second = ([(e.source, e.target, e.value) for e in each.energies] for each in (one, other))
    return first == second and one.rates == other.rates
