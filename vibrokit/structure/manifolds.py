"""Stable and unstable manifolds of a periodic saddle, grown as curves of controlled curvature.

A branch is the union of the images of a fundamental domain, the piece of its linear approximation from a point near the
saddle to the image of that point (You, Kostelich & Yorke 1991). Where neighbouring points of an image are too far apart
or turn too sharply, points are inserted into the domain and carried from there (Hobson 1993), so that no point is ever
interpolated; when it is sharp enough is decided as by Krauskopf & Osinga (1998).

References
----------
Z. You, E. J. Kostelich and J. A. Yorke, "Calculating stable and unstable manifolds", *International Journal of
Bifurcation and Chaos* 1 (1991) 605–623.
D. Hobson, "An efficient method for computing invariant manifolds of planar maps", *Journal of Computational Physics*
104 (1993) 14–22.
B. Krauskopf and H. Osinga, "Growing 1D and quasi-2D unstable manifolds of maps", *Journal of Computational Physics* 146
(1998) 404–419.
"""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError, shown
from vibrokit.kernels.choice import ensemble_stepper, single_stepper
from vibrokit.kernels.ensemble import carry, run_ensemble
from vibrokit.kernels.rk4 import RK4
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import RAN_OUT
from vibrokit.oscillator import Oscillator
from vibrokit.results.manifold import Manifold
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.structure.curves import Domain, Limits, grow
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

_START = 1e-6  # how far the domain reaches from the saddle, as a share of the region
_CLOSE = 1e-9  # how well the saddle must be known
_ITERATIONS = 30
_MOST_STEPS = 1024  # that ensembles are given in a free oscillation, above which located contacts are no slower
_PARTS = 64  # of 2π/ω_n, over which an equilibrium's rates are found
_NEAREST = 1e-13  # how near to the saddle it may begin: rounding must not tear it
_LENGTH = 10.0  # default arc length, in diagonals of the region
_LEAST_GROWTH, _MOST_GROWTH = 2.0, 8.0  # of an image over the one before, where that can be chosen
_WEAKEST = 1e-8  # multiplier, relative to the other one, that is still known to be other than zero

Array = NDArray[np.float64]


def preimages(
    osc: Oscillator,
    states: Array,
    periods: int = 1,
    *,
    stepper: Stepper | None = None,
    interval: float | None = None,
    executor: concurrent.futures.Executor | None = None,
) -> Array:
    """Map states of the section backwards in time.

    Parameters
    ----------
    osc : Oscillator
    states : array (count, n)
        States (x, v), extra noise states after.
    periods : int
        Forcing periods to go back; units of 2π/ω_n for a scene without forcing.
    stepper : Stepper, optional
    interval : float, optional
        Length of a period (s), for scenes without forcing.
    executor : concurrent.futures.Executor, optional

    Returns
    -------
    array (count, n)
        NaN where the motion ran out of range: what damping takes forwards, it gives backwards.
    """
    flip = np.ones(np.shape(states)[1])
    flip[1] = -1.0
    chosen = stepper or ensemble_stepper(osc, Flow.STATE_REVERSED)
    ended = run_ensemble(
        osc, Flow.STATE_REVERSED, chosen, states * flip, periods, interval=interval, executor=executor
    )  # fmt: skip
    return np.where((ended.status == RAN_OUT)[:, None], ended.states * flip, np.nan)


