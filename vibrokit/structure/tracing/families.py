"""Families of steady motions: an orbit, an equilibrium or a limit cycle at every value of one parameter."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.flow_kind import Flow

_ITERATIONS = 12
_CLOSED = 1e-9  # residual of a member, relative to the sizes of the coordinates
_NUDGE = 1e-4  # share of the span that a derivative in the parameter is taken over
_MOMENT = 1e-4  # share of a cycle's duration that its rate of change is taken over
_ONE_ORBIT = 1e-5  # the same for an orbit and its image after a part of its period
_RESTING = 1e-2  # of the sizes: motion in a cycle's duration below which it is none
_SHORT = 0.25  # how far from the identity the flow that tells an equilibrium may be

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Member:
    """One steady motion of a family.

    Attributes
    ----------
    value : float
        Of the parameter.
    place : array (n + 1,)
        Unknowns in units of their sizes, then the value in units of the span.
    point : array (n,)
        On the section.
    duration : float
        Time after which it is compared with itself (s).
    monodromy : array (n, n)
        Derivative of the flow over the duration.
    defect : array (n,)
        Image of the point less the point.
    jacobian : array (n, n)
        Derivative of the defect in the unknowns, each in units of its size.
    """

    value: float
    place: Array
    point: Array
    duration: float
    monodromy: Array
    defect: Array
    jacobian: Array

    @property
    def residual(self) -> float:
        """Distance of the point from its image."""
        return float(np.linalg.norm(self.defect))


@dataclasses.dataclass(frozen=True, eq=False)
class Family:
    """Steady motions of one kind, as the solutions of defect(unknowns, value) = 0.

    The unknowns are the point; for a limit cycle the point is a turning point, whose velocity is 0, and its duration
    takes the place of the velocity.

    Attributes
    ----------
    osc : Oscillator
    path : str
        Of the parameter.
    kind : str
        ``"periodic"``, ``"equilibrium"`` or ``"limit cycle"``.
    period : int
        In forcing periods, for periodic ones.
    sizes : array (n,)
        By which the unknowns are measured.
    span : float
        By which the parameter is measured.
    middle : float
        A value between those that will be asked for.
    stepper : Stepper
    interval : float
        For equilibria: time over which the flow is looked at (s).
    """

    osc: Oscillator
    path: str
    kind: str
    period: int
    sizes: Array
    span: float
    middle: float
    stepper: Stepper
    interval: float = 0.0

    def at(self, value: float) -> Oscillator:
        """Return the scene at a value of the parameter."""
        return self.osc.replace({self.path: value})

    def place_of(self, unknowns: Array, value: float) -> Array:
        """Return unknowns and value, each in its unit."""
        return np.append(unknowns / self.sizes, value / self.span)

    def member(self, place: Array) -> Member:
        """Evaluate the defect and its derivatives at a place, which need not be on the family."""
        value, unknowns = float(place[-1] * self.span), place[:-1] * self.sizes
        osc, (point, duration) = self.at(value), self._start(unknowns)
        if self.kind == "periodic":
            duration = self.period * osc.section_interval
        size = len(point)
        start = np.concatenate([point, np.eye(size).ravel()])
        image = self._flow(osc, Flow.STATE_VARIATIONAL, start, duration)
        monodromy = image[size:].reshape(size, size)
        jacobian = monodromy - np.eye(size)
        if self.kind == "limit cycle":
            jacobian[:, 1] = self._rate(osc, image[:size], duration)
            if duration * np.abs(jacobian[:, 1] / self.sizes).max() < _RESTING:
                raise StructureError("Newton's method for a limit cycle came to an equilibrium.")
        defect = image[:size] - point
        return Member(value, place, point, duration, monodromy, defect, jacobian * self.sizes)

    def corrected(self, guess: Array, slope: Array, normal: Array) -> Member:
        """Return the member on the plane through a guess, by Newton's method until the residual no longer falls.

        Parameters
        ----------
        guess : array (n + 1,)
        slope : array (n,)
            Derivative of the defect in the parameter, in units of the span; it need not be exact.
        normal : array (n + 1,)
            Of the plane.

        Raises
        ------
        StructureError
            The iteration did not come near any member.
        """
        best, place = None, guess
        for _ in range(_ITERATIONS):
            member = self.member(place)
            if not np.isfinite(member.residual) or (best is not None and member.residual >= best.residual):
                break
            best = member
            matrix = np.vstack([np.column_stack([member.jacobian, slope]), normal])
            try:
                place = place + np.linalg.solve(matrix, np.append(-member.defect, normal @ (guess - place)))
            except np.linalg.LinAlgError:
                break
        if best is None or best.residual > _CLOSED * float(np.linalg.norm(self.sizes)):
            value = float(guess[-1] * self.span)
            raise StructureError(f"Newton's method found no {self.kind} motion near {self.path} = {value:g}.")
        return best

    def slope(self, member: Member) -> Array:
        """Return the derivative of the defect in the parameter, in units of the span: a difference, inwards."""
        step = np.copysign(_NUDGE, self.middle - member.value)
        osc = self.at(member.value + step * self.span)
        duration = self.period * osc.section_interval if self.kind == "periodic" else member.duration
        image = self._flow(osc, Flow.STATE, member.point, duration)
        return (image - member.point - member.defect) / step

    def closes_early(self, member: Member) -> bool:
        """Whether an orbit repeats after a part of its period: then it is of another family, which this one met."""
        if self.kind != "periodic":
            return False
        osc = self.at(member.value)
        for parts in (parts for parts in range(2, self.period + 1) if self.period % parts == 0):
            shorter = dataclasses.replace(self, period=self.period // parts)
            image = shorter._flow(osc, Flow.STATE, member.point, 0.0)
            if np.linalg.norm((image - member.point) / self.sizes) < _ONE_ORBIT:
                return True
        return False

    def tangent(self, member: Member, slope: Array, ahead: Array) -> Array:
        """Return the unit tangent of the family at a member, on the side of `ahead`."""
        tangent: Array = np.linalg.svd(np.column_stack([member.jacobian, slope]))[2][-1]
        return tangent if tangent @ ahead >= 0 else -tangent

    def _start(self, unknowns: Array) -> tuple[Array, float]:
        if self.kind != "limit cycle":
            return unknowns, self.interval
        if not unknowns[1] > 0:
            raise StructureError(f"Newton's method for a limit cycle came to the duration {unknowns[1]:g}.")
        point = unknowns.copy()
        point[1] = 0.0
        return point, float(unknowns[1])

    def _flow(self, osc: Oscillator, flow: Flow, start: Array, duration: float) -> Array:
        periodic = self.kind == "periodic"
        count, interval = (self.period, None) if periodic else (1, duration)
        ended = run_ensemble(osc, flow, self.stepper, start[None], count, interval=interval)
        if ended.intervals[0] < count:
            raise StructureError(f"a trajectory ran out of range from {tuple(start[:2].tolist())}.")
        return ended.states[0]

    def _rate(self, osc: Oscillator, state: Array, duration: float) -> Array:
        """Rate of change of an autonomous scene's state, from two short flights."""
        moment = _MOMENT * duration
        once = self._flow(osc, Flow.STATE, state, moment)
        twice = self._flow(osc, Flow.STATE, state, 2 * moment)
        return (4 * once - twice - 3 * state) / (2 * moment)


def short_interval(osc: Oscillator, point: Array, stepper: Stepper) -> float:
    """Return a time over which the flow at an equilibrium is so near the identity that its logarithm is the rates."""
    size = len(point)
    units = np.ones(size)
    units[1] = osc.natural_frequency
    start, interval = np.concatenate([point, np.eye(size).ravel()]), osc.section_interval / 16
    for _ in range(60):
        image = run_ensemble(osc, Flow.STATE_VARIATIONAL, stepper, start[None], 1, interval=interval).states[0]
        change = image[size:].reshape(size, size) - np.eye(size)
        if np.linalg.norm(change * units / units[:, None]) < _SHORT:
            break
        interval /= 2
    return float(interval)
