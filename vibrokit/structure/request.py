"""Request: what the searches are asked for, checked before any work is done."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import json
from numbers import Integral, Real
from typing import Any

from vibrokit.errors import SceneError, StepperError, StructureError, shown
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.structure import Structure
from vibrokit.scene_file import scene_data

_MOST_CELLS = 10**9


@dataclasses.dataclass(frozen=True)
class Request:
    """Counts and sizes that `find_structure` was given.

    Raises
    ------
    StructureError
        One of them is not what it must be.
    """

    cells: Any
    refine: Any
    margin: Any
    starts: Any
    settling: Any
    budget: Any

    def __post_init__(self) -> None:
        settling = self.settling
        if isinstance(settling, bool) or not isinstance(settling, Real) or not 0 < float(settling) <= 0.5:
            raise StructureError(
                f"settling is {shown(settling)}; give a share of the region's size, above 0 and at most 0.5."
            )
        checked = {
            "cells": pair("cells", self.cells),
            "starts": pair("starts", self.starts),
            "settling": float(settling),
            "refine": whole("refine", self.refine, 0, 10),
            "margin": None if self.margin is None else whole("margin", self.margin, 1, 100),
            "budget": None if self.budget is None else whole("budget", self.budget, 1, _MOST_CELLS),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        if self.cells[0] * self.cells[1] * 4**self.refine > _MOST_CELLS:
            raise StructureError(
                f"refine is {self.refine}, which makes more than {_MOST_CELLS} cells of {self.cells}; take fewer."
            )


def whole(name: str, number: Any, least: int, most: int) -> int:
    """Return a whole number within bounds.

    Raises
    ------
    StructureError
        It is none.
    """
    if isinstance(number, bool) or not isinstance(number, Integral) or not least <= int(number) <= most:
        raise StructureError(f"{name} is {shown(number)}; give a whole number from {least} to {most}.")
    return int(number)


def pair(name: str, counts: Any, most: int = _MOST_CELLS) -> tuple[int, int]:
    """Return two whole numbers, 1 or more, whose product is within bounds.

    Raises
    ------
    StructureError
        They are not that.
    """
    try:
        first, second = (whole(name, count, 1, most) for count in counts)
    except (TypeError, ValueError, StructureError):
        first = second = most + 1
    if first * second > most:
        raise StructureError(
            f"{name} is {shown(counts)}; give two whole numbers, 1 or more, whose product is at most {most}."
        )
    return first, second


def check_means(osc: Any, stepper: Any, executor: Any, progress: Any) -> None:
    """Refuse what is no oscillator, stepper, executor or callable, before any work is done.

    Raises
    ------
    SceneError, StepperError, StructureError
        In this order, what each is of.
    """
    if not isinstance(osc, Oscillator):
        raise SceneError(f"the oscillator is {shown(osc)}, which is none; compose one, or load_scene a bundled one.")
    if stepper is not None and not isinstance(stepper, Stepper):
        raise StepperError(f"the stepper is {shown(stepper)}, which is none; give one, such as RK4(steps=256).")
    if executor is not None and not isinstance(executor, concurrent.futures.Executor):
        raise StructureError(
            f"executor is {shown(executor)}, which is none; give a concurrent.futures.Executor, or None for threads."
        )
    if progress is not None and not callable(progress):
        raise StructureError(f"progress is {shown(progress)}, which cannot be called; give a function of two numbers.")


def check_belongs(osc: Oscillator, structure: Any) -> None:
    """Refuse a structure that is not one of this oscillator; noise may differ, for a structure knows none.

    Raises
    ------
    StructureError
        It is none, or is of another scene.
    """
    if not isinstance(structure, Structure):
        raise StructureError(f"the structure is {shown(structure)}, which is none; give what find_structure returned.")
    ours, theirs = (_without_noise(data) for data in (scene_data(osc), structure.scene))
    if ours != theirs:
        raise StructureError(
            "the structure is that of another scene, or of this one with other numbers; give the one that "
            "find_structure returns for this oscillator."
        )
    size = 2 + (len(osc.noise.extra_states) if osc.noise else 0)
    if any(attractor.points.shape[1] != size for attractor in structure.attractors):
        raise StructureError(
            f"the structure was found without the states that the noise has of its own, so its points are not the "
            f"{size} numbers long that this oscillator needs; find the structure of the scene with this noise."
        )


def _without_noise(data: Any) -> str:
    return json.dumps({name: value for name, value in data.items() if name != "noise"}, sort_keys=True, default=str)
