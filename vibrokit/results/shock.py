"""Shock: the smallest sudden change of state that leaves a basin."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from vibrokit.documented import documented

Array = NDArray[np.float64]


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class Shock:
    """The smallest sudden change of state that leaves a basin."""

    source: Annotated[int, "label of the attractor whose state changes"]
    target: Annotated[int, "label of the attractor that is reached"]
    size: Annotated[float, "√((ω_n Δx)² + Δv²); ``|Δv|`` for a change of velocity alone", "m s-1"]
    error: Annotated[float, "how much smaller the smallest one may be; the last step of the search", "m s-1"]
    kick: Annotated[Array, "Δx (m) and Δv (m s⁻¹)"]
    state: Annotated[Array, "the state before the change, shape (n,)"]
    time: Annotated[float, "time after the section", "s"]


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class ShapeStability:
    """Stability of an attractor by the shape of its basin, to compare with its activation energy."""

    label: Annotated[int, "label of the attractor"]
    basin_fraction: Annotated[float, "share of the region's cells that lead to it"]
    basin_fraction_error: Annotated[float, "standard error of the share"]
    velocity_kick: Annotated[
        Shock | None, "the smallest change of v alone; None if none up to the size of the region leaves the basin"
    ]
    any_kick: Annotated[Shock | None, "the smallest change of x and v"]
