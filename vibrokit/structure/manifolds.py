"""Stable and unstable manifolds of a periodic saddle, grown as curves of controlled curvature.

A branch is the union of the images of a fundamental domain, the piece of its linear approximation from a point near the
saddle to the image of that point (You, Kostelich & Yorke, *Int. J. Bifurcation Chaos* 1, 605, 1991). Where neighbouring
points of an image are too far apart or the angle between chords is too large, points are inserted into the domain and
mapped from there (Hobson, *J. Comput. Phys.* 104, 14, 1993), so that no point is interpolated. The criterion for the
angle is that of Krauskopf & Osinga (*J. Comput. Phys.* 146, 404, 1998).
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import dataclasses
import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError, shown
from vibrokit.kernels.choice import LOCATED, ensemble_stepper, single_stepper
from vibrokit.kernels.ensemble import compiled_kernel, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.kernels.tasks import carry
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.progress import advance
from vibrokit.results.region import Region
from vibrokit.results.saddle import Manifold, ManifoldEnd, Saddle
from vibrokit.structure.autonomous import refine_equilibrium
from vibrokit.structure.curves import Domain, Growth, Limits
from vibrokit.structure.newton import Evaluation, newton
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

BRANCHES = "branches"
"""Unit of stages that grow manifolds: each branch advances them."""
_START, _NEAREST = 1e-6, 1e-13  # of the region: extent of the domain from the saddle, and what rounding leaves of it

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class FlowMap:
    """A power of the section map, or of its inverse if the flow is the reversed one."""

    osc: Oscillator
    stepper: Stepper
    flow: Flow
    periods: int
    interval: float  # of a period (s)

    def __call__(self, states: Array, images: int = 1) -> Array:
        """Return images of states (count, n); NaN where they diverged: backwards in time, damping adds energy."""
        flip = np.ones(np.shape(states)[1])
        if self.flow is Flow.STATE_REVERSED:
            flip[1] = -1.0
        ended = run_ensemble(
            self.osc, self.flow, self.stepper, states * flip, images * self.periods, interval=self.interval
        )  # fmt: skip
        return np.where((ended.status == COMPLETED)[:, None], ended.states * flip, np.nan)


def default_arc_length(region: Any, branches: int = 1) -> float:
    """Return 10 diagonals of a region for each of a few branches; many branches share 160 diagonals."""
    return min(10.0, 160.0 / branches) * float(np.linalg.norm(np.diff(Region.of(region).bounds)))


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
    most_sections: float = math.inf,
    executor: concurrent.futures.Executor | None = None,
) -> Iterator[Manifold]:
    """Grow both branches of the stable and the unstable manifold from each point of a saddle, one after another.

    They come by point of the saddle, then as in `stable` (True for the stable manifold), then against and along the
    eigenvector, which points to larger x. A branch is cut at `arc_length`, by default 10 diagonals of the region, and
    where it leaves the region widened by its own size on every side. Neighbouring points are at most `spacing` apart,
    in units of the region's width and height; the angle between neighbouring chords longer than a hundredth of that is
    at most `bend` (rad), and its product with the longer chord below half of ``spacing * bend``. A branch ends, too,
    before the image that would need more than `most_sections` in all, each state counted.

    The saddle is refined with the stepper too, because a coarse stepper moves the saddle. By default, with stops it is
    `Order8(1e-6)`, or a finer one where that loses the saddle. On the bundled scenes it takes no longer than RK4(1024),
    and half of that where contacts are stiffer. On ``hertz-0.570``, against FreeFlight(1e-10), 99% of the points of
    RK4(1024) lie within 2e-4 of the curve and all within 5e-3, over arcs of 20 diagonals. Without stops it is the
    stepper of ensembles with four times the steps, which costs less and is more accurate there.

    A StructureError is raised if the saddle does not have one stable and one unstable direction, or if there are more
    states than x and v.
    """
    _check(osc, saddle, spacing, bend, arc_length)
    frame = Region.of(region)
    limits = Limits(
        low=frame.bounds[:, 0], width=np.diff(frame.bounds)[:, 0], spacing=spacing, bend=bend,
        arc_length=arc_length or default_arc_length(frame),
    )  # fmt: skip
    branches = _Branches(osc, saddle_index, saddle, limits, most_sections, stepper)
    tasks = list(itertools.product(range(len(saddle.points)), stable, (-1, 1)))
    for backwards in stable:  # not in several threads at once
        compiled_kernel(osc, *branches.flow_and_stepper(backwards))
    with contextlib.closing(carry(branches.grow, tasks, executor)) as grown:
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
class _Branches:
    """The branches of a saddle; each is a unit of work that an executor may carry."""

    osc: Oscillator
    saddle_index: int
    saddle: Saddle
    limits: Limits
    most_sections: float
    stepper: Stepper | None

    def flow_and_stepper(self, backwards: bool) -> tuple[Flow, Stepper]:
        flow = Flow.STATE_REVERSED if backwards else Flow.STATE
        default = LOCATED if self.osc.barriers else ensemble_stepper(self.osc, flow).refined().refined()
        return flow, self.stepper or default

    def grow(self, place: int, backwards: bool, side: int) -> Manifold:
        """Grow one branch from a point of the saddle."""
        osc, here, limits = self.osc, _linearised(self.osc, self.saddle, place), self.limits
        multiplier, direction = _direction(here, backwards, limits)
        named = functools.partial(Manifold, self.saddle_index, place, backwards, side)
        if not 1e-8 <= abs(multiplier) <= 1e8:  # rounding leaves the smaller multiplier no digits
            return named(here.point[None], ManifoldEnd.TOO_EXTREME)
        point, rate = here.point, abs(math.log(abs(multiplier))) / here.duration
        flow, stepper = self.flow_and_stepper(backwards)
        once = FlowMap(osc, stepper, flow, self.saddle.period, osc.section_interval)
        if osc.autonomous:
            once = dataclasses.replace(once, periods=1, interval=min(once.interval, math.log(8) / rate))
        else:
            once, point = _with_fixed_point(once, here, limits, 2 if self.stepper is None else 0)
        duration = once.interval * once.periods
        repeats = math.ceil(math.log(2) / (rate * duration))
        repeats += repeats % 2 if multiplier < 0 else 0
        images = dataclasses.replace(once, periods=once.periods * repeats)
        limits = dataclasses.replace(limits, applications=self.most_sections / images.periods)
        domain = _domain(images, point, side * direction, math.exp(rate * duration * repeats), limits)
        return named(*Growth(domain, images, limits).run())


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
        point, duration = refine_equilibrium(osc, saddle.points[place]).point, osc.section_interval / 64
        derivative = VectorField(osc).jacobian(point)
        exponents, vectors = np.linalg.eig(derivative)
        return _Linearised(point, derivative, np.exp(duration * exponents), vectors, duration)
    if len(saddle.nodes) > 1:
        raise StructureError(
            f"the orbit has the multiplier {saddle.multipliers[0].real:.2g}, so that rounding errors carry motion away "
            "from it within its duration, and curves that grow from period to period cannot be followed. The boundary "
            "of the basins shows its stable manifold."
        )
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


def _with_fixed_point(images: FlowMap, here: _Linearised, limits: Limits, refinements: int) -> tuple[FlowMap, Array]:
    """Return the map that the curve grows along, and its fixed point, by Newton's method with a finer derivative.

    Along a long, very unstable orbit the errors of a stepper grow until the map has no fixed point; the stepper is
    refined then.
    """
    derivative = np.linalg.inv(here.derivative) if images.flow is Flow.STATE_REVERSED else here.derivative
    jacobian = derivative - np.eye(2)

    def evaluate(points: Array) -> Evaluation:
        offsets = images(points) - points
        return Evaluation(offsets, jacobian[None], offsets)

    (point,), _, (offset,) = newton(evaluate, here.point[None])
    error = float(np.linalg.norm(np.linalg.solve(jacobian, offset) / limits.width))
    if error < 1e-9:
        return images, point
    if refinements:
        finer = dataclasses.replace(images, stepper=images.stepper.refined())
        return _with_fixed_point(finer, here, limits, refinements - 1)
    raise StructureError(
        f"with {images.stepper} there is no saddle near {tuple(np.round(point, 6).tolist())}: Newton's steps do not "
        f"fall below {error:.1g} of the region. Use a finer stepper, or one that locates contacts."
    )


def _domain(images: FlowMap, point: Array, direction: Array, growth: float, limits: Limits) -> Domain:
    """The piece of the linear manifold from a point to its image; a shorter one where rounding requires it."""
    reach = _START * direction
    if _START / growth < _NEAREST:
        return Domain(point, reach, _START / _NEAREST, np.zeros(2))
    image = images((point + reach / growth)[None])[0]
    return Domain(point, reach, growth, image - (point + reach))
