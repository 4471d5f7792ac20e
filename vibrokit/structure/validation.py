"""Arguments of the searches, checked before any work is done."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from numbers import Integral
from typing import Any

import numpy as np

from vibrokit.arguments import MOST_CELLS, members, pair, real, whole
from vibrokit.errors import StructureError, shown
from vibrokit.kernels.named import check_stepper, name_of, named_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.tasks import check_executor
from vibrokit.oscillator import Oscillator, check_oscillator, generator_from
from vibrokit.results.one_scene import per_unit_mass
from vibrokit.results.region import Region
from vibrokit.results.structure import Structure
from vibrokit.scene_file import scene_data

DEFAULT_CELLS = (200, 200)
"""Of the finest basin grid."""


@dataclasses.dataclass(frozen=True)
class Request:
    """Arguments of `find_structure`; a StructureError is raised if one of them is not allowed."""

    region: Any
    cells: Any
    refine: Any
    margin: Any
    starts: Any
    settling: Any
    budget: Any
    edge_budget: Any
    saddles: Any
    manifolds: Any
    stepper: Stepper | None
    rng: int

    def __post_init__(self) -> None:
        settling = real(self.settling)
        if not 0 < settling <= 0.5:
            raise StructureError(
                "settling must be a fraction of the region's widths, above 0 and at most 0.5, got "
                f"{shown(self.settling)}."
            )
        for name in ("saddles", "manifolds"):
            if not isinstance(getattr(self, name), bool):
                raise StructureError(f"{name} must be True or False, got {shown(getattr(self, name))}.")
        checked = {
            "region": None if self.region is None else Region.of(self.region),
            "cells": None if self.cells is None else pair("cells", self.cells),
            "starts": pair("starts", self.starts),
            "settling": settling,
            "refine": whole("refine", self.refine, 0, 10),
            "margin": None if self.margin is None else whole("margin", self.margin, 1, 100),
            "budget": None if self.budget is None else whole("budget", self.budget, 1, MOST_CELLS),
            "edge_budget": None if self.edge_budget is None else whole("edge_budget", self.edge_budget, 1, 10**12),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        cells = self.cells or DEFAULT_CELLS
        if math.prod(cells) * 4**self.refine > MOST_CELLS:
            raise StructureError(
                f"refine = {self.refine} makes more than {MOST_CELLS} cells of {cells}; give a smaller number."
            )

    @property
    def settings(self) -> dict[str, Any]:
        """The arguments as plain data."""
        return plain({field.name: getattr(self, field.name) for field in dataclasses.fields(self)})


def plain(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments as plain data, which the same call takes."""
    return {name: _plain(value) for name, value in arguments.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, Region):
        return value.bounds.tolist()
    if isinstance(value, Stepper):
        return name_of(value)
    return list(value) if isinstance(value, tuple) else value


def stepper_of(stepper: Stepper | str | None) -> Stepper | None:
    """Return the stepper that a text describes; everything else as it is, for `check_means`."""
    return named_stepper(stepper) if isinstance(stepper, str) else stepper


def seed_of(rng: int | np.random.Generator) -> int:
    """Return a seed, or draw one from a generator; a ParameterError is raised for anything else."""
    generator = generator_from(rng)
    return int(rng) if isinstance(rng, Integral) else int(generator.integers(2**63))


def share(name: str, number: Any, least: float = 0.0) -> None:
    """Refuse a number that is not a share: above 0, at most 1 and not below `least`."""
    if not max(least, math.ulp(0.0)) <= real(number) <= 1:
        allowed = f"from {least:g} to 1" if least else "above 0 and at most 1"
        raise StructureError(f"{name} must be {allowed}, got {shown(number)}.")


def gibibytes(name: str, amount: Any) -> float:
    """Return an amount of memory (GiB); a StructureError is raised unless it is a positive number."""
    if not real(amount) > 0:
        raise StructureError(f"{name} must be a positive number of GiB, got {shown(amount)}.")
    return real(amount)


def intensities(caller: str, given: Any) -> tuple[float, ...]:
    """Return noise intensities in descending order, each once; raises StructureError unless all are positive."""
    found = members(given)
    listed = (given,) if found is None else found
    for intensity in listed:
        if not 0 < real(intensity) < math.inf:
            raise StructureError(f"{caller}: intensities must be positive numbers, got {shown(intensity)}.")
    if not listed:
        raise StructureError(f"{caller}: intensities must contain at least one number, got ().")
    return tuple(sorted({real(intensity) for intensity in listed}, reverse=True))


def check_means(osc: Any, stepper: Any, executor: Any) -> None:
    """Refuse a wrong oscillator, stepper or executor with a SceneError, StepperError or StructureError."""
    check_oscillator(osc)
    check_stepper(stepper)
    check_executor(executor)


def check_belongs(osc: Oscillator, structure: Any) -> None:
    """Refuse, with a StructureError, a structure that is not one of this oscillator.

    The noise may differ, because it has no effect on a structure.
    """
    if not isinstance(structure, Structure):
        raise StructureError(f"structure must be a Structure from find_structure, got {shown(structure)}.")
    if _without_noise(scene_data(osc)) != _without_noise(structure.scene):
        raise StructureError(
            "the structure is that of another scene, or of this one with other parameters; give the one that "
            "find_structure returns for this oscillator."
        )
    size = 2 + (len(osc.noise.extra_states) if osc.noise else 0)
    if any(attractor.points.shape[1] != size for attractor in structure.attractors):
        raise StructureError(
            f"the points of the structure do not have {size} states, as those of this oscillator with the extra "
            "states of its noise; find the structure of the scene with this noise."
        )


def _without_noise(data: Any) -> str:
    kept = {name: value for name, value in per_unit_mass(data).items() if name != "noise"}
    return json.dumps(kept, sort_keys=True, default=str)
