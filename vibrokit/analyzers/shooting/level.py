"""How far from an attractor extremal paths are started: near enough for the quadratic form, no nearer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.exits import Exit
from vibrokit.analyzers.shooting.domain import FundamentalDomain, Shell
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.structure import Structure
from vibrokit.symbolic.flow_kind import Flow

_LARGEST = 0.01  # of the way out
_SMALLEST = 1e-7
_SHRINK = 0.25
_CURVED = 0.02  # most by which an action may differ from the quadratic form a shell later, relative
_TRIED = 64
_LEAST = 1e-300

Array = NDArray[np.float64]


def fitted_domain(
    osc: Oscillator,
    structure: Structure,
    leaving: Exit,
    attractor: Attractor,
    shells: tuple[Shell, ...],
    duration: float,
    stepper: Stepper,
) -> FundamentalDomain:
    """Return the fundamental domain with the largest inner edge, at most a hundredth of the way out, that is linear.

    The way out is the least distance, in whitened coordinates, of the attractor from a cell that counts as left. The
    quadratic form is off by a cubic term, so that a start at a share ε of the way is off by ε³ of the action to be
    found, 1e-6 at a hundredth; the time that a path takes grows with log(1/ε) only. An attractor that almost touches a
    stop is linear less far than its basin reaches: the edge shrinks until paths from all over the domain, carried on by
    one shell, have the action of the quadratic form there to within 2 %.

    Parameters
    ----------
    osc : Oscillator
    structure : Structure
    leaving : Exit
    attractor : Attractor
    shells : tuple of Shell
    duration : float
        From shell to shell (s).
    stepper : Stepper

    Raises
    ------
    StructureError
        No edge down to 1e-7 of the way out is linear.
    """
    way = way_out(osc, structure, leaving, attractor.label, shells[0])
    rates = -np.log(np.maximum(np.abs(attractor.multipliers), _LEAST))
    share, error = _LARGEST, np.inf
    while share >= _SMALLEST:
        domain = FundamentalDomain(shells, share * way, share, float(rates.max() / rates.min()), osc.autonomous)
        error = curvature(osc, domain, duration, stepper)
        if error <= _CURVED:
            return domain
        share *= _SHRINK
    raise StructureError(
        f"the quadratic quasi-potential is wrong by {error:.2g} of itself as near as {_SMALLEST:g} of the way out; the "
        "attractor grazes a stop, or the stepper is too coarse: take a finer one, or give a radius."
    )


def way_out(osc: Oscillator, structure: Structure, leaving: Exit, label: int, shell: Shell) -> float:
    """Return the least distance, in whitened coordinates, from an attractor to what counts as left.

    Where no cell does: to the nearest edge of the region.
    """
    basins = structure.basins
    cells = basins.region.cell_centres(basins.labels.shape)
    labels = basins.labels.ravel()
    outside = ((labels >= 0) & (labels != label)) | leaving.beyond(osc, cells)
    covariance = (shell.root @ shell.root.T)[:2, :2]  # states of the noise take their most likely values
    if outside.any():
        offset = cells[outside] - shell.point[:2]
        return float(np.sqrt(np.sum(offset * np.linalg.solve(covariance, offset.T).T, axis=1).min()))
    gaps = np.abs(basins.region.bounds - shell.point[:2, None]).min(axis=1)
    return float((gaps / np.sqrt(np.diag(covariance))).min())


def curvature(osc: Oscillator, domain: FundamentalDomain, duration: float, stepper: Stepper) -> float:
    """Return the largest relative difference of actions, one shell later, from the quadratic form there."""
    worst = 0.0
    size = len(domain.shells[0].point)
    places = np.random.default_rng(0).random((_TRIED, size))
    for number, shell in enumerate(domain.shells):
        starts = domain.states(_in_shell(places, number, domain))[0]
        ended = run_ensemble(
            osc, Flow.HAMILTONIAN, stepper, starts, start_time=shell.time % osc.section_interval, interval=duration
        )
        after = domain.shells[(number + 1) % len(domain.shells)]
        place = np.linalg.solve(after.root, (ended.states[:, :size] - after.point).T).T
        expected = 0.5 * np.sum(place**2, axis=1)
        error = np.abs(ended.states[:, -1] - expected) / np.abs(expected)
        worst = max(worst, float(np.where(np.isfinite(error), error, np.inf).max()))
    return worst


def _in_shell(places: Array, number: int, domain: FundamentalDomain) -> Array:
    if domain.edge_only:
        return places[:, :-1]
    across = (number + places[:, -1:]) / len(domain.shells)
    return np.hstack([places[:, :-1], across])
