"""Equilibria and limit cycles of scenes without periodic excitation, by Newton's method."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import brentq

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.structure.along_x import states_at, turn_of, wrapped
from vibrokit.structure.linear_map import linear_map
from vibrokit.structure.newton import Evaluation, newton, scaled
from vibrokit.structure.orbits import CONVERGED, EQUAL, Orbit
from vibrokit.structure.rest import SteadyForce
from vibrokit.structure.scales import size_of, units_of
from vibrokit.symbolic.flow_kind import Flow

PARTS_OF_A_TURN = 16
"""Parts of 2π/ω_n: over one of them the motion at an equilibrium is linearized."""
_RECURRENCE = 1e-2  # of the extent of the motion: distance of two passages from which Newton's method starts

Array = NDArray[np.float64]
Passage = tuple[float, Array]
"""A time (s), and the state then."""


class Equilibrium(Orbit):
    """An equilibrium of a scene without periodic excitation; its period is 1, its duration 0.

    Its monodromy matrix is that over a sixteenth of 2π/ω_n, in which deviations stay moderate, and its residual is the
    distance that its rate of change would cover in that time.
    """

    kind: ClassVar[str] = "equilibrium"

    def refined(self, osc: Oscillator, stepper: Stepper) -> Equilibrium:
        """Return the equilibrium itself, which does not depend on the stepper."""
        return self


def equilibrium_equations(osc: Oscillator) -> Callable[[Array], Evaluation]:
    """Return the equations of an equilibrium, b τ = 0 with τ a sixteenth of 2π/ω_n; attached is the Jacobian of b τ."""
    field, time = VectorField(osc), osc.section_interval / PARTS_OF_A_TURN

    def evaluate(states: Array) -> Evaluation:
        jacobians = time * field.jacobian(states)
        return Evaluation(time * field.rate(states), jacobians, jacobians)

    return evaluate


def refine_equilibrium(osc: Oscillator, guess: Array) -> Equilibrium:
    """Refine an equilibrium by Newton's method on the vector field until the residual no longer falls.

    A StructureError is raised for a scene with periodic excitation, and if no equilibrium is near the guess.
    """
    _refuse_forcing(osc)
    units = units_of(osc)
    (point,), (residual,), (jacobian,) = newton(scaled(equilibrium_equations(osc), units), guess[None])
    if not residual <= CONVERGED * (1.0 + float(np.linalg.norm(guess / units))):
        raise StructureError(
            f"Newton's method found no equilibrium near {tuple(np.round(guess, 6).tolist())}: the residual is "
            f"{residual:.1e}; start nearer to one."
        )
    if not np.isfinite(jacobian).all():
        raise StructureError(
            f"the forces have no finite derivative at the equilibrium {tuple(np.round(point, 6).tolist())}, so its "
            "stability is not known; write them with a finite slope there."
        )
    # Balanced: a stiff stop makes the rate of v huge in units of x, which would cost as many digits.
    balanced, balance = scipy.linalg.matrix_balance(jacobian, permute=False)
    monodromy = balance @ scipy.linalg.expm(balanced) @ np.linalg.inv(balance)
    return Equilibrium(point[None], 1, 0.0, monodromy[None], float(residual))


def equilibria(osc: Oscillator, low: float, high: float) -> tuple[Equilibrium, ...]:
    """Return the equilibria between two places (m), by position: the force at rest changes its sign there.

    A StructureError is raised for a scene with periodic excitation.
    """
    _refuse_forcing(osc)
    found = list[Equilibrium]()
    for state in states_at(osc, np.array([(place, 0.0) for place in SteadyForce(osc).zeros(low, high)]).reshape(-1, 2)):
        with contextlib.suppress(StructureError):  # a force that jumps has no equilibrium where it does
            rest = refine_equilibrium(osc, state)
            if not found or abs(rest.point[0] - found[-1].point[0]) > 1e-14 * (high - low):
                found.append(rest)
    return tuple(found)


def equilibrium_exponents(osc: Oscillator, point: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues (s⁻¹) of the vector field's Jacobian at an equilibrium, the fastest growing first.

    A StructureError is raised for a scene with periodic excitation, and for a point that is not at rest.
    """
    _refuse_forcing(osc)
    place, field = np.array(point, dtype=float), VectorField(osc)
    exponents = np.linalg.eigvals(field.jacobian(place)).astype(complex)
    speed = float(np.linalg.norm(field.rate(place)))
    fastest = max(float(np.abs(exponents).max()), 1.0 / osc.time_unit)
    if not speed <= EQUAL * fastest * (size_of(osc) + float(np.linalg.norm(place))):
        raise StructureError(
            f"{tuple(np.round(place, 6).tolist())} is not an equilibrium: the state moves at {speed:.2e} per second "
            "there; give a point at rest."
        )
    return exponents[np.argsort(-exponents.real, kind="stable")]


