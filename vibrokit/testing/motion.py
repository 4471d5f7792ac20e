"""Short motions of a scene with a part, against SciPy and against a quadrature."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from vibrokit.oscillator import Oscillator
from vibrokit.parts.part import Part
from vibrokit.testing.report import ConformanceError

SAME = 1e-6  # of the size of the motion; single trajectories have 1e-10 in each step
_MOST_EVALUATIONS = 200_000
_LARGEST = 1e3  # a motion beyond it is left alone: the reference loses its digits, too
_FUNCTIONS = {"Max": max, "Min": min, "Abs": abs, "sign": lambda x: float(np.sign(x))}

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """A motion from a start over a time (s), and the rates of the state that the formula of the part gives."""

    part: Part
    scene: Oscillator
    start: tuple[float, ...]
    duration: float
    rates: Callable[[float, Array], Sequence[float]]


class _Unfinished(Exception):
    """The reference takes too many steps."""


def numeric(
    formula: sympy.Expr, arguments: Sequence[sympy.Symbol], values: Mapping[sympy.Symbol, float]
) -> Callable[..., float]:
    """Return a formula as a function of Python's numbers."""
    raw = sympy.lambdify([*arguments, *values], formula, modules=[_FUNCTIONS, "math"], dummify=True)
    numbers = tuple(values.values())
    return lambda *point: float(raw(*point, *numbers))


def follow(motions: Iterable[Motion]) -> str:
    """Compare trajectories with SciPy's; return a remark, or raise ConformanceError."""
    worst, left_out = 0.0, 0
    for motion in motions:
        ended = reference_end(motion)
        if ended is None:
            left_out += 1
            continue
        path = motion.scene.trajectory(motion.start, duration=motion.duration, samples=4)
        found = np.array([path.x[-1], path.v[-1], *path.states[-1, 2:]])
        worst = max(worst, compare(motion.part, motion.duration, found, ended, SAME))
    skipped = f", {left_out} that run away or are too stiff left out" if left_out else ""
    return f"within {worst:.1g} of SciPy{skipped}"


def compare(part: Part, duration: float, found: Array, ended: tuple[Array, float], same: float) -> float:
    """Return the distance of two ends of a motion in units of its size; raise ConformanceError if it is too large."""
    expected, size = ended
    distance = float(np.abs(found - expected).max()) / size
    if not distance <= same:
        raise ConformanceError(
            f"A scene with {part!r} moves to {found.tolist()} in {duration:.6g} s, but its formula gives "
            f"{expected.tolist()}; write a formula that steppers can follow, without pulses or turns that are too "
            "short for them."
        )
    return distance


def reference_end(motion: Motion) -> tuple[Array, float] | None:
    """The end of a motion by DOP853 and its size; None if it runs away or takes too many steps."""
    evaluations = 0

    def rates(t: float, state: Array) -> Sequence[float]:
        nonlocal evaluations
        evaluations += 1
        if evaluations > _MOST_EVALUATIONS or np.abs(state).max() > _LARGEST:
            raise _Unfinished
        return motion.rates(t, state)

    span, shortest = (0.0, motion.duration), motion.duration / 50
    try:
        solved = solve_ivp(rates, span, motion.start, method="DOP853", rtol=1e-12, atol=1e-14, max_step=shortest)
    except (_Unfinished, ArithmeticError, ValueError):
        return None
    return (solved.y[:, -1], float(np.abs(solved.y).max())) if solved.success else None
