"""Checks that the parts of a scene fit together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from vibrokit.arguments import members, real
from vibrokit.errors import SceneError, shown
from vibrokit.parts.barrier import Barrier
from vibrokit.parts.excitation import Excitation
from vibrokit.parts.noise import NoiseModel


def checked_parts(name: str, parts: Any, kind: type) -> tuple[Any, ...]:
    """Return parts as a tuple; raise SceneError unless they are a sequence of parts of a kind."""
    if isinstance(parts, kind):
        raise SceneError(f"scene: {name} must be a sequence, got a single {type(parts).__name__}; give a list of it.")
    found = members(parts)
    if found is None:
        raise SceneError(f"scene: {name} must be a sequence of {kind.__name__} objects, got {shown(parts)}.")
    for part in found:
        if not isinstance(part, kind):
            raise SceneError(f"scene: {name} must be of type {kind.__name__}, got {shown(part)}.")
    return found


def check_names(noise: NoiseModel) -> None:
    """Refuse names of extra states that are none, or not distinct."""
    names: Any = noise.extra_states
    fits = isinstance(names, tuple) and all(isinstance(name, str) and name for name in names)
    if not fits or len(set(names)) < len(names):
        raise SceneError(
            f"scene: {type(noise).__name__}.extra_states must be a tuple of distinct names, such as ('y',), got "
            f"{shown(names)}."
        )


def check_stops(barriers: Sequence[Barrier]) -> None:
    """Refuse two stops on one side, and a left stop to the right of the right one."""
    for side in ("left", "right"):
        places = [barrier.position for barrier in barriers if barrier.side == side]
        if len(places) > 1:
            raise SceneError(
                f"scene: at most one stop per side is allowed, got {len(places)} on the {side} side, at "
                f"{', '.join(f'{p:g}' for p in places)}."
            )
    stops = {barrier.side: barrier.position for barrier in barriers}
    if len(stops) == 2 and stops["left"] > stops["right"]:
        raise SceneError(
            f"scene: the left stop, at {stops['left']:g}, is to the right of the right stop, at "
            f"{stops['right']:g}; exchange them, or give both the same position."
        )


def check_periods(excitations: Sequence[Excitation]) -> None:
    """Refuse a period that is none."""
    for index, part in enumerate(excitations):
        period = part.period
        if period is not None and not real(period) > 0:
            raise SceneError(
                f"scene: the period of excitations.{index} ({type(part).__name__}) must be a positive number, None "
                f"for a constant force, or math.inf for one that never repeats, got {shown(period)}."
            )
