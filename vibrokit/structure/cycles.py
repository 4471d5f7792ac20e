"""Limit cycles of scenes without periodic excitation, by Newton's method."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.structure.equilibria import AT_REST, refuse_forcing
from vibrokit.structure.linear_map import linear_map
from vibrokit.structure.newton import Evaluation, newton
from vibrokit.structure.orbits import CONVERGED
from vibrokit.structure.scales import size_of
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 256  # in 2π/ω_n, along a path in which turning points are looked for
_RECURRENCE = 1e-2  # of the extent of the motion: how close it comes to where it was, for Newton's method to begin
_MOST_TURNS = 256  # turning points in one cycle
_MOST_TRIALS = 8  # recurrences from which Newton's method may fail
_LONGEST_STEP = 0.25  # of the duration: what one Newton step may change in it

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Cycle:
    """A closed orbit of a scene without periodic excitation, with its linearisation.

    Attributes
    ----------
    point : array (n,)
        A turning point on it, v = 0; from `find_cycle`, the one of greatest x.
    duration : float
        Time after which it repeats (s).
    monodromy : array (n, n)
        Derivative of the flow over that time. One eigenvalue is 1: that of a shift along the cycle.
    residual : float
        Distance between the point and its image.
    """

    point: Array
    duration: float
    monodromy: Array
    residual: float


def refine_cycle(osc: Oscillator, state: Array, duration: float, stepper: Stepper) -> Cycle:
    """Refine a cycle by Newton's method on the turning point (v = 0) and the duration until the residual stays.

    Parameters
    ----------
    osc : Oscillator
        Without periodic excitation.
    state : array (n,)
        Near a turning point of the cycle; its v is set to 0.
    duration : float
        About the time after which the cycle repeats (s).
    stepper : Stepper

    Returns
    -------
    Cycle

    Raises
    ------
    StructureError
        A scene with periodic excitation, or no cycle so near that the iteration converges to it.
    """
    refuse_forcing(osc)
    guess = np.array(state, dtype=float)
    guess[1] = duration

    def limited(unknowns: Array, steps: Array) -> Array:
        most = _LONGEST_STEP * unknowns[:, 1]
        steps[:, 1] = np.clip(steps[:, 1], -most, most)
        return steps

    (unknowns,), (residual,), (monodromy,) = newton(cycle_equations(osc, stepper), guess[None], limited=limited)
    start = turning_point(guess)
    if not residual <= CONVERGED * (size_of(osc) + float(np.linalg.norm(start))):
        raise StructureError(
            f"Newton's method found no cycle of duration {duration:.6g} s near {tuple(np.round(start, 6).tolist())}: "
            f"the residual is {residual:.1e}. The start is too far away, or the cycle is one of a family; follow the "
            "motion for longer, take a finer stepper, or give the scene damping."
        )
    cycle = Cycle(turning_point(unknowns), float(unknowns[1]), monodromy, float(residual))
    _check_cycle(cycle, VectorField(osc).rate(cycle.point), size_of(osc), stepper)
    return cycle


def cycle_equations(osc: Oscillator, stepper: Stepper) -> Callable[[Array], Evaluation]:
    """Return the equations of one cycle; attached is the derivative of the flow over the duration.

    v is 0 at the turning point, so the duration takes its place among the unknowns.
    """
    field = VectorField(osc)

    def evaluate(unknowns: Array) -> Evaluation:
        start, duration = turning_point(unknowns[0])[None], float(unknowns[0, 1])
        if not duration > 0:
            raise StructureError(f"Newton's method for a limit cycle reached the duration {duration:g} s.")
        found = linear_map(osc, start, stepper, interval=duration)
        jacobians = found.derivatives - np.eye(start.shape[1])
        jacobians[:, :, 1] = field.rate(found.images)
        return Evaluation(found.images - start, jacobians, found.derivatives)

    return evaluate


def turning_point(unknowns: Array) -> Array:
    """Return the state that unknowns stand for, with v = 0 in place of the duration."""
    point = unknowns.copy()
    point[1] = 0.0
    return point


def _check_cycle(cycle: Cycle, rate: Array, size: float, stepper: Stepper) -> None:
    """Refuse an equilibrium, which repeats after any time, and a derivative that does not map the rate to itself."""
    speed = float(np.linalg.norm(rate))
    place = tuple(np.round(cycle.point, 6).tolist())
    if speed * cycle.duration < AT_REST * (size + float(np.linalg.norm(cycle.point))):
        raise StructureError(
            f"Newton's method converged to the equilibrium {place}, not to a cycle; start farther from it."
        )
    carried = float(np.linalg.norm(cycle.monodromy @ rate - rate))
    if carried > 1e-3 * speed * max(1.0, float(np.linalg.norm(cycle.monodromy))):
        raise StructureError(
            f"the cycle through {place} has no multiplier 1: the derivative of its flow is off by "
            f"{carried / speed:.1e}; take a finer stepper than {stepper}."
        )


def find_cycle(osc: Oscillator, state: Array, stepper: Stepper, *, longest: float) -> Cycle:
    """Find the cycle that the motion from a state settles on, by the recurrence of its turning points.

    Parameters
    ----------
    osc : Oscillator
        Without periodic excitation.
    state : array (n,)
        On the cycle or near it.
    stepper : Stepper
    longest : float
        Longest duration of a cycle to look for (s). The motion is followed for twice that time.

    Returns
    -------
    Cycle
        Its point is the turning point of greatest x.

    Raises
    ------
    StructureError
        A scene with periodic excitation, or motion that does not repeat within that time.
    """
    refuse_forcing(osc)
    spacing = osc.time_unit / _SAMPLES
    count = math.ceil(2 * longest / spacing)
    path = record(osc, Flow.STATE, stepper, np.array(state, dtype=float), 0.0, spacing, count)
    extent = float(np.ptp(path[len(path) // 2 :, :2], axis=0).max())
    # From the last turn backwards, where the motion is closest to the cycle.
    before = np.flatnonzero((path[:-1, 1] > 0) & (path[1:, 1] <= 0))[::-1][:_MOST_TURNS]
    turns: list[tuple[float, Array]] = []
    failures: list[StructureError] = []
    for index in before:
        turns.append(_turn(osc, path[index], index * spacing, spacing, stepper))
        (last, here), (time, there) = turns[0], turns[-1]
        if time == last or last - time > longest or float(np.abs(here - there).max()) > _RECURRENCE * extent:
            continue
        highest = max(turns[1:], key=lambda turn: float(turn[1][0]))[1]
        try:
            cycle = refine_cycle(osc, highest, last - time, stepper)
        except StructureError as error:
            failures.append(error)
            if len(failures) == _MOST_TRIALS:
                break
            continue
        off = abs(cycle.duration - (last - time)) / cycle.duration + np.abs(cycle.point - highest).max() / extent
        if off < 10 * _RECURRENCE:
            return cycle
    raise StructureError(
        f"the motion from {tuple(np.round(state, 6).tolist())} does not repeat within {longest:.6g} s, by its last "
        f"{len(turns)} turning points; start nearer to the cycle, or give a longer time than that."
        + (f" Where it came close to doing so: {failures[0]}" if failures else "")
    )


def _turn(osc: Oscillator, state: Array, time: float, spacing: float, stepper: Stepper) -> tuple[float, Array]:
    """Locate the turning point between a sample and the next: its time, and the state there."""

    def after(delay: float) -> Array:
        return run_ensemble(osc, Flow.STATE, stepper, state[None], interval=delay).states[0] if delay else state

    end = after(spacing)
    delay = spacing if end[1] >= 0 else float(brentq(lambda delay: after(delay)[1], 0.0, spacing, xtol=1e-9 * spacing))
    return time + delay, after(delay)
