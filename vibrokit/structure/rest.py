"""A mass at rest: the steady force on it, where that is 0, its potential, and the tops of potential barriers.

Exits lead over the tops, however weak the forces of a scene are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.structure.along_x import intervals_within, states_at
from vibrokit.structure.one_variable import bracketed_roots, tones

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_TIMES, _MOST_TIMES = 64, 1024  # in the shortest period of a force, whose mean is exact for 63 harmonics; in all
_PLACES = 1024  # in a range of x between borders, at which the force is compared with 0

Array = NDArray[np.float64]


class SteadyForce:
    """The force on the mass (m s⁻²) without the periodic part of the excitations.

    Of forces that vary in time with the state it has the mean over their common period.
    """

    def __init__(self, osc: Oscillator) -> None:
        self.osc, self.field = osc, VectorField(osc)
        self._times = _times_over(osc)
        periods = {
            i: part.period
            for i, part in enumerate(osc.excitations)
            if part.period is not None and not part.depends_on_state
        }
        now = sum(np.mean([self.field.excitation(index, time) for time in self._times]) for index in periods)
        finite = ((partial(self.field.excitation, i), period) for i, period in periods.items() if math.isfinite(period))
        self._periodic = now - sum(tones(force, period, 1, 1.0)[0] for force, period in finite)

    def __call__(self, states: Array) -> Array:
        """Return the force at states (…, 2)."""
        with np.errstate(all="ignore"):  # a force may be singular
            rates = self._mean(self.field.rate, states)[..., 1] - self._periodic
        return rates

    def slope(self, states: Array) -> Array:
        """Return the derivatives of the force by x and v at states (…, 2), shape (…, 2)."""
        with np.errstate(all="ignore"):
            derivatives = self._mean(self.field.jacobian, states)[..., 1, :2]
        return derivatives

    def _mean(self, function: Callable[[Array, Array], Array], states: Array) -> Array:
        """The mean over the times of a function of states and times."""
        full = states_at(self.osc, states)
        many = np.broadcast_to(full, (len(self._times), *full.shape))
        times = self._times.reshape(-1, *[1] * (states.ndim - 1))
        return np.asarray(function(many, times).mean(axis=0))

    def at_rest(self, places: Array) -> Array:
        """Return the force at rest at places (…)."""
        return self(np.stack([places, np.zeros_like(places)], axis=-1))

    def zeros(self, low: float, high: float) -> list[float]:
        """Return the places between two others, in ascending order, where the force at rest changes its sign.

        A force changes its sign at a pole, too, so each interval between borders of the forces is searched by itself.
        """
        found = list[float]()
        for one, other in intervals_within(self.osc, low, high):
            places = np.linspace(one, other, _PLACES)
            found += bracketed_roots(self._value, places, self.at_rest(places))
        return sorted(found)

    def rests(self, length: float, most: int = 5) -> list[float]:
        """Return the places of rest nearest to x = 0, within four lengths of it, in ascending order."""
        return sorted(sorted(self.zeros(-4 * length, 4 * length), key=abs)[:most])

    def _value(self, x: float) -> float:
        found = float(self.at_rest(np.array(x)))
        if not math.isfinite(found):
            raise StructureError(
                f"the force at rest has no value at x = {x:.6g}, where it is needed: a formula is 0/0 there, or "
                "infinite; write it without that division, or give a region without that place."
            )
        return found

    def work(self, places: Array) -> tuple[Array, Array]:
        """Return the force at rest inside the intervals from place to place, (count − 1, 8), and its integral."""
        halves = 0.5 * np.diff(places)[:, None]
        forces = self.at_rest(places[:-1, None] + halves * (1 + _NODES))
        return forces, np.sum(halves * _WEIGHTS * forces, axis=1)

    def speed_to_reach(self, low: float, high: float) -> float:
        """Return the speed (m/s) that a mass at the lowest point of the potential needs to reach two places.

        It is 0 where a border of the forces lies between them, because no speed crosses it.
        """
        if self.osc.model.domain.borders(low, high):
            return 0.0
        stops = [stop.position for stop in self.osc.barriers if low < stop.position < high]
        places = np.unique([*np.linspace(low, high, _PLACES), *stops, *self.zeros(low, high)])
        potential = np.concatenate([[0.0], -np.cumsum(self.work(places)[1])])
        speed = math.sqrt(2 * float(max(potential[0], potential[-1]) - potential.min()))
        return float(f"{speed:.6g}")  # tops that are equally high are so in spite of rounding


def _times_over(osc: Oscillator) -> Array:
    """Times (s) whose mean is that of the forces that vary periodically with the state; 0 without any."""
    varying = tuple(
        part
        for part in osc.excitations
        if part.depends_on_state and part.period is not None and math.isfinite(part.period)
    )
    if not varying:
        return np.zeros(1)
    period = osc.replace(excitations=varying).section_interval
    count = min(_MOST_TIMES, _TIMES * round(period / min(part.period or math.inf for part in varying)))
    return period * np.arange(count) / count


class Top(NamedTuple):
    """A place beyond which the steady force no longer pushes the mass back, but away."""

    speed: float  # m/s, of a mass at the lowest point of the potential that just reaches the top
    place: float  # m


def tops_around(osc: Oscillator, low: float, high: float, length: float) -> list[Top]:
    """Return the next top on each side of a range of x (m), the lower first; none where the potential only rises.

    Distances are searched from a thousandth of a length of the scene on.
    """
    steady = SteadyForce(osc)
    places = [_next_top(steady, low, high, sign, length) for sign in (-1.0, 1.0)]
    found = [Top(steady.speed_to_reach(min(low, x), max(high, x)), x) for x in places if math.isfinite(x)]
    return sorted(top for top in found if math.isfinite(top.speed))


def _next_top(steady: SteadyForce, low: float, high: float, sign: float, length: float) -> float:
    """Return the next top beyond one end of a range; nan if there is none."""
    end = high if sign > 0 else low
    border = steady.osc.model.domain.around(0.5 * (low + high))[1 if sign > 0 else 0]
    distances = np.logspace(-3, 12, 15 * 64 + 1) * max(length, 0.5 * (high - low))
    distances = distances[distances < sign * (border - end)]

    def outward(away: Array) -> Array:
        return sign * steady.at_rest(end + sign * away)

    forces = outward(distances)
    passed = np.flatnonzero((forces[1:] > 0) & (forces[:-1] <= 0) | ~np.isfinite(forces[1:]))
    count = int(passed[0]) + 2 if passed.size else len(forces)
    count -= not np.isfinite(forces[:count]).all()
    roots = bracketed_roots(lambda away: float(outward(np.array(away))), distances[:count], forces[:count])
    before = 0.5 * (np.array([0.0, *roots])[:-1] + np.array(roots))  # in a pair of roots, the first one is the top
    tops = np.flatnonzero(outward(before) < 0)
    return end + sign * roots[int(tops[0])] if tops.size else math.nan


def in_front_of_stops(osc: Oscillator, tops: Iterable[Top]) -> list[Top]:
    """Return the tops that the mass reaches without contact with a stop."""
    return [top for top in tops if not any(one.sign * (top.place - one.position) > 0 for one in osc.barriers)]
