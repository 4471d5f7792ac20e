"""Periodic orbits: Newton's method on the section map, and what is computed of every closed orbit."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.structure.linear_map import linear_map
from vibrokit.structure.newton import Evaluation, newton
from vibrokit.structure.scales import size_of
from vibrokit.symbolic.flow_kind import Flow

EQUAL = 1e-6
"""Distance, relative to the size of an orbit, below which two points are one."""
CONVERGED = 1e-6
"""Largest residual, relative to the size of the motion, of an orbit that Newton's method has found."""

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Orbit:
    """A fixed point of the section map's power, with its linearisation.

    Attributes
    ----------
    point : array (n,)
    period : int
    monodromy : array (n, n)
        Derivative of the map over `period` periods.
    residual : float
        Distance between the point and its image.
    """

    point: Array
    period: int
    monodromy: Array
    residual: float


def section_equations(
    osc: Oscillator,
    period: int,
    stepper: Stepper,
    executor: concurrent.futures.Executor | None = None,
) -> Callable[[Array], Evaluation]:
    """Return the equations of a fixed point of the section map's power; attached is the derivative of that map."""

    def evaluate(points: Array) -> Evaluation:
        found = linear_map(osc, points, stepper, intervals=period, executor=executor)
        return Evaluation(found.images - points, found.derivatives - np.eye(points.shape[1]), found.derivatives)

    return evaluate


def refine_orbit(osc: Oscillator, guess: Array, period: int, stepper: Stepper) -> Orbit:
    """Refine a periodic point by Newton's method until the residual no longer falls.

    Raises
    ------
    StructureError
        The iteration did not converge to a periodic point.
    """
    roots = newton(section_equations(osc, period, stepper), guess[None])
    orbit = Orbit(roots.places[0], period, roots.attached[0], float(roots.sizes[0]))
    if not orbit.residual <= CONVERGED * (size_of(osc) + float(np.linalg.norm(guess))):
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
    nearest = np.linalg.norm(known - point, axis=1).min()
    return bool(nearest < tolerance * (size_of(osc) + np.abs(known).max()))


def exponents_of(multipliers: NDArray[np.complex128], duration: float) -> NDArray[np.complex128]:
    """Return the growth rates (s⁻¹) of multipliers over a duration; −∞ for a multiplier 0."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(multipliers) / duration, dtype=np.complex128)


def moved_by_tightening(point: Array, refined: Callable[[Stepper], Array], stepper: Stepper, times: int) -> float:
    """Return how far a point of an orbit moves when the integration is tightened.

    Parameters
    ----------
    point : array (n,)
    refined : callable
        Returns the point that a stepper finds; raises StructureError where it finds no such orbit.
    stepper : Stepper
        The one that found the point.
    times : int
        How often the stepper is refined.

    Returns
    -------
    float
        The largest distance; infinite if a finer stepper finds no such orbit.
    """
    furthest, finer = 0.0, stepper
    for _ in range(times):
        finer = finer.refined()
        try:
            furthest = max(furthest, float(np.linalg.norm(refined(finer) - point)))
        except StructureError:
            return math.inf
    return furthest
