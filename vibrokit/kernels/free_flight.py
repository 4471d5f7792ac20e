"""FreeFlight: exact between stops, for linear springs."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, ClassVar

from vibrokit.kernels.order8 import CONTACT, LocatedStepper

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText


@dataclasses.dataclass(frozen=True)
class FreeFlight(LocatedStepper):
    """Exact flight between the stops, for linear springs and sinusoidal forces.

    The flight is its Taylor series to rounding error, at any damping and at resonance; the first touch is found by
    bounds that cannot miss one. Contacts are stepped as `Order8` does, to the same order. Choose it for orbits,
    certificates, grazing, stiff stops and long flights; a scene with a nonlinear spring is refused.

    Parameters
    ----------
    tolerance : float
        Largest error of one step in contact, relative to the size of what is integrated.
    """

    name: ClassVar[str] = "free_flight"
    templates: ClassVar[tuple[str, ...]] = ("steps", *CONTACT, "free_flight", "attempts", "sections")

    def scene_part(self, text: SceneText) -> list[str]:
        """That of a located stepper, and the series of the flight."""
        return [text.flight_sizes, *super().scene_part(text), text.flight]

    def series(self, text: SceneText) -> str:
        """The order of the series, and its number of terms."""
        return text.flight_sizes
