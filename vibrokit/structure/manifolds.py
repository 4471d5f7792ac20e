"""Stable and unstable manifolds of a periodic saddle, grown as curves of controlled curvature.

A branch is the union of the images of a fundamental domain, the piece of its linear approximation from a point near the
saddle to the image of that point (You, Kostelich & Yorke 1991). Where neighbouring points of an image are too far apart
or the angle between chords is too large, points are inserted into the domain and mapped from there (Hobson 1993), so
that no point is interpolated. The criterion for the angle is that of Krauskopf & Osinga (1998).

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
import contextlib
import dataclasses
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError, shown
from vibrokit.kernels.choice import ensemble_stepper, single_stepper
from vibrokit.kernels.ensemble import carry, compiled_kernel, run_ensemble
from vibrokit.kernels.rk4 import RK4
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.progress import advance
from vibrokit.results.manifold import Manifold, ManifoldEnd
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.structure.curves import Domain, Limits, grow
from vibrokit.structure.equilibria import refine_equilibrium
from vibrokit.structure.newton import Evaluation, newton
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

BRANCHES = "branches"
"""Unit of stages that grow manifolds: each branch advances them."""
_START = 1e-6  # extent of the domain from the saddle, as a share of the region
_CLOSE = 1e-9  # largest error of the saddle, as a share of the region
_MOST_STEPS = 1024  # of an ensemble in a free oscillation, above which located contacts are no slower
_PARTS = 64  # of 2π/ω_n, over which the multipliers of an equilibrium are taken
_NEAREST = 1e-13  # smallest distance from the saddle at which the domain may start, because of rounding
_LENGTH = 10.0  # default arc length, in diagonals of the region
_LEAST_GROWTH, _MOST_GROWTH = 2.0, 8.0  # ratio of the lengths of an image and the one before, if it can be chosen
_WEAKEST = 1e-8  # smallest multiplier, relative to the other one, that rounding leaves different from zero

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
        NaN where the motion diverged: backwards in time, damping adds energy.
    """
    flip = np.ones(np.shape(states)[1])
    flip[1] = -1.0
    chosen = stepper or ensemble_stepper(osc, Flow.STATE_REVERSED)
    ended = run_ensemble(
        osc, Flow.STATE_REVERSED, chosen, states * flip, periods, interval=interval, executor=executor
    )  # fmt: skip
    return np.where((ended.status == COMPLETED)[:, None], ended.states * flip, np.nan)


