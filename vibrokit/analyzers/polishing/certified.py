"""Solved paths as energies with their certificates, and findings about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from vibrokit.analyzers.polishing.certify import certify
from vibrokit.analyzers.polishing.sensitivity import sensitivities
from vibrokit.analyzers.polishing.solved_path import SolvedPath
from vibrokit.analyzers.polishing.tolerances import TOLERANCES
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound, Certificate, upper_bound
from vibrokit.results.finding import Finding
from vibrokit.results.labels import goal_name

METHOD = "least action"
_COMPETING = 0.01  # of the least action: at ΔU/D = 100 such a path still carries a third as many exits
_FLAT = 1e-3  # sine of the angle between the manifolds
_ROUNDING = 1e-12  # of an action, which is a sum of thousands of terms


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
        error=certificate.error + _ROUNDING * action,
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
    """The energy of a path, once for each attractor that it leads to.

    Without a certificate, the error is the change by which the path was accepted as long enough.
    """
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
    if sine < _FLAT:
        findings.append(Finding.of(Code.FLAT_VALLEY, best.source, best.target, sine=sine))
    return findings
