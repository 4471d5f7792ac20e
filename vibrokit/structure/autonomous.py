"""Equilibria and limit cycles of scenes without periodic excitation, by Newton's method."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
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
from vibrokit.structure.borders import intervals_within
from vibrokit.structure.linear_map import linear_map
from vibrokit.structure.newton import Evaluation, newton, scaled
from vibrokit.structure.orbits import CONVERGED, Orbit
from vibrokit.structure.roots import bracketed_roots
from vibrokit.structure.scales import size_of, units_of
from vibrokit.symbolic.flow_kind import Flow

PARTS_OF_A_TURN = 16
"""Parts of 2π/ω_n: over one of them the motion at an equilibrium is linearized."""
_PLACES = 1024  # at which the force at rest is compared with 0
_ONE_PLACE = 1e-14  # of the range: distance of two results that are one
_AT_REST = 1e-6  # largest relative motion of a state that counts as an equilibrium
_SAMPLES = 256  # in 2π/ω_n, along a path in which turning points are searched for
_RECURRENCE = 1e-2  # of the extent of the motion: distance between turning points from which Newton's method starts
_MOST_TURNS = 256  # turning points in one cycle
_MOST_TRIALS = 8  # recurrences from which Newton's method may fail
_LONGEST_STEP = 0.25  # of the duration: what one Newton step may change in it

Array = NDArray[np.float64]


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
    refuse_forcing(osc)
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


def equilibria(osc: Oscillator, low: float, high: float) -> list[Equilibrium]:
    """Return the equilibria between two places (m), by position: the force at rest changes its sign there.

    A force changes its sign at a pole, too, so each interval between borders of the forces is searched by itself.
    Where the force comes near 0 between the places where it is evaluated and turns back, a node and a saddle next to it
    are both found. A StructureError is raised for a scene with periodic excitation.
    """
    refuse_forcing(osc)
    field, rest = VectorField(osc), np.zeros(1 if osc.noise is None else 1 + len(osc.noise.extra_states))

    def force(places: Array) -> Array:
        states = np.hstack([places[:, None], np.broadcast_to(rest, (len(places), len(rest)))])
        return field.rate(states)[:, 1]

    def force_at(x: float) -> float:
        found = float(force(np.array([x]))[0])
        if not math.isfinite(found):
            raise StructureError(
                f"the force at rest has no value at x = {x:.6g}, where it is needed: a formula is 0/0 there, or "
                "infinite; write it without that division, or give a region without that place."
            )
        return found

    guesses, found = list[float](), list[Equilibrium]()
    for one, other in intervals_within(osc, low, high):
        places = np.linspace(one, other, _PLACES)
        guesses += bracketed_roots(force_at, places, force(places))
    for guess in sorted(guesses):
        with contextlib.suppress(StructureError):  # a force that jumps has no equilibrium where it does
            found.append(refine_equilibrium(osc, np.concatenate([[guess], rest])))
    apart = _ONE_PLACE * (high - low)
    return [one for at, one in enumerate(found) if not at or abs(one.point[0] - found[at - 1].point[0]) > apart]


def equilibrium_exponents(osc: Oscillator, point: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues (s⁻¹) of the vector field's Jacobian at an equilibrium, the fastest growing first.

    A StructureError is raised for a scene with periodic excitation, and for a point that is not at rest.
    """
    refuse_forcing(osc)
    place, field = np.array(point, dtype=float), VectorField(osc)
    exponents = np.linalg.eigvals(field.jacobian(place)).astype(complex)
    speed = float(np.linalg.norm(field.rate(place)))
    fastest = max(float(np.abs(exponents).max()), 1.0 / osc.time_unit)
    if not speed <= _AT_REST * fastest * (size_of(osc) + float(np.linalg.norm(place))):
        raise StructureError(
            f"{tuple(np.round(place, 6).tolist())} is not an equilibrium: the state moves at {speed:.2e} per second "
            "there; give a point at rest."
        )
    return exponents[np.argsort(-exponents.real, kind="stable")]


def refuse_forcing(osc: Oscillator) -> None:
    """Raise StructureError for a scene with periodic excitation."""
    if not osc.autonomous:
        raise StructureError(
            f"the scene has periodic excitation (period {osc.section_interval:.6g} s), and only scenes without it "
            "have cycles and equilibria; ask for its periodic orbits."
        )


class Cycle(Orbit):
    """A closed orbit of a scene without periodic excitation, from a turning point (v = 0); its period is 1.

    One eigenvalue of its monodromy matrix is 1: that of a shift along the cycle.
    """

    kind: ClassVar[str] = "limit cycle"

    def refined(self, osc: Oscillator, stepper: Stepper) -> Cycle:
        """Return the cycle that Newton's method finds from here with another stepper; may raise StructureError."""
        return refine_cycle(osc, self.point, self.duration, stepper)


def refine_cycle(osc: Oscillator, state: Array, duration: float, stepper: Stepper) -> Cycle:
    """Refine a cycle by Newton's method on the turning point (v = 0) and the duration until the residual stays.

    `state` is near a turning point of the cycle; its v is set to 0. A StructureError is raised for a scene with
    periodic excitation, and if the iteration does not converge to a cycle.
    """
    refuse_forcing(osc)
    guess = np.array(state, dtype=float)
    guess[1] = duration

    def limited(unknowns: Array, steps: Array) -> Array:
        most = _LONGEST_STEP * unknowns[:, 1]
        steps[:, 1] = np.clip(steps[:, 1], -most, most)
        return steps

    units, start = units_of(osc), turning_point(guess)
    equations = scaled(cycle_equations(osc, stepper), units)
    (unknowns,), (residual,), (monodromy,) = newton(equations, guess[None], limited=limited)
    if not residual <= CONVERGED * (1.0 + float(np.linalg.norm(start / units))):
        raise StructureError(
            f"Newton's method found no cycle of duration {duration:.6g} s near {tuple(np.round(start, 6).tolist())}: "
            f"the residual is {residual:.1e}. The start is too far away, or the cycle is one of a family; follow the "
            "motion for longer, take a finer stepper, or give the scene damping."
        )
    cycle = Cycle(turning_point(unknowns)[None], 1, float(unknowns[1]), monodromy[None], float(residual))
    check_cycle(cycle, VectorField(osc).rate(cycle.point), size_of(osc), stepper)
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


def check_cycle(cycle: Orbit, rate: Array, size: float, stepper: Stepper) -> None:
    """Refuse an equilibrium, which repeats after any time, and a derivative that does not map the rate to itself.

    A StructureError is raised for both.
    """
    speed = float(np.linalg.norm(rate))
    place = tuple(np.round(cycle.point, 6).tolist())
    if speed * cycle.duration < _AT_REST * (size + float(np.linalg.norm(cycle.point))):
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
    turning point of greatest x. A StructureError is raised for a scene with periodic excitation, and for motion that
    does not repeat within that time.
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