def branch_count(saddle: Saddle) -> int:
    """Return the number of branches of both manifolds."""
    return 4 * len(saddle.points)


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
) -> Iterator[Manifold]:
    """Grow both branches of the stable and the unstable manifold from each point of a saddle, one after another.

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
        Integrates the points; the saddle is refined with it too, because a coarse stepper moves the saddle. By default
        RK4 with four times the steps of ensembles, or the stepper of single trajectories if that is no slower. On
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
        Grows the branches; threads of this process by default.

    Yields
    ------
    Manifold
        By point of the saddle, then as in `stable`, then against and along the eigenvector, which points to larger x.

    Raises
    ------
    StructureError
        The saddle does not have one stable and one unstable direction, or there are more states than x and v.
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
    for backwards in stable:  # not in several threads at once
        flow = Flow.STATE_REVERSED if backwards else Flow.STATE
        compiled_kernel(osc, flow, stepper or _default_stepper(osc, flow))
    with contextlib.closing(carry(_branch, tasks, executor)) as grown:
        for branch in grown:
            yield branch
            advance(1, BRANCHES)


def _check(osc: Oscillator, saddle: Saddle, spacing: float, bend: float, arc_length: float | None) -> None:
    states = saddle.points.shape[1]
    if states != 2:
        raise StructureError(f"manifolds are curves in the plane of x and v, but this scene has {states} states.")
    if saddle.period == 0:
        raise StructureError(
            "manifolds are grown from periodic saddles, but this one is a chaotic set without an orbit."
        )
    if osc.autonomous and saddle.duration > 0:
        raise StructureError("manifolds are grown from equilibria of autonomous scenes, but this is a limit cycle.")
    for name, value, most in (("spacing", spacing, 1.0), ("bend", bend, 1.5), ("arc_length", arc_length, math.inf)):
        if value is not None and not (isinstance(value, int | float) and 0 < value <= most):
            allowed = "any number above 0" if most == math.inf else f"a number above 0, at most {most}"
            raise StructureError(f"{name} must be {allowed}, got {shown(value)}.")


@dataclasses.dataclass(frozen=True, eq=False)
class _Map:
    """A power of the section map or of its inverse, along which a manifold grows away from the saddle."""

    osc: Oscillator
    stepper: Stepper
    backwards: bool
    periods: int
    interval: float

    def __call__(self, states: Array, images: int = 1) -> Array:
        """Return images of states; NaN where they diverged."""
        count = images * self.periods
        if self.backwards:
            return preimages(self.osc, states, count, stepper=self.stepper, interval=self.interval)
        ended = run_ensemble(self.osc, Flow.STATE, self.stepper, states, count, interval=self.interval)
        return np.where((ended.status == COMPLETED)[:, None], ended.states, np.nan)


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
    here = _linearised(osc, saddle, place)
    multiplier, direction = _direction(here, backwards, limits)
    if abs(multiplier) < _WEAKEST or abs(multiplier) > 1.0 / _WEAKEST:
        return Manifold(saddle_index, place, backwards, side, here.point[None], ManifoldEnd.TOO_EXTREME)
    point, rate = here.point, abs(math.log(abs(multiplier))) / here.duration
    flow = Flow.STATE_REVERSED if backwards else Flow.STATE
    chosen = stepper or _default_stepper(osc, flow)
    if osc.autonomous:
        interval, periods = min(osc.section_interval, math.log(_MOST_GROWTH) / rate), 1
    else:
        interval, periods = osc.section_interval, saddle.period
        point = _fixed_point(_Map(osc, chosen, backwards, periods, interval), here, limits)
    repeats = math.ceil(math.log(_LEAST_GROWTH) / (rate * interval * periods))
    repeats += repeats % 2 if multiplier < 0 else 0
    images = _Map(osc, chosen, backwards, periods * repeats, interval)
    domain = _domain(images, point, side * direction, math.exp(rate * interval * periods * repeats), limits)
    return Manifold(saddle_index, place, backwards, side, *grow(domain, images, limits))


def _default_stepper(osc: Oscillator, flow: Flow) -> Stepper:
    rough = ensemble_stepper(osc, flow)
    turns = max(1.0, osc.section_interval * osc.natural_frequency / (2 * math.pi))
    if isinstance(rough, RK4) and rough.steps <= _MOST_STEPS * turns:
        return rough.refined().refined()
    return single_stepper(osc, flow)


@dataclasses.dataclass(frozen=True, eq=False)
class _Linearised:
    """A point of a saddle, the derivative of its map, and the multipliers and eigenvectors over the duration (s)."""

    point: Array
    derivative: Array
    multipliers: NDArray[Any]
    vectors: NDArray[Any]
    duration: float


def _linearised(osc: Oscillator, saddle: Saddle, place: int) -> _Linearised:
    """Refine a point of the saddle. The duration of an equilibrium is short, to keep both multipliers moderate."""
    if osc.autonomous:
        point, duration = refine_equilibrium(osc, saddle.points[place]).point, osc.section_interval / _PARTS
        derivative = VectorField(osc).jacobian(point)
        exponents, vectors = np.linalg.eig(derivative)
        return _Linearised(point, derivative, np.exp(duration * exponents), vectors, duration)
    orbit = refine_orbit(osc, saddle.points[place], saddle.period, single_stepper(osc, Flow.STATE_VARIATIONAL))
    duration = saddle.period * osc.section_interval
    return _Linearised(orbit.point, orbit.monodromy, *np.linalg.eig(orbit.monodromy), duration)


def _direction(here: _Linearised, backwards: bool, limits: Limits) -> tuple[float, Array]:
    """Multiplier and direction of one of the manifolds; it points to larger x and is as long as the region is wide."""
    multipliers, vectors = here.multipliers, here.vectors
    order = np.argsort(np.abs(multipliers))
    if np.iscomplexobj(multipliers) or not abs(multipliers[order[0]]) < 1.0 < abs(multipliers[order[1]]):
        listed = ", ".join(f"{multiplier:.4g}" for multiplier in multipliers[order])
        raise StructureError(
            f"the multipliers of the orbit are {listed}, but only a saddle has manifolds that are curves; give an "
            "orbit with one multiplier inside the unit circle and one outside."
        )
    chosen = order[0 if backwards else 1]
    vector = vectors[:, chosen] / np.linalg.norm(vectors[:, chosen] / limits.width)
    return float(multipliers[chosen]), vector if vector[0] > 0 or (vector[0] == 0 < vector[1]) else -vector


def _fixed_point(images: _Map, here: _Linearised, limits: Limits) -> Array:
    """Fixed point of the map that the curve grows along, by Newton's method with the derivative of a more exact map."""
    derivative = np.linalg.inv(here.derivative) if images.backwards else here.derivative
    jacobian = derivative - np.eye(2)

    def evaluate(points: Array) -> Evaluation:
        offsets = images(points) - points
        return Evaluation(offsets, jacobian[None], offsets)

    (point,), _, (offset,) = newton(evaluate, here.point[None])
    error = float(np.linalg.norm(np.linalg.solve(jacobian, offset) / limits.width))
    if not error < _CLOSE:
        raise StructureError(
            f"with {images.stepper} there is no saddle near {tuple(np.round(point, 6).tolist())}: Newton's steps do "
            f"not fall below {error:.1g} of the region. Use a finer stepper, or one that locates contacts."
        )
    return point


def _domain(images: _Map, point: Array, direction: Array, growth: float, limits: Limits) -> Domain:
    """The piece of the linear manifold from a point to its image; a shorter one where rounding requires it."""
    reach = _START * direction
    if _START / growth < _NEAREST:
        return Domain(point, reach, _START / _NEAREST, np.zeros(2))
    image = images((point + reach / growth)[None])[0]
    return Domain(point, reach, growth, image - (point + reach))
