"""Solved paths as energies with certificates: how an action changes when all that it rests on is tightened."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.leg import SolvedPath
from vibrokit.analyzers.polishing.newton import extremal_path
from vibrokit.analyzers.polishing.path_solver import MORE_PERIODS, solved_again
from vibrokit.analyzers.polishing.sensitivity import sensitivities
from vibrokit.analyzers.polishing.tolerances import TOLERANCES
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound, Certificate, upper_bound
from vibrokit.results.finding import Finding
from vibrokit.results.labels import goal_name

METHOD = "least action"
_FARTHER = 10.0  # times as far from its source: the error of the linearized start grows 100-fold, so that it shows
_COMPETING = 0.01  # of the least action: at ΔU/D = 100 such a path still carries a third as many exits

Array = NDArray[np.float64]


def certified(problem: ExitProblem, solved: SolvedPath, findings: list[Finding]) -> list[ActivationEnergy]:
    """The energies of a path with its certificate, or without if that fails."""
    source, action = problem.source, solved.action
    findings += remarks(problem, solved)
    try:
        certificates = [certify(leg.propagator, leg.found) for leg in solved.legs]
    except StructureError as failure:
        findings.append(Finding.of(Code.NO_CERTIFICATE, source, action=action, reason=str(failure)))
        return energies(problem, solved)
    certificate = Certificate.combined(certificates)
    if not certificate.error <= action:
        reason = f"its action changes by {certificate.error:.2g} when its beginning, length and integration do."
        findings.append(Finding.of(Code.NO_CERTIFICATE, source, action=action, reason=reason))
        return energies(problem, solved, error=certificate.error)
    if any(leg.found.source.start_on_orbit for leg in solved.legs):
        findings.append(Finding.of(Code.STARTS_ON_ORBIT, source, action=action, periods=certificate.periods))
    derivatives = [sensitivities(problem, leg.end, leg.propagator, leg.found) for leg in solved.legs]
    names = [name for name in derivatives[0] if all(name in each for each in derivatives)]
    return energies(
        problem,
        solved,
        error=certificate.error + 1e-12 * action,  # that is rounding of a sum of thousands of terms
        residual=certificate.residual,
        certificate=certificate,
        sensitivity={name: sum(each[name].value for each in derivatives) for name in names},
        sensitivity_error={name: sum(each[name].error for each in derivatives) for name in names},
    )


def remarks(problem: ExitProblem, solved: SolvedPath) -> list[Finding]:
    """Return findings on the orbits that a path passes, and on where its end leads."""
    found = [
        Finding.of(Code.PASSES_ORBITS, problem.source, target, action=solved.action, through=list(solved.through))
        for target in solved.targets
        if solved.through
    ]
    if len(solved.targets) > 1:
        goals = [goal_name(problem.structure.names, label) for label in solved.targets]
        found.append(Finding.of(Code.ONE_SADDLE_TO_SEVERAL, problem.source, saddle=solved.end.saddle, goals=goals))
    return found


def energies(
    problem: ExitProblem, solved: SolvedPath, *, error: float | None = None, **evidence: Any
) -> list[ActivationEnergy]:
    """The energy of a path, once for each attractor that it leads to; without an error, with that of its length."""
    action = solved.action
    error = TOLERANCES.lasting * action if error is None else error
    known = {"residual": max(max(leg.found.residual, leg.found.slack) for leg in solved.legs)} | evidence
    return [
        ActivationEnergy(
            source=problem.source,
            target=target,
            value=action,
            lower=0.0,
            upper=upper_bound(action, error),
            method=METHOD,
            bound=Bound.BRACKET if solved.end.one_of_many else Bound.UPPER,
            numerical_error=error,
            path=solved.path,
            saddle=solved.end.saddle,
            proposed_by=solved.finder,
            **known,
        )
        for target in solved.targets
    ]


def valleys(branches: Sequence[ActivationEnergy]) -> list[Finding]:
    """Findings where exits are not confined to one path."""
    if not branches:
        return []
    best, findings = branches[0], []
    limit = (1 + _COMPETING) * best.value
    paths = {id(branch.path): branch for branch in branches if branch.value <= limit}  # one may lead to several
    alike = [branch.value for branch in paths.values() if branch.path is not best.path]
    if alike:
        percent = 100 * _COMPETING
        findings.append(
            Finding.of(
                Code.COMPETING_PATHS, best.source, best.target, percent=percent, least=best.value, actions=alike
            )
        )  # fmt: skip
    sine = 1.0 if best.certificate is None else best.certificate.transversality
    if sine < 1e-3:
        findings.append(Finding.of(Code.FLAT_VALLEY, best.source, best.target, sine=sine))
    return findings


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
