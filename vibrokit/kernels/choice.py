"""Which stepper a scene is given when the user names none."""

from __future__ import annotations

from vibrokit.kernels.rk4 import RK4
from vibrokit.kernels.stepper import Stepper
from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow


class CoarseStepsWarning(UserWarning):
    """RK4 was given too few steps for a contact."""


def ensemble_stepper(scene: Scene, flow: Flow) -> Stepper:
    return RK4()


def single_stepper(scene: Scene, flow: Flow) -> Stepper:
    return RK4()
