"""RK4: fixed steps of order 4, many trajectories at once."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, ClassVar, Self

from vibrokit.errors import StepperError
from vibrokit.kernels.lanes import lanes_of, pieces_of_step
from vibrokit.kernels.stepper import Stepper
from vibrokit.parts.scene import Scene

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText

_LARGEST = 10**7


@dataclasses.dataclass(frozen=True)
class RK4(Stepper):
    """Classical Runge–Kutta, fixed steps, trajectories packed in vector lanes: for ensembles and for noise.

    Order 4 while nothing touches; a contact that is crossed inside a step costs order. A force that begins like depth^p
    leaves 1 + p: 2.5 for Hertz, 2 for linear stops, 1.5 for √depth, 1 where the force jumps at first touch. So
    ``RK4(8192)`` is off by 2e-5 in a period with a stop 20 √depth, and by 5e-9 with a Hertz stop. Choose it for basins
    and action plots, and for noise, which need many trajectories at moderate accuracy; choose `FreeFlight` or `Order8`
    for orbits and certificates, and wherever a contact is shorter than a few steps.

    Derivatives of momenta jump where the derivative of a contact force jumps: at linear stops, and where a pulling
    force is set to zero. Fixed steps miss this jump, which is proportional to p₂. Across such a contact, the
    derivatives are then correct without noise, where p = 0, and wrong on any other path.

    Parameters
    ----------
    steps : int
        Steps from section to section (forcing period, or 2π/ω_n without forcing).
    """

    name: ClassVar[str] = "rk4"
    templates: ClassVar[tuple[str, ...]] = ("fixed_steps",)

    steps: int = 256

    def __post_init__(self) -> None:
        if isinstance(self.steps, bool) or not isinstance(self.steps, int) or not 1 <= self.steps <= _LARGEST:
            raise StepperError(f"RK4: steps must be a whole number from 1 to {_LARGEST}, got {self.steps!r}.")

    def settings(self, scene: Scene, interval: float) -> tuple[float, ...]:
        """Steps in this interval, and after how many intervals the forcing repeats."""
        return float(self.steps_in(scene, interval)), float(scene.intervals_in_period(interval))

    def settings_of_path(self, scene: Scene, spacing: float, samples: int) -> tuple[float, ...]:
        """Steps from sample to sample, none longer than those of an ensemble, under a forcing that never repeats."""
        return float(max(1, math.ceil(spacing * self.steps / scene.time_unit - 1e-9))), 0.0

    def steps_in(self, scene: Scene, interval: float) -> int:
        """Return the number of steps in an interval (s), 1 or more."""
        return max(1, round(self.steps * interval / scene.time_unit))

    def scene_part(self, text: SceneText) -> list[str]:
        """The lane-packed step, and what it calls; and the laws of the stops.

        Raises StepperError for momenta or derivatives under a force that jumps: they jump too, and steps across the
        jump miss that. So do steps across an infinite slope: 1024 of them left derivatives under √depth off by 0.3.
        """
        what = "momenta" if text.flow.has_momenta else "derivatives of the motion"
        if text.jumps and text.breaks:
            raise StepperError(
                f"RK4 steps across contacts, and where a contact force jumps at first touch, the {what} jump too; use "
                "FreeFlight or Order8, which locate contacts."
            )
        if text.steep:
            raise StepperError(
                "RK4 steps across a place where the slope of a force is infinite, as that of the root of the depth at "
                f"first touch, and there the {what} are far off; use Order8, which shortens its steps."
            )
        facts = f"LANES = {lanes_of(text)}\nFACTS = (LANES, FORCED)\nWALLS = ()  # steps go across contacts\n"
        # The laws are compiled only if contact times are needed.
        return [text.constants, facts, text.forcing, *pieces_of_step(text), text.stops]

    def refined(self) -> Self:
        """Twice the steps."""
        return dataclasses.replace(self, steps=2 * self.steps)

    def coarsened(self) -> Self:
        """Half the steps."""
        return dataclasses.replace(self, steps=max(1, self.steps // 2))