def _refuse_forcing(osc: Oscillator) -> None:
    if not osc.autonomous:
        raise StructureError(
            f"the scene has periodic excitation (period {osc.section_interval:.6g} s), and only scenes without it "
            "have cycles and equilibria; ask for its periodic orbits."
        )


@dataclasses.dataclass(frozen=True, eq=False)
class Cycle(Orbit):
    """A closed orbit of a scene without periodic excitation; its period is 1.

    It starts at a turning point (v = 0); motion that turns over has none, and starts at some x. One eigenvalue of its
    monodromy matrix is 1: that of a shift along the cycle.
    """

    kind: ClassVar[str] = "limit cycle"

    pinned: int = 1  # the coordinate that is given at the start: v, or x where motion turns over

    def refined(self, osc: Oscillator, stepper: Stepper) -> Cycle:
        """Return the cycle that Newton's method finds from here with another stepper; may raise StructureError."""
        return refine_cycle(osc, self.point, self.duration, stepper, pinned=self.pinned)


def refine_cycle(osc: Oscillator, state: Array, duration: float, stepper: Stepper, *, pinned: int = 1) -> Cycle:
    """Refine a cycle by Newton's method on its start and the duration until the residual stays.

    `state` is near a turning point of the cycle, and its v is set to 0; where x is pinned, that stays what it is. A
    StructureError is raised for a scene with periodic excitation, and if the iteration does not converge to a cycle.
    """
    _refuse_forcing(osc)
    start = np.array(state, dtype=float)
    start[pinned] *= pinned == 0
    guess = _with(start, pinned, duration)

    def limited(unknowns: Array, steps: Array) -> Array:
        most = 0.25 * unknowns[:, pinned]
        steps[:, pinned] = np.clip(steps[:, pinned], -most, most)
        return steps

    units = units_of(osc)
    equations = scaled(cycle_equations(osc, stepper, pinned, start[pinned]), units)
    (unknowns,), (residual,), (monodromy,) = newton(equations, guess[None], limited=limited)
    if not residual <= CONVERGED * (1.0 + float(np.linalg.norm(start / units))):
        raise StructureError(
            f"Newton's method found no cycle of duration {duration:.6g} s near {tuple(np.round(start, 6).tolist())}: "
            f"the residual is {residual:.1e}. The start is too far away, or the cycle is one of a family; follow the "
            "motion for longer, take a finer stepper, or give the scene damping."
        )
    point, duration = _with(unknowns, pinned, start[pinned]), float(unknowns[pinned])
    cycle = Cycle(point[None], 1, duration, monodromy[None], float(residual), pinned)
    _check(cycle, VectorField(osc).rate(point), size_of(osc), stepper)
    return cycle


def cycle_equations(
    osc: Oscillator, stepper: Stepper, pinned: int = 1, level: float = 0.0
) -> Callable[[Array], Evaluation]:
    """Return the equations of one cycle; attached is the derivative of the flow over the duration.

    A coordinate of the start is given, so that the duration takes its place among the unknowns.
    """
    field = VectorField(osc)

    def evaluate(unknowns: Array) -> Evaluation:
        start, duration = _with(unknowns, pinned, level), float(unknowns[0, pinned])
        if not duration > 0:
            raise StructureError(f"Newton's method for a limit cycle reached the duration {duration:g} s.")
        found = linear_map(osc, start, stepper, interval=duration)
        jacobians = found.derivatives - np.eye(start.shape[1])
        jacobians[:, :, pinned] = field.rate(found.images)
        return Evaluation(wrapped(osc, found.images - start), jacobians, found.derivatives)

    return evaluate


def _with(states: Array, coordinate: int, value: float) -> Array:
    changed = states.copy()
    changed[..., coordinate] = value
    return changed


