"""The search for steady states at one value of a parameter."""

from __future__ import annotations

import dataclasses

from vibrokit.errors import VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.region import Region
from vibrokit.structure.basins.grid import CELL_CODES
from vibrokit.structure.find import structure_of
from vibrokit.structure.parameter_values import ParameterLine
from vibrokit.structure.validation import Request


@dataclasses.dataclass(frozen=True, eq=False)
class SearchedValue:
    """Steady states found at one value, each by itself."""

    value: float
    attractors: tuple[Attractor, ...] = ()
    region: Region | None = None
    budget: int = 0
    findings: tuple[Finding, ...] = ()
    refused: bool = False  # whether there is no such scene, or none that can have attractors


def searched_value(osc: Oscillator, line: ParameterLine, value: float, request: Request) -> SearchedValue:
    """Search for the steady states at a value."""
    if reason := line.refusal(osc, value):
        return SearchedValue(value, findings=(Finding.of(Code.NOTHING_AT, value=value, reason=reason),), refused=True)
    there = line.at(osc, value)
    try:
        structure = structure_of(there, dataclasses.replace(request, cells=None), basins=False)
    except VibrokitError as error:
        nothing = Finding.of(Code.NOTHING_AT, value=value, reason=str(error))
        return SearchedValue(value, findings=(nothing,), refused=there.model.undamped)
    # Basins are found once all attractors are known.
    findings = tuple(one for one in structure.findings if one.code not in (*CELL_CODES, Code.STOPPED))
    return SearchedValue(value, structure.attractors, structure.basins.region, structure.budget, findings)
