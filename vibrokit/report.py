"""What the command line prints: tables for people, one object for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vibrokit.results.versions import versions

if TYPE_CHECKING:
    from vibrokit.results.result import Result
    from vibrokit.results.structure import Structure


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


def energy_table(name: str, result: Result) -> str:
    """Return the activation energies that an analyzer found, a line each."""
    rows = [f"{name}: {result.status}", "", "from → to   ΔU            lower         upper         momentum at exit"]
    rows += [
        f"{e.source} → {e.target}       {e.value:<12.6g}  {e.lower:<12.6g}  {e.upper:<12.6g}  {e.residual:.2g}"
        for e in result.energies
    ]
    return "\n".join([*rows, ""])


def record(
    scene: str, seed: int, structure: Structure, results: Mapping[str, Result], seconds: float
) -> dict[str, Any]:
    """Return all of a run as plain data."""
    energies = ("source", "target", "method", "value", "lower", "upper", "residual")
    return {
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
        "energies": [{key: getattr(e, key) for key in energies} for r in results.values() for e in r.energies],
        "versions": versions(),
        "seed": seed,
        "seconds": seconds,
    }
