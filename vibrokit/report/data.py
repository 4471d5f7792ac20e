"""A run as plain data for other programs, in the words of the Python interface; null where a number is not finite."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from functools import singledispatch
from typing import Any

import numpy as np

from vibrokit.comparison.transitions import Transitions
from vibrokit.report.text import noise_intensity
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.finding import Finding
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure

_ATTRACTOR = ("label", "name", "kind", "period", "impacts", "points", "basin_fraction", "basin_fraction_error")
_SADDLE = ("period", "points", "multipliers", "kind", "leads_to")
_ENERGY = ("source", "target", "method", "value", "lower", "upper", "bound", "numerical_error", "residual", "saddle")


def run_data(structure: Structure | None, results: Mapping[str, Result]) -> dict[str, Any]:
    """Return what a run found.

    Parameters
    ----------
    structure : Structure or None
    results : mapping of str to Result
        By the names of the analyzers.
    """
    records: dict[str, Record] = {} if structure is None else {"structure": structure}
    records |= results
    return plain(
        {
            "attractors": [_fields(a, _ATTRACTOR) for a in structure.attractors] if structure else [],
            "saddles": [_fields(s, _SADDLE) for s in structure.saddles] if structure else [],
            "energies": [_energy(name, r, e) for name, r in results.items() for e in r.energies],
            "branches": [_energy(name, r, e) for name, r in results.items() for e in r.branches],
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


def findings_data(record: str, findings: Iterable[Finding], names: Sequence[str] = ()) -> list[dict[str, Any]]:
    """Return findings with their sentences.

    Parameters
    ----------
    record : str
        What they belong to: ``"structure"`` or the name of an analyzer.
    findings : iterable of Finding
    names : sequence of str
        Of the attractors.
    """
    fields = ("code", "severity", "source", "target", "values", "advice")
    return [plain({"record": record, **_fields(one, fields), "text": one.sentence(names)}) for one in findings]


@singledispatch
def plain(value: Any) -> Any:
    """Return a value as JSON has it: complex numbers as pairs, numbers that are not finite as None."""
    return value


@plain.register
def _(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


@plain.register
def _(value: complex) -> list[Any]:
    return [plain(value.real), plain(value.imag)]


@plain.register
def _(value: np.generic | np.ndarray) -> Any:
    return plain(value.tolist())


@plain.register
def _(value: Mapping) -> dict[str, Any]:  # type: ignore[type-arg]
    return {str(name): plain(entry) for name, entry in value.items()}


@plain.register
def _(value: list | tuple) -> list[Any]:  # type: ignore[type-arg]
    return [plain(entry) for entry in value]


def _fields(thing: Any, names: Iterable[str]) -> dict[str, Any]:
    return {name: getattr(thing, name) for name in names}


def _energy(analyzer: str, result: Result, energy: ActivationEnergy) -> dict[str, Any]:
    intensity = noise_intensity(result)
    ratio = energy.value / intensity if intensity > 0 else None
    return {**_fields(energy, _ENERGY), "exit": result.exit_of(energy), "ratio": ratio, "analyzer": analyzer}


def _transitions(transitions: Transitions) -> dict[str, Any]:
    cycles = [dataclasses.asdict(cycle) for cycle in transitions.cycle_hierarchy]
    names = ("names", "energies", "lower", "upper", "weights", "most_stable", "missing", "verdict")
    return {**_fields(transitions, names), "cycle_hierarchy": cycles}
