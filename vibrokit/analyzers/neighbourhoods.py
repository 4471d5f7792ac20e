"""Neighbourhoods of attractors: how far noise spreads the motion around them, and how fast that is forgotten."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.analyzers.paths.local_potential import potential_along
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

_FEW = 64  # centres, each with its own ellipse
_FORGOTTEN = 10.0  # section intervals in which the density on an attractor without multipliers forgets its start

Array = NDArray[np.float64]


def covariances_of(problem: ExitProblem, attractor: Attractor) -> Array:
    """Return the stationary covariances of x and v per unit D at the points of an attractor, shape (count, 2, 2).

    They are 0 for an attractor that never repeats: its points are a set of their own.

    Raises
    ------
    StructureError
        The orbit is not stable, or noise does not make it spread.
    """
    return _covariances(problem.osc, attractor, problem.single_stepper(Flow.LINEARISED))


@functools.lru_cache(maxsize=256)
def _covariances(osc: Oscillator, attractor: Attractor, stepper: Stepper) -> Array:
    """The same, kept: each attractor is a target of all others, at several intensities."""
    if not attractor.is_fixed:
        return np.zeros((len(_places(attractor)), 2, 2))
    orbit = refine_orbit(osc, attractor.points[0], attractor.period, stepper)
    return np.array([one.covariance[:2, :2] for one in potential_along(osc, orbit, stepper, 1)])


def core_of(
    problem: ExitProblem,
    attractor: Attractor,
    intensity: float,
    size: float = 1.0,
    resolved: Callable[[Array], Array] | None = None,
) -> tuple[Array, Array]:
    """Return the core of an attractor as ellipses: centres c (count, 2) and matrices R, |R (q − c)| ≤ 1 inside.

    Semi-axes are the standard deviations of the density around the attractor, which hold 39 % of it, times `size`; for
    motion that never repeats, 1/60 of the widths of the region. `resolved`, if given, returns the least semi-axes in x
    and v that a grid resolves at some points, shape (count, 2).
    """
    centres, region = problem.on_turn(_places(attractor)), problem.structure.basins.region
    least = 1 / 60 * np.ptp(region.bounds, axis=1)
    if attractor.is_fixed:
        least = 1e-9 * least  # as far as its own width does not decide
    if resolved is not None:
        least = np.maximum(least, resolved(centres))
    covariances = size**2 * intensity * covariances_of(problem, attractor)
    return centres, metrics_of(attractor, covariances, np.broadcast_to(least, centres.shape))


def metrics_of(attractor: Attractor, covariances: Array, least: Array) -> Array:
    """Return a matrix R for each point, so that |R δq| ≤ 1 is an ellipse with the shape of the covariance.

    No semi-axis is below `least`, array (count, 2) in x and v; for motion that never repeats the largest of these holds
    everywhere.
    """
    widths = least if attractor.is_fixed else np.broadcast_to(least.max(axis=0), least.shape)
    scales = widths[:, :, None] * widths[:, None, :]
    variances, axes = np.linalg.eigh(covariances / scales)
    widened = np.einsum("nij,nj,nkj->nik", axes, np.maximum(variances, 1.0), axes) * scales
    return np.linalg.cholesky(np.linalg.inv(widened)).transpose(0, 2, 1)


def _places(attractor: Attractor) -> Array:
    """x and v of the places where motion on an attractor may be on a section, shape (count, 2)."""
    cycle = attractor.kind == "limit cycle"  # noise makes its phase any
    return attractor.orbit[:-1] if cycle else attractor.points[:, :2]


def relaxation_of(attractor: Attractor, interval: float, least: float = 1.0) -> float:
    """Return the section intervals in which deviations of the density around an attractor fall by a factor e.

    Parameters
    ----------
    attractor : Attractor
    interval : float
        From section to section (s).
    least : float
        Section intervals.
    """
    if attractor.kind == "limit cycle" and len(attractor.exponents) > 1:
        slowest = float(np.sort(attractor.exponents.real)[-2])  # the last one is that of the phase
        return max(least, -1.0 / (slowest * interval)) if slowest < 0 else _FORGOTTEN
    largest = float(np.abs(attractor.multipliers).max()) if len(attractor.multipliers) else 0.0
    if not 0.0 < largest < 1.0 or not attractor.is_fixed:
        return _FORGOTTEN
    return max(least, -max(attractor.period, 1) / math.log(largest))


def nearest(states: Array, centres: Array, roots: Array, turn: float = 0.0) -> Array:
    """Return the least |R (q − c)|² over centres c with their matrices R, at each state q, shape (…).

    Parameters
    ----------
    states : array (…, 2)
    centres : array (count, 2)
    roots : array (count, 2, 2)
        If there are more than a few centres, the first R is used for all.
    turn : float
        Distance along x after which centres repeat, as on a circle; 0 if they do not.
    """
    if turn:
        away = np.array([[-turn, 0.0], [0.0, 0.0], [turn, 0.0]])
        centres, roots = (centres + away[:, None]).reshape(-1, 2), np.tile(roots, (3, 1, 1))
    if len(centres) > _FEW:
        distances: Array = cKDTree(centres @ roots[0].T).query(states @ roots[0].T)[0]
        return distances**2
    each = (np.sum(((states - c) @ root.T) ** 2, axis=-1) for c, root in zip(centres, roots, strict=True))
    return functools.reduce(np.minimum, each)


def noise_strength(scene: Oscillator, states: Array) -> Array:
    """Return a_vv at some states, from q′ = b + a p at the momentum (0, 1): velocities spread by √(a_vv D t)."""
    kick, field = np.zeros_like(states), VectorField(scene)
    still = field.hamiltonian_rate(states, kick)[..., 1]
    kick[..., 1] = 1.0
    return np.maximum(field.hamiltonian_rate(states, kick)[..., 1] - still, 0.0)
