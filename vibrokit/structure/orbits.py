"""Periodic orbits: refined by Newton on the variational equations; what is said of every closed orbit."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.structure.scales import size_of
from vibrokit.symbolic.flow_kind import Flow

_ITERATIONS = 30
EQUAL = 1e-6
"""Distance, relative to the size of an orbit, below which two points are one."""

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


def section_derivative(
    osc: Oscillator, point: Array, periods: int, stepper: Stepper, *, interval: float | None = None
) -> tuple[Array, Array]:
    """Return the image of a point of the section after some periods, and the derivative of that map.

    In an autonomous scene the time from section to section may be chosen by `interval`.
    """
    size = len(point)
    start = np.concatenate([point, np.eye(size).ravel()])
    ended = run_ensemble(osc, Flow.STATE_VARIATIONAL, stepper, start[None], periods, interval=interval)
    image = ended.states[0]
    return image[:size], image[size:].reshape(size, size)


def refine_orbit(
    osc: Oscillator, guess: Array, period: int, stepper: Stepper, *, interval: float | None = None
) -> Orbit:
    """Refine a periodic point by Newton's method until the residual no longer falls.

    A short `interval` finds equilibria of autonomous scenes, however fast deviations from them grow.

    Raises
    ------
    StructureError
        The iteration did not come near any periodic point.
    """
    best: Orbit | None = None
    point = np.array(guess, dtype=float)
    for _ in range(_ITERATIONS):
        image, monodromy = section_derivative(osc, point, period, stepper, interval=interval)
        residual = float(np.linalg.norm(image - point))
        if not np.isfinite(residual) or (best is not None and residual >= best.residual):
            break
        best = Orbit(point, period, monodromy, residual)
        try:
            point = point - np.linalg.solve(monodromy - np.eye(len(point)), image - point)
        except np.linalg.LinAlgError:
            break
    scale = size_of(osc) + float(np.linalg.norm(guess))
    if best is None or best.residual > 1e-6 * scale:
        found = "no finite image" if best is None else f"a residual of {best.residual:.1e}"
        raise StructureError(
            f"Newton's method found no orbit of period {period} near {tuple(np.round(guess, 6).tolist())}: {found}. "
            "The start is too far off, or the orbit is not hyperbolic; wait longer or take a finer stepper."
        )
    return best


def least_period(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Orbit:
    """Return the orbit with its least period: recurrences close to a bifurcation can show a multiple of it."""
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
    """Return the rates of growth (s⁻¹) that multipliers over some time stand for; −∞ for a multiplier 0."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(multipliers) / duration, dtype=np.complex128)


def moved_by_tightening(point: Array, refined: Callable[[Stepper], Array], stepper: Stepper, times: int) -> float:
    """Return how far a point of an orbit moves when the integration is tightened.

    Parameters
    ----------
    point : array (n,)
    refined : callable
        Returns the point as a stepper has it; raises StructureError where there is no such orbit for it.
    stepper : Stepper
        What the point was found with.
    times : int
        How often the stepper is refined.

    Returns
    -------
    float
        The largest distance; infinite if at a finer setting there is no such orbit.
    """
    furthest, finer = 0.0, stepper
    for _ in range(times):
        finer = finer.refined()
        try:
            furthest = max(furthest, float(np.linalg.norm(refined(finer) - point)))
        except StructureError:
            return math.inf
    return furthest
