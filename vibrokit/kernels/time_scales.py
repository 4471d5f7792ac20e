"""The shortest times of a scene that steps must resolve: pulses of its excitations, and contacts.

A step that is longer than a pulse may jump it, and nothing shows that it did.
"""

from __future__ import annotations

import bisect
import functools
import math
import types
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import grey_closing, grey_opening

from vibrokit.kernels.fixed_steps import RK4
from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.kernels.vector_field import VectorField
from vibrokit.parts.excitation import Constant, Excitation
from vibrokit.parts.scene import Scene
from vibrokit.parts.spring import LinearSpring
from vibrokit.symbolic.flow_kind import Flow

_PLACE = (0.8, 0.6)  # (x, v) at which a force that depends on them is sampled
_SAMPLES = 2**16  # of a period of an excitation; the narrowest pulse that is seen lasts two of them
_TURNS = 128  # free oscillations from t = 0 in which an excitation that never repeats is sampled
_WIDTHS = tuple(dict.fromkeys(int(2 ** (step / 2)) for step in range(2, 29)))  # of pulses, up to a quarter of a period
_DEPTHS = np.geomspace(1e-14, 10.0, 451)  # of a contact, as parts of the reach of the motion
_DECADE = 30  # of them in a decade

Array = NDArray[np.float64]


class Changes(NamedTuple):
    """The shortest times (s) in which excitations change; infinite where there is no such change."""

    pulse: float  # for which the force is larger, or smaller, than before and after
    rise: float  # in which the force would cross its range at its greatest slope
    wave: float = math.inf  # period of the highest frequency of sinusoids, which need no search for pulses
    size: float = 0.0  # range of the largest other force (m s⁻²)


def changes_of(scene: Scene) -> Changes:
    """Return the shortest times in which the excitations of a scene change."""
    turns = _TURNS * 2 * math.pi / scene.reference_frequency
    found = [_changes(part, turns if math.isinf(part.period or math.inf) else math.inf) for part in scene.excitations]
    if not found:
        return Changes(math.inf, math.inf)
    pulses, rises, waves, sizes = zip(*found, strict=True)
    return Changes(min(pulses), min(rises), min(waves), max(sizes))


@functools.lru_cache(maxsize=64)
def _changes(part: Excitation, longest: float) -> Changes:
    """Measure one excitation over its period: a pulse is what an opening or a closing of its width removes.

    Pulses lower than a hundredth of the range of the force are left out.
    """
    if part.frequencies is not None:
        return Changes(math.inf, math.inf, 2 * math.pi / max(part.frequencies) if part.frequencies else math.inf)
    repeats, window = math.isinf(longest), min(part.period or math.inf, longest)
    field = VectorField(Scene(natural_frequency=1.0, damping_ratio=0.0, excitations=(part,)))
    spacing = window / _SAMPLES
    force = np.nan_to_num([field.excitation(0, spacing * sample, _PLACE) for sample in range(_SAMPLES)])
    size = float(np.ptp(force))
    if not size > 0.0:
        return Changes(math.inf, math.inf)
    steepest = np.abs(np.diff(force, append=force[0] if repeats else force[-1])).max()
    width = bisect.bisect_left(_WIDTHS, True, key=lambda width: _removes(width, force, 0.01 * size, repeats))
    pulse = _WIDTHS[width] * spacing if width < len(_WIDTHS) else math.inf
    return Changes(pulse, float(size / steepest) * spacing, size=size)


def _removes(width: int, force: Array, least: float, repeats: bool) -> bool:
    """Whether pulses are narrower than some samples: whether an opening or a closing of that width changes the force.

    At the ends of a force that does not repeat nothing is known of it.
    """
    peaks, dips = force - grey_opening(force, width, mode="wrap"), grey_closing(force, width, mode="wrap") - force
    changed = np.maximum(peaks, dips)
    return bool((changed if repeats else changed[width:-width]).max() > least)


@functools.lru_cache(maxsize=64)
def fastest_of_noise(scene: Scene) -> float:
    """Return the fastest rate (s⁻¹) of the extra states of the noise, where all states are 0; 0 if it has none."""
    extra = scene.noise.extra_states if scene.noise is not None else ()
    if not extra:
        return 0.0
    rates = VectorField(scene).jacobian(np.zeros(2 + len(extra)))[2:, 2:]
    return float(np.abs(np.linalg.eigvals(rates)).max()) if np.isfinite(rates).all() else 0.0


