"""Newton's method from one start or from many at once: orbits, equilibria, cycles and members of families."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrokit.progress import count

Array = NDArray[np.float64]


class Evaluation(NamedTuple):
    """The equations at some places.

    Attributes
    ----------
    residuals : array (count, n)
        What is to be zero; NaN where it does not exist.
    jacobians : array (count, n, n)
        Its derivatives.
    attached : array (count, …)
        What the caller wants returned with each root.
    """

    residuals: Array
    jacobians: Array
    attached: NDArray[Any]


class Roots(NamedTuple):
    """Where the iteration ended.

    Attributes
    ----------
    places : array (count, n)
    sizes : array (count,)
        Norms of the residuals; NaN where the first residual was not finite.
    attached : array (count, …)
        What was attached to each place.
    """

    places: Array
    sizes: Array
    attached: NDArray[Any]


def newton(
    evaluate: Callable[[Array], Evaluation],
    guesses: Array,
    *,
    iterations: int = 30,
    least_share: float = 1.0,
    limited: Callable[[Array, Array], Array] = lambda places, steps: steps,
    converged: Callable[[Array, Array], NDArray[np.bool_]] = lambda places, sizes: sizes == 0,
) -> Roots:
    """Improve guesses (count, n) by Newton steps for as long as the residual falls.

    A step that does not make the residual smaller is taken back. With `least_share` below 1 a quarter of it is tried
    next, and each success doubles the share, up to the whole step; otherwise that start has ended.

    Parameters
    ----------
    evaluate : callable
        Takes places (count, n), of those starts that have not ended.
    guesses : array (count, n)
    iterations : int
        Most evaluations.
    least_share : float
        Smallest share of a Newton step to try.
    limited : callable, optional
        Takes places and steps (count, n); returns the steps, shortened where they are too long.
    converged : callable, optional
        Takes places and sizes of the residuals; returns which need no further step. By default the iteration goes on
        until rounding keeps the residual from falling.
    """
    places = np.array(guesses, dtype=float)
    now = evaluate(places)
    sizes = np.linalg.norm(now.residuals, axis=1)
    attached, shares = now.attached.copy(), np.ones(len(places))
    steps = limited(places, _steps(now))
    going = np.isfinite(sizes)
    for _ in range(iterations - 1):
        going &= ~converged(places, sizes) & np.isfinite(steps).all(axis=1) & (shares >= least_share)
        active = np.flatnonzero(going)
        if not len(active):
            break
        tried = places[active] + shares[active, None] * steps[active]
        new = evaluate(tried)
        count(newton_iterations=len(active))
        new_sizes = np.linalg.norm(new.residuals, axis=1)
        better = new_sizes < sizes[active]  # never where it is not finite
        shares[active] = np.where(better, np.minimum(1.0, 2 * shares[active]), shares[active] / 4)
        moved = active[better]
        places[moved], sizes[moved], attached[moved] = tried[better], new_sizes[better], new.attached[better]
        steps[moved] = limited(tried, _steps(new))[better]
    return Roots(places, sizes, attached)


def _steps(here: Evaluation) -> Array:
    """Newton steps; NaN where a Jacobian is singular or not finite."""
    steps = np.full_like(here.residuals, np.nan)
    with np.errstate(all="ignore"):
        determinants = np.linalg.det(here.jacobians)
    solvable = np.isfinite(determinants) & (determinants != 0)
    steps[solvable] = -np.linalg.solve(here.jacobians[solvable], here.residuals[solvable, :, None])[..., 0]
    return steps
