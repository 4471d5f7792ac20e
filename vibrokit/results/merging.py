"""merged: one result of an analyzer from runs that left different attractors; part_of: the way back."""

from __future__ import annotations

import dataclasses
import functools
import operator
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import xarray

from vibrokit.errors import StructureError
from vibrokit.results.comparable import noiseless
from vibrokit.results.data import joined
from vibrokit.results.labels import label_of
from vibrokit.results.result import Result

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
