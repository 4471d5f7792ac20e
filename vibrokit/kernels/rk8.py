"""RK8: fixed steps of order 8, many trajectories at once."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, ClassVar

from vibrokit.errors import StepperError
from vibrokit.kernels.fixed_steps import FixedSteps
from vibrokit.kernels.lanes import staged_step, step_function
from vibrokit.kernels.tableau import NODES, STAGES
from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText


@dataclasses.dataclass(frozen=True)
class RK8(FixedSteps):
    """Dormand–Prince of order 8, fixed steps, trajectories packed in vector lanes: for ensembles without stops.

    Order 8 where the forces are smooth; a contact that is crossed inside a step leaves the orders of `RK4`, at a higher
    cost. The method is that of DOP853 (Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I, II.10),
    without its error estimate: compare with `refined()`.

    Parameters
    ----------
    steps : int
        Steps from section to section (forcing period, or 2π/ω_n without forcing).
    """

    name: ClassVar[str] = "rk8"
    nodes: ClassVar[tuple[float, ...]] = tuple(map(float, NODES))
    slopes: ClassVar[int] = STAGES + 1  # and a point

    steps: int = 24

    def check(self, scene: Scene, flow: Flow) -> None:
        """Refuse noise: a random force has no high order."""
        if flow is Flow.NOISY:
            raise StepperError("RK8 integrates smooth motion only; use RK4 for noisy trajectories.")

    def step_part(self, text: SceneText) -> list[str]:
        """The step of twelve stages."""
        return [step_function(text, staged_step(text), len(self.nodes))]
