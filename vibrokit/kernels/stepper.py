"""Emitter: what generated modules consist of. Stepper: how trajectories are integrated."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Self

from vibrokit.construction import Constructed
from vibrokit.errors import StepperError
from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText


@dataclasses.dataclass(frozen=True)
class Emitter(ABC, metaclass=Constructed):
    """What generated modules consist of: that of the scene, and those that scenes of a form share.

    For developers
    --------------
    An emitter says which pieces make the module of the scene. One that integrates names the templates of its driver
    too, files of `vibrokit/kernels/templates`, and what stands above them.
    """

    name: ClassVar[str]
    templates: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def scene_part(self, text: SceneText) -> list[str]:
        """Return the pieces of the scene; raise StepperError if this flow of this scene cannot be integrated."""

    def driver_part(self, text: SceneText) -> list[str]:
        """Return the constants that stand above the templates."""
        return []

    def check(self, flow: Flow) -> None:
        """Raise StepperError for a flow that can be integrated in no scene."""


@dataclasses.dataclass(frozen=True)
class Stepper(Emitter):
    """A way to integrate: its configuration is its fields, all else is derived.

    For developers
    --------------
    A stepper also turns its fields into the few numbers that the templates read.
    """

    draws: ClassVar[bool] = False
    """Whether it can integrate random forces."""

    def check(self, flow: Flow) -> None:
        """Refuse noise where the order of the steps does not hold for a random force."""
        if flow is Flow.NOISY and not self.draws:
            raise StepperError(f"{type(self).__name__} integrates smooth motion only; use RK4 for noisy trajectories.")

    @abstractmethod
    def settings(self, scene: Scene, interval: float, samples: int = 0) -> tuple[float, ...]:
        """Return the numbers that the templates read, for motion from section to section (s).

        With `samples`, for motion that goes on through the samples of a path, so many intervals apart.
        """

    def steps_in(self, scene: Scene, interval: float) -> int:
        """Return the number of fixed steps in an interval (s); 0 if the stepper chooses its own steps."""
        return 0

    @abstractmethod
    def refined(self) -> Self:
        """Return the next finer setting, for an error estimate by comparison."""

    @abstractmethod
    def coarsened(self) -> Self:
        """Return the next coarser setting."""
