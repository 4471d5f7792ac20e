"""Certify: how a polished path changes when everything that it rests on is tightened."""

from __future__ import annotations

import dataclasses

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.completion import MORE_PERIODS, solved_again
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.newton import extremal_path
from vibrokit.results.energy import Certificate

_FARTHER = 10.0  # times as far from its source: the error of the linearized start grows 100-fold, so that it shows

Array = NDArray[np.float64]


def certify(propagator: SegmentPropagator, found: ExtremalPath) -> Certificate:
    """Solve again from ten times as far, with two more periods at either end, and with a tightened integration.

    Raises StructureError if one of these has no solution nearby.
    """
    nearer = solved_again(propagator, found, -_dropped(found), 0, found.accepted(_FARTHER))
    before, after = found.source.period_nodes, found.ending.period_nodes
    longer = solved_again(propagator, found, MORE_PERIODS * before, MORE_PERIODS * after)
    tighter = _tightened(propagator, found)
    return Certificate(
        residual=max(found.residual, found.slack),
        start_distance=float(found.distances[0]),
        end_distance=found.ending.distance_left(found.points[-1]),
        periods=(len(found.points) - 2 + found.last / propagator.piece) / propagator.pieces,
        by_start=nearer.action - found.action,
        by_length=longer.action - found.action,
        by_stepper=tighter.action - found.action,
        transversality=transversality(propagator, found),
    )


def _dropped(found: ExtremalPath) -> int:
    """Nodes to drop for a start ten times as far; for one on the orbit, two periods, or half of the path."""
    if found.source.start_on_orbit:
        return min(MORE_PERIODS * found.source.period_nodes, len(found.points) // 2)
    distances = found.distances
    away = np.flatnonzero(distances[:-1] >= _FARTHER * distances[0])
    return int(away[0]) if away.size else 0


def _tightened(propagator: SegmentPropagator, found: ExtremalPath) -> ExtremalPath:
    finer = dataclasses.replace(propagator, stepper=propagator.stepper.refined())
    source, ending = found.source.again(finer), found.ending.carried_by(finer)
    return extremal_path(finer, source, found.first, ending, found.points, found.last)


def transversality(propagator: SegmentPropagator, found: ExtremalPath) -> float:
    """Return the sine of the least angle at which the two manifolds meet, anywhere along the path.

    The tangent spaces of the paths that leave the source and of those that reach the end are carried along the path,
    each in the direction in which it is attracting, in units of the path's extent. Without forcing, the manifolds of
    two equilibria share the direction of the path itself, which is left out.
    """
    scale, n = found.scale, propagator.size
    slopes = found.slopes * scale / scale[:, None]
    leaving = [_orthonormal(found.source.space_at(found.first, leaving=True) / scale[:, None])]
    for slope in slopes:
        leaving.append(_orthonormal(slope @ leaving[-1]))
    reaching = [_orthonormal(_tangents(propagator, found))]
    for slope in slopes[::-1]:
        reaching.append(_orthonormal(np.linalg.solve(slope, reaching[-1])))
    shared = int(propagator.osc.autonomous and found.ending.period_nodes > 0)
    return float(_sines(np.array(leaving), np.array(reaching[::-1]))[:, shared].min()) if n > shared else 1.0


def _sines(first: Array, second: Array) -> Array:
    """Sines of the principal angles between pairs of spaces (count, 2n, n), ascending, from what is left of one."""
    left = second - first @ (first.transpose(0, 2, 1) @ second)
    sines: Array = np.minimum(np.linalg.svd(left, compute_uv=False)[:, ::-1], 1.0)
    return sines


def _tangents(propagator: SegmentPropagator, found: ExtremalPath) -> Array:
    """A basis (2n, n), in units of the scale, of the changes of the last point after which a path still ends there."""
    phase = (found.first + len(found.points) - 2) % propagator.pieces
    time = phase * propagator.piece + found.last
    in_point, in_time = found.ending.derivatives(found.points[-1], time, found.scale)
    changes = scipy.linalg.null_space(np.hstack([in_point, in_time]))
    double = len(found.scale)
    if not found.ending.free_time:
        return changes
    rate = propagator.rate(found.points[-1], time) / found.scale
    return changes[:double] - np.outer(rate, changes[double:])


def _orthonormal(basis: Array) -> Array:
    return np.linalg.qr(basis)[0]