def grow_manifolds(
    osc: Oscillator,
    saddle_index: int,
    saddle: Saddle,
    *,
    region: Any,
    arc_length: float | None = None,
    stepper: Stepper | None = None,
    spacing: float = 0.01,
    bend: float = 0.2,
    stable: Sequence[bool] = (True, False),
    executor: concurrent.futures.Executor | None = None,
) -> tuple[Manifold, ...]:
    """Grow both branches of the stable and the unstable manifold from each point of a saddle.

    Parameters
    ----------
    osc : Oscillator
    saddle_index : int
        Place of the saddle among those of the structure, kept in the result.
    saddle : Saddle
        A periodic orbit or an equilibrium with one stable and one unstable direction.
    region : Region or ((x_min, x_max), (v_min, v_max))
        Lengths are measured in units of its width and height; a branch ends where it leaves the region widened by
        its own size on every side.
    arc_length : float, optional
        Length in the plane of x and v at which a branch is cut; by default 10 diagonals of the region.
    stepper : Stepper, optional
        Carries the points; also the saddle is refined with it, for a coarse one moves it. By default RK4 with four
        times the steps that ensembles are given, or what single trajectories are given where that is no slower. On
        ``hertz-0.570``, against FreeFlight(1e-10) and its 32 s, 99% of the points of RK4(1024), in 1.9 s, lie within
        2e-4 of the curve and all within 5e-3, over arcs of 20 diagonals; of RK4(256), in 1.1 s, within 1e-2 and 2e-2.
    spacing : float
        Largest distance of neighbouring points, as a share of the region's size.
    bend : float
        Largest angle (rad) between neighbouring chords longer than a hundredth of `spacing`. The product of an angle
        and its longer chord is kept below half of ``spacing * bend``.
    stable : sequence of bool
        Which manifolds: True for the stable one, False for the unstable one.
    executor : concurrent.futures.Executor, optional
        Carries the branches; threads of this process by default.

    Returns
    -------
    tuple of Manifold
        By point of the saddle, then as in `stable`, then against and along the eigenvector, which points to larger x.

    Raises
    ------
    StructureError
        The saddle has no one stable and one unstable direction, or there are more states than x and v.
    """
    _check(osc, saddle, spacing, bend, arc_length)
    frame = Region.of(region)
    limits = Limits(
        low=frame.bounds[:, 0], width=np.diff(frame.bounds)[:, 0], spacing=spacing, bend=bend,
        arc_length=arc_length or _LENGTH * float(np.linalg.norm(np.diff(frame.bounds))),
    )  # fmt: skip
    tasks = [
        (osc, saddle_index, saddle, point, backwards, side, limits, stepper)
        for point in range(len(saddle.points))
        for backwards in stable
        for side in (-1, 1)
    ]
    return tuple(carry(_branch, tasks, executor))


def _check(osc: Oscillator, saddle: Saddle, spacing: float, bend: float, arc_length: float | None) -> None:
    states = saddle.points.shape[1]
    if states != 2:
        raise StructureError(f"manifolds are curves in the plane of x and v, and this scene has {states} states.")
    if saddle.period == 0:
        raise StructureError(
            "manifolds are grown from periodic saddles, and this one is a chaotic set without an orbit."
        )
    if osc.autonomous and saddle.duration > 0:
        raise StructureError("manifolds are grown from equilibria of autonomous scenes, and this is a limit cycle.")
    for name, value, most in (("spacing", spacing, 1.0), ("bend", bend, 1.5), ("arc_length", arc_length, math.inf)):
        if value is not None and not (isinstance(value, int | float) and 0 < value <= most):
            allowed = "any number above 0" if most == math.inf else f"a number above 0, at most {most}"
            raise StructureError(f"{name} is {shown(value)}; give {allowed}.")


@dataclasses.dataclass(frozen=True, eq=False)
class _Carrier:
    """The map that a manifold grows along, away from the saddle: the section map or its inverse, some times."""

    osc: Oscillator
    stepper: Stepper
    backwards: bool
    periods: int
    interval: float

    def __call__(self, states: Array, images: int = 1) -> Array:
        """Images of states; NaN where they ran out of range."""
        count = images * self.periods
        if self.backwards:
            return preimages(self.osc, states, count, stepper=self.stepper, interval=self.interval)
        ended = run_ensemble(self.osc, Flow.STATE, self.stepper, states, count, interval=self.interval)
        return np.where((ended.status == RAN_OUT)[:, None], ended.states, np.nan)


