"""RK4: fixed steps, many trajectories at once."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, ClassVar, Self

from vibrokit.errors import StepperError
from vibrokit.kernels.lanes import lane_step, tabulation
from vibrokit.kernels.stepper import Stepper
from vibrokit.parts.scene import Scene

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText

_LARGEST = 10**7


@dataclasses.dataclass(frozen=True)
class RK4(Stepper):
    """Classical Runge–Kutta, fixed steps, trajectories packed in vector lanes: the fastest for large ensembles.

    Order 4 while nothing touches; a contact that is crossed inside a step costs order: 2.5 for Hertz, 2 for linear
    stops, 1 where the force jumps at first touch. Choose it for basins, action plots and noise, which need many
    trajectories at moderate accuracy; choose `FreeFlight` or `Order8` for orbits and
    certificates, and wherever a contact is shorter than a few steps.

    Derivatives of momenta jump where those of a contact force do: at linear stops, and where a law that would pull is
    cut. Steps across such a contact miss it, by a term proportional to p₂. So they are right along the motion without
    noise, where p = 0, and wrong along any other path.

    Parameters
    ----------
    steps : int
        Steps from section to section (forcing period, or 2π/ω_n without forcing).
    """

    name: ClassVar[str] = "rk4"
    templates: ClassVar[tuple[str, ...]] = ("rk4",)

    steps: int = 256

    def __post_init__(self) -> None:
        if isinstance(self.steps, bool) or not isinstance(self.steps, int) or not 1 <= self.steps <= _LARGEST:
            raise StepperError(f"RK4: steps must be a whole number from 1 to {_LARGEST}, got {self.steps!r}.")

    def settings(self, scene: Scene, interval: float) -> tuple[float, ...]:
        """Steps in this interval, after how many of them the forcing repeats, and the step length."""
        steps = self.steps_in(scene, interval)
        return float(steps), float(scene.intervals_in_period(interval)), scene.time_unit / self.steps

    def steps_in(self, scene: Scene, interval: float) -> int:
        """Return the number of steps in an interval (s), 1 or more."""
        return max(1, round(self.steps * interval / scene.time_unit))

    def scene_part(self, text: SceneText) -> list[str]:
        """The lane-packed step, and what it calls; and the laws of the stops.

        Raises StepperError for momenta or derivatives under a force that jumps: they jump too, and steps across the
        jump miss that.
        """
        if text.jumps and text.breaks:
            what = "momenta" if text.flow.has_momenta else "derivatives of the motion"
            raise StepperError(
                f"RK4 steps across contacts, and where a contact force jumps at first touch, the {what} jump too; use "
                "FreeFlight or Order8, which locate contacts."
            )
        noise = [text.amplitude, text.slope]
        pieces = [text.constants, text.forcing, tabulation(text), text.derivative, *noise, lane_step(text)]
        return [*pieces, text.stops]  # the laws, compiled only if contact times are needed

    def refined(self) -> Self:
        """Twice the steps."""
        return dataclasses.replace(self, steps=2 * self.steps)

    def coarsened(self) -> Self:
        """Half the steps."""
        return dataclasses.replace(self, steps=max(1, self.steps // 2))
