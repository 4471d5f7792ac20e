"""Default steppers of a scene."""

from __future__ import annotations

import functools
import math
import sys
import warnings
from pathlib import Path
from types import FrameType

from vibrokit.errors import StepperError
from vibrokit.kernels.fixed_steps import RK4, FixedSteps
from vibrokit.kernels.kernel import kernel_for
from vibrokit.kernels.located import FreeFlight, Order8
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.time_scales import changes_of, contact_times, fastest_of_noise
from vibrokit.parts.noise import WhiteNoise
from vibrokit.parts.scene import Scene
from vibrokit.parts.spring import LinearSpring
from vibrokit.symbolic.flow_kind import Flow

_STEPS, _FEWEST_STEPS = 256, 32  # in an interval of a quarter of a free oscillation or more; in a very short one
_MOST_STEPS, _MOST_NOISY_STEPS = 1024, 65536  # in an interval of one free oscillation or less
_PER_TURN = 64  # steps in one free oscillation
_TOO_FEW = 8  # steps in one contact; with fewer, RK4 was observed to create spurious steady states
_MOST_WAVES = 16  # for which the Taylor series of a free flight is worth its terms
_PER_NOISY_PULSE = 128  # that begins or ends with a jump
_PER_DECAY = 4  # steps in which a state of the noise decays by e
_PER_PULSE, _PER_RISE, _PER_WAVE = 16, 4, 16  # steps in a pulse of an excitation, where it crosses its range, in a wave
_TOLERANCE = 1e-10
LOCATED = Order8(1e-6)
"""For ensembles, wherever fixed steps would be too many."""
_PACKAGE = str(Path(__file__).parents[1])


class CoarseStepsWarning(UserWarning):
    """Fixed steps are too few in a contact."""


def ensemble_stepper(scene: Scene, flow: Flow) -> Stepper:
    """Choose the stepper for many trajectories: RK4 if few steps resolve every contact, otherwise Order8.

    Next to a pole no fixed steps are short enough: they cross one that throws the mass back. Where the force of a
    spring jumps or has an infinite slope, RK4(256) was off by 2e-2 to 6e-2 within a period.

    Measured on ``hertz-0.570``, Hamilton's equations over five periods, two threads: RK4(256) has a median error of
    2e-3 at 0.52 µs per trajectory and period, RK4(1024) 2e-4 at 1.7 µs, Order8(1e-6) 5e-7 at 3 µs. So located
    contacts are cheaper wherever RK4 needs more than 1024 steps.
    """
    try:
        steps = _power_of_two(_steps_needed(scene, flow))
    except StepperError:  # not a flow that fixed steps can follow
        return LOCATED
    if flow is Flow.HAMILTONIAN_VARIATIONAL and scene.barriers and kernel_for(scene, flow, RK4()).module.BENDS:
        return LOCATED  # fixed steps have its derivatives where p = 0 only
    module = kernel_for(scene, flow, RK4()).module
    if flow is not Flow.NOISY and (module.ROUGH or (module.BORDERED and _has_borders(scene))):
        return LOCATED
    turns = max(1.0, _turns(scene))
    if flow is Flow.NOISY:  # if these are too few, integration warns
        return RK4(min(steps, int(_MOST_NOISY_STEPS * turns)))
    return RK4(steps) if steps <= _MOST_STEPS * turns else LOCATED


def single_stepper(scene: Scene, flow: Flow) -> Stepper:
    """Choose the stepper for one trajectory: FreeFlight where it applies, otherwise Order8; RK4 with noise."""
    if flow is Flow.NOISY:
        return ensemble_stepper(scene, flow)
    return FreeFlight(_TOLERANCE) if _flies(scene, flow) else Order8(_TOLERANCE)


