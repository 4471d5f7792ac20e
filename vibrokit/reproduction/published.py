"""The numbers that the paper prints, and the settings that go with them."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from decimal import Decimal
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Any

_FILE = Path(__file__).with_name("paper.toml")

STATES: Mapping[str, str] = {"N": "clear", "I": "hammering"}
"""What the steady states of the paper are called here, or how their names begin."""


class Method(StrEnum):
    """How the paper obtained a number."""

    ACTION_PLOT = "action-plot"
    DENSITY = "sgcm-wkb"
    EXIT_TIMES = "exit-times"


@dataclasses.dataclass(frozen=True)
class Published:
    """One published activation energy."""

    scene: str
    state: str  # key of `STATES`
    method: Method
    value: float  # m² s⁻³
    half_digit: float  # half a unit of its last printed digit


@cache
def paper() -> dict[str, Any]:
    """Return the data file."""
    with _FILE.open("rb") as file:
        return tomllib.load(file)


def scenes() -> tuple[str, ...]:
    """Return the names of the paper's scenes."""
    return tuple(paper()["energies"])


def target_of(state: str) -> str | None:
    """Return what a state is left for: I for N, since other motion with impacts belongs to it, and N for any other."""
    return STATES["N"] if state == "I" else None


def published_energies() -> tuple[Published, ...]:
    """Return all published activation energies, scene by scene."""
    return tuple(
        Published(scene, state, Method(method), float(text), 0.5 * 10.0 ** int(Decimal(text).as_tuple().exponent))
        for scene, methods in paper()["energies"].items()
        for method, states in methods.items()
        for state, text in states.items()
    )
