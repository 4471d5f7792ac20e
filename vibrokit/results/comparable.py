"""Whether a result is of a given scene and of given steady states."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibrokit.errors import StructureError, shown
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.section import Section

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
    return {**scene, "noise": noise}


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
