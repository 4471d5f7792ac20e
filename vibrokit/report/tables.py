"""The tables of records: inputs, steady states, saddles, energies, sensitivities and rates."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from vibrokit.comparison.sensitivities import numbers_in, sensitivities, twins
from vibrokit.errors import StructureError
from vibrokit.oscillator import Oscillator
from vibrokit.quantity import Quantity
from vibrokit.report.blocks import Table
from vibrokit.results.basins import ESCAPED
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.existence import touches_text
from vibrokit.results.labels import goal_name
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.results.sweep import Sweep
from vibrokit.text_table import number_text, power_text
from vibrokit.text_units import familiar, symbol_text, unit_text


def input_table(osc: Oscillator) -> Table:
    """Return every parameter of a scene with its symbol in the equations, its value and its unit, a row each."""
    symbols, rows = osc.model.symbols, []
    for path, declared, value in osc.entries:
        unit = "not declared" if declared.unit is None else unit_text(declared.unit) or "1"
        symbol = symbol_text(str(symbols[path])) if path in symbols else ""
        rows.append((path, symbol, number(value), unit, written(value) or familiar(value, declared.unit)))
    if osc.mass is not None:
        rows.append(("mass", "", number(osc.mass), "kg", written(osc.mass)))
    rows += [(f"barriers.{index}.side", "", one.side, "", "") for index, one in enumerate(osc.barriers)]
    return Table("inputs", "Inputs", ("parameter", "symbol", "value", "unit", "that is"), tuple(rows))


def attractor_table(structure: Structure) -> Table:
    """Return the steady states, a row each."""
    header = ("attractor", "label", "kind", "period", "stop hits", "basin", "at (x, v)")
    rows = []
    for a in structure.attractors:
        basin = f"{100 * a.basin_fraction:.2f} ± {100 * a.basin_fraction_error:.2f} %"
        rows.append((a.name, str(a.label), a.kind, str(a.period), f"{a.impacts:.4g}", basin, _place(a.points, 6)))
    return Table("states", "Steady states", header, tuple(rows))


def saddle_table(structure: Structure) -> Table:
    """Return the saddles, a row each."""
    rows = []
    for number, s in enumerate(structure.saddles):
        sides = " | ".join(
            goal_name(structure.names, label) if label >= 0 or label == ESCAPED else "–" for label in s.leads_to
        )
        kind = f"{s.kind}, in a chaotic set" if s.embedded else s.kind
        sizes = ", ".join(f"{m.real:.6g}" if m.imag == 0 else f"{m:.4g}" for m in s.multipliers[:2])
        rows.append((str(number), sides, kind, str(s.period), sizes, _place(s.points, 10)))
    header = ("saddle", "between", "kind", "period", "multipliers", "at (x, v)")
    return Table("saddles", "Saddles", header, tuple(rows))


def energy_table(record: Record, energies: Iterable[ActivationEnergy]) -> Table:
    """Return activation energies, a row each, also as multiples of the scene's noise intensity."""
    intensity = noise_intensity(record)
    header = ("exit", "ΔU", "ΔU/D", "lower", "upper", "bound", "error", "residual", "saddle", "method")
    rows = []
    for e in energies:
        ratio = number_text(e.value / intensity if intensity else math.nan, ".4g")
        bounds = number_text(e.lower, ".6g"), "unknown" if math.isinf(e.upper) else f"{e.upper:.6g}", str(e.bound)
        errors = number_text(e.numerical_error, ".1e"), number_text(e.residual, ".1e")
        saddle = str(e.saddle) if e.saddle >= 0 else "–"
        value = f"{e.value:.{_digits(e)}g}"
        method = f"{e.method} ({e.proposed_by})" if e.proposed_by else e.method
        rows.append((e.exit_between(record.names), value, ratio, *bounds, *errors, saddle, method))
    return Table("energies", "Activation energies (m² s⁻³)", header, tuple(rows))