def _branch(
    osc: Oscillator,
    saddle_index: int,
    saddle: Saddle,
    place: int,
    backwards: bool,
    side: int,
    limits: Limits,
    stepper: Stepper | None,
) -> Manifold:
    """Grow one branch; a unit of work that an executor may carry."""
    point, monodromy, length = _linearised(osc, saddle, place)
    multiplier, direction = _direction(monodromy, backwards, limits)
    if abs(multiplier) < _WEAKEST or abs(multiplier) > 1.0 / _WEAKEST:
        status = f"It was not grown: its multiplier of {multiplier:.2g} is too extreme to follow over a whole period."
        return Manifold(saddle_index, place, backwards, side, point[None], status)
    rate = abs(math.log(abs(multiplier))) / length
    flow = Flow.STATE_REVERSED if backwards else Flow.STATE
    chosen = stepper or _default_stepper(osc, flow)
    if osc.autonomous:
        interval, periods = min(osc.section_interval, math.log(_MOST_GROWTH) / rate), 1
    else:
        interval, periods = osc.section_interval, saddle.period
        carrier = _Carrier(osc, chosen, backwards, periods, interval)
        point = _fixed_point(carrier, point, monodromy, limits)
    repeats = math.ceil(math.log(_LEAST_GROWTH) / (rate * interval * periods))
    repeats += repeats % 2 if multiplier < 0 else 0
    images = _Carrier(osc, chosen, backwards, periods * repeats, interval)
    domain = _domain(images, point, side * direction, math.exp(rate * interval * periods * repeats), limits)
    curve, status = grow(domain, images, limits)
    return Manifold(saddle_index, place, backwards, side, curve, status)


def _default_stepper(osc: Oscillator, flow: Flow) -> Stepper:
    rough = ensemble_stepper(osc, flow)
    turns = max(1.0, osc.section_interval * osc.natural_frequency / (2 * math.pi))
    if isinstance(rough, RK4) and rough.steps <= _MOST_STEPS * turns:
        return rough.refined().refined()
    return single_stepper(osc, flow)


def _linearised(osc: Oscillator, saddle: Saddle, place: int) -> tuple[Array, Array, float]:
    """A point of the saddle, the derivative of the map there, and the time that map takes.

    Without forcing that time is short, so that neither multiplier is lost in rounding.
    """
    exact = single_stepper(osc, Flow.STATE_VARIATIONAL)
    interval = osc.section_interval / (_PARTS if osc.autonomous else 1)
    orbit = refine_orbit(osc, saddle.points[place], saddle.period, exact, interval=interval)
    return orbit.point, orbit.monodromy, saddle.period * interval


def _direction(monodromy: Array, backwards: bool, limits: Limits) -> tuple[float, Array]:
    """Multiplier and direction, to larger x and as long as the region is wide, of one of the manifolds."""
    multipliers, vectors = np.linalg.eig(monodromy)
    order = np.argsort(np.abs(multipliers))
    if np.iscomplexobj(multipliers) or not abs(multipliers[order[0]]) < 1.0 < abs(multipliers[order[1]]):
        listed = ", ".join(f"{multiplier:.4g}" for multiplier in multipliers[order])
        raise StructureError(
            f"the multipliers of the orbit are {listed}, and only a saddle has manifolds that are curves: give one "
            "with one multiplier inside the unit circle and one outside."
        )
    chosen = order[0 if backwards else 1]
    vector = vectors[:, chosen] / np.linalg.norm(vectors[:, chosen] / limits.width)
    return float(multipliers[chosen]), vector if vector[0] > 0 or (vector[0] == 0 < vector[1]) else -vector


def _fixed_point(carrier: _Carrier, point: Array, monodromy: Array, limits: Limits) -> Array:
    """Fixed point of the very map that carries the curve, by Newton's method with a derivative from nearby."""
    least, best = math.inf, point
    inverse = np.linalg.inv(monodromy - np.eye(2))
    inverse = inverse @ monodromy if carrier.backwards else -inverse
    for _ in range(_ITERATIONS):
        step = inverse @ (carrier(point[None])[0] - point)
        size = float(np.linalg.norm(step / limits.width))
        if not size < least:
            break
        least, best, point = size, point, point + step
    if not least < _CLOSE:
        raise StructureError(
            f"{carrier.stepper} has no saddle near {tuple(np.round(best, 6).tolist())}: Newton's steps fall to "
            f"{least:.1g} of the region only. Take a finer stepper, or one that locates contacts."
        )
    return best


def _domain(images: _Carrier, point: Array, direction: Array, growth: float, limits: Limits) -> Domain:
    """The piece of the linear manifold from a point to its image; less where rounding would tear it."""
    reach = _START * direction
    if _START / growth < _NEAREST:
        return Domain(point, reach, _START / _NEAREST, np.zeros(2))
    image = images((point + reach / growth)[None])[0]
    return Domain(point, reach, growth, image - (point + reach))
