"""What the command line prints: tables for people, one object for other programs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.versions import versions

if TYPE_CHECKING:
    from vibrokit.results.energy import ActivationEnergy
    from vibrokit.results.result import Result
    from vibrokit.results.structure import Structure
    from vibrokit.results.transitions import Transitions


def attractor_table(scene: str, structure: Structure) -> str:
    """Return the steady states, a line each, under what was found in words."""
    rows = [f"{scene}: {structure.status}", "", "state  kind         period  stop hits  basin            at (x, v)"]
    for a in structure.attractors:
        basin = f"{100 * a.basin_fraction:.2f} ± {100 * a.basin_fraction_error:.2f} %"
        place = f"({a.points[0, 0]:+.6f}, {a.points[0, 1]:+.6f})"
        rows.append(f"{a.label:<5}  {a.kind:<11}  {a.period:<6}  {a.impacts:<9.4g}  {basin:<15}  {place}")
    return "\n".join([*rows, ""])


def saddle_table(structure: Structure) -> str:
    """Return the saddles, a line each; nothing where there is none."""
    if not structure.saddles:
        return ""
    rows = ["between  kind         period  multipliers             at (x, v)"]
    for s in structure.saddles:
        sides = " | ".join(str(label) if label >= 0 else "–" for label in s.leads_to)
        sizes = ", ".join(_multiplier(m) for m in s.multipliers[:2])
        place = f"({s.points[0, 0]:+.10f}, {s.points[0, 1]:+.10f})"
        rows.append(f"{sides:<7}  {s.kind:<11}  {s.period:<6}  {sizes:<22}  {place}")
    return "\n".join([*rows, ""])


def _multiplier(value: complex) -> str:
    return f"{value.real:.6g}" if value.imag == 0 else f"{value:.4g}"


def analysis(name: str, result: Result) -> str:
    """Return all that an analyzer found: energies, branches that compete, and what follows in the long run."""
    tables = [f"{name}:", result.status, ""]
    if result.energies:
        tables += [energy_table(result.energies), ""]
    if isinstance(result, LeastActionResult):
        if len(result.branches) > len(result.energies):
            tables += ["branches, the best of each exit first:", energy_table(_ranked(result.branches)), ""]
        if result.transitions is not None and len(result.transitions.labels) > 1:
            tables += [transition_table(result.transitions, result.scene), ""]
    return "\n".join(tables)


def energy_table(energies: Iterable[ActivationEnergy]) -> str:
    """Return activation energies, a line each; the residual is the size of the momentum at the exit."""
    rows = [("from → to", "saddle", "ΔU", "lower", "upper", "residual", "method")]
    for e in energies:
        saddle = str(e.saddle) if e.saddle >= 0 else "–"
        numbers = f"{e.value:.10g}", f"{e.lower:.6g}", f"{e.upper:.6g}", f"{e.residual:.2g}"
        rows.append((e.exit, saddle, *numbers, e.method))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(f"{text:<{width}}" for text, width in zip(row, widths, strict=True)) for row in rows)
    return "\n".join(line.rstrip() for line in lines)


def _ranked(branches: Sequence[ActivationEnergy]) -> list[ActivationEnergy]:
    return sorted(branches, key=lambda branch: (branch.source, branch.target, branch.value))


def transition_table(transitions: Transitions, scene: Mapping[str, Any]) -> str:
    """Return the transition matrix and what follows from it, the weights at the scene's own noise among it."""
    intensity = scene.get("noise", {}).get("intensity", 0.0)
    weights = [str(transitions.stationary_weights(intensity))] if transitions.known and intensity > 0 else []
    return "\n".join([str(transitions), *weights])


def record(
    scene: str, seed: int, structure: Structure, results: Mapping[str, Result], seconds: float
) -> dict[str, Any]:
    """Return all of a run as plain data; numbers that are not finite are null."""
    found = {
        "scene": scene,
        "attractors": [
            {
                "label": a.label,
                "kind": a.kind,
                "period": a.period,
                "impacts": a.impacts,
                "points": a.points.tolist(),
                "basin_fraction": a.basin_fraction,
            }
            for a in structure.attractors
        ],
        "saddles": [
            {"period": s.period, "points": s.points.tolist(), "multipliers": [[m.real, m.imag] for m in s.multipliers]}
            for s in structure.saddles
        ],
        "energies": [_energy(e) for r in results.values() for e in r.energies],
        "versions": versions(),
        "seed": seed,
        "seconds": seconds,
    }
    for result in results.values():
        if isinstance(result, LeastActionResult) and result.transitions is not None:
            found["transitions"] = _transitions(result.transitions)
    return found


def _energy(energy: ActivationEnergy) -> dict[str, Any]:
    numbers = {name: _number(getattr(energy, name)) for name in ("value", "lower", "upper", "residual")}
    saddle = {"saddle": energy.saddle} if energy.saddle >= 0 else {}
    return {"source": energy.source, "target": energy.target, "method": energy.method, **numbers, **saddle}


def _transitions(transitions: Transitions) -> dict[str, Any]:
    return {
        "labels": list(transitions.labels),
        "energies": [[_number(value) for value in row] for row in transitions.energies.tolist()],
        "weights": [_number(value) for value in transitions.weights.tolist()],
        "most_stable": transitions.most_stable,
        "order_of_escapes": [
            {"members": list(e.members), "source": e.source, "target": e.target, "energy": _number(e.energy)}
            for e in transitions.order_of_escapes
        ],
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
