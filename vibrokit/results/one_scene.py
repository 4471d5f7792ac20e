"""Results of one scene: whether they are, one result of several, and the part of one attractor."""

from __future__ import annotations

import dataclasses
import functools
import math
import operator
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
import xarray

from vibrokit.errors import StructureError, shown
from vibrokit.results.data import joined
from vibrokit.results.labels import label_of
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.section import Section

R = TypeVar("R", bound=Result)


def merged(results: Sequence[R]) -> R:
    """Return one result with the attractors of all; each was run with other settings for each attractor.

    Its settings are those of the first one without the source and the noise intensities, which its arrays have.

    Raises
    ------
    StructureError
        The results are of different classes, scenes or attractors, or two are of the same attractor.
    """
    first = results[0]
    if len(results) == 1:
        return first
    if any(
        (type(one), noiseless(one.scene), one.names) != (type(first), noiseless(first.scene), first.names)
        for one in results
    ):
        raise StructureError("results can be merged if they are of one analyzer and one scene.")
    labels = [label for one in results for label in _sources(one)]
    if len(set(labels)) < len(labels):
        raise StructureError("two of the results that are to be merged are of the same attractor.")
    data = {}
    for one in results:
        for place, label in enumerate(_sources(one)):
            data[label] = one.data.isel(source=place).drop_vars(["source", "source_name"])
    return type(first)(
        scene=first.scene,
        settings={key: None if key in ("source", "intensities") else value for key, value in first.settings.items()},
        findings=tuple(finding for one in results for finding in one.findings),
        stats=functools.reduce(operator.add, (one.stats for one in results)),
        complete=all(one.complete for one in results),
        seed=first.seed,
        seconds=float(np.sum([one.seconds for one in results])),
        energies=tuple(energy for one in results for energy in one.energies),
        branches=tuple(branch for one in results for branch in one.branches),
        section=first.section,
        data=joined(data, first.names),
    )


def part_of(result: R, label: int) -> R:
    """Return what a result says of one of its attractors, with an equal share of the time and the work."""
    sources, analyzed = _sources(result), analyzed_labels(result)
    number, count = analyzed.index(label), len(analyzed)
    general = (None, label) if label == min([*sources, label]) else (label,)  # what is of no attractor is told once
    data = result.data.isel(source=[sources.index(label)]) if label in sources else xarray.Dataset()
    return dataclasses.replace(
        result,
        settings={**result.settings, "source": label},
        findings=tuple(finding for finding in result.findings if finding.source in general),
        energies=tuple(energy for energy in result.energies if energy.source == label),
        branches=tuple(energy for energy in result.branches if energy.source == label),
        stats=result.stats.part(number, count),
        seconds=result.seconds / count,
        data=data,
    )


def analyzed_labels(result: Result) -> list[int]:
    """Return the labels of the attractors that were to be analyzed."""
    source = result.settings.get("source")
    return list(range(len(result.names))) if source is None else [label_of(source, result.names)]


def _sources(result: Result) -> list[int]:
    """Labels of the attractors that have arrays."""
    return result.data["source"].values.tolist() if "source" in result.data else []


_SAME_POINT = 0.01  # of the extent of the region: two searches find one orbit to far better than that
_LARGEST_PERIOD = 64  # points: an orbit has fewer, a sample of chaotic motion more, which no two searches share


def check_scene(which: str, record: Record, scene: Any) -> None:
    """Refuse, with a StructureError, a record of another scene; `which` names it.

    The noise intensity may differ: each rate has its own.
    """
    changed = differences(noiseless(scene), noiseless(record.scene))
    if changed:
        raise StructureError(f"{which} is of another scene: {changed}. Use results of one scene.")


def check_comparable(which: str, result: Result, scene: Any, section: Section) -> None:
    """Refuse, with a StructureError, a result of another scene or of other steady states; `which` names it."""
    check_scene(which, result, scene)
    if result.names != section.names or len(result.section.points) != len(section.points):
        raise StructureError(
            f"{which} has the attractors {', '.join(result.names) or 'none'}, and {', '.join(section.names) or 'none'} "
            "are needed. Run all analyzers on one structure."
        )
    extent = np.ptp(section.bounds, axis=1)
    for name, own, its in zip(section.names, section.points, result.section.points, strict=True):
        if _distance(own, its, extent) > _SAME_POINT:
            raise StructureError(
                f"{name} of {which} lies elsewhere on the section than it should. Run all analyzers on one structure."
            )


def _distance(own: Any, its: Any, extent: Any) -> float:
    """The largest distance of an orbit's points from those of another, in extents of the region."""
    if len(own) > _LARGEST_PERIOD and len(its) > _LARGEST_PERIOD:
        return 0.0
    if len(own) != len(its):
        return math.inf
    return float(max(np.min(np.abs((its[:, :2] - point[:2]) / extent).max(axis=1)) for point in own))


def noiseless(scene: Any) -> dict[str, Any]:
    """Return a scene as plain data without its noise intensity."""
    noise = {key: value for key, value in (scene.get("noise") or {}).items() if key != "intensity"}
    return {**per_unit_mass(scene), "noise": noise}


def per_unit_mass(scene: Any) -> dict[str, Any]:
    """Return what decides the motion in a scene as plain data: without its mass, and without units it was given in."""
    return {key: value for key, value in scene.items() if key not in ("mass", "given")}


def differences(one: Any, other: Any, path: str = "") -> str:
    """Return the first place where plain data differ, with both values; empty if they are equal."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in {**one, **other}:
            found = differences(one.get(key), other.get(key), f"{path}.{key}" if path else str(key))
            if found:
                return found
        return ""
    if isinstance(one, list | tuple) and isinstance(other, list | tuple) and len(one) == len(other):
        pairs = zip(one, other, strict=True)
        return next(filter(None, (differences(a, b, f"{path}.{n}") for n, (a, b) in enumerate(pairs))), "")
    return "" if one == other else f"{path} is {shown(other)} instead of {shown(one)}"
