"""Motion that turns over and over, in scenes without periodic excitation whose spring's force repeats along x."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.structure.autonomous import check_cycle
from vibrokit.structure.circle import turn_of, wrapped
from vibrokit.structure.linear_map import linear_map
from vibrokit.structure.newton import Evaluation, newton, scaled
from vibrokit.structure.orbits import CONVERGED, Orbit
from vibrokit.structure.scales import size_of, units_of
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 256  # in 2π/ω_n, along a path in which passages are searched for
_RECURRENCE = 1e-2  # of the largest speed: difference of two passages from which Newton's method starts
_MOST_TURNS = 16  # in one period

Array = NDArray[np.float64]


class Rotation(Orbit):
    """Motion that repeats after whole turns along x, from a place on; its period is 1.

    One eigenvalue of its monodromy matrix is 1: that of a shift in time.
    """

    kind: ClassVar[str] = "limit cycle"

    def refined(self, osc: Oscillator, stepper: Stepper) -> Rotation:
        """Return the rotation that Newton's method finds from here with another stepper; may raise StructureError."""
        return refine_rotation(osc, self.point, self.duration, stepper)


def refine_rotation(osc: Oscillator, state: Array, duration: float, stepper: Stepper) -> Rotation:
    """Refine a rotation by Newton's method on the velocity at a place and the duration until the residual stays.

    A StructureError is raised if the iteration does not converge.
    """
    guess = np.array(state, dtype=float)
    guess[0] = duration
    equations, units = scaled(_equations(osc, float(state[0]), stepper), units_of(osc)), units_of(osc)
    (unknowns,), (residual,), (monodromy,) = newton(equations, guess[None])
    if not residual <= CONVERGED * (1.0 + float(np.linalg.norm(state / units))):
        raise StructureError(
            f"Newton's method found no rotation of duration {duration:.6g} s near "
            f"{tuple(np.round(state, 6).tolist())}: the residual is {residual:.1e}; follow the motion for longer."
        )
    point = unknowns.copy()
    point[0] = state[0]
    rotation = Rotation(point[None], 1, float(unknowns[0]), monodromy[None], float(residual))
    check_cycle(rotation, VectorField(osc).rate(point), size_of(osc), stepper)
    return rotation


def _equations(osc: Oscillator, place: float, stepper: Stepper) -> Callable[[Array], Evaluation]:
    """Return the equations of a rotation: after a duration the motion is at the same place, whole turns on."""
    field = VectorField(osc)

    def evaluate(unknowns: Array) -> Evaluation:
        start, duration = unknowns.copy(), float(unknowns[0, 0])
        start[0, 0] = place
        if not duration > 0:
            raise StructureError(f"Newton's method for a rotation reached the duration {duration:g} s.")
        found = linear_map(osc, start, stepper, interval=duration)
        jacobians = found.derivatives - np.eye(start.shape[1])
        jacobians[:, :, 0] = field.rate(found.images)
        return Evaluation(wrapped(osc, found.images - start), jacobians, found.derivatives)

    return evaluate


def find_rotation(osc: Oscillator, state: Array, stepper: Stepper, *, longest: float) -> Rotation:
    """Find the rotation that the motion from a state settles on, by its passages of x = 0 on the circle.

    The motion is followed for twice `longest`, the longest duration of a rotation (s). A StructureError is raised if it
    does not advance by whole turns and repeat within that time.
    """
    spacing, turn = osc.time_unit / _SAMPLES, turn_of(osc)
    path = record(
        osc, Flow.STATE, stepper, np.array(state, dtype=float), 0.0, spacing, math.ceil(2 * longest / spacing)
    )
    x, v = path[:, 0], path[:, 1]
    turns = np.floor(x / turn) if turn else np.zeros(len(x))
    passed = np.flatnonzero(np.diff(turns))[-_MOST_TURNS - 1 :]
    settled = len(passed) > 1 and len(set(np.sign(np.diff(turns)[passed]).tolist())) == 1
    if settled:
        levels = turn * np.maximum(turns[passed], turns[passed + 1])
        parts = (levels - x[passed]) / (x[passed + 1] - x[passed])
        speeds = v[passed] + parts * (v[passed + 1] - v[passed])
        times = spacing * (passed + parts)
        for back in range(2, len(passed) + 1):
            if abs(speeds[-1] - speeds[-back]) < _RECURRENCE * np.abs(speeds).max():
                start = path[passed[-1]].copy()
                start[:2] = 0.0, speeds[-1]
                return refine_rotation(osc, start, float(times[-1] - times[-back]), stepper)
    raise StructureError(
        f"the motion from {tuple(np.round(state, 6).tolist())} does not turn over and repeat within {longest:.6g} s; "
        "start nearer to a rotation."
    )