class ContactTime(NamedTuple):
    """Duration of a typical contact, and how sharply it begins."""

    duration: float  # from touch to release (s)
    exponent: float  # power of the depth in the force near touch: 3/2 for Hertz, 1 for linear stops, 0 for a jump


@functools.lru_cache(maxsize=64)
def contact_times(scene: Scene, flow: Flow) -> tuple[ContactTime, ...]:
    """Estimate the contact with each stop at a typical impact speed; very soft stops are left out.

    The greatest depth follows from the energy, ½v² = ∫ F dδ, and the duration is close to π·depth/v for every power.
    The formulas are those of the kernel for lanes, which an ensemble needs anyway, called as Python: a few thousand
    values take less time than compiling them. Raises StepperError if RK4 cannot integrate this flow of this scene.
    """
    if not scene.barriers:
        return ()
    module, theta = kernel_for(scene, flow, RK4()).module, theta_of(scene).tolist()
    reach, speed = _typical_motion(scene, module, theta)
    found = (_contact(module, theta, stop, reach, speed) for stop in range(len(scene.barriers)))
    return tuple(contact for contact in found if contact is not None)


def _contact(module: types.ModuleType, theta: list[float], stop: int, reach: float, speed: float) -> ContactTime | None:
    depths = reach * _DEPTHS
    shortest = None
    for rate in (0.0, speed, -speed):  # a law that damps is stiffer on the way in, backwards in time on the way out
        force = np.array([_force(module.law.py_func, stop, depth, rate, theta) for depth in depths.tolist()])
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


def _force(law: Callable[..., float], stop: int, depth: float, rate: float, theta: list[float]) -> float:
    """The force of a stop; infinite where it is out of range, NaN where it has no real value."""
    try:
        return float(law(stop, depth, rate, theta))
    except OverflowError:
        return math.inf
    except (ArithmeticError, TypeError, ValueError):  # a power may be complex
        return math.nan


def _typical_motion(scene: Scene, module: types.ModuleType, theta: list[float]) -> tuple[float, float]:
    """Largest displacement and speed: of the linear response to the forcing, or those needed to reach a stop."""
    own = scene.reference_frequency
    stiffness = scene.own_frequency**2 if scene.spring is None else own**2
    stiffness = scene.spring.stiffness if isinstance(scene.spring, LinearSpring) else stiffness
    rates, sizes = _harmonics(scene, module, theta)
    with np.errstate(divide="ignore", invalid="ignore"):
        response = np.abs(sizes / (stiffness - rates**2 + 1j * scene.linear_damping * rates))
    response[sizes == 0.0] = 0.0
    constant = sum(part.magnitude for part in scene.excitations if isinstance(part, Constant))
    moving = rates > 0.0  # a constant part may displace a mass without a spring by any length
    reach, speed = float(response.sum()) + abs(constant) / own**2, float((rates[moving] * response[moving]).sum())
    gap = max(abs(barrier.position) for barrier in scene.barriers)
    if gap > 0.0:
        limit = 10.0 * gap  # stops limit a resonance to about this
        reach, speed = max(gap, min(reach, limit)), max(own * gap, min(speed, own * limit))
    elif not 0.0 < reach < math.inf or not 0.0 < speed < math.inf:
        reach, speed = 1.0, own
    return reach, speed


def _harmonics(scene: Scene, module: types.ModuleType, theta: list[float]) -> tuple[Array, Array]:
    """Angular frequencies of the forcing at x = 0 over one interval, and their amplitudes."""
    if not module.FORCED:
        return np.zeros(0), np.zeros(0)
    unit, samples = scene.time_unit, 128
    times = [unit * sample / samples for sample in range(samples)]
    if scene.depends_on_state:
        field, parts = VectorField(scene), range(len(scene.excitations))
        values = np.array([sum(field.excitation(index, time) for index in parts) for time in times])
    else:
        values = np.array([module.forcing.py_func(time, theta) for time in times])
    sizes = np.asarray(np.abs(np.fft.rfft(values)) * (2.0 / samples), dtype=np.float64)
    sizes[0] /= 2.0
    sizes[sizes < 1e-9 * sizes.max()] = 0.0  # rounding, which a resonance would amplify
    return 2.0 * math.pi / unit * np.arange(len(sizes), dtype=np.float64), sizes
