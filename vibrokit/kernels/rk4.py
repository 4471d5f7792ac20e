"""RK4: fixed steps of order 4, many trajectories at once."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, ClassVar

from vibrokit.kernels.fixed_steps import FixedSteps
from vibrokit.kernels.lanes import CLASSICAL_NODES, classical_step, step_function

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText


@dataclasses.dataclass(frozen=True)
class RK4(FixedSteps):
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
    nodes: ClassVar[tuple[float, ...]] = CLASSICAL_NODES

    def step_part(self, text: SceneText) -> list[str]:
        """The classical step, with noise or without."""
        return [text.amplitude, text.slope, step_function(text, classical_step(text), len(self.nodes))]
