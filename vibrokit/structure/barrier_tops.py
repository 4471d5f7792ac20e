"""Tops of the potential barriers around a range of x: beyond them motion leads elsewhere, or leaves for good.

Exits lead over these tops, however weak the forces of a scene are.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from vibrokit.oscillator import Oscillator
from vibrokit.structure.harmonic_balance import SteadyForce
from vibrokit.structure.roots import bracketed_roots
from vibrokit.structure.scales import length_of

_NEAREST, _FARTHEST, _PER_DECADE = -3, 12, 64  # decades of distance, in lengths of the scene, where tops are searched
_SAMPLES = 512  # of the force in a range of x

Array = NDArray[np.float64]


class Top(NamedTuple):
    """A place beyond which the steady force no longer pushes the mass back, but away."""

    speed: float  # m/s, of a mass at the lowest point of the potential that just reaches the top
    place: float  # m


def tops_around(osc: Oscillator, low: float, high: float) -> list[Top]:
    """Return the next top on each side of a range of x (m), the lower first; none where the potential only rises."""
    steady = SteadyForce(osc)
    places = [_next_top(osc, steady, low, high, sign) for sign in (-1.0, 1.0)]
    found = [Top(speed_to_reach(osc, min(low, x), max(high, x)), x) for x in places if math.isfinite(x)]
    return sorted(top for top in found if math.isfinite(top.speed))


def speed_to_reach(osc: Oscillator, low: float, high: float) -> float:
    """Return the speed (m/s) that a mass at the lowest point of the steady potential needs to reach both ends.

    It is 0 where a border of the forces lies between the ends, because no speed crosses it.
    """
    if osc.model.domain.borders(low, high):
        return 0.0
    far = np.geomspace(1.0 / _SAMPLES, 1.0, _SAMPLES) * (high - low)  # where stops may be much stiffer than the rest
    places = np.unique(np.concatenate([np.linspace(low, high, _SAMPLES), high - far, low + far]))
    force = SteadyForce(osc)(np.stack([places, np.zeros_like(places)], axis=1))
    potential = -cumulative_trapezoid(force, places, initial=0.0)
    speed = math.sqrt(2 * float(max(potential[0], potential[-1]) - potential.min()))
    return float(f"{speed:.6g}")  # tops that are equally high are so in spite of rounding


def _next_top(osc: Oscillator, steady: SteadyForce, low: float, high: float, sign: float) -> float:
    """Return the next top beyond one end of a range; nan if there is none."""
    end = high if sign > 0 else low
    border = osc.model.domain.around(0.5 * (low + high))[1 if sign > 0 else 0]
    distances = np.logspace(_NEAREST, _FARTHEST, (_FARTHEST - _NEAREST) * _PER_DECADE + 1)
    distances *= max(length_of(osc), 0.5 * (high - low))
    distances = distances[distances < sign * (border - end)]

    def outward(away: Array) -> Array:
        return sign * steady(np.stack([end + sign * away, np.zeros_like(away)], axis=1))

    forces = outward(distances)
    passed = np.flatnonzero((forces[1:] > 0) & (forces[:-1] <= 0) | ~np.isfinite(forces[1:]))
    count = int(passed[0]) + 2 if passed.size else len(forces)
    count -= not np.isfinite(forces[:count]).all()
    roots = bracketed_roots(
        lambda away: float(outward(np.array([away]))[0]), distances[:count], forces[:count]
    )  # a pair between two samples, where the first one is a top, included
    before = 0.5 * (np.array([0.0, *roots])[:-1] + np.array(roots))
    tops = np.flatnonzero(outward(before) < 0)
    return end + sign * roots[int(tops[0])] if tops.size else math.nan


def in_front_of_stops(osc: Oscillator, tops: Iterable[Top]) -> list[Top]:
    """Return the tops that the mass reaches without contact with a stop."""
    return [top for top in tops if not any(one.sign * (top.place - one.position) > 0 for one in osc.barriers)]