def _check(cycle: Cycle, rate: Array, size: float, stepper: Stepper) -> None:
    """Refuse an equilibrium, which repeats after any time, and a derivative that does not map the rate to itself."""
    speed = float(np.linalg.norm(rate))
    place = tuple(np.round(cycle.point, 6).tolist())
    if speed * cycle.duration < EQUAL * (size + float(np.linalg.norm(cycle.point))):
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

    The motion is followed for twice `longest`, the longest duration of a cycle (s). The point of the cycle is the
    turning point of greatest x, or x = 0 if it turns over. A StructureError is raised for a scene with periodic
    excitation, and for motion that does not repeat within that time.
    """
    _refuse_forcing(osc)
    start, spacing = np.array(state, dtype=float), osc.time_unit / 256
    path = record(osc, Flow.STATE, stepper, start, 0.0, spacing, math.ceil(2 * longest / spacing))
    for speed, duration in _turning_over(osc, path, spacing):
        with contextlib.suppress(StructureError):
            return refine_cycle(osc, np.array([0.0, speed, *path[-1, 2:]]), duration, stepper, pinned=0)
    extent = float(np.ptp(path[len(path) // 2 :, :2], axis=0).max())
    failures = list[StructureError]()
    for highest, duration in _recurrences(_turning_points(osc, path, spacing, stepper), longest, extent):
        try:
            cycle = refine_cycle(osc, highest, duration, stepper)
        except StructureError as error:
            failures.append(error)
            if len(failures) == 8:
                break
            continue
        off = abs(cycle.duration - duration) / cycle.duration + np.abs(cycle.point - highest).max() / extent
        if off < 10 * _RECURRENCE:
            return cycle
    raise StructureError(
        f"the motion from {tuple(np.round(state, 6).tolist())} does not repeat within {longest:.6g} s, by its last "
        "turning points; start nearer to the cycle, or give a longer time than that."
        + (f" Where it came close to doing so: {failures[0]}" if failures else "")
    )


def _recurrences(turns: Iterator[Passage], longest: float, extent: float) -> Iterator[tuple[Array, float]]:
    """The highest turning point since each one near the last, and the time since then; the last turn comes first."""
    since = list[Passage]()
    last, here = next(turns, (0.0, np.empty(0)))
    for time, there in turns:
        since.append((time, there))
        if last - time <= longest and float(np.abs(here - there).max()) <= _RECURRENCE * extent:
            yield max(since, key=lambda turn: float(turn[1][0]))[1], last - time


def _turning_points(osc: Oscillator, path: Array, spacing: float, stepper: Stepper) -> Iterator[Passage]:
    """Locate the last turning points of greatest x, from the end backwards, where motion is closest to the cycle."""

    def after(state: Array, delay: float) -> Array:
        return run_ensemble(osc, Flow.STATE, stepper, state[None], interval=delay).states[0] if delay else state

    for index in np.flatnonzero((path[:-1, 1] > 0) & (path[1:, 1] <= 0))[::-1][:256]:
        start, delay = path[index], spacing
        if after(start, spacing)[1] < 0:
            delay = float(brentq(lambda delay, start=start: after(start, delay)[1], 0.0, spacing, xtol=1e-9 * spacing))
        yield index * spacing + delay, after(start, delay)


def _turning_over(osc: Oscillator, path: Array, spacing: float) -> Iterator[tuple[float, float]]:
    """The speed at x = 0 and the duration of motion that turns over, by its last passages; nothing if it does not."""
    turn, (x, v) = turn_of(osc), path[:, :2].T
    turns = np.floor(x / turn) if turn else np.zeros(len(x))
    passed = np.flatnonzero(np.diff(turns))[-17:]
    if len(passed) < 2 or len(set(np.sign(np.diff(turns)[passed]).tolist())) != 1:
        return
    levels = turn * np.maximum(turns[passed], turns[passed + 1])
    parts = (levels - x[passed]) / (x[passed + 1] - x[passed])
    speeds, times = v[passed] + parts * (v[passed + 1] - v[passed]), spacing * (passed + parts)
    for back in range(2, len(passed) + 1):
        if abs(speeds[-1] - speeds[-back]) < _RECURRENCE * np.abs(speeds).max():
            yield float(speeds[-1]), float(times[-1] - times[-back])
            return
