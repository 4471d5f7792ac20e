"""Writes lane-packed Runge–Kutta steps: many trajectories of one scene, side by side in vector registers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.tableau import RESULT, STAGES, WEIGHTS

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText

_FEW_EQUATIONS = 8
_ROOT_THIRD = 1 / math.sqrt(3)
CLASSICAL_NODES = (0.0, 0.5, 1.0)
# `z` has a row of lanes for each variable. `forces` has the forcing at the nodes of each step, the same for all lanes
# because they share the phase; `normals` has two standard normals for each lane, in two rows, for a single step; both
# only where a scene and a flow need them.
_STEP = (
    "def step_lanes(z, forces, normals, theta, h, steps):",
    "    keep_apart(), promise_no_overlap(), use_widest_registers()",
)  # fmt: skip
_STAGES = (("", ""), ("0.5*h*", "k1_"), ("0.5*h*", "k2_"), ("h*", "k3_"))


def step_function(text: SceneText, step: Sequence[str], nodes: int) -> str:
    """Function `step_lanes`, which takes steps of every lane, from the lines of one step."""
    lines = [*_STEP]
    lines += [f"    {name} = theta[{place}]" for name, place in text.parameters.items()]
    lines += ["    for step in range(steps):", *[f"        _node = {nodes * len(text.functions)}*step"] * text.forced]
    return "\n".join([*lines, *(f"    {line}" for line in step), ""])


def lanes_of(text: SceneText) -> int:
    """Number of lanes of a block, whose numbers stay in the nearest cache."""
    return 32 if len(text.variables) <= _FEW_EQUATIONS else 16


def _ended(text: SceneText, start: Sequence[str], point: Sequence[str], target: str) -> list[str]:
    """A line that makes a number NaN if a pole lies between the start of a step and a point; none without poles."""
    if not text.gauges:
        return []
    states = [*start[: text.states], *point[: text.states]]
    return [f"        {target} += crossed({', '.join([*states, *text.parameters])})"]


def classical_step(text: SceneText) -> list[str]:
    """Lines of a classical Runge–Kutta step, between two kicks where there is noise.

    With U₁, U₂ standard normal, ΔW = √h U₁ and ΔZ = ½ h^(3/2) (U₁ + U₂/√3) have the right joint law.
    """
    names, lanes = text.variables, lanes_of(text)
    noisy = bool(text.amplitude)
    driven = names[text.states - 1]
    start = [f"z[{row * lanes} + lane]" for row in range(text.states)]
    at_nodes = [_named(f"f{node}", text) for node in range(len(CLASSICAL_NODES))]
    lines = [_read([name for names in at_nodes for name in names])] if text.forced else []
    lines += ["    _half = 0.5*sqrt(h)"] if noisy else []
    lines += ["    for lane in range(LANES):"]
    lines += [f"        {name} = z[{row * lanes} + lane]" for row, name in enumerate(names)]
    lines += _kicks(driven, text) if noisy else []
    for stage, (factor, before) in enumerate(_STAGES, start=1):
        point = [f"{name} + {factor}{before}{name}" if before else name for name in names]
        targets = ", ".join(f"k{stage}_{name}" for name in names)
        values = [*point, *at_nodes[stage // 2], *text.parameters]
        lines.append(f"        {targets} = derivative({', '.join(values)})")
        lines += _ended(text, start, point, f"k{stage}_{names[0]}") if before or noisy else []
    for row, name in enumerate(names):
        slopes = f"k1_{name} + 2.0*(k2_{name} + k3_{name}) + k4_{name}"
        after = " + _later" if noisy and name == driven else ""
        lines.append(f"        z[{row * lanes} + lane] = {name} + h/6.0*({slopes}){after}")
    return [*lines, *_ended(text, names, start, start[0])]


def staged_step(text: SceneText) -> list[str]:
    """Lines of a Dormand–Prince step of order 8, without noise. The rows of `z` after the variables keep its slopes.

    With few equations, a stage is one loop over the lanes. With many, that loop would need more registers and a longer
    compilation than it gains: the point of a stage is computed in a loop over all numbers of all lanes first, which
    halves both times.
    """
    names, lanes = text.variables, lanes_of(text)
    few, size = len(names) <= _FEW_EQUATIONS, len(names) * lanes

    def at(place: int, row: int) -> str:
        return f"z[{place * size + row * lanes} + lane]"

    def moved(weights: NDArray[np.float64], row: int) -> str:
        return at(0, row) + _combined(weights, lambda stage: at(1 + stage, row))

    def number(stage: int) -> str:
        return f"z[{(1 + stage) * size} + number]"

    lines, rows, start = list[str](), range(len(names)), [at(0, row) for row in range(text.states)]
    for stage, weights in enumerate(WEIGHTS):
        point = [moved(weights, row) if few else at(1 + STAGES, row) for row in rows]
        if not few:
            lines += [f"    for number in range({size}):"]
            lines += [f"        {number(STAGES)} = z[number]{_combined(weights, number)}"]
        force = _named("force", text)
        lines += [_read(force, stage * len(force))] if force else []
        lines += ["    for lane in range(LANES):"]
        lines += [f"        {', '.join(at(1 + stage, row) for row in rows)} = \\"]
        lines += [f"            derivative({', '.join([*point, *force, *text.parameters])})"]
        lines += _ended(text, start, point, at(1 + stage, 0)) if stage else []
    if text.gauges:
        last = [moved(RESULT, row) for row in range(text.states)]
        lines += ["    for lane in range(LANES):", *_ended(text, start, last, at(1, 0))]
    return [*lines, f"    for number in range({size}):", f"        z[number] = z[number]{_combined(RESULT, number)}"]


def _combined(weights: NDArray[np.float64], slope: Callable[[int], str]) -> str:
    """Text that adds the weighted slopes of a step, if there are any; `slope` gives the text of that of a stage."""
    terms = [f"{float(weight)!r}*{slope(stage)}" for stage, weight in enumerate(weights) if weight]
    return f" + h*({' + '.join(terms)})" if terms else ""


def _named(name: str, text: SceneText) -> list[str]:
    """Names of the functions of time at a node."""
    several = len(text.functions) > 1
    return [f"{name}_{place}" if several else name for place in range(len(text.functions))]


def _read(names: Sequence[str], first: int | None = None) -> str:
    """A line that reads values of the table, from that of a step or from a later one on."""
    places = [f"_node + {place}" for place in range(first or 0, (first or 0) + len(names))]
    values = (f"forces[{place}]" for place in (["_node", *places[1:]] if first is None else places))
    return f"    {', '.join(names)} = {', '.join(values)}"


def _kicks(driven: str, text: SceneText) -> list[str]:
    """Lines that kick the driven state before the step and keep the kick after it; Milstein's term is in the latter."""
    milstein = " + _size*sqrt(h)*slope(x, v, theta)*(_first*_first - 1.0)" if text.slope else ""
    return [
        "        _first, _second = normals[lane], normals[LANES + lane]",
        "        _size = _half*amplitude(x, v, theta)",
        f"        _later = _size*(_first - {_ROOT_THIRD!r}*_second){milstein}",
        f"        {driven} += _size*(_first + {_ROOT_THIRD!r}*_second)",
    ]


def tabulation(text: SceneText, nodes: Sequence[float]) -> str:
    """Function `tabulate(start, h, steps, theta, table)`: functions of time at the nodes of steps; empty without."""
    if not text.forced:
        return ""
    lines = ["def tabulate(start, h, steps, theta, table):", "    for step in range(steps):"]
    count = len(text.functions)
    for place, node in enumerate(nodes):
        targets = (f"table[{len(nodes) * count}*step + {place * count + k}]" for k in range(count))
        lines.append(f"        {', '.join(targets)} = forcing(start + h*(step + {node!r}), theta)")
    return "\n".join([*lines, ""])
