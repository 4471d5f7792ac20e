"""Emitter: what a generated module consists of. Stepper: how trajectories are integrated."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Self

from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText


@dataclasses.dataclass(frozen=True)
class Emitter(ABC):
    """What a generated module consists of: pieces of the scene, and templates below them.

    For developers
    --------------
    An emitter names its templates, files of `vibrokit/kernels/templates`, and says which pieces of the scene stand
    above them.
    """

    name: ClassVar[str]
    templates: ClassVar[tuple[str, ...]] = ()
    staged: ClassVar[bool] = False  # whether a step keeps the slopes of its stages
    scaled: ClassVar[bool] = False  # whether factors of its stages are computed beforehand

    @abstractmethod
    def scene_part(self, text: SceneText) -> list[str]:
        """Return the pieces of the scene that stand above the templates."""

    def templates_for(self, text: SceneText) -> tuple[str, ...]:
        """Return the names of the templates that a scene needs, in the order in which they are pasted."""
        return self.templates

    def check(self, scene: Scene, flow: Flow) -> None:  # noqa: B027 - most take every scene
        """Raise StepperError if the module cannot be made for this flow of this scene."""


@dataclasses.dataclass(frozen=True)
class Stepper(Emitter):
    """A way to integrate: its configuration is its fields, all else is derived.

    For developers
    --------------
    A stepper also turns its fields into the few numbers that the templates read.
    """

    @abstractmethod
    def settings(self, scene: Scene, interval: float) -> tuple[float, ...]:
        """Return the numbers that the templates read."""

    def steps_in(self, scene: Scene, interval: float) -> int:
        """Return the number of fixed steps in an interval (s); 0 if the stepper chooses its own steps."""
        return 0

    @abstractmethod
    def refined(self) -> Self:
        """Return the next finer setting, for an error estimate by comparison."""

    @abstractmethod
    def coarsened(self) -> Self:
        """Return the next coarser setting."""