def warn_of_coarse_steps(scene: Scene, flow: Flow, stepper: Stepper) -> None:
    """Warn, at the line that called into this package, if fixed steps are too few in a contact to follow it."""
    if not isinstance(stepper, FixedSteps):
        return
    shortest = min((contact.duration for contact in contact_times(scene, flow)), default=math.inf)
    taken, needed = stepper.steps * shortest / scene.time_unit, _steps_of_changes(scene, flow)
    if taken < _TOO_FEW:
        problem = f"takes about {taken:.2g} steps in a contact with a stop, too few to follow it"
    elif stepper.steps < needed / 2:
        problem = "takes steps that are too long for the shortest pulse, the steepest rise or the highest frequency"
        problem += " of an excitation"
    else:
        return
    steps = _power_of_two(_steps_needed(scene, flow))
    advice = f"take RK4(steps={steps})" if steps <= _MOST_NOISY_STEPS else f"it needs some {steps} steps"
    if flow is not Flow.NOISY:
        advice += f", or {type(single_stepper(scene, flow)).__name__}, which finds contacts and pulses"
    warnings.warn(
        f"{type(stepper).__name__}(steps={stepper.steps}) {problem}; {advice}.",
        CoarseStepsWarning,
        stacklevel=_frames_inside(sys._getframe()),
    )


def _steps_needed(scene: Scene, flow: Flow) -> float:
    unit = scene.time_unit
    turns = _turns(scene)
    needed = max(_FEWEST_STEPS, _STEPS * min(1.0, 4.0 * turns), _PER_TURN * turns, _steps_of_changes(scene, flow))
    needed = max(needed, _PER_DECAY * unit * fastest_of_noise(scene))
    for contact in contact_times(scene, flow):
        needed = max(needed, _steps_per_contact(contact.exponent) * unit / contact.duration)
    return needed


def _steps_of_changes(scene: Scene, flow: Flow) -> float:
    """Steps that resolve the excitations; with noise, which no step resolves either, those that see each pulse.

    A step that a jump falls into is off by a third of the jump, so that 128 steps in a rectangular pulse give it an
    impulse within 0.3 %.
    """
    changes = changes_of(scene)
    rises = _PER_RISE / changes.rise
    if flow is Flow.NOISY:
        rises = min(rises, _PER_NOISY_PULSE / changes.pulse)
    return scene.time_unit * max(_PER_PULSE / changes.pulse, rises, _PER_WAVE / changes.wave)


def _turns(scene: Scene) -> float:
    """Free oscillations in the interval that steps are counted in."""
    return scene.time_unit * scene.reference_frequency / (2 * math.pi)


def _steps_per_contact(exponent: float) -> int:
    """Steps per contact: the lower the exponent, the lower the order of steps across the touch."""
    if exponent > 1.25:
        return 16
    return 32 if exponent > 0.75 else 64


@functools.lru_cache(maxsize=64)
def _has_borders(scene: Scene) -> bool:
    """Whether forces have poles or end somewhere, at the parameters of the scene; formulas alone may not tell."""
    from vibrokit.symbolic.model import Model  # only here is SymPy needed

    return bool(Model(scene).conditions)


def _power_of_two(needed: float) -> int:
    return int(2 ** math.ceil(math.log2(needed)))


def _flies(scene: Scene, flow: Flow) -> bool:
    """Whether all parts are built-in ones that FreeFlight accepts; decided without their formulas, for speed."""
    linear = scene.friction is None and (scene.spring is None or type(scene.spring) is LinearSpring)
    linear = linear and all(len(part.variables) == 1 for part in scene.excitations)
    waves = [part.frequencies for part in scene.excitations]
    sinusoids = None not in waves and sum(len(one or ()) for one in waves) <= _MOST_WAVES
    if scene.noise is None or type(scene.noise) is WhiteNoise:
        return linear and sinusoids
    with_noise = flow.has_momenta or flow.has_covariance  # the amplitude is among what is integrated
    return linear and sinusoids and not with_noise and not scene.noise.extra_states


def _frames_inside(frame: FrameType | None) -> int:
    """Number of frames up to the first one outside this package; 1 is the given frame."""
    count = 1
    while frame is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, count = frame.f_back, count + 1
    return count
