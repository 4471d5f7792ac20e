"""Regions of (x, v) that follow from a scene and from its attractors."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.parts.barrier import Barrier
from vibrokit.results.attractor import Attractor
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.structure.borders import between_borders
from vibrokit.structure.scales import length_of, states_at, units_of

_MARGIN = 0.25  # of the width, on each side
_RESTING = 1e-3
_SHALLOWEST, _DEPTHS = 1e-9, 400  # of depths in a stop, relative to the largest, at which its force is sampled
_PLACES = 64  # in x, at which the force is compared with that of another place
_SAME_PLACE = 1e-6  # relative: difference of two places, or forces, that are the same
_FARTHEST, _TRIED = 30.0, 600  # sizes of a motion within which tops of barriers are searched for, and places tried

Array = NDArray[np.float64]


def search_region(osc: Oscillator) -> Region:
    """Return a region for starts: it contains the stops, and the reach of a linear oscillator under the same forces."""
    reach = length_of(osc)
    region = Region((-reach, reach), (-reach * osc.natural_frequency, reach * osc.natural_frequency))
    return _without_deep_contact(osc, between_borders(osc, region))


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
    region = between_borders(osc, region, points[:, 0].tolist())
    return _without_deep_contact(osc, region, (float(x.min()), float(x.max())))


def with_barrier_tops(osc: Oscillator, low: float, high: float) -> tuple[float, float]:
    """Return a range of x (m) extended to the next tops of potential barriers on both sides, if these are near.

    There a steady force that has pushed the mass back begins to push it away. Periodic forces are left out.
    """
    field, length = VectorField(osc), max(length_of(osc), 0.5 * (high - low))
    periodic = sum(field.excitation(i, 0.0) for i, part in enumerate(osc.excitations) if part.period is not None)
    distances = length * np.geomspace(1.0 / _TRIED, _FARTHEST, _TRIED)

    def extended(end: float, sign: float) -> float:
        border = osc.model.domain.around(end)[1 if sign > 0 else 0]
        away = distances[distances < sign * (border - end)]

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
