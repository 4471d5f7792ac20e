"""Writes lane-packed Runge–Kutta–Nyström steps of order 12: only the forces at positions are evaluated.

With u″ = r u′ + F(u, t) and u = exp(r t/2) q, the equation q″ = r²/4 q + exp(−r t/2) F does not contain a velocity.
Time counts from the start of a step, so that no factor grows. All factors are the same for all steps of a length.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StepperError
from vibrokit.kernels.lanes import ended, lanes_of, steps_of, tabulation
from vibrokit.kernels.nystrom_tableau import NODES, POSITION, STAGES, VELOCITY, WEIGHTS

if TYPE_CHECKING:
    from vibrokit.symbolic.second_order_source import SecondOrderWriter
    from vibrokit.symbolic.source import SceneText

_START, _POINT = ("_u0", "_w0"), ("_x0", "_w0")  # the first pair is that of the motion; forces depend on x only
_SCALE = """@njit(**LINKED)
def prepare(h, theta, room):
    constants = np.zeros((KINDS, 3))
    constants_of(theta, constants)
    for kind in range(KINDS):
        own, turned, damping = constants[kind, 0], constants[kind, 1], constants[kind, 2]
        half = 0.5*(own + damping)
        place = kind*(STAGES + 2)*4
        for stage in range(STAGES + 1):
            after = h*FRACTIONS[stage]
            grown = exp(half*after)
            room[place] = grown*(1.0 + after*(own - half))
            room[place + 1] = grown*after*turned
            room[place + 2] = grown*h*h
            room[place + 3] = half*half if stage == STAGES else 1.0/grown
            place += 4
        room[place] = grown*(own - half)/turned
        room[place + 1] = grown
        room[place + 2] = grown*h/turned
        room[place + 3] = (half - own)/turned
"""
"""Of u and w at the start and of the forces, in u of a stage (rows 0 to STAGES) and in w of the end (the last row)."""


def nystrom_step(text: SceneText) -> list[str]:
    """Pieces of a kernel of Runge–Kutta–Nyström steps; raises StepperError if the flow has no second-order form."""
    writer = text.second_order
    if writer is None:
        raise StepperError(
            f"RKN12 needs forces that do not depend on the velocity, besides linear damping, and the "
            f"{text.flow.value} flow of this scene has others; use RK8 or Order8."
        )
    head = f"STAGES = {STAGES}\nKINDS = {writer.kinds}\nFRACTIONS = np.array({(*NODES.tolist(), 1.0)!r})\n"
    accelerations = writer.text(tuple(text.parameters), forced=text.forced)
    step = steps_of(text, _step(text, writer), STAGES)
    return [head, tabulation(text, NODES.tolist()), accelerations, text.crossed, _SCALE, step]


def nystrom_room(text: SceneText) -> int:
    """Numbers that a step reads: its factors."""
    writer = text.second_order
    assert writer is not None, "the step is written first, and refuses such a flow"
    return _factor(writer.kinds, 0, 0)


def _factor(kind: int, stage: int, number: int) -> int:
    """Place of one of the four factors of a stage of a kind of pair."""
    return (kind * (STAGES + 2) + stage) * 4 + number


def _step(text: SceneText, writer: SecondOrderWriter) -> list[str]:
    """Lines of a step.

    One loop over the lanes holds all stages: a loop for each stage takes twice as long to compile.
    """
    lanes = lanes_of(text)
    lines = ["    for lane in range(LANES):"]
    for n, pair in enumerate(writer.pairs):
        lines += [f"        _u{n}, _w{n} = z[{pair.position * lanes} + lane], z[{pair.velocity * lanes} + lane]"]
    for stage, weights in enumerate(WEIGHTS):
        lines += _stage(text, writer, stage, weights)
    for n, pair in enumerate(writer.pairs):
        end, last = ([f"room[{_factor(pair.kind, row, k)}]" for k in range(4)] for row in (STAGES, STAGES + 1))
        lines += [f"        _x{n} = {end[0]}*_u{n} + {end[1]}*_w{n}{_sum(POSITION, end[2], f'_g{{}}_{n}')}"]
        lines += [f"        z[{pair.position * lanes} + lane] = _x{n}"]
        moved = f"{last[0]}*_u{n} + {last[1]}*_w{n} + {last[3]}*_x{n}"
        lines += [f"        z[{pair.velocity * lanes} + lane] = {moved}{_sum(VELOCITY, last[2], f'_g{{}}_{n}')}"]
    for n, place in enumerate(writer.integrals):
        lines += [f"        z[{place * lanes} + lane] +={_sum(VELOCITY, 'h', f'_r{{}}_{n}').removeprefix(' +')}"]
    return [*lines, *ended(text, _START, _POINT, f"z[{writer.pairs[0].position * lanes} + lane]")]


def _stage(text: SceneText, writer: SecondOrderWriter, stage: int, weights: NDArray[np.float64]) -> list[str]:
    """Lines of a stage: positions `_x`, and from them the scaled forces `_g` and the rates of the integrals `_r`."""
    lines, pairs = [], list(enumerate(writer.pairs))
    for n, pair in pairs:
        row = [f"room[{_factor(pair.kind, stage, k)}]" for k in range(4)]
        lines += [f"        _x{n} = {row[0]}*_u{n} + {row[1]}*_w{n}{_sum(weights, row[2], f'_g{{}}_{n}')}"]
    targets = [*(f"_a{n}" for n, _ in pairs), *(f"_r{stage}_{n}" for n, _ in enumerate(writer.integrals))]
    arguments = [*(f"_x{n}" for n, _ in pairs), *[f"forces[_node + {stage}]"] * text.forced, *text.parameters]
    lines += [f"        {', '.join(targets)}, = accelerations({', '.join(arguments)})"]
    lines += ended(text, _START, _POINT, "_a0") if stage else []
    for n, pair in pairs:
        own, square = (f"room[{_factor(pair.kind, row, 3)}]" for row in (stage, STAGES))
        scaled = f"{own}*(_a{n} + {square}*_x{n})"
        lines += [f"        _g{stage}_{n} = {scaled}"]
    return lines


def _sum(weights: NDArray[np.float64], factor: str, force: str) -> str:
    """Text that adds the weighted forces of the stages, if there are any; `force` has braces for the stage."""
    terms = [f"{float(weight)!r}*{force.format(stage)}" for stage, weight in enumerate(weights) if weight]
    return f" + {factor}*({' + '.join(terms)})" if terms else ""
