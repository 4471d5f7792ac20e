"""Names the force that makes a trajectory need too many steps: the one with the shortest time scale."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.scene import Scene

_SHARES = np.geomspace(1e-13, 1e-1, 25)  # changes of a variable, as shares of its size, that a slope is taken over


class FastForce(NamedTuple):
    """A force whose time scale limits the steps: a description, and the time scale (s)."""

    words: str
    time: float
    friction: bool  # whether it is steep in the velocity of the mass


def fastest_force(scene: Scene, state: NDArray[np.float64]) -> FastForce | None:
    """Return the force with the shortest time scale around a state; None where no force has one.

    The time scale of a force f(x, v) is 1/(√|∂f/∂x| + |∂f/∂v|). For a spring only the slope in v counts. For a stop the
    slopes are those at the depth of the state, or at a depth close to first touch if the mass is not in contact.
    """
    return min(_forces(scene, state), key=lambda force: force.time, default=None)


def _forces(scene: Scene, state: NDArray[np.float64]) -> Iterator[FastForce]:
    x, v = float(state[0]), float(state[1])
    speed = max(abs(v), scene.natural_frequency * abs(x), np.finfo(float).tiny)
    spring = scene.spring
    if spring is not None:
        steepness = max(_slope(partial(spring.force, x), centre, speed) for centre in (0.0, v))
        if steepness > 0.0:
            words = f"the spring force changes with the velocity at up to {steepness:.3g} s⁻¹"
            yield FastForce(words, 1.0 / steepness, True)
    for number, barrier in enumerate(scene.barriers):
        place, rate = barrier.position, barrier.sign * v
        depth = max(barrier.sign * (x - place), 1e-9 * max(abs(place), abs(x), speed / scene.natural_frequency))
        rigidity = _slope(partial(_at_rate, barrier.law, rate), depth, 0.5 * depth)
        damping = _slope(partial(barrier.law.force, depth), rate, speed)
        if rigidity > 0.0 or damping > 0.0:
            words = (
                f"barrier {number} ({barrier.side}, at {place:g}) has a stiffness of {rigidity:.3g} s⁻² and a damping "
                f"of {damping:.3g} s⁻¹ at the depth {depth:.3g}"
            )
            yield FastForce(words, 1.0 / (math.sqrt(rigidity) + damping), False)


def _at_rate(law: ContactLaw, rate: float, depth: float) -> Any:
    return law.force(depth, rate)


def _slope(force: Callable[[float], Any], centre: float, size: float) -> float:
    """The steepest slope of a force around a point; changes that are rounding do not count."""
    steepest = 0.0
    for change in size * _SHARES:
        with contextlib.suppress(ArithmeticError, TypeError, ValueError):  # outside the domain of the formula
            above, below = float(force(centre + change)), float(force(centre - change))
            if abs(above - below) > 1e-9 * (abs(above) + abs(below)):
                steepest = max(steepest, abs(above - below) / (2.0 * change))
    return steepest if math.isfinite(steepest) else 0.0
