"""Stepper: how trajectories are integrated."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import ClassVar, Self

from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.scene_text import SceneText


@dataclasses.dataclass(frozen=True)
class Stepper(ABC):
    """A way to integrate: its configuration is its fields, all else is derived.

    For developers
    --------------
    A stepper names its templates, files of `vibrokit/kernels/templates`, says which pieces of the scene it is
    pasted under, and turns its fields into the few numbers that the templates read.
    """

    name: ClassVar[str]
    templates: ClassVar[tuple[str, ...]]
    flight: ClassVar[bool] = False

    @abstractmethod
    def settings(self, scene: Scene, interval: float) -> tuple[float, ...]:
        """Numbers that the templates read."""

    @abstractmethod
    def scene_part(self, text: SceneText) -> list[str]:
        """Pieces of the scene that the templates are pasted under."""

    def templates_for(self, text: SceneText) -> tuple[str, ...]:
        """Names of the templates that a scene needs, in the order in which they are pasted."""
        return self.templates

    @abstractmethod
    def refined(self) -> Self:
        """The next finer setting, for an error estimate by comparison."""

    @abstractmethod
    def coarsened(self) -> Self:
        """The next coarser setting."""

    def check(self, scene: Scene, flow: Flow) -> None:  # noqa: B027 - most steppers take every scene
        """Raise StepperError if this stepper cannot integrate this flow of this scene."""
