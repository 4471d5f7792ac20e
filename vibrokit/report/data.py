"""A run as plain data for other programs, in the words of the Python interface; null where a number is not finite."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrokit.comparison.reconciliation import Reconciliation
from vibrokit.comparison.transitions import Transitions
from vibrokit.comparison.verdicts import exit_name
from vibrokit.errors import StructureError
from vibrokit.report.tables import noise_intensity
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.finding import Finding
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.results.sweep import Sweep

if TYPE_CHECKING:  # a saved record is reported without SymPy and Numba
    from vibrokit.assessment.plausibility import Plausibility

_ATTRACTOR = ("label", "name", "kind", "period", "impacts", "points", "basin_fraction", "basin_fraction_error")
_SADDLE = ("period", "points", "multipliers", "kind", "leads_to", "embedded")
_ENERGY = ("source", "target", "method", "value", "lower", "upper", "bound", "numerical_error", "residual", "saddle",
           "proposed_by", "sensitivity", "sensitivity_error")  # fmt: skip
_RATE = ("source", "target", "intensity", "value", "log_value", "log_error", "event", "method")


def run_data(structure: Structure | None, results: Mapping[str, Result]) -> dict[str, Any]:
    """Return what a run found; `results` are by the names of the analyzers."""
    records: dict[str, Record] = {} if structure is None else {"structure": structure}
    records |= results
    return plain(
        {
            "attractors": [_fields(a, _ATTRACTOR) for a in structure.attractors] if structure else [],
            "saddles": [_fields(s, _SADDLE) for s in structure.saddles] if structure else [],
            "energies": [_energy(name, r, e) for name, r in results.items() for e in r.energies],
            "branches": [_energy(name, r, e) for name, r in results.items() for e in r.branches],
            "rates": [_rate(name, r, rate) for name, r in results.items() for rate in r.rates],
            "transitions": {
                name: _transitions(Transitions.of(r))
                for name, r in results.items()
                if any(e.target >= 0 for e in r.energies)
            },
            "findings": [
                entry
                for name, record in records.items()
                for entry in findings_data(name, record.findings, record.names)
            ],
            "settings": {name: record.settings for name, record in records.items()},
            "stats": {name: dataclasses.asdict(record.stats) for name, record in records.items()},
        }
    )


def reconciliation_data(one: Reconciliation) -> dict[str, Any]:
    """Return quantities and verdicts, each verdict with its sentence."""
    verdicts = [{**dataclasses.asdict(v), "about": v.about(one.names), "text": v.sentence()} for v in one.verdicts]
    exits = [
        {"source": source, "target": target, "exit": exit_name(one.names, source, target)}
        for source, target in one.exits
    ]
    return plain(
        {
            "attractors": one.names,
            "methods": one.methods,
            "level": one.level,
            "agreed": one.agreed,
            "complete": one.complete,
            "exits": exits,
            "verdicts": verdicts,
            "quantities": [dataclasses.asdict(q) for q in one.quantities],
            "findings": findings_data("reconciliation", one.findings, one.names),
        }
    )


def sweep_data(one: Sweep) -> dict[str, Any]:
    """Return where branches exist (SI units), and their displacements, energies and mean times at each value."""
    return plain(
        {
            "parameter": dict(one.factors),
            "unit": one.unit,
            "values": one.values,
            "intensities": one.intensity,
            "coexistence": [dataclasses.asdict(each) for each in one.coexistence],
            "bifurcations": [_fields(each, ("kind", "value", "branch", "side")) for each in one.states.bifurcations],
            "branches": [_branch(one, name) for name in one.names],
            "complete": one.complete,
            "findings": findings_data("sweep", one.findings, one.names),
            "settings": one.settings,
        }
    )


def _branch(one: Sweep, name: str) -> dict[str, Any]:
    """A branch of a sweep; without energies or mean times where none is known."""
    low, high, push = one.along(name)
    found: dict[str, Any] = {"name": name, "least_x": low, "largest_x": high, "push": push}
    with contextlib.suppress(StructureError):
        found["energy"] = one.energy(name)
        found["log_mean_time"], found["log_mean_time_error"] = one.log_mean_time(name)
    return found


def plausibility_data(one: Plausibility) -> dict[str, Any]:
    """Return the closed forms of a scene, and the sentences on those that are unusual."""
    rows = [
        {"measure": row.measure.value, "subject": row.subject, "value": row.value, "unit": row.measure.unit}
        for row in one.rows
    ]
    oddities = [{"code": odd.code.value, "values": odd.values, "text": str(odd)} for odd in one.oddities]
    return plain({"rows": rows, "oddities": oddities})


def findings_data(record: str, findings: Iterable[Finding], names: Sequence[str] = ()) -> list[dict[str, Any]]:
    """Return findings with their sentences; `record` is ``"structure"`` or the name of an analyzer."""
    fields = ("code", "severity", "source", "target", "values", "advice")
    return [plain({"record": record, **_fields(one, fields), "text": one.sentence(names)}) for one in findings]


def plain(value: Any) -> Any:
    """Return a value as JSON has it: complex numbers as pairs, numbers that are not finite as None."""
    match value:
        case np.generic() | np.ndarray():
            return plain(value.tolist())
        case Mapping():
            return {str(name): plain(entry) for name, entry in value.items()}
        case list() | tuple():
            return [plain(entry) for entry in value]
        case complex():
            return [plain(value.real), plain(value.imag)]
        case float():
            return value if math.isfinite(value) else None
    return value


def _fields(thing: Any, names: Iterable[str]) -> dict[str, Any]:
    return {name: getattr(thing, name) for name in names}


def _energy(analyzer: str, result: Result, energy: ActivationEnergy) -> dict[str, Any]:
    intensity = noise_intensity(result)
    ratio = energy.value / intensity if intensity > 0 else None
    return {**_fields(energy, _ENERGY), "exit": result.exit_of(energy), "ratio": ratio, "analyzer": analyzer}


def _rate(analyzer: str, result: Result, rate: ExitRate) -> dict[str, Any]:
    return {**_fields(rate, _RATE), "exit": result.exit_of(rate), "analyzer": analyzer}


def _transitions(transitions: Transitions) -> dict[str, Any]:
    cycles = [dataclasses.asdict(cycle) for cycle in transitions.cycle_hierarchy]
    names = ("names", "energies", "lower", "upper", "weights", "most_stable", "missing", "verdict")
    return {**_fields(transitions, names), "cycle_hierarchy": cycles}
