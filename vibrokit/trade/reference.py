"""An independent integrator to measure the others against: SciPy's DOP853, restarted at every change of contact.

It shares the derived right-hand side with the steppers and nothing else: neither steps nor event location.
"""

from __future__ import annotations

import types
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from vibrokit.errors import IntegrationError
from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.kernels.located import Order8
from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow

TIGHTEST = 2.3e-14  # relative tolerance, the least that SciPy's DOP853 takes
_MOST_CHANGES = 1_000_000  # of contact in one interval; chatter would never end

Array = NDArray[np.float64]


def reference_map(
    scene: Scene, states: Array, periods: int = 1, *, flow: Flow = Flow.STATE, tolerance: float = TIGHTEST
) -> Array:
    """Map states from section to section, slowly and independently of every stepper.

    `states` has shape (count, equations), and the absolute tolerance of DOP853 is a tenth of the relative one.
    IntegrationError is raised if DOP853 fails.
    """
    motion = _Motion(scene, flow, tolerance)
    ends = [np.array(state, dtype=float) for state in states]
    for _ in range(periods):  # each from time 0: the phase cannot drift
        ends = [motion.follow(state, scene.section_interval) for state in ends]
    return np.array(ends)


class _Motion:
    """The motion of one scene, with each stop switched on or off between steps."""

    def __init__(self, scene: Scene, flow: Flow, tolerance: float) -> None:
        self.module: types.ModuleType = kernel_for(scene, flow, Order8()).module
        self.theta = theta_of(scene)
        self.stops = tuple(self.module.stop(i, self.theta) for i in range(self.module.BARRIERS))
        self.tolerance = tolerance

    def follow(self, state: Array, interval: float) -> Array:
        """Integrate from time 0 to `interval`."""
        time, pushing = 0.0, self.pushing_at(state)
        for _ in range(_MOST_CHANGES):
            solver = self._solver(time, state, interval, pushing, interval / 32)
            change = None
            while solver.status == "running" and change is None:
                time, state = solver.t, solver.y
                _step(solver)
                change = self._change(solver, pushing)
            if change is None:
                return solver.y
            # A step is more accurate than its interpolant: repeat it up to the change.
            landing = self._solver(time, state, change[0], pushing, np.inf)
            while landing.status == "running":
                _step(landing)
            time, state, pushing = landing.t, landing.y, change[1]
            if time >= interval:
                return state
        raise IntegrationError(
            f"the reference integrator met more than {_MOST_CHANGES} changes of contact in one period.",
            time,
            tuple(state),
        )

    def _solver(self, time: float, state: Array, end: float, pushing: tuple[bool, ...], longest: float) -> DOP853:
        module, theta = self.module, self.theta
        switches = np.array(pushing or (False,))

        def rate(t: float, z: Array) -> Array:
            out = np.empty_like(z)
            module.rhs(t, z, switches, theta, out)
            return out

        return DOP853(rate, time, state, end, rtol=self.tolerance, atol=0.1 * self.tolerance, max_step=longest)

    def pushing_at(self, z: Array) -> tuple[bool, ...]:
        """Which stops push at this point."""
        module, found = self.module, []
        for i, wall in enumerate(self.stops):
            depth, rate = module.SIDES[i] * (z[0] - wall), module.SIDES[i] * z[1]
            touching = depth > 0.0 or (depth == 0.0 and rate > 0.0)
            if touching and module.CLAMPED[i]:
                touching = module.law(i, max(depth, 1e-30), rate, self.theta) > 0.0
            found.append(bool(touching))
        return tuple(found)

    def _change(self, solver: DOP853, pushing: tuple[bool, ...]) -> tuple[float, tuple[bool, ...]] | None:
        """First change of contact in the last step: when, and which stops push after it."""
        if not self.stops:
            return None
        dense = solver.dense_output()
        probes = np.linspace(solver.t_old, solver.t, 17)
        states = dense(probes).T
        for k in range(1, len(probes)):
            high = probes[k]
            changed = self.pushing_at(states[k]) != pushing
            if not changed and states[k - 1, 1] * states[k, 1] < 0.0:
                high = _turn(dense, probes[k - 1], high)  # a graze shows at the turning point, if anywhere
                changed = self.pushing_at(dense(high)) != pushing
            if changed:
                return self._bisected(dense, probes[k - 1], high, pushing)
        return None

    def _bisected(self, dense: Any, low: float, high: float, pushing: tuple[bool, ...]) -> Any:
        after = self.pushing_at(dense(high))
        while low < (middle := 0.5 * (low + high)) < high:
            found = self.pushing_at(dense(middle))
            if found == pushing:
                low = middle
            else:
                high, after = middle, found
        return high, after


def _step(solver: DOP853) -> None:
    solver.step()
    if solver.status == "failed" or not np.isfinite(solver.y).all():
        last = tuple(float(value) for value in solver.y)
        raise IntegrationError(
            f"the reference integrator, DOP853, failed at t = {solver.t:g} in state {last}; measure a milder scene.",
            float(solver.t),
            last,
        )


def _turn(dense: Any, low: float, high: float) -> float:
    """Where the velocity vanishes."""
    rising = dense(high)[1] > 0.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if (dense(middle)[1] > 0.0) == rising:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)
