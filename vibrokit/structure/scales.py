"""Lengths and regions that follow from a scene and from its attractors.

Lengths are measured by the size of the motions, so that no result depends on the units.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq, minimize_scalar

from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.parts.barrier import Barrier
from vibrokit.results.attractor import Attractor
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle

_RESONANCE = 5.0  # amplification of a periodic force that two stops do not limit: room for subharmonic motions
_AMPLITUDES, _PHASES = 400, 128  # of the trial motions of harmonic balance
_LEAST_SWING, _MOST_SWING = 1e-3, 1e3  # of the deflection: range of amplitudes, where the damping does not bound it
_SAMPLES, _LEAST_SAMPLES = 64, 512  # of a force in 2π/ω_n, and in all; its maximum is refined from the largest
_LONGEST = 1024  # units of 2π/ω_n over which a force is sampled, if its period is longer
_MARGIN = 0.25  # of the width, on each side
_RESTING = 1e-3
_SHALLOWEST, _DEPTHS = 1e-9, 400  # of depths in a stop, relative to the largest, at which its force is sampled
_PLACES = 64  # in x, at which the force is compared with that of another place
_SAME_PLACE = 1e-6  # relative: difference of two places, or forces, that are the same
_FARTHEST, _TRIED = 30.0, 600  # sizes of a motion within which tops of barriers are searched for, and places tried
_DECADES = 12  # of deflections, above and below 1 m, at which a spring's force is compared with its linear part

Array = NDArray[np.float64]


@functools.lru_cache(maxsize=256)
def length_of(osc: Oscillator) -> float:
    """Return the distance that the mass may be expected to move (m).

    It is the largest of twice the distance to the stops, the deflection of a spring ω_n² by the largest forces of the
    excitations, and the amplitude of the largest resonant motion. Where two stops do not limit a resonance, it
    multiplies the deflection by periodic forces. Where x = 0 is unstable without forcing, or there are neither stops
    nor forces, it includes the deflection at which the nonlinear part of the spring's force is as large as the linear
    part. A linear spring has no length scale; the length is 1 then.
    """
    field, push, swing = VectorField(osc), 0.0, 0.0
    for index, part in enumerate(osc.excitations):
        resonant = len(osc.barriers) < 2 and part.period is not None
        largest = _largest_force(field, index, part.period, 2 * math.pi / osc.natural_frequency)
        push += largest * (_RESONANCE if resonant else 1.0) / osc.natural_frequency**2
        swing += largest / osc.natural_frequency**2 if part.period is None else _swing(osc, field, largest, part.period)
    length = max([push, swing, *(2 * abs(barrier.position) for barrier in osc.barriers)])
    if not length or _pushes_away(osc, field):
        length = max(length, _bending(osc, field))
    return length or 1.0


def units_of(osc: Oscillator) -> Array:
    """Return the sizes of the coordinates of a state, shape (n,): length, velocity, and both for those of the noise.

    Displacements are compared with displacements and velocities with velocities, so that no unit matters.
    """
    length = length_of(osc)
    units = np.full(states_at(osc, np.zeros((1, 2))).shape[1], size_of(osc))
    units[:2] = length, length * osc.natural_frequency
    return units


def size_of(osc: Oscillator) -> float:
    """Return the size of states (x, v) that goes with it, x and v taken together."""
    return length_of(osc) * math.hypot(1.0, osc.natural_frequency)


def _swing(osc: Oscillator, field: VectorField, force: float, period: float) -> float:
    """Largest amplitude A at which a force at most as large keeps up x = A cos(2πt/T), by harmonic balance; else 0.

    A bistable resonance has several amplitudes; the largest one is limited by the damping (A. H. Nayfeh and D. T. Mook,
    "Nonlinear Oscillations", 1979, section 4.1).
    """
    frequency, natural = 2 * math.pi / period, osc.natural_frequency
    deflection, damping = force / natural**2, 2 * osc.damping_ratio * natural * frequency
    most = min(_MOST_SWING * deflection, force / damping if damping else math.inf)
    if not most > 0:
        return 0.0
    phases = 2 * math.pi / _PHASES * np.arange(_PHASES)
    amplitudes = np.geomspace(min(most, deflection) * _LEAST_SWING, most, _AMPLITUDES)[:, None]
    motion = np.stack([amplitudes * np.cos(phases), -amplitudes * frequency * np.sin(phases)], axis=-1)
    steady = sum(field.excitation(index, 0.0) for index in range(len(osc.excitations)))
    rates = field.rate(states_at(osc, motion.reshape(-1, 2)))[:, 1].reshape(motion.shape[:2]) - steady
    missing = 2 * np.mean((amplitudes * frequency**2 * np.cos(phases) + rates) * np.exp(-1j * phases), axis=1)
    balanced = amplitudes[np.abs(missing) <= force, 0]
    return float(balanced.max()) if balanced.size else 0.0


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
    span = min(period, _LONGEST * turn)
    times, spacing = np.linspace(
        0.0, span, max(_LEAST_SAMPLES, math.ceil(_SAMPLES * span / turn)), endpoint=False, retstep=True
    )
    near = max(times, key=force)
    refined = minimize_scalar(
        lambda time: -force(time), bounds=(near - spacing, near + spacing), method="bounded",
        options={"xatol": 1e-9 * spacing},
    )  # fmt: skip
    return max(force(near), -float(refined.fun))


def states_at(osc: Oscillator, places: Array) -> Array:
    """Return states (…, n) at places (…, 2); states of the noise are 0."""
    extra = len(osc.noise.extra_states) if osc.noise else 0
    return np.pad(places, (*[(0, 0)] * (places.ndim - 1), (0, extra)))


def search_region(osc: Oscillator) -> Region:
    """Return a region for starts: it contains the stops, and the reach of a linear oscillator under the same forces."""
    reach = length_of(osc)
    return _without_deep_contact(
        osc, Region((-reach, reach), (-reach * osc.natural_frequency, reach * osc.natural_frequency))
    )


def frame_of(osc: Oscillator, attractors: Sequence[Attractor]) -> Region:
    """Return a region that contains the attractors' points and the stops, with a margin around them.

    It contains the largest speed of each attractor at any phase, since other motions pass the section there. It is at
    least as wide as the gap between two stops. Without two stops it is at least as wide as the widest motion,
    or, if all attractors are at rest, as the length scale of the scene. Beyond a stop it ends at the depth that its
    largest speed can reach. Where a shift along x leaves the motion unchanged, as of a pendulum that turns over, it
    contains the copy of each attractor that is nearest to x = 0, and is at least as wide as the shift. Without stops it
    contains the tops of the potential barriers around the attractors.
    """
    attractors, shift = without_copies(osc, attractors)
    points = np.concatenate([attractor.points[:, :2] for attractor in attractors])
    cycles = [attractor.orbit for attractor in attractors if attractor.kind == "limit cycle"]
    points = np.concatenate([points, *cycles])
    places = [barrier.position for barrier in osc.barriers]
    gap = float(np.ptp(places)) if len(places) == 2 else 0.0
    x, v = points.T
    low, high = min([x.min(), *places]), max([x.max(), *places])
    if not osc.barriers:
        low, high = with_barrier_tops(osc, low, high)
    swings = [0.5 * float(np.ptp(attractor.orbit[:, 0])) for attractor in attractors]
    widest = max(swings)
    least = 0.5 * max(gap, shift) or (widest if widest > _RESTING * length_of(osc) else length_of(osc))
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), least)
    swing = float(np.abs(x - x.mean()).max())
    fastest = max(float(np.abs(attractor.orbit[:, 1]).max()) for attractor in attractors)
    speed = max(osc.natural_frequency * max(swing, least), float(np.abs(v).max()), fastest)
    half, speed = half * (1 + 2 * _MARGIN), speed * (1 + 2 * _MARGIN)
    region = Region((float(middle - half), float(middle + half)), (-speed, speed))
    return _without_deep_contact(osc, region, (float(x.min()), float(x.max())))


def with_barrier_tops(osc: Oscillator, low: float, high: float) -> tuple[float, float]:
    """Return a range of x (m) extended to the next tops of potential barriers on both sides, if these are near.

    There a steady force that has pushed the mass back begins to push it away. Periodic forces are left out.
    """
    field, length = VectorField(osc), max(length_of(osc), 0.5 * (high - low))
    periodic = sum(field.excitation(i, 0.0) for i, part in enumerate(osc.excitations) if part.period is not None)
    away = length * np.geomspace(1.0 / _TRIED, _FARTHEST, _TRIED)

    def extended(end: float, sign: float) -> float:
        def push(distances: Array) -> Array:
            places = np.stack([end + sign * distances, np.zeros_like(distances)], axis=1)
            outward: Array = sign * (field.rate(states_at(osc, places))[:, 1] - periodic)
            return outward

        outward = push(away) > 0
        tops = np.flatnonzero(outward[1:] & ~outward[:-1])
        if not tops.size:
            return end
        near, far = away[tops[0] : tops[0] + 2]
        return end + sign * float(brentq(lambda distance: push(np.array([distance]))[0], near, far))

    return extended(low, -1.0), extended(high, 1.0)


def without_copies(osc: Oscillator, attractors: Sequence[Attractor]) -> tuple[list[Attractor], float]:
    """Return attractors of which none is another one shifted along x, and the least such shift (m); 0 for none."""
    kept, least = list[Attractor](), math.inf
    for one in sorted(attractors, key=lambda each: abs(float(each.points[:, 0].mean()))):
        shifts = [shift for other in kept if (shift := _shift(osc, other, one))]
        least = min([least, *shifts])
        kept += [] if shifts else [one]
    return kept, least if math.isfinite(least) else 0.0


def _shift(osc: Oscillator, one: Attractor, other: Attractor) -> float:
    """Distance along x from an attractor to another one, if that shift leaves the motion unchanged; else 0."""
    if osc.barriers or one.points.shape != other.points.shape:
        return 0.0
    units, moved = units_of(osc), other.points - one.points
    shift = float(moved[0, 0])
    moved[:, 0] -= shift
    if not np.all(np.abs(moved) < _SAME_PLACE * units):
        return 0.0
    x, v = np.meshgrid(np.linspace(-shift, shift, _PLACES), [-units[1], 0.0, units[1]])
    here = np.stack([x.ravel(), v.ravel()], axis=1)
    rates = [VectorField(osc).rate(states_at(osc, places))[:, 1] for places in (here, here + np.array([shift, 0.0]))]
    unchanged = np.abs(rates[1] - rates[0]).max() < _SAME_PLACE * np.abs(rates[0]).max()
    return abs(shift) if unchanged else 0.0


def _without_deep_contact(osc: Oscillator, region: Region, kept: tuple[float, float] = (math.inf, -math.inf)) -> Region:
    """Return the part of a region that the mass reaches with the region's largest speed; `kept` stays inside.

    A state deeper in a stiff stop has more energy than any state of interest: it is thrown out at a speed far above
    those of the region, and strikes the stops many times in each period before it is back.
    """
    (low, high), speed = region.x, max(region.v)
    for barrier in osc.barriers:
        edge = high if barrier.side == "right" else low
        most = barrier.sign * (edge - barrier.position)
        if most <= 0:
            continue
        end = barrier.position + barrier.sign * (1 + 2 * _MARGIN) * _reached_depth(osc, barrier, speed, most)
        if barrier.side == "right":
            high = min(high, max(end, kept[1]))
        else:
            low = max(low, min(end, kept[0]))
    return Region((low, high), region.v)


def _reached_depth(osc: Oscillator, barrier: Barrier, speed: float, most: float) -> float:
    """Depth (m), at most `most`, at which the force beyond that at first touch has stopped a mass of some speed."""
    depths = most * np.concatenate([[0.0], np.geomspace(_SHALLOWEST, 1.0, _DEPTHS)])
    places = np.stack([barrier.position + barrier.sign * depths, np.zeros_like(depths)], axis=1)
    force = -barrier.sign * VectorField(osc).rate(states_at(osc, places))[:, 1]
    energy = cumulative_trapezoid(force - force[0], depths, initial=0.0)
    beyond = np.flatnonzero(~(energy <= 0.5 * speed**2))
    return float(depths[beyond[0]]) if beyond.size else most


def lies_in(region: Region, orbit: Attractor | Saddle) -> bool:
    """Whether some point of an orbit on the section is in a region; of a limit cycle, whether any of its points is."""
    points = orbit.orbit if isinstance(orbit, Attractor) and orbit.kind == "limit cycle" else orbit.points
    return bool(region.contains(points).any())
