"""merged: one result of an analyzer from runs that left different attractors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from vibrokit.errors import StructureError
from vibrokit.results.data import joined
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
    if any((type(one), one.scene, one.names) != (type(first), first.scene, first.names) for one in results):
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
        settings={**first.settings, "source": None, "intensities": None},
        findings=tuple(finding for one in results for finding in one.findings),
        stats=first.stats,
        complete=all(one.complete for one in results),
        seed=first.seed,
        seconds=float(np.sum([one.seconds for one in results])),
        energies=tuple(energy for one in results for energy in one.energies),
        branches=tuple(branch for one in results for branch in one.branches),
        section=first.section,
        data=joined(data, first.names),
    )


def _sources(result: Result) -> list[int]:
    return result.data["source"].values.tolist() if "source" in result.data else []
