"""Certify: what happens to a polished path when all that it stands on is tightened."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.endings import ComesTo, Ending
from vibrokit.analyzers.polishing.ends import End, linear_end
from vibrokit.analyzers.polishing.heteroclinic import MORE, end_distances, solved_again, start_distances
from vibrokit.analyzers.polishing.newton import Extremum, extremal_path
from vibrokit.results.certificate import Certificate

_FARTHER = 10.0

Array = NDArray[np.float64]


def certify(carrier: Carrier, found: Extremum) -> Certificate:
    """Solve again from ten times as far, with two more periods at either end, and with a tightened integrator.

    Raises
    ------
    StructureError
        One of these has no solution near.
    """
    starts = start_distances(found)
    nearer = solved_again(carrier, found, -_later(found), 0)
    ending = found.ending
    after = MORE * len(ending.end.states) if isinstance(ending, ComesTo) else 0
    longer = solved_again(carrier, found, MORE * len(found.source.states), after)
    tighter = _tightened(carrier, found)
    periods = (len(found.points) - 2) + ending.last(found.free, carrier.piece) / carrier.piece
    return Certificate(
        residual=max(found.residual, found.slack),
        start_distance=float(starts[0]),
        end_distance=float(end_distances(found)[0]),
        periods=periods / carrier.pieces,
        by_start=nearer.action - found.action,
        by_length=longer.action - found.action,
        by_stepper=tighter.action - found.action,
        transversality=transversality(carrier, found),
    )


def _later(found: Extremum) -> int:
    """Nodes to drop for a start ten times as far from the orbit; for one on it, two periods, or half of the path."""
    if found.source.held:
        return min(MORE * len(found.source.states), len(found.points) // 2)
    starts = start_distances(found)
    away = np.flatnonzero(starts[:-1] >= _FARTHER * starts[0])
    return int(away[0]) if away.size else 0


def _tightened(carrier: Carrier, found: Extremum) -> Extremum:
    finer = carrier.with_stepper(carrier.stepper.refined())
    ending: Ending = found.ending
    if isinstance(ending, ComesTo):
        ending = ComesTo(_again(finer, ending.end), ending.phase)
    last = ending.last(found.free, carrier.piece)
    return extremal_path(finer, _again(finer, found.source), found.first, ending, found.points, last=last)


def _again(carrier: Carrier, end: End) -> End:
    again = linear_end(carrier, end.states[0], len(end.states) // carrier.pieces)
    return again.on_orbit() if end.held else again


def transversality(carrier: Carrier, found: Extremum) -> float:
    """Return the sine of the least angle at which the two manifolds meet, anywhere along the path.

    The tangent spaces of what leaves the source and of what comes to the end are carried along the path, each in the
    direction in which that is attracting, in units of the path's extent. Without forcing they share the direction of
    the path itself, which is left out.
    """
    scale, n = found.scale, found.points.shape[1] // 2
    slopes = found.slopes * scale / scale[:, None]
    number = len(slopes)
    leaving = [_orthonormal(found.source.leaving[found.source.node(found.first)] / scale[:, None])]
    for slope in slopes:
        leaving.append(_orthonormal(slope @ leaving[-1]))
    autonomous = carrier.osc.autonomous
    start = float((found.first + number - 1) % carrier.pieces) * carrier.piece
    time = start + found.ending.last(found.free, carrier.piece)
    rate = carrier.rate(found.points[-1], 0.0 if autonomous else time)
    coming = _orthonormal(found.ending.incoming(rate, scale) / scale[:, None])
    shared = int(autonomous and isinstance(found.ending, ComesTo))
    least = 1.0
    for node in range(number, -1, -1):
        angles = np.sort(scipy.linalg.subspace_angles(leaving[node], coming))
        if len(angles) > shared:
            least = min(least, float(np.sin(angles[shared])))
        if node:
            coming = _orthonormal(np.linalg.solve(slopes[node - 1], coming))
    return least if n > shared else 1.0


def _orthonormal(basis: Array) -> Array:
    return np.linalg.qr(basis)[0]
