"""Records as text: tables of their numbers, their findings as sentences, and how much work they took."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import singledispatch
from typing import Any

from vibrokit.comparison.reconciliation import Reconciliation
from vibrokit.comparison.transitions import Transitions
from vibrokit.progress import Stats
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Severity
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.finding import Finding
from vibrokit.results.labels import goal_name
from vibrokit.results.plain import PlainRecord
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.text_table import number_text, power_text, text_table

_LEAST_SHARE = 0.01  # of the time: shorter stages are not listed


def record_text(title: str, record: Record) -> str:
    """Return all that a record says: tables, findings, and one line on the work it took."""
    heading = title if record.complete else f"{title} (incomplete)"
    sections = [heading, *_tables(record), findings_text(record.findings, record.names), stats_text(record)]
    return "\n\n".join(section for section in sections if section)


@singledispatch
def _tables(record: Record) -> list[str]:
    """Tables of a record's numbers; a record of another kind has its findings only."""
    return []


@_tables.register
def _plain_tables(record: PlainRecord) -> list[str]:
    return [energy_table(record, record.energies)] if record.energies else []


@_tables.register
def _reconciliation_tables(reconciliation: Reconciliation) -> list[str]:
    return [str(reconciliation)]


@_tables.register
def _structure_tables(structure: Structure) -> list[str]:
    return [attractor_table(structure), saddle_table(structure)]


@_tables.register
def _result_tables(result: Result) -> list[str]:
    tables = [energy_table(result, result.energies)]
    if len(result.branches) > len(result.energies):
        ranked = sorted(result.branches, key=lambda branch: (branch.source, branch.target, branch.value))
        tables.append("All paths, the cheapest of each exit first:\n" + energy_table(result, ranked))
    if any(energy.sensitivity for energy in result.energies):
        tables.append("Change of ΔU per unit of each parameter:\n" + sensitivity_table(result))
    if result.rates:
        tables.append(rate_table(result))
    if any(energy.target >= 0 for energy in result.energies):
        tables.append(transitions_text(Transitions.of(result), noise_intensity(result)))
    return tables


def attractor_table(structure: Structure) -> str:
    """Return the steady states, a line each."""
    if not structure.attractors:
        return "No steady state was found."
    rows = [("attractor", "label", "kind", "period", "stop hits", "basin", "at (x, v)")]
    for a in structure.attractors:
        basin = f"{100 * a.basin_fraction:.2f} ± {100 * a.basin_fraction_error:.2f} %"
        rows.append((a.name, str(a.label), a.kind, str(a.period), f"{a.impacts:.4g}", basin, _place(a.points, 6)))
    return "\n".join(text_table(rows))


def saddle_table(structure: Structure) -> str:
    """Return the saddles, a line each; nothing if there is no saddle."""
    if not structure.saddles:
        return ""
    rows = [("saddle", "between", "kind", "period", "multipliers", "at (x, v)")]
    for number, s in enumerate(structure.saddles):
        sides = " | ".join(
            goal_name(structure.names, label) if label >= 0 or label == ESCAPED else "–" for label in s.leads_to
        )
        kind = f"{s.kind}, in a chaotic set" if s.embedded else s.kind
        sizes = ", ".join(f"{m.real:.6g}" if m.imag == 0 else f"{m:.4g}" for m in s.multipliers[:2])
        rows.append((str(number), sides, kind, str(s.period), sizes, _place(s.points, 10)))
    return "\n".join(text_table(rows))


