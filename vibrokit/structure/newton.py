"""Newton's method from one start or from many at once: orbits, equilibria, cycles and members of families."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrokit.progress import count

Array = NDArray[np.float64]


class Evaluation(NamedTuple):
    """The equations at some places, and what the caller wants returned with each root."""

    residuals: Array  # (count, n); NaN where they do not exist
    jacobians: Array  # (count, n, n)
    attached: NDArray[Any]  # (count, …)


class Roots(NamedTuple):
    """Where the iteration ended, and what was attached to each place."""

    places: Array  # (count, n)
    sizes: Array  # (count,), norms of the residuals; NaN where the first residual was not finite
    attached: NDArray[Any]  # (count, …)


def scaled(equations: Callable[[Array], Evaluation], units: Array) -> Callable[[Array], Evaluation]:
    """Return the same equations with residuals in some units (n,)."""

    def evaluate(places: Array) -> Evaluation:
        found = equations(places)
        return found._replace(residuals=found.residuals / units, jacobians=found.jacobians / units[:, None])

    return evaluate


def newton(
    evaluate: Callable[[Array], Evaluation],
    guesses: Array,
    *,
    iterations: int = 30,
    least_fraction: float = 1.0,
    limited: Callable[[Array, Array], Array] = lambda places, steps: steps,
    converged: Callable[[Array, Array], NDArray[np.bool_]] = lambda places, sizes: sizes == 0,
) -> Roots:
    """Improve guesses (count, n) by Newton steps for as long as the residual falls.

    There are `iterations` evaluations at most. A step that does not reduce the residual is taken back, and a quarter of
    it is tried next, down to the fraction `least_fraction` of a Newton step; each success doubles the fraction, up to
    the whole step. `limited` shortens steps that are too long for their places. `converged` tells from places and sizes
    of the residuals which need no further step; by default the iteration goes on until rounding keeps the residual from
    falling.
    """
    places = np.array(guesses, dtype=float)
    now = evaluate(places)
    sizes = np.linalg.norm(now.residuals, axis=1)
    attached, fractions = now.attached.copy(), np.ones(len(places))
    steps = limited(places, _steps(now))
    going = np.isfinite(sizes)
    for _ in range(iterations - 1):
        going &= ~converged(places, sizes) & np.isfinite(steps).all(axis=1) & (fractions >= least_fraction)
        active = np.flatnonzero(going)
        if not len(active):
            break
        tried = places[active] + fractions[active, None] * steps[active]
        new = evaluate(tried)
        count(newton_iterations=len(active))
        new_sizes = np.linalg.norm(new.residuals, axis=1)
        better = new_sizes < sizes[active]  # never where it is not finite
        fractions[active] = np.where(better, np.minimum(1.0, 2 * fractions[active]), fractions[active] / 4)
        moved = active[better]
        places[moved], sizes[moved], attached[moved] = tried[better], new_sizes[better], new.attached[better]
        steps[moved] = limited(tried, _steps(new))[better]
    return Roots(places, sizes, attached)


def _steps(here: Evaluation) -> Array:
    """Newton steps; NaN where a Jacobian is singular or not finite."""
    steps = np.full_like(here.residuals, np.nan)
    with np.errstate(all="ignore"):
        signs, logarithms = np.linalg.slogdet(here.jacobians)  # the determinant of many nodes may overflow
    solvable = np.isfinite(logarithms) & (signs != 0)
    steps[solvable] = -np.linalg.solve(here.jacobians[solvable], here.residuals[solvable, :, None])[..., 0]
    return steps
