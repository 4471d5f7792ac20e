"""Quantity: one number of one exit, or of one state, by one method, with its interval."""

from __future__ import annotations

import dataclasses
import math
from enum import StrEnum
from typing import Annotated

from vibrokit.documented import documented
from vibrokit.results.rated import HELD, METASTABLE

DEVIATIONS = 1.96
"""Standard errors on each side of a value in an interval of 95 %."""


class Kind(StrEnum):
    """Kinds of quantities, in the order of tables, each with its `label` there."""

    label: str

    def __new__(cls, value: str, label: str) -> Kind:
        member = str.__new__(cls, value)
        member._value_ = value
        member.label = label
        return member

    ENERGY = "energy", "ΔU (m² s⁻³)"
    """ΔU for D → 0 (m² s⁻³): the least action with its bounds, or the limit of rates."""
    ARRHENIUS = "arrhenius", "ΔU by Arrhenius fit"
    """The slope of a straight line through all ln τ against 1/D (m² s⁻³); its interval is one for ΔU."""
    BARRIER = "barrier", "barrier at the saddle"
    """−D ln ρ at the lowest saddle above its minimum at noise D (m² s⁻³); it differs from ΔU by the order of D."""
    LOG_TIME = "log-time", "ln τ (τ in s)"
    """ln τ at noise D, τ in s."""
    SLOPE = "slope", "slope d ln τ/d(1/D)"
    """d ln τ/d(1/D) between two neighbouring intensities (m² s⁻³), at the middle of their 1/D."""
    LOG_PREFACTOR = "log-prefactor", "ln of prefactor (s)"
    """ln of τ exp(−ΔU/D) in s at noise D, with the energy of the narrowest interval that any result has."""
    OCCUPANCY = "occupancy", "share of time, by rates"
    """Share of time in a state in the long run at noise D, by the balance of rates."""
    DENSITY_SHARE = "density-share", "share, by the density"
    """Share of the stationary density at noise D in the cells of a state's basin; the method gives no interval."""
    WEIGHT_EXPONENT = "weight-exponent", "ln of share, exponent only"
    """ln of the share of time without its prefactor, −w/D, at noise D, by energies alone; 0 for the most stable."""


OF_EXITS = (Kind.ENERGY, Kind.LOG_TIME)
"""Kinds that an exit needs to be listed: one of them at least."""
OF_STATES = (Kind.OCCUPANCY, Kind.DENSITY_SHARE, Kind.WEIGHT_EXPONENT)
"""Kinds that belong to a state and not to an exit."""


@documented
@dataclasses.dataclass(frozen=True)
class Quantity:
    """One number by one method, with its 95 % interval or its bounds; NaN where one is not known."""

    kind: Annotated[Kind, "what the number is"]
    source: Annotated[int, "label of the attractor that is left, or whose share it is"]
    target: Annotated[int | None, "label of what is reached, as in `ExitRate`; None for all exits together or a share"]
    method: Annotated[str, "name of the result's analyzer"]
    intensity: Annotated[float, "noise intensity D; NaN where it does not matter", "m2 s-3"]
    value: Annotated[float, "value, in the unit that its kind has", ""]
    lower: Annotated[float, "lower end of its interval", ""]
    upper: Annotated[float, "upper end of its interval", ""]
    event: Annotated[str, "what counts as an exit, as in `ExitRate`; empty where that does not matter"] = ""
    relaxations: Annotated[float, "mean time until the source is left in its relaxation times"] = math.nan
    core_share: Annotated[float, "smaller share of the cores of source and target in their own basins"] = math.nan

    @property
    def metastable(self) -> bool:
        """Whether source and target are metastable at this noise; true where this is not known."""
        return not (self.relaxations < METASTABLE or self.core_share < HELD)

    @property
    def error(self) -> float:
        """Half of the interval in standard errors: one standard error if the interval is symmetric."""
        return (self.upper - self.lower) / (2.0 * DEVIATIONS)

    @property
    def below(self) -> float:
        """Distance of the lower end from the value; half of the interval if it does not contain the value."""
        return self.value - self.lower if self._held else (self.upper - self.lower) / 2.0

    @property
    def above(self) -> float:
        """Distance of the upper end from the value; half of the interval if it does not contain the value."""
        return self.upper - self.value if self._held else (self.upper - self.lower) / 2.0

    @property
    def _held(self) -> bool:
        return self.lower <= self.value <= self.upper

    @property
    def resolved(self) -> bool:
        """Whether value and interval are known."""
        return all(map(math.isfinite, (self.value, self.lower, self.upper)))
