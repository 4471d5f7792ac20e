"""Why a trajectory ended: the border that it met, or the force that needs too short steps."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import single_stepper
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.parts.friction import Friction
from vibrokit.parts.scene import Scene
from vibrokit.parts.spring import Spring
from vibrokit.symbolic.flow_kind import Flow

_ROUNDS, _PARTS = 3, 32  # in which the time of the end is narrowed down, and parts of an interval in each
_REACH = 16.0  # times v Δt: under a force r⁻ⁿ the pole is ½ (n + 1) v Δt away, Δt before the end
_SHARES = np.geomspace(1e-13, 1e-1, 25)  # changes of a variable, as shares of its size, that a slope is taken over

Array = NDArray[np.float64]


def ending(scene: Scene, flow: Flow, stepper: Stepper, state: Array, time: float, spacing: float) -> tuple[float, str]:
    """Return when a trajectory ended (s), and at which border, in words; "" if it met none.

    The trajectory ends in the interval `spacing` after a time at which it was in `state`. Of a noisy one, that is the
    time, and the border is the one that motion without noise meets.
    """
    from vibrokit.symbolic.model import Model  # only here is SymPy needed

    started = time
    if flow is Flow.NOISY:
        stepper = single_stepper(scene, Flow.STATE)
    for _ in range(_ROUNDS):
        spacing /= _PARTS
        path = record(scene, Flow.STATE, stepper, state, time, spacing, _PARTS)
        state, time = path[-1], time + spacing * min(len(path) - 1, _PARTS - 1)
    border = Model(scene).border_ahead(state.tolist(), time, _REACH * spacing)
    return started if flow is Flow.NOISY else time, border


class FastForce(NamedTuple):
    """A force whose time scale limits the steps: a description, and the time scale (s)."""

    words: str
    time: float
    friction: bool  # whether it is steep in the velocity of the mass


def fastest_force(scene: Scene, state: Array) -> FastForce | None:
    """Return the force with the shortest time scale around a state; None where no force has one.

    The time scale of a force f(x, v) is 1/(√|∂f/∂x| + |∂f/∂v|). For a spring and friction only the slope in v
    counts. For a stop the slopes are those at the depth of the state, or at a depth close to first touch if the mass
    is not in contact.
    """
    x, v = float(state[0]), float(state[1])
    speed = max(abs(v), scene.reference_frequency * abs(x), np.finfo(float).tiny)
    found = [_in_velocity(name, part, x, v, speed) for name, part in scene.forces_of_state.items()]
    found += [_stop(scene, number, x, v, speed) for number in range(len(scene.barriers))]
    return min((force for force in found if force.time < math.inf), key=lambda force: force.time, default=None)


def _in_velocity(name: str, part: Spring | Friction, x: float, v: float, speed: float) -> FastForce:
    steepness = max(_slope(lambda rate: part.force(x, rate), centre, speed) for centre in (0.0, v))
    words = f"the force of the {name} changes with the velocity at up to {steepness:.3g} s⁻¹"
    return FastForce(words, 1.0 / steepness if steepness > 0.0 else math.inf, True)


def _stop(scene: Scene, number: int, x: float, v: float, speed: float) -> FastForce:
    barrier = scene.barriers[number]
    law, place, rate = barrier.law, barrier.position, barrier.sign * v
    depth = max(barrier.sign * (x - place), 1e-9 * max(abs(place), abs(x), speed / scene.reference_frequency))
    rigidity = _slope(lambda deep: law.force(deep, rate), depth, 0.5 * depth)
    damping = _slope(lambda fast: law.force(depth, fast), rate, speed)
    words = (
        f"barrier {number} ({barrier.side}, at {place:g}) has a stiffness of {rigidity:.3g} s⁻² and a damping of "
        f"{damping:.3g} s⁻¹ at the depth {depth:.3g}"
    )
    steepness = math.sqrt(rigidity) + damping
    return FastForce(words, 1.0 / steepness if steepness > 0.0 else math.inf, False)


def _slope(force: Callable[[float], Any], centre: float, size: float) -> float:
    """The steepest slope of a force around a point; changes that are rounding do not count."""
    steepest = 0.0
    for change in size * _SHARES:
        with contextlib.suppress(ArithmeticError, TypeError, ValueError):  # outside the domain of the formula
            above, below = float(force(centre + change)), float(force(centre - change))
            if abs(above - below) > 1e-9 * (abs(above) + abs(below)):
                steepest = max(steepest, abs(above - below) / (2.0 * change))
    return steepest if math.isfinite(steepest) else 0.0
