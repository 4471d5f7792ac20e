"""Motion of scenes without periodic excitation: limit cycles by Newton's method, and the rates at equilibria."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import RAN_OUT
from vibrokit.oscillator import Oscillator
from vibrokit.structure.scales import size_of
from vibrokit.symbolic.flow_kind import Flow

_ITERATIONS = 30
_SAMPLES = 256  # in 2π/ω_n, along a path in which turning points are looked for
_RECURRENCE = 1e-2  # of the extent of the motion: how close it comes to where it was, for Newton's method to begin
_MOST_TURNS = 256  # turning points in one cycle
_MOST_TRIALS = 8  # recurrences from which Newton's method may fail
_CONVERGED = 1e-6
_FRACTION = 1 / 256  # of the shortest time scale at an equilibrium: one step of any stepper is exact there
_AT_REST = 1e-6

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
    _refuse_forcing(osc)
    point = np.array(state, dtype=float)
    point[1] = 0.0
    guess, start = duration, point
    best: Cycle | None = None
    for _ in range(_ITERATIONS):
        image, monodromy = _carried(osc, point, duration, stepper)
        residual = float(np.linalg.norm(image - point))
        if not math.isfinite(residual) or (best is not None and residual >= best.residual):
            break
        best = Cycle(point, duration, monodromy, residual)
        # v stays 0 at the turning point, and its column makes room for the derivative with respect to the duration.
        matrix = monodromy - np.eye(len(point))
        matrix[:, 1] = _rate(osc, image, stepper)
        try:
            step = np.linalg.solve(matrix, point - image)
        except np.linalg.LinAlgError:
            break
        duration += float(np.clip(step[1], -0.25 * duration, 0.25 * duration))
        step[1] = 0.0
        point = point + step
    found = "no finite image" if best is None else f"a residual of {best.residual:.1e}"
    if best is None or best.residual > _CONVERGED * (size_of(osc) + float(np.linalg.norm(start))):
        raise StructureError(
            f"Newton's method found no cycle of duration {guess:.6g} s near {tuple(np.round(start, 6).tolist())}: "
            f"{found}. The start is too far off, or the cycle is one of a family; wait longer, take a finer stepper, "
            "or give the scene damping."
        )
    _check_cycle(osc, best, stepper)
    return best


def _check_cycle(osc: Oscillator, cycle: Cycle, stepper: Stepper) -> None:
    """Refuse an equilibrium, which repeats after any time, and a derivative that does not carry the flow along."""
    rate = _rate(osc, cycle.point, stepper)
    speed = float(np.linalg.norm(rate))
    place = tuple(np.round(cycle.point, 6).tolist())
    if speed * cycle.duration < _AT_REST * (size_of(osc) + float(np.linalg.norm(cycle.point))):
        raise StructureError(
            f"Newton's method came to the equilibrium {place}, not to a cycle; start farther from the equilibrium."
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
    _refuse_forcing(osc)
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


def equilibrium_exponents(osc: Oscillator, point: Array, stepper: Stepper) -> NDArray[np.complex128]:
    """Return the eigenvalues of the flow linearised at an equilibrium.

    They are the logarithms of the multipliers over a time so short, against the fastest of them, that no logarithm is
    off by a turn, divided by that time.

    Parameters
    ----------
    osc : Oscillator
        Without periodic excitation.
    point : array (n,)
        The equilibrium.
    stepper : Stepper

    Returns
    -------
    complex array (n,)
        In s⁻¹, the fastest growing first. A multiple eigenvalue, as at critical damping, is known to about 1e-6 of the
        fastest one, others to 1e-11.

    Raises
    ------
    StructureError
        A scene with periodic excitation, or a point that is not at rest.
    """
    _refuse_forcing(osc)
    place = np.array(point, dtype=float)
    time = 1e-12 * osc.time_unit
    fastest = 0.0
    for _ in range(_ITERATIONS):
        image, multipliers = _carried(osc, place, time, stepper)
        if not np.isfinite(multipliers).all():  # too short a time for the stepper to find its way in a contact
            time *= 4
            continue
        fastest = float(np.abs(np.linalg.eigvals(multipliers) - 1.0).max()) / time
        if time * fastest > 0.5 * _FRACTION or time > _FRACTION * osc.time_unit:
            break
        time = min(4 * time, _FRACTION / max(fastest, 1e-300))
    moved = float(np.linalg.norm(image - place))
    if not moved <= _AT_REST * time * max(fastest, 1.0 / osc.time_unit) * (size_of(osc) + float(np.linalg.norm(place))):
        raise StructureError(
            f"{tuple(np.round(place, 6).tolist())} is no equilibrium: the state moves at {moved / time:.2e} per second "
            "there; give a point at rest."
        )
    exponents = np.log(np.linalg.eigvals(multipliers).astype(complex)) / time
    return exponents[np.argsort(-exponents.real, kind="stable")]


def _carried(osc: Oscillator, point: Array, duration: float, stepper: Stepper) -> tuple[Array, Array]:
    """Return the image of a point after some time, and the derivative of the flow."""
    size = len(point)
    start = np.concatenate([point, np.eye(size).ravel()])
    ended = run_ensemble(osc, Flow.STATE_VARIATIONAL, stepper, start[None], interval=duration)
    if ended.status[0] != RAN_OUT:
        return np.full(size, np.nan), np.full((size, size), np.nan)
    return ended.states[0, :size], ended.states[0, size:].reshape(size, size)


def _rate(osc: Oscillator, point: Array, stepper: Stepper) -> Array:
    """Time derivative of the state, from the flow over a short time and over twice that."""
    short = 1e-5 * osc.time_unit
    once, twice = (
        run_ensemble(osc, Flow.STATE, stepper, point[None], interval=time).states[0] for time in (short, 2 * short)
    )
    return (4 * once - 3 * point - twice) / (2 * short)


def _refuse_forcing(osc: Oscillator) -> None:
    if not osc.autonomous:
        raise StructureError(
            f"the scene has periodic excitation (period {osc.section_interval:.6g} s), and cycles and equilibria are "
            "of scenes without; ask for its periodic orbits."
        )
