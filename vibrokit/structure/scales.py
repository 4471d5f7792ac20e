"""Lengths that follow from a scene, and the units that go with them.

Lengths are measured by the size of the motions, so that no result depends on the units.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.structure.along_x import states_at, turn_of
from vibrokit.structure.known_motions import Balance, balances_of
from vibrokit.structure.one_variable import bracketed_roots

_DECADES = 12  # above and below 1 m: deflections at which a spring is compared with a linear one, damping with 0

Array = NDArray[np.float64]


@functools.lru_cache(maxsize=256)
def length_of(osc: Oscillator) -> float:
    """Return the distance that the mass may be expected to move (m).

    It is the largest of twice the distance to the stops, the deflection of a spring ω_n² by the largest forces of the
    excitations, and the amplitude of the largest resonant motion. Where two stops do not limit a resonance, it
    multiplies the deflection by periodic forces. Where x = 0 is unstable without forcing, or there are neither stops
    nor forces, it includes the deflection at which the nonlinear part of the spring's force is as large as the linear
    part. Where damping changes its sign with the amplitude, it includes the amplitude at which it does. Where forces
    have poles or other borders, no motion about x = 0 is larger than the distance to the nearest, which takes the place
    of amplitudes. A linear spring has no length scale; the length is 1 then. Where the force of the spring repeats
    along x, it is half a turn or more.
    """
    field, push = VectorField(osc), 0.0
    for index, part in enumerate(osc.excitations):
        resonant = len(osc.barriers) < 2 and part.period is not None
        largest = _largest_force(field, index, part.period, 2 * math.pi / osc.reference_frequency)
        push += largest * (5.0 if resonant else 1.0) / osc.reference_frequency**2  # room for subharmonic motions
    stops = (2 * abs(barrier.position) for barrier in osc.barriers)
    if osc.model.domain:
        return max([push, _length_between_borders(osc), *stops]) or 1.0
    length = max([push, _self_sustained(osc, field), *stops])
    if not length or _pushes_away(osc, field):
        length = max(length, _bending(osc, field))
    length = length or 1.0
    return max(length, _swing(balances_of(osc, length)), 0.5 * turn_of(osc))


def turns_of(osc: Oscillator) -> float:
    """Return the number of free oscillations in a section interval."""
    return osc.section_interval * osc.reference_frequency / (2 * math.pi)


def doublings_of(osc: Oscillator) -> int:
    """Return how often a number of parts of a section interval is doubled, to stay as fine in 2π/ω_n.

    A section interval is the period of the forcing. Up to two of 2π/ω_n it counts as one.
    """
    turns = turns_of(osc)
    return max(0, math.ceil(math.log2(turns / 2) - 1e-9))


def units_of(osc: Oscillator) -> Array:
    """Return the sizes of the coordinates of a state, shape (n,): length, velocity, and both for those of the noise.

    Displacements are compared with displacements and velocities with velocities, so that no unit matters.
    """
    length = length_of(osc)
    units = np.full(states_at(osc, np.zeros((1, 2))).shape[1], size_of(osc))
    units[:2] = length, length * osc.reference_frequency
    return units


def size_of(osc: Oscillator) -> float:
    """Return the size of states (x, v) that goes with it, x and v taken together."""
    return length_of(osc) * math.hypot(1.0, osc.reference_frequency)


def _swing(balances: Iterable[Balance]) -> float:
    """Largest distance from x = 0 of motions that tones keep up, those of all tones together."""
    widest = dict[float, float]()
    for one in balances:
        widest[one.frequency] = max(widest.get(one.frequency, 0.0), one.amplitude)
    return sum(widest.values()) + max((abs(one.centre) for one in balances), default=0.0)


def _self_sustained(osc: Oscillator, field: VectorField) -> float:
    """Largest amplitude A at which the motion x = A cos ω_n t has the same energy after a turn; 0 if there is none.

    Damping that oscillates with the amplitude has many; the first few count.
    Limit cycles, stable and unstable ones, have about these amplitudes (N. N. Bogoliubov and Y. A. Mitropolsky,
    "Asymptotic Methods in the Theory of Non-linear Oscillations", 1961, section 1).
    """
    phases = 2 * math.pi / 128 * np.arange(128)
    shape = np.stack([np.cos(phases), -osc.reference_frequency * np.sin(phases)], axis=-1)

    def gain(logarithm: float) -> float:
        motion = math.exp(logarithm) * shape
        with np.errstate(all="ignore"):  # a force may be singular
            powers = field.rate(states_at(osc, motion))[:, 1] * motion[:, 1]
        gained, exchanged = float(powers.mean()), float(np.abs(powers).mean())
        return 0.0 if abs(gained) <= 1e-9 * exchanged else gained / exchanged

    places = np.linspace(-_DECADES, _DECADES, 16 * _DECADES + 1) * math.log(10)
    gains = np.array([gain(place) for place in places])
    known = (gains != 0) & np.isfinite(gains).cumprod().astype(bool)
    found = bracketed_roots(gain, places[known], gains[known])[:4]
    return float(f"{math.exp(max(found, default=-math.inf)):.9g}")


def _length_between_borders(osc: Oscillator) -> float:
    """Return the distance (m) from x = 0 to the nearest border; 0 for a scene without.

    Where x = 0 is itself a border, or beyond one, it is twice the distance to the farthest place of rest, or else the
    distance to the farther border.
    """
    low, high = osc.model.domain.around(0.0)
    if low < 0.0 < high:
        nearest = min(-low, high)
        return nearest if math.isfinite(nearest) else 0.0
    side = 1.0 if low >= 0.0 else -1.0
    near, far = sorted((abs(low), abs(high)))
    away = near + np.geomspace(1e-12, 1e12, 24 * 32 + 1)
    away = away[away < far]
    places = np.stack([side * away, np.zeros_like(away)], axis=1)
    outward = VectorField(osc).rate(states_at(osc, places))[:, 1] > 0
    rests = away[1:][outward[1:] != outward[:-1]]
    lengths = [*(2.0 * rests[-1:]), *([far] if math.isfinite(far) else [])]
    return float(f"{min(lengths, default=0.0):.9g}")


def _pushes_away(osc: Oscillator, field: VectorField) -> bool:
    """Return whether the force on a mass near x = 0 grows in the direction of its displacement."""
    return bool(field.jacobian(states_at(osc, np.zeros((1, 2))))[0, 1, 0] > 0)


def _bending(osc: Oscillator, field: VectorField) -> float:
    """Deflection at which the nonlinear part of the force of the spring is as large as the linear one; 0 for none."""
    rest = states_at(osc, np.zeros((1, 2)))
    slope = float(field.jacobian(rest)[0, 1, 0])
    offset = float(field.rate(rest)[0, 1])

    def excess(logarithm: float) -> float:
        sides = states_at(osc, np.array([[1.0, 0.0], [-1.0, 0.0]]) * math.exp(logarithm))
        forces = field.rate(sides)[:, 1] - offset
        return float(np.abs(forces - slope * sides[:, 0]).max() / (abs(slope) * sides[0, 0])) - 1.0

    if slope == 0.0 or not math.isfinite(slope):
        return 0.0
    places = np.linspace(-_DECADES, _DECADES, 8 * _DECADES + 1) * math.log(10)
    values = [excess(place) for place in places]
    for low, high, below, above in zip(places, places[1:], values, values[1:], strict=False):
        if below < 0 <= above < math.inf:
            return float(f"{math.exp(brentq(excess, low, high)):.9g}")
    return 0.0


def _largest_force(field: VectorField, index: int, period: float | None, turn: float) -> float:
    """Largest absolute value of an excitation over its period; `turn` is 2π/ω_n."""

    def force(time: float) -> float:
        return abs(field.excitation(index, time))

    if period is None:
        return force(0.0)
    span = min(period, 1024 * turn)
    times, spacing = np.linspace(0.0, span, max(512, math.ceil(64 * span / turn)), endpoint=False, retstep=True)
    near = max(times, key=force)
    refined = minimize_scalar(
        lambda time: -force(time), bounds=(near - spacing, near + spacing), method="bounded",
        options={"xatol": 1e-9 * spacing},
    )  # fmt: skip
    return max(force(near), -float(refined.fun))
