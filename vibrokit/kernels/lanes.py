"""Writes the lane-packed Runge–Kutta step: many trajectories of one scene, side by side in vector registers."""

from __future__ import annotations

import math

from vibrokit.symbolic.scene_text import SceneText

_FEW_EQUATIONS = 8
_ROOT_THIRD = 1 / math.sqrt(3)
_STAGES = (("", ""), ("0.5*h*", "k1_"), ("0.5*h*", "k2_"), ("h*", "k3_"))


def lane_count(text: SceneText) -> int:
    """Lanes of one block: few enough that their numbers stay in the nearest cache."""
    return 32 if len(text.variables) <= _FEW_EQUATIONS else 16


def lane_step(text: SceneText) -> str:
    """Function `step_lanes(z, f0, f1, f2, theta, h)`: one classical Runge–Kutta step of every lane.

    `z` has shape (EQUATIONS, LANES); f0, f1, f2 is the forcing at the step's start, middle and end, the same for
    all lanes because they share the phase.
    """
    names = text.variables
    forces = "f0, f1, f2, " if text.forced else ""
    lines = [f"LANES = {lane_count(text)}", "", "", "@njit(**OPTIONS)", f"def step_lanes(z, {forces}theta, h):"]
    lines += [f"    {name} = theta[{place}]" for name, place in text.parameters.items()]
    lines += ["    for lane in range(LANES):"]
    lines += [f"        {name} = z[{index}, lane]" for index, name in enumerate(names)]
    for stage, (factor, before) in enumerate(_STAGES, start=1):
        point = [f"{name} + {factor}{before}{name}" if before else name for name in names]
        force = [f"f{(stage // 2)}"] if text.forced else []
        targets = ", ".join(f"k{stage}_{name}" for name in names)
        lines.append(f"        {targets} = derivative({', '.join([*point, *force, *text.parameters])})")
    for index, name in enumerate(names):
        slopes = f"k1_{name} + 2.0*(k2_{name} + k3_{name}) + k4_{name}"
        lines.append(f"        z[{index}, lane] = {name} + h/6.0*({slopes})")
    return "\n".join([*lines, ""])


def tabulation(text: SceneText) -> str:
    """Function `tabulate(start, h, theta, table)`: the forcing at every half step; nothing without forcing."""
    if not text.forced:
        return ""
    return "\n".join(
        [
            "@njit(**OPTIONS)",
            "def tabulate(start, h, theta, table):",
            "    for half in range(table.size):",
            "        table[half] = forcing(start + 0.5*h*half, theta)",
            "",
        ]
    )


def kicks(text: SceneText) -> str:
    """Functions `kick_before` and `kick_after`: the noise of one step, in two parts.

    With U₁, U₂ standard normal, ΔW = √h U₁ and ΔZ = ½ h^(3/2) (U₁ + U₂/√3) have the right joint law.
    """
    driven = text.states - 1
    milstein = " + 0.5*size*slope(x, v, theta)*h*(first[lane]*first[lane] - 1.0)" if text.slope else ""
    return f"""
@njit(**OPTIONS)
def kick_before(z, first, second, theta, h, later):
    half = 0.5*sqrt(h)
    for lane in range(LANES):
        x = z[0, lane]
        v = z[1, lane]
        size = amplitude(x, v, theta)
        z[{driven}, lane] += half*size*(first[lane] + {_ROOT_THIRD!r}*second[lane])
        later[lane] = half*size*(first[lane] - {_ROOT_THIRD!r}*second[lane]){milstein}


@njit(**OPTIONS)
def kick_after(z, later):
    for lane in range(LANES):
        z[{driven}, lane] += later[lane]
"""
