"""RKN12: fixed steps of order 12 for motion without stops, many trajectories at once."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, ClassVar

from vibrokit.errors import StepperError
from vibrokit.kernels.fixed_steps import FixedSteps
from vibrokit.kernels.nystrom import nystrom_room, nystrom_step
from vibrokit.kernels.nystrom_tableau import STAGES
from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText


@dataclasses.dataclass(frozen=True)
class RKN12(FixedSteps):
    """Runge–Kutta–Nyström of order 12, fixed steps, trajectories packed in vector lanes: for smooth scenes.

    Forces may depend on the velocity by linear damping only, and there may be no stops. The same error takes a third of
    the evaluations of `RK8`, and each is cheaper. The method is that of Dormand, El-Mikkawy and Prince (IMA J. Numer.
    Anal. 7, 1987) without its error estimate: compare with `refined()`. An exponential factor removes the damping from
    the equations.

    Parameters
    ----------
    steps : int
        Steps from section to section (forcing period, or 2π/ω_n without forcing).
    """

    name: ClassVar[str] = "rkn12"
    nodes: ClassVar[int] = STAGES
    prepared: ClassVar[bool] = True

    steps: int = 12

    def check(self, scene: Scene, flow: Flow) -> None:
        """Refuse noise and stops."""
        super().check(scene, flow)
        if scene.barriers:
            raise StepperError("RKN12 is for scenes without stops; use Order8 or FreeFlight, which locate contacts.")

    def step_part(self, text: SceneText) -> list[str]:
        """The step of seventeen stages."""
        return nystrom_step(text)

    def room(self, text: SceneText) -> int:
        """The factors of the stages."""
        return nystrom_room(text)
