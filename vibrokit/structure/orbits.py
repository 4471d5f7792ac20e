"""Periodic orbits: Newton's method on the section map, and what is computed of every closed orbit."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Stop, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.structure.linear_map import linear_map
from vibrokit.structure.newton import Evaluation, newton, scaled
from vibrokit.structure.scales import units_of
from vibrokit.symbolic.flow_kind import Flow

EQUAL = 1e-6
"""Distance, relative to the size of an orbit, below which two points are one."""
CONVERGED = 1e-6
"""Largest residual, relative to the size of the motion, of an orbit that Newton's method has found."""

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Orbit:
    """A closed orbit with its linearization; of this class itself, a fixed point of the section map's power."""

    kind: ClassVar[str] = "periodic"

    point: Array  # (n,)
    period: int  # in forcing periods
    duration: float  # time after which it repeats (s)
    monodromy: Array  # (n, n), derivative of the flow over the duration
    residual: float  # distance between the point and its image, in units of the scene

    def refined(self, osc: Oscillator, stepper: Stepper) -> Orbit:
        """Return the orbit that Newton's method finds from here with another stepper; may raise StructureError."""
        return refine_orbit(osc, self.point, self.period, stepper)

    def moved_by_tightening(self, osc: Oscillator, stepper: Stepper, times: int) -> float:
        """Return how far its point moves when the stepper is refined so many times; infinite if the orbit vanishes."""
        furthest = 0.0
        for _ in range(times):
            stepper = stepper.refined()
            try:
                furthest = max(furthest, float(np.linalg.norm(self.refined(osc, stepper).point - self.point)))
            except StructureError:
                return math.inf
        return furthest


def section_equations(
    osc: Oscillator, period: int, stepper: Stepper, executor: concurrent.futures.Executor | None = None
) -> Callable[[Array], Evaluation]:
    """Return the equations of a fixed point of the section map's power; attached is the derivative of that map."""

    def evaluate(points: Array) -> Evaluation:
        found = linear_map(osc, points, stepper, intervals=period, executor=executor)
        return Evaluation(found.images - points, found.derivatives - np.eye(points.shape[1]), found.derivatives)

    return evaluate


def refine_orbit(osc: Oscillator, guess: Array, period: int, stepper: Stepper) -> Orbit:
    """Refine a periodic point by Newton's method until the residual stays; StructureError where it stays large."""
    units = units_of(osc)
    (point,), (residual,), (monodromy,) = newton(scaled(section_equations(osc, period, stepper), units), guess[None])
    orbit = Orbit(point, period, period * osc.section_interval, monodromy, float(residual))
    if not orbit.residual <= CONVERGED * (1.0 + float(np.linalg.norm(guess / units))):
        raise StructureError(
            f"Newton's method found no orbit of period {period} near {tuple(np.round(guess, 6).tolist())}: the "
            f"residual is {orbit.residual:.1e}. The start is too far away, or the orbit is not hyperbolic; follow the "
            "motion for longer, or take a finer stepper."
        )
    return orbit


def least_period(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Orbit:
    """Return the orbit with its least period; near a bifurcation, recurrences may show a multiple of it."""
    for divisor in range(1, orbit.period):
        if orbit.period % divisor == 0:
            try:
                shorter = refine_orbit(osc, orbit.point, divisor, stepper)
            except StructureError:
                continue
            if same_point(osc, orbit.point, shorter.point[None], EQUAL):
                return shorter
    return orbit


def visited(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Array:
    """Return the points of an orbit on the section, in the order of visits, shape (period, n)."""
    points = [orbit.point]
    for _ in range(orbit.period - 1):
        points.append(run_ensemble(osc, Flow.STATE, stepper, points[-1][None], 1).states[0])
    return np.array(points)


def same_point(osc: Oscillator, point: Array, known: Array, tolerance: float) -> bool:
    """Whether a point is one of some known points (count, n), to a tolerance relative to the size of the motion."""
    near = np.abs(known - point) < tolerance * (units_of(osc) + np.abs(known).max(axis=0))
    return bool(near.all(axis=1).any())


def arrival_at(orbits: Mapping[int, Array], distances: Array) -> Stop:
    """Return the test that ends a trajectory within distances in x and v of a point of orbits, given by label."""
    points = np.concatenate([np.empty((0, 2)), *(points[:, :2] for points in orbits.values())])
    labels = np.repeat(list(orbits), [len(points) for points in orbits.values()])
    metrics = np.tile(np.diag(1.0 / distances), (len(points), 1, 1))
    return Stop(points=points, point_labels=labels.astype(np.int64), metrics=metrics)


def exponents_of(multipliers: NDArray[np.complex128], duration: float) -> NDArray[np.complex128]:
    """Return the growth rates (s⁻¹) of multipliers over a duration; −∞ for a multiplier 0."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(multipliers) / duration, dtype=np.complex128)