def sensitivity_table(result: Result) -> Table:
    """Return what each parameter does to each energy: per unit, and in per cent by 1 %; a row if it has an effect.

    Parameters that several parts share have a row together, per unit of their magnitude.
    """
    known = [energy for energy in result.energies if energy.sensitivity and energy.value > 0]
    numbers, columns, header = numbers_in(result.scene), [], ["parameter"]
    for energy in known:
        powers = {one.parameter: one.energy for one in sensitivities(energy, numbers)}
        slopes = dict(energy.sensitivity)
        for name, paths in twins({path: numbers[path] for path in slopes}).items():
            slopes[name] = math.fsum(math.copysign(slopes[path], slopes[path] * numbers[path]) for path in paths)
        columns += [slopes, powers]
        header += [energy.exit_between(result.names), "% by 1 %"]
    names = dict.fromkeys(name for column in columns[::2] for name, value in column.items() if value)
    rows = tuple((name, *(number_text(column.get(name, math.nan), ".5g") for column in columns)) for name in names)
    title = "Change of ΔU per unit of each parameter, and in per cent by 1 % of it"
    return Table("sensitivities", title, tuple(header), rows)


def rate_table(result: Result) -> Table:
    """Return exit rates at finite noise, a row each, with the mean times that are their inverses."""
    header = ("exit", "D", "mean time (s)", "rate (s⁻¹)", "error of ln", "event", "method")
    rows = []
    for rate in result.rates:
        times = power_text(-rate.log_value), power_text(rate.log_value), f"{rate.log_error:.2g}"
        rows.append((result.exit_of(rate), f"{rate.intensity:g}", *times, rate.event, rate.method))
    return Table("rates", "Exit rates at finite noise", header, tuple(rows))


def coexistence_table(sweep: Sweep) -> Table:
    """Return from where to where each branch of a sweep exists, a row for each stretch with the same contacts."""
    label, scale = sweep.axis()
    rows = tuple(
        (
            one.name, f"{one.first / scale:.8g}", one.begins, f"{one.last / scale:.8g}", one.ends,
            *([touches_text(one)] if sweep.stops else []),
        )
        for one in sweep.coexistence
    )  # fmt: skip
    header = ("state", "from", "begins by", "to", "ends by", *(["contact"] if sweep.stops else []))
    return Table("coexistence", f"Steady states along {label}", header, rows)


def gap_table(sweep: Sweep) -> Table:
    """Return the values at which there is no steady state, a row each with the reason."""
    label, scale = sweep.axis()
    rows = tuple((f"{value / scale:.8g}", reason) for value, reason in sweep.gaps)
    return Table("gaps", "Values without a steady state", (label, "reason"), rows)


def along_table(sweep: Sweep) -> Table:
    """Return what each branch of a sweep does at each value, a row each; empty cells where nothing is known."""
    rows: list[tuple[str, ...]] = []
    label, scale = sweep.axis()
    for name in sweep.names:
        low, high, push = sweep.along(name)
        energy = power = time = np.full(len(low), math.nan)
        with contextlib.suppress(StructureError):
            energy, power = sweep.energy(name), sweep.sensitivity(name)
            time = sweep.log_mean_time(name)[0]
        for value, *numbers in zip(sweep.values, low, high, push, energy, power, time, strict=True):
            if not math.isnan(numbers[0]):
                rows.append((name, f"{value / scale:.10g}", *("" if math.isnan(n) else f"{n:.8g}" for n in numbers)))
    header = ("state", label, "least x (m)", "largest x (m)", "push (m s⁻²)", "ΔU (m² s⁻³)", "ΔU, % by 1 %", "ln τ (s)")
    return Table("along", "Along the parameter", header, tuple(rows), detail=True)


def noise_intensity(record: Record) -> float:
    """Return the noise intensity D of a record's scene (m² s⁻³); 0 without noise."""
    return float((record.scene.get("noise") or {}).get("intensity", 0.0))


def number(value: Any) -> str:
    """Return the value of a parameter as text."""
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def written(value: Any) -> str:
    """Return the value of a parameter as the user wrote it with a unit; empty if it has none."""
    return value.text if isinstance(value, Quantity) else ""


def _digits(energy: ActivationEnergy) -> int:
    """Significant digits of an energy, one more than its numerical error leaves certain."""
    error = energy.numerical_error
    if not (error > 0 and energy.value > 0):
        return 6 if math.isnan(error) else 10
    return min(10, max(2, 2 + math.floor(math.log10(energy.value / error))))


def _place(points: Any, digits: int) -> str:
    return f"({points[0, 0]:.{digits}g}, {points[0, 1]:.{digits}g})"
