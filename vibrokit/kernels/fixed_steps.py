"""RK4 and RK8: steps of one length, many trajectories at once."""

from __future__ import annotations

import dataclasses
import math
from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar, Self

from vibrokit.errors import StepperError
from vibrokit.kernels.lanes import CLASSICAL_NODES, classical_step, lanes_of, staged_step, step_function, tabulation
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.tableau import NODES, STAGES
from vibrokit.parts.scene import Scene

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText

_LARGEST = 10**7


@dataclasses.dataclass(frozen=True)
class FixedSteps(Stepper):
    """A stepper whose steps are all of one length, trajectories packed in vector lanes. Abstract.

    Parameters
    ----------
    steps : int
        Steps from section to section (forcing period, or 2π/ω_n without forcing).
    """

    templates: ClassVar[tuple[str, ...]] = ("fixed_steps",)
    nodes: ClassVar[tuple[float, ...]]
    """Fractions of a step at which the forcing is evaluated."""
    slopes: ClassVar[int] = 0
    """Values for each variable that a step keeps in memory."""

    steps: int = 256

    def __post_init__(self) -> None:
        if isinstance(self.steps, bool) or not isinstance(self.steps, int) or not 1 <= self.steps <= _LARGEST:
            raise StepperError(
                f"{type(self).__name__}: steps must be a whole number from 1 to {_LARGEST}, got {self.steps!r}."
            )

    def settings(self, scene: Scene, interval: float, samples: int = 0) -> tuple[float, ...]:
        """Steps in this interval, none longer on a path than in an ensemble; intervals until the forcing repeats."""
        if samples:
            return float(max(1, math.ceil(interval * self.steps / scene.time_unit - 1e-9))), 0.0
        return float(self.steps_in(scene, interval)), float(scene.intervals_in_period(interval))

    def steps_in(self, scene: Scene, interval: float) -> int:
        """Return the number of steps in an interval (s), 1 or more."""
        return max(1, round(self.steps * interval / scene.time_unit))

    def scene_part(self, text: SceneText) -> list[str]:
        """The lane-packed step, and what it calls; and the laws of the stops.

        Raises StepperError for momenta or derivatives under a force that jumps: they jump too, and steps across the
        jump miss that. So do steps across an infinite slope: 1024 of `RK4` left derivatives under √depth off by 0.3.
        """
        name, what = type(self).__name__, "momenta" if text.flow.has_momenta else "derivatives of the motion"
        if text.jumps and text.breaks:
            raise StepperError(
                f"{name} steps across contacts, and where a contact force jumps at first touch, the {what} "
                "jump too; use FreeFlight or Order8, which locate contacts."
            )
        if text.steep:
            raise StepperError(
                f"{name} steps across a place where the slope of a force is infinite, as that of the root "
                f"of the depth at first touch, and there the {what} are far off; use Order8, which shortens its steps."
            )
        sizes = f"{len(self.nodes) * max(1, len(text.functions))}, {self.slopes * len(text.variables)}"
        facts = f"LANES = {lanes_of(text)}\nFACTS = (LANES, FORCED, {sizes})\nWALLS = ()  # steps go across contacts\n"
        step = [tabulation(text, self.nodes), text.derivative, text.crossed, *self.step_part(text)]
        # The laws are compiled only if contact times are needed.
        return [text.constants, facts, text.forcing, *step, text.stops]

    @abstractmethod
    def step_part(self, text: SceneText) -> list[str]:
        """Return the function `step_lanes`, and what only it calls."""

    def refined(self) -> Self:
        """Twice the steps."""
        return dataclasses.replace(self, steps=2 * self.steps)

    def coarsened(self) -> Self:
        """Half the steps."""
        return dataclasses.replace(self, steps=max(1, self.steps // 2))


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
    draws: ClassVar[bool] = True
    nodes: ClassVar[tuple[float, ...]] = CLASSICAL_NODES

    def step_part(self, text: SceneText) -> list[str]:
        """The classical step, with noise or without."""
        return [text.amplitude, text.slope, step_function(text, classical_step(text), len(self.nodes))]


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

    def step_part(self, text: SceneText) -> list[str]:
        """The step of twelve stages."""
        return [step_function(text, staged_step(text), len(self.nodes))]
