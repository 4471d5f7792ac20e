"""Writes the lane-packed Runge–Kutta step: many trajectories of one scene, side by side in vector registers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

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


def lane_count(text: SceneText) -> int:
    """Lanes of one block: few enough that their numbers stay in the nearest cache."""
    return 32 if len(text.variables) <= _FEW_EQUATIONS else 16


def lane_step(text: SceneText) -> str:
    """Function `step_lanes(z, f0, f1, f2, first, second, theta, h)`: one step of every lane.

    `z` has shape (EQUATIONS, LANES); f0, f1, f2 is the forcing at the step's start, middle and end, the same for
    all lanes because they share the phase; first, second are two standard normals for each lane. A scene without
    forcing and a flow without noise have no such arguments. `draw_lanes(streams, first, second)` draws the normals.

    LLVM turns loops into vector code before it inlines, so each function here asks for wide registers itself, and knows
    the number of lanes.

    The step is a classical Runge–Kutta step, between two kicks where there is noise. With U₁, U₂ standard normal,
    ΔW = √h U₁ and ΔZ = ½ h^(3/2) (U₁ + U₂/√3) have the right joint law.
    """
    names = text.variables
    noisy = bool(text.amplitude)
    driven = names[text.states - 1]
    arguments = ["z", *(_FORCES if text.forced else []), *(_NORMALS if noisy else []), "theta", "h"]
    lines = [_REGISTERS, f"LANES = {lane_count(text)}", *(_DRAWING if noisy else []), "", ""]
    lines += ["@njit(**INLINED)", f"def step_lanes({', '.join(arguments)}):"]
    lines += ["    use_widest_registers()"]
    lines += [f"    {name} = theta[{place}]" for name, place in text.parameters.items()]
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


def tabulation(text: SceneText) -> str:
    """Function `tabulate(start, h, theta, table)`: the forcing at every half step; nothing without forcing."""
    if not text.forced:
        return ""
    return "\n".join(
        [
            "@njit(**INLINED)",
            "def tabulate(start, h, theta, table):",
            "    for half in range(table.size):",
            "        table[half] = forcing(start + 0.5*h*half, theta)",
            "",
        ]
    )
