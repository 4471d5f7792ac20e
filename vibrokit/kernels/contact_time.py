"""Durations of contacts, from which the number of fixed steps is chosen."""

from __future__ import annotations

import functools
import math
import types
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.kernel import first_call, kernel_for, theta_of
from vibrokit.kernels.rk4 import RK4
from vibrokit.parts.excitation import Constant
from vibrokit.parts.scene import Scene
from vibrokit.parts.spring import LinearSpring
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 128  # of the forcing, over one interval
_DEPTHS = np.geomspace(1e-14, 10.0, 451)  # as parts of the reach of the motion
_DECADE = 30  # of them in a decade
_LONGEST_REACH = 10.0  # stops limit a resonance to about this many times their distance


class ContactTime(NamedTuple):
    """Duration of a typical contact, and how sharply it begins."""

    duration: float  # from touch to release (s)
    exponent: float  # power of the depth in the force near touch: 3/2 for Hertz, 1 for linear stops, 0 for a jump


@functools.lru_cache(maxsize=64)
def contact_times(scene: Scene, flow: Flow) -> tuple[ContactTime, ...]:
    """Estimate the contact with each stop at a typical impact speed; very soft stops are left out.

    The greatest depth follows from the energy, ½v² = ∫ F dδ, and the duration is close to π·depth/v for every power.
    The law is that of the kernel for lanes, which an ensemble needs anyway. Raises StepperError if RK4 cannot integrate
    this flow of this scene.
    """
    if not scene.barriers:
        return ()
    module, theta = kernel_for(scene, flow, RK4()).module, theta_of(scene)
    with first_call(module.law):
        module.law(0, 0.0, 0.0, theta)
    reach, speed = _typical_motion(scene, module, theta)
    found = (_contact(module, theta, stop, reach, speed) for stop in range(len(scene.barriers)))
    return tuple(contact for contact in found if contact is not None)


def _contact(
    module: types.ModuleType, theta: NDArray[np.float64], stop: int, reach: float, speed: float
) -> ContactTime | None:
    depths = reach * _DEPTHS
    shortest = None
    for rate in (0.0, speed, -speed):  # a law that damps is stiffer on the way in, backwards in time on the way out
        force = np.array([module.law(stop, depth, rate, theta) for depth in depths])
        force = np.clip(np.nan_to_num(force), 0.0, 1e100)
        per_fold = force * depths  # dδ = δ d(ln δ) on this grid
        work = np.cumsum(0.5 * (per_fold[1:] + per_fold[:-1]) * np.diff(np.log(depths)))
        deepest = max(_DECADE, int(np.searchsorted(work, 0.5 * speed**2)))
        if deepest == len(work):  # too soft to end the motion
            continue
        before = deepest - _DECADE
        exponent = 0.0
        if force[before] > 0.0 and not module.JUMPS[stop]:
            exponent = math.log(force[deepest] / force[before]) / math.log(depths[deepest] / depths[before])
        found = ContactTime(math.pi * float(depths[deepest]) / speed, exponent)
        shortest = found if shortest is None else min(shortest, found)
    return shortest


def _typical_motion(scene: Scene, module: types.ModuleType, theta: NDArray[np.float64]) -> tuple[float, float]:
    """Largest displacement and speed: of the linear response to the forcing, or those needed to reach a stop."""
    own = scene.natural_frequency
    stiffness = scene.spring.stiffness if isinstance(scene.spring, LinearSpring) else own**2
    rates, sizes = _harmonics(scene, module, theta)
    with np.errstate(divide="ignore", invalid="ignore"):
        response = np.abs(sizes / (stiffness - rates**2 + 2j * scene.damping_ratio * own * rates))
    response[sizes == 0.0] = 0.0
    constant = sum(part.magnitude for part in scene.excitations if isinstance(part, Constant))
    moving = rates > 0.0  # a constant part may displace a mass without a spring by any length
    reach, speed = float(response.sum()) + abs(constant) / own**2, float((rates[moving] * response[moving]).sum())
    gap = max(abs(barrier.position) for barrier in scene.barriers)
    if gap > 0.0:
        limit = _LONGEST_REACH * gap
        reach, speed = max(gap, min(reach, limit)), max(own * gap, min(speed, own * limit))
    elif not 0.0 < reach < math.inf or not 0.0 < speed < math.inf:
        reach, speed = 1.0, own
    return reach, speed


def _harmonics(
    scene: Scene, module: types.ModuleType, theta: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angular frequencies of the forcing over one interval, and their amplitudes."""
    if not module.FORCED:
        return np.zeros(0), np.zeros(0)
    unit = scene.time_unit
    values = np.array([module.forcing(unit * sample / _SAMPLES, theta) for sample in range(_SAMPLES)])
    sizes = np.asarray(np.abs(np.fft.rfft(values)) * (2.0 / _SAMPLES), dtype=np.float64)
    sizes[0] /= 2.0
    sizes[sizes < 1e-9 * sizes.max()] = 0.0  # rounding, which a resonance would amplify
    return 2.0 * math.pi / unit * np.arange(len(sizes), dtype=np.float64), sizes
