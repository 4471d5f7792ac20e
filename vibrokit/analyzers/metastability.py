"""Metastability: the core of an attractor at some noise, and whether the attractor is a state of its own there.

A rate describes a state that lasts much longer than its relaxation, and that noise keeps inside its basin.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.analyzers.paths.local_potential import potential_along
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.rated import HELD, METASTABLE
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

_FORGOTTEN = 10.0  # section intervals in which the density on an attractor without multipliers forgets its start

Array = NDArray[np.float64]


def metastability(problem: ExitProblem, data: xarray.Dataset) -> tuple[xarray.Dataset, tuple[Finding, ...]]:
    """Return the data of one attractor with what decides which are metastable, and what of that limits its rates.

    Data without rates is returned as it is. Otherwise it gets ``relaxation_time`` (s) of all attractors, over
    ``core_source``, and `core_shares` over (``intensity_index``, ``core_source``, ``core_label``).
    """
    if "log_rate" not in data or "rate_intensity" not in data:
        return data, ()
    attractors, intensities = problem.structure.attractors, data["rate_intensity"].values.tolist()
    interval = problem.osc.section_interval
    relaxations = interval * np.array([relaxation_of(attractor, interval) for attractor in attractors])
    shares = np.array([[core_shares(problem, a, intensity) for a in attractors] for intensity in intensities])
    added = data.assign(
        relaxation_time=(
            ("core_source",), relaxations, {"long_name": "time in which deviations fall by a factor e", "units": "s"},
        ),
        core_share=(
            ("intensity_index", "core_source", "core_label"), shares,
            {"long_name": "share of the core of an attractor in the basin of each", "units": "1"},
        ),
    )  # fmt: skip
    findings = []
    for intensity, logs in zip(intensities, data["log_rate"].values, strict=True):
        left = float(np.nansum(np.exp(logs))) * relaxations[problem.source]
        if left * METASTABLE > 1.0:
            values = {"intensity": intensity, "ratio": 1.0 / left, "least": METASTABLE}
            findings.append(Finding.of(Code.NOT_METASTABLE, problem.source, **values))
    return added, tuple(findings)


def targets_at(problem: ExitProblem, intensity: float) -> tuple[Attractor, ...]:
    """Return the attractors that may be reached and are states of their own at some noise.

    Noise around another state keeps arriving in the core of one that is not, and nothing has been left then.
    """
    return tuple(target for target in problem.targets if _held(problem, target, intensity) >= HELD)


def with_states(problem: ExitProblem, intensities: Sequence[float]) -> tuple[tuple[float, ...], tuple[Finding, ...]]:
    """Return those intensities at which there are a state to leave and one to reach, and what is not a state.

    Where position or the basin's boundary decides, nothing has to settle, and all of them are returned.
    """
    if not _by_commitment(problem):
        return tuple(intensities), ()
    kept, findings = [], []
    for intensity in intensities:
        own = _held(problem, problem.attractor, intensity)
        if own < HELD:
            findings.append(Finding.of(Code.CORE_EXCEEDS_BASIN, problem.source, intensity=intensity, share=own))
            continue
        held = {target.label: _held(problem, target, intensity) for target in problem.targets}
        if problem.outlet is not None or max(held.values()) >= HELD:
            kept.append(intensity)
        for label, share in held.items():
            if share < HELD:
                found = Finding.of(Code.TARGET_EXCEEDS_BASIN, problem.source, label, intensity=intensity, share=share)
                findings.append(found)
    return tuple(kept), tuple(findings)


def core_shares(problem: ExitProblem, attractor: Attractor, intensity: float) -> Array:
    """Return which share of an attractor's core lies in the basin of each attractor, by label.

    It is NaN where no core decides about exits, where the core is too narrow for the cells of the basins, or where
    noise gives it no width. At most 64 ellipses are sampled, each by 400 states at equal areas.
    """
    structure = problem.structure
    basins, unknown = structure.basins, np.full(len(structure.attractors), np.nan)
    if not _by_commitment(problem):
        return unknown
    try:
        centres, roots = core_of(problem, attractor, intensity)
    except StructureError:
        return unknown
    some = np.unique(np.linspace(0, len(centres) - 1, min(len(centres), 64)).astype(int))
    axes = np.linalg.inv(roots[some])
    cells = np.array([np.ptp(basins.region.x), np.ptp(basins.region.v)]) / basins.labels.shape
    if np.linalg.svd(axes / cells[:, None], compute_uv=False).min() < 1.0:
        return unknown
    order = np.arange(400) + 0.5
    radius, angle = np.sqrt(order / len(order)), math.pi * (1.0 + math.sqrt(5.0)) * order
    disk = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    labels = basins.at(problem.on_turn(centres[some, None] + np.einsum("nij,kj->nki", axes, disk)))
    return np.array([np.mean(labels == other.label) for other in structure.attractors])


def _held(problem: ExitProblem, attractor: Attractor, intensity: float) -> float:
    """Share of an attractor's core that lies in its own basin; 1 where that is not known."""
    share = float(core_shares(problem, attractor, intensity)[attractor.label])
    return 1.0 if math.isnan(share) else share


def _by_commitment(problem: ExitProblem) -> bool:
    """Whether a state has left when it is in the core of another attractor."""
    return not (problem.exit.by_position or problem.exit.at_boundary)


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
    """The same, kept, since each attractor is a target of all others."""
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
        If there are more than 64 centres, the first R is used for all.
    turn : float
        Distance along x after which centres repeat, as on a circle; 0 if they do not.
    """
    if turn:
        away = np.array([[-turn, 0.0], [0.0, 0.0], [turn, 0.0]])
        centres, roots = (centres + away[:, None]).reshape(-1, 2), np.tile(roots, (3, 1, 1))
    if len(centres) > 64:
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
