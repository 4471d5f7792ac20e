"""The material of a report: records of one scene, merged into one assessment where they belong together."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from vibrokit.assessment.assessment import Assessment
from vibrokit.comparison.reconcile import numbered
from vibrokit.errors import ArgumentError, shown
from vibrokit.results.one_scene import check_comparable, check_scene
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.section import Section
from vibrokit.results.structure import Structure


def gathered(records: Sequence[Record]) -> list[Record]:
    """Return the records of a report: a structure and its results become one assessment.

    Raises
    ------
    ArgumentError
        There is no record, something is no record, or there are two assessments or two structures.
    StructureError
        The records are of different scenes, or a result is of other steady states than the structure.
    """
    if not records:
        raise ArgumentError("a report needs a record at least, such as an assessment, a structure or a result.")
    for one in records:
        if not isinstance(one, Record):
            raise ArgumentError(f"a report is made of records, such as an assessment or a result, got {shown(one)}.")
        check_scene("a record", one, records[0].scene)
    wholes = [one for one in records if isinstance(one, Assessment)]
    structures = [one for one in records if isinstance(one, Structure)]
    if len(wholes) > 1 or len(structures) > 1:
        raise ArgumentError(
            f"a report is of one assessment and one structure at most, got {len(wholes)} and {len(structures)}; make a "
            "report of each."
        )
    whole = wholes[0] if wholes else None
    structure = structures[0] if structures else whole.structure if whole else None
    results = [one for one in records if isinstance(one, Result)]
    if structure is None or (whole is None and not results):
        return list(records)
    others = [one for one in records if not isinstance(one, Assessment | Structure | Result)]
    return [_assessment(whole, structure, results), *others]


def _assessment(whole: Assessment | None, structure: Structure, results: Sequence[Result]) -> Assessment:
    """An assessment with further results, or one of a structure and results."""
    named = dict(whole.results) if whole else {}
    for one in results:
        check_comparable("a result", one, structure.scene, Section.of(structure))
        named[next(name for name in numbered(one.made_by) if name not in named)] = one
    if whole is not None:
        return dataclasses.replace(whole, results=named)
    return Assessment(
        structure=structure,
        results=named,
        scene=results[0].scene,
        complete=structure.complete and all(one.complete for one in results),
        seconds=structure.seconds + sum(one.seconds for one in results),
        versions=structure.versions,
    )