def energy_table(record: Record, energies: Iterable[ActivationEnergy]) -> str:
    """Return activation energies, a line each, also as multiples of the scene's noise intensity."""
    intensity = noise_intensity(record)
    rows = [("exit", "ΔU", "ΔU/D", "lower", "upper", "bound", "error", "residual", "saddle", "method")]
    for e in energies:
        ratio = number_text(e.value / intensity if intensity else math.nan, ".4g")
        bounds = f"{e.lower:.6g}", "unknown" if math.isinf(e.upper) else f"{e.upper:.6g}", str(e.bound)
        errors = number_text(e.numerical_error, ".1e"), number_text(e.residual, ".1e")
        saddle = str(e.saddle) if e.saddle >= 0 else "–"
        value = f"{e.value:.{_digits(e)}g}"
        rows.append((e.exit_between(record.names), value, ratio, *bounds, *errors, saddle, e.method))
    return "\n".join(text_table(rows)) if len(rows) > 1 else "No activation energy was found."


def sensitivity_table(result: Result) -> str:
    """Return the derivative of each energy in each parameter, a line for each parameter that has an effect."""
    known = [energy for energy in result.energies if energy.sensitivity]
    names = dict.fromkeys(name for energy in known for name, value in energy.sensitivity.items() if value)
    rows = [("parameter", *(energy.exit_between(result.names) for energy in known))]
    rows += [
        (name, *(number_text(energy.sensitivity.get(name, math.nan), ".5g") for energy in known)) for name in names
    ]
    return "\n".join(text_table(rows))


def rate_table(result: Result) -> str:
    """Return exit rates at finite noise, a line each, with the mean times that are their inverses."""
    rows = [("exit", "D", "mean time (s)", "rate (s⁻¹)", "error of ln", "event", "method")]
    for rate in result.rates:
        times = power_text(-rate.log_value), power_text(rate.log_value), f"{rate.log_error:.2g}"
        rows.append((result.exit_of(rate), f"{rate.intensity:g}", *times, rate.event, rate.method))
    return "\n".join(text_table(rows))


def transitions_text(transitions: Transitions, intensity: float) -> str:
    """Return energies between all attractors and what follows, or what is missing for that."""
    if not transitions.known:
        return transitions.verdict
    weights = [str(transitions.stationary_weights(intensity))] if intensity > 0 else []
    return "\n".join([str(transitions), *weights])


def findings_text(findings: Sequence[Finding], names: Sequence[str] = ()) -> str:
    """Return the findings as sentences: errors and warnings with advice, then information."""
    lines = []
    for severity in (Severity.ERROR, Severity.WARNING, Severity.INFO):
        for finding in (one for one in findings if one.severity is severity):
            advice = "" if severity is Severity.INFO else f" {finding.advice}"
            lines.append(f"{severity}: {finding.sentence(names)}{advice}".rstrip())
    return "\n".join(lines)


def stats_text(record: Record) -> str:
    """Return how much work a record took, in one line."""
    counts = ", ".join(f"{number:,} {name}" for name, number in stats_counts(record.stats).items() if number)
    stages = sorted(record.stats.seconds.items(), key=lambda item: -item[1])
    times = ", ".join(f"{name} {spent:.1f} s" for name, spent in stages if spent >= _LEAST_SHARE * record.seconds)
    return f"{record.seconds:.1f} s" + (f" ({times})" if times else "") + (f"; {counts}" if counts else "") + "."


def stats_counts(stats: Stats) -> dict[str, int]:
    """Return the counts of `Stats` by what they count."""
    return {
        "trajectories": stats.trajectories,
        "section intervals": stats.intervals,
        "steps": stats.steps,
        "Newton iterations": stats.newton_iterations,
    }


def noise_intensity(record: Record) -> float:
    """Return the noise intensity D of a record's scene (m² s⁻³); 0 without noise."""
    return float((record.scene.get("noise") or {}).get("intensity", 0.0))


def _digits(energy: ActivationEnergy) -> int:
    """Significant digits of an energy, one more than its numerical error leaves certain."""
    error = energy.numerical_error
    if not (error > 0 and energy.value > 0):
        return 6 if math.isnan(error) else 10
    return min(10, max(2, 2 + math.floor(math.log10(energy.value / error))))


def _place(points: Any, digits: int) -> str:
    return f"({points[0, 0]:+.{digits}f}, {points[0, 1]:+.{digits}f})"
