"""Writes lane-packed Runge–Kutta steps: many trajectories of one scene, side by side in vector registers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.tableau import NODES, RESULT, STAGES, WEIGHTS

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText

_FEW_EQUATIONS = 8
_ROOT_THIRD = 1 / math.sqrt(3)
_FORCES = ("f0", "f1", "f2")
_NORMALS = ("first", "second")
_REGISTERS = "from vibrokit.kernels.registers import use_widest_registers"
_DRAWING = (
    "from vibrokit.kernels.streams import normal_pair", "", "",
    "@njit(**INLINED)", "def draw_lanes(streams, first, second):", "    use_widest_registers()",
    "    for lane in range(LANES):", "        first[lane], second[lane] = normal_pair(streams, lane)",
)  # fmt: skip
_STAGES = (("", ""), ("0.5*h*", "k1_"), ("0.5*h*", "k2_"), ("h*", "k3_"))
_CLASSICAL_NODES = (0.0, 0.5, 1.0)


def classical_step(text: SceneText) -> list[str]:
    """Pieces of a kernel of classical Runge–Kutta steps, with noise or without."""
    head = sizes(text, len(_CLASSICAL_NODES))
    return [head, tabulation(text, _CLASSICAL_NODES), text.derivative, text.amplitude, text.slope, _unrolled(text)]


def staged_step(text: SceneText) -> list[str]:
    """Pieces of a kernel of Dormand–Prince steps of order 8, without noise."""
    nodes = tuple(float(node) for node in NODES)
    return [f"{sizes(text, STAGES)}STAGES = {STAGES}\n", tabulation(text, nodes), text.derivative, _staged(text)]


def sizes(text: SceneText, nodes: int) -> str:
    """Lanes of a block, whose numbers stay in the nearest cache, and values of the forcing in a step."""
    lanes = 32 if len(text.variables) <= _FEW_EQUATIONS else 16
    return f"{_REGISTERS}\n\nLANES = {lanes}\nNODES = {nodes}\n"


def _staged(text: SceneText) -> str:
    """Function `step_lanes(z, slopes, point, forces, theta, h)`: a step of order 8 of every lane.

    `slopes` and `point` are workspaces. With few equations, a stage is one loop over the lanes. With many, that loop
    would need more registers and a longer compilation than it gains: the point of a stage is computed in a loop over
    all numbers of all lanes first, which halves both times.
    """
    names, few = text.variables, len(text.variables) <= _FEW_EQUATIONS
    lines = ["@njit(**INLINED)", f"def step_lanes(z, slopes, point, {'forces, ' * text.forced}theta, h):"]
    lines += ["    use_widest_registers()"]
    lines += [f"    {name} = theta[{place}]" for name, place in text.parameters.items()]
    lines += ["    flat_z, flat_point = z.reshape(EQUATIONS*LANES), point.reshape(EQUATIONS*LANES)"]
    lines += ["    flat_slopes = slopes.reshape((STAGES, EQUATIONS*LANES))"]
    for stage, weights in enumerate(WEIGHTS):
        places = [f"{index}, lane]" for index, _ in enumerate(names)]
        if few:
            at = [f"z[{place}{_combined(weights, f'slopes[{{}}, {place}')}" for place in places]
        else:
            lines += ["    for number in range(EQUATIONS*LANES):"]
            lines += [f"        flat_point[number] = flat_z[number]{_combined(weights, 'flat_slopes[{}, number]')}"]
            at = [f"point[{place}" for place in places]
        lines += [f"    force = forces[{stage}]"] * text.forced
        force = ["force"] * text.forced
        lines += ["    for lane in range(LANES):"]
        lines += [f"        {', '.join(f'slopes[{stage}, {place}' for place in places)} = \\"]
        lines += [f"            derivative({', '.join([*at, *force, *text.parameters])})"]
    lines += ["    for number in range(EQUATIONS*LANES):"]
    lines += [f"        flat_z[number] += {_combined(RESULT, 'flat_slopes[{}, number]').removeprefix(' + ')}"]
    return "\n".join([*lines, ""])


def _combined(weights: NDArray[np.float64], slope: str) -> str:
    """Text that adds the weighted slopes of a step, if there are any; `slope` has braces for the stage."""
    terms = [f"{float(weight)!r}*{slope.format(stage)}" for stage, weight in enumerate(weights) if weight]
    return f" + h*({' + '.join(terms)})" if terms else ""


def _unrolled(text: SceneText) -> str:
    """Function `step_lanes(z, forces, first, second, theta, h)`: a classical step of every lane.

    `z` has shape (EQUATIONS, LANES); `forces` has the forcing at the step's start, middle and end, the same for all
    lanes because they share the phase; first, second are two standard normals for each lane. A scene without forcing
    and a flow without noise have no such arguments. `draw_lanes(streams, first, second)` draws the normals.

    LLVM turns loops into vector code before it inlines, so each function here asks for wide registers itself, and knows
    the number of lanes.

    The step is a classical Runge–Kutta step, between two kicks where there is noise. With U₁, U₂ standard normal,
    ΔW = √h U₁ and ΔZ = ½ h^(3/2) (U₁ + U₂/√3) have the right joint law.
    """
    names = text.variables
    noisy = bool(text.amplitude)
    driven = names[text.states - 1]
    arguments = ["z", *["forces"] * text.forced, *(_NORMALS if noisy else []), "theta", "h"]
    lines = [*(_DRAWING if noisy else []), "", ""]
    lines += ["@njit(**INLINED)", f"def step_lanes({', '.join(arguments)}):"]
    lines += ["    use_widest_registers()"]
    lines += [f"    {name} = theta[{place}]" for name, place in text.parameters.items()]
    lines += ["    f0, f1, f2 = forces[0], forces[1], forces[2]"] if text.forced else []
    lines += ["    _half = 0.5*sqrt(h)"] if noisy else []
    lines += ["    for lane in range(LANES):"]
    lines += [f"        {name} = z[{index}, lane]" for index, name in enumerate(names)]
    lines += _kicks(driven, text) if noisy else []
    for stage, (factor, before) in enumerate(_STAGES, start=1):
        point = [f"{name} + {factor}{before}{name}" if before else name for name in names]
        force = [_FORCES[stage // 2]] if text.forced else []
        targets = ", ".join(f"k{stage}_{name}" for name in names)
        lines.append(f"        {targets} = derivative({', '.join([*point, *force, *text.parameters])})")
    for index, name in enumerate(names):
        slopes = f"k1_{name} + 2.0*(k2_{name} + k3_{name}) + k4_{name}"
        after = " + _later" if noisy and name == driven else ""
        lines.append(f"        z[{index}, lane] = {name} + h/6.0*({slopes}){after}")
    return "\n".join([*lines, ""])


def _kicks(driven: str, text: SceneText) -> list[str]:
    """Lines that kick the driven state before the step and keep the kick after it; Milstein's term is in the latter."""
    milstein = " + _size*sqrt(h)*slope(x, v, theta)*(first[lane]*first[lane] - 1.0)" if text.slope else ""
    return [
        "        _size = _half*amplitude(x, v, theta)",
        f"        _later = _size*(first[lane] - {_ROOT_THIRD!r}*second[lane]){milstein}",
        f"        {driven} += _size*(first[lane] + {_ROOT_THIRD!r}*second[lane])",
    ]


def tabulation(text: SceneText, nodes: Sequence[float]) -> str:
    """Function `tabulate(start, h, theta, table)`: the forcing at the nodes of every step; nothing without forcing."""
    if not text.forced:
        return ""
    lines = ["@njit(**INLINED)", "def tabulate(start, h, theta, table):", "    for step in range(table.shape[0]):"]
    lines += [
        f"        table[step, {place}] = forcing(start + h*(step + {node!r}), theta)"
        for place, node in enumerate(nodes)
    ]
    return "\n".join([*lines, ""])
