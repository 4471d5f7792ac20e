"""Seeds: nodes where the quasi-potential is known, on and round the attractor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.quasi_potential import local_potential
from vibrokit.analyzers.screening.grids import Grids
from vibrokit.analyzers.screening.tables import forward
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

_REACH = 2.6  # cells that the ellipse of given nodes covers in x and in v
_FINE = 4  # points of a curve per cell

Array = NDArray[np.float64]


def seeds(osc: Oscillator, stepper: Stepper, attractor: Attractor, grids: Grids) -> list[Array]:
    """Return the potential of the nodes of each phase that is known beforehand, infinite elsewhere.

    Round the points of an orbit or of an equilibrium it is ½ δqᵀ Σ⁻¹ δq, with Σ carried from phase to phase by
    M Σ Mᵀ + C. An attractor that meets the section in a curve or a cloud has 0 at the nodes next to it.

    Raises
    ------
    StructureError
        The attractor is not hyperbolic.
    """
    if attractor.kind in ("periodic", "equilibrium"):
        return _ellipses(osc, stepper, attractor, grids)
    points = attractor.points[:, :2] if attractor.kind != "limit cycle" else _filled(attractor.orbit, grids)
    known = []
    for phase in range(grids.phases):
        values = np.full(grids.cells, np.inf)
        inside = points[grids.inside(phase, points)]
        corner = np.floor(grids.places(phase, inside)).astype(np.int64)
        for more in ((0, 0), (0, 1), (1, 0), (1, 1)):
            values[tuple((corner + more).T)] = 0.0
        known.append(values)
        points = run_ensemble(
            osc, Flow.STATE, stepper, points, 1, start_time=grids.time(phase), interval=grids.step
        ).states  # fmt: skip
    return known


def _ellipses(osc: Oscillator, stepper: Stepper, attractor: Attractor, grids: Grids) -> list[Array]:
    orbit = refine_orbit(osc, attractor.points[0], attractor.period, stepper)
    covariance, point = local_potential(osc, orbit, stepper).covariance, orbit.point
    known = [np.full(grids.cells, np.inf) for _ in range(grids.phases)]
    for number in range(attractor.period * grids.phases):
        phase = number % grids.phases
        stiffness = np.linalg.inv(covariance)
        offset = grids.nodes(phase) - point
        values = 0.5 * np.einsum("...i,ij,...j->...", offset, stiffness, offset)
        reach = _REACH * grids.spacing(phase)
        level = 0.5 * float(np.max(np.diag(stiffness) * reach**2))
        known[phase] = np.where(values <= level, np.minimum(values, known[phase]), known[phase])
        images, slopes, gramians = forward(osc, stepper, point[None], grids.time(phase), grids.step)
        point, covariance = images[0], slopes[0] @ covariance @ slopes[0].T + gramians[0]
    return known


def _filled(curve: Array, grids: Grids) -> Array:
    """Points along a curve, so dense that no cell is jumped."""
    lengths = np.linalg.norm(np.diff(curve[:, :2], axis=0) / grids.spacing(0), axis=1)
    dense = max(1, int(np.ceil(_FINE * lengths.max())))
    at = np.linspace(0, len(curve) - 1, dense * (len(curve) - 1) + 1)
    return np.column_stack([np.interp(at, np.arange(len(curve)), curve[:, axis]) for axis in (0, 1)])
