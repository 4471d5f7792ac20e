"""Periodic orbits: Newton's method on the section map or on many nodes, and what is computed of every closed orbit."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, ClassVar

import mpmath
import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Stop, run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.structure.along_x import wrapped
from vibrokit.structure.linear_map import linear_map
from vibrokit.structure.newton import Evaluation, newton, scaled
from vibrokit.structure.scales import units_of
from vibrokit.symbolic.flow_kind import Flow

EQUAL = 1e-6
"""Distance, relative to the size of an orbit, below which two points are one."""
CONVERGED = 1e-6
"""Largest residual, relative to the size of the motion, of an orbit that Newton's method has found."""
LONGEST_PERIOD = 16
"""Longest period of orbits that are searched for."""
SAMPLES = 1024
"""Of an orbit in a section interval, for records and pictures."""

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Orbit:
    """A closed orbit with its linearization; of this class itself, a fixed point of the section map's power.

    It has one node, a point on the section. Where deviations grow so much over the duration that motion from that point
    would not come back, it has several at equal times, of which the first is on the section.
    """

    kind: ClassVar[str] = "periodic"

    nodes: Array  # (count, n)
    period: int  # in forcing periods
    duration: float  # time after which it repeats (s)
    steps: Array  # (count, n, n), derivatives of the flow from node to node
    residual: float  # distance between the nodes and the images of those before them, in units of the scene

    @property
    def point(self) -> Array:
        return self.nodes[0]

    @cached_property
    def monodromy(self) -> Array:
        """Derivative of the flow over the duration, shape (n, n); infinite where deviations grow by more than 1e308."""
        with np.errstate(over="ignore", invalid="ignore"):
            return functools.reduce(lambda product, step: step @ product, self.steps)

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        """Eigenvalues of the monodromy matrix, shape (n,)."""
        return multipliers_of(self.steps)

    @cached_property
    def exponents(self) -> NDArray[np.complex128]:
        """Growth rates (s⁻¹), shape (n,), in the order of the multipliers; −∞ for a multiplier 0."""
        if len(self.steps) == 1:
            with np.errstate(divide="ignore"):
                return np.asarray(np.log(self.multipliers) / self.duration, dtype=np.complex128)
        logarithms = [complex(mpmath.log(value)) for value in _eigenvalues(self.steps)]
        return np.asarray(logarithms, dtype=np.complex128) / self.duration

    @property
    def unstable_direction(self) -> Array:
        """Direction (n,) in which motion beside it grows most."""
        return _growing(self.steps)

    def refined(self, osc: Oscillator, stepper: Stepper) -> Orbit:
        """Return the orbit that Newton's method finds from here with another stepper; may raise StructureError."""
        return refine_orbit(osc, self.nodes, self.period, stepper)

    def moved_by_tightening(self, osc: Oscillator, stepper: Stepper, times: int) -> float:
        """Return how far its point moves when the stepper is refined so many times; infinite if the orbit vanishes."""
        furthest = 0.0
        for _ in range(times):
            stepper = stepper.refined()
            try:
                furthest = max(furthest, float(np.linalg.norm(self.refined(osc, stepper).point - self.point)))
            except StructureError:
                return math.inf
        return furthest


def section_equations(
    osc: Oscillator, period: int, stepper: Stepper, executor: concurrent.futures.Executor | None = None
) -> Callable[[Array], Evaluation]:
    """Return the equations of a fixed point of the section map's power; attached is the derivative of that map."""

    def evaluate(points: Array) -> Evaluation:
        found = linear_map(osc, points, stepper, intervals=period, executor=executor)
        return Evaluation(
            wrapped(osc, found.images - points), found.derivatives - np.eye(points.shape[1]), found.derivatives
        )

    return evaluate


def _node_equations(osc: Oscillator, count: int, interval: float, stepper: Stepper) -> Callable[[Array], Evaluation]:
    """Return the equations of nodes (1, count n) at equal times: each is the image of the one before.

    Attached are the derivatives of the images (1, count, n, n).
    """

    def evaluate(flat: Array) -> Evaluation:
        nodes = flat.reshape(count, -1)
        n = nodes.shape[1]
        found = linear_map(osc, nodes, stepper, interval=interval, phases=np.arange(count))
        jacobian = np.zeros((count, n, count, n))
        each, following = np.arange(count), np.roll(np.arange(count), -1)
        jacobian[each, :, each] = found.derivatives
        jacobian[each, :, following] -= np.eye(n)
        residuals = wrapped(osc, found.images - nodes[following])
        return Evaluation(residuals.reshape(1, -1), jacobian.reshape(1, count * n, count * n), found.derivatives[None])

    return evaluate


def refine_orbit(osc: Oscillator, guess: Array, period: int, stepper: Stepper) -> Orbit:
    """Refine a periodic point by Newton's method until the residual stays; StructureError where it stays large.

    The guess (n,) is a point on the section, or consists of several nodes (count, n) at equal times, of which `period`
    are on the section; then all of them are unknowns.
    """
    units, guesses = units_of(osc), np.atleast_2d(guess)
    count, duration = len(guesses), period * osc.section_interval
    equations = (
        section_equations(osc, period, stepper)
        if count == 1
        else _node_equations(osc, count, duration / count, stepper)
    )
    (found,), (residual,), (steps,) = newton(scaled(equations, np.tile(units, count)), guesses.reshape(1, -1))
    orbit = Orbit(found.reshape(guesses.shape), period, duration, steps.reshape(count, *2 * units.shape), residual)
    if not orbit.residual <= CONVERGED * (1.0 + float(np.linalg.norm(guesses / units, axis=1).max())):
        raise StructureError(
            f"Newton's method found no orbit of period {period} near {tuple(np.round(guesses[0], 6).tolist())}: the "
            f"residual is {orbit.residual:.1e}. The start is too far away, or the orbit is not hyperbolic; follow the "
            "motion for longer, or take a finer stepper."
        )
    return orbit


def least_period(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Orbit:
    """Return the orbit with its least period; near a bifurcation, recurrences may show a multiple of it."""
    for divisor in range(1, orbit.period):
        if orbit.period % divisor == 0:
            try:
                part = max(1, len(orbit.nodes) * divisor // orbit.period)
                shorter = refine_orbit(osc, orbit.nodes[:part], divisor, stepper)
            except StructureError:
                continue
            if same_point(osc, orbit.point, shorter.point[None], EQUAL):
                return shorter
    return orbit


def visited(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Array:
    """Return the points of an orbit on the section, in the order of visits, shape (period, n)."""
    if len(orbit.nodes) > 1:
        return orbit.nodes[:: len(orbit.nodes) // orbit.period]
    points = [orbit.point]
    for _ in range(orbit.period - 1):
        points.append(run_ensemble(osc, Flow.STATE, stepper, points[-1][None], 1).states[0])
    return np.array(points)


def nodes_from(visit: int, nodes: Array, points: Array) -> Array:
    """Return the nodes (count, n) of an orbit from another visit of the section on: that point, if there is one node.

    The points (period, n) are those of all visits.
    """
    if len(nodes) == 1:
        return points[visit : visit + 1]
    return np.roll(nodes, -visit * (len(nodes) // len(points)), axis=0)


def states_along(osc: Oscillator, nodes: Array, period: int, stepper: Stepper, pieces: int) -> Array:
    """Return states (period · pieces, n) along an orbit at equal times, each reached from the node before it.

    The nodes (count, n) are those of the orbit. The number of pieces of a section interval is a multiple of the number
    of nodes there, or divides it.
    """
    total = period * pieces
    if len(nodes) >= total:
        return nodes[:: len(nodes) // total]
    return sampled(osc, nodes, period * osc.section_interval, stepper, total // len(nodes))


def sampled(osc: Oscillator, nodes: Array, duration: float, stepper: Stepper, each: int) -> Array:
    """Return so many states from each node (count, n) of an orbit of a duration on, each reached from that node."""
    span = duration / len(nodes)
    parts = (record(osc, Flow.STATE, stepper, node, at * span, span / each, each) for at, node in enumerate(nodes))
    return np.concatenate([part[:each] for part in parts])


def unstable_direction(osc: Oscillator, nodes: Array, period: int, stepper: Stepper) -> Array | None:
    """Return the direction (n,) in which motion beside an orbit grows most; None where it diverges.

    The nodes are those of an orbit, or of motion close to one that ends a number of periods later.
    """
    duration = period * osc.section_interval / len(nodes)
    steps = linear_map(osc, nodes, stepper, interval=duration, phases=np.arange(len(nodes))).derivatives
    if not np.isfinite(steps).all():
        return None
    return _growing(steps)


def same_point(osc: Oscillator, point: Array, known: Array, tolerance: float) -> bool:
    """Whether a point is one of some known points (count, n), to a tolerance relative to the size of the motion."""
    sizes = units_of(osc) + np.abs(wrapped(osc, known)).max(axis=0)
    near = np.abs(wrapped(osc, known - point)) < tolerance * sizes
    return bool(near.all(axis=1).any())


def arrival_at(orbits: Mapping[int, Array], distances: Array) -> Stop:
    """Return the test that ends a trajectory within distances in x and v of a point of orbits, given by label."""
    points = np.concatenate([np.empty((0, 2)), *(points[:, :2] for points in orbits.values())])
    labels = np.repeat(list(orbits), [len(points) for points in orbits.values()])
    metrics = np.tile(np.diag(1.0 / distances), (len(points), 1, 1))
    return Stop(points=points, point_labels=labels.astype(np.int64), metrics=metrics)


def _growing(steps: Array) -> Array:
    """The eigenvector (n,) of the largest eigenvalue of a product of matrices (count, n, n)."""

    def scaled_product(product: Array, step: Array) -> Array:
        after: Array = step @ product
        return after / np.linalg.norm(after)

    values, vectors = np.linalg.eig(functools.reduce(scaled_product, steps))
    return np.real(vectors[:, int(np.argmax(np.abs(values)))])


def multipliers_of(steps: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues (n,) of a product of matrices (count, n, n), the first of them applied first.

    One that is larger than any floating-point number is given as the largest of these. A StructureError is raised for
    matrices that are not finite.
    """
    if not np.isfinite(steps).all():
        raise StructureError(
            "the motion cannot be linearized along the orbit: a formula of a force has no finite slope there."
        )
    if len(steps) == 1:
        return np.asarray(np.linalg.eigvals(steps[0]), dtype=complex)
    return np.nan_to_num([complex(value) for value in _eigenvalues(steps)])


def _eigenvalues(steps: Array) -> list[Any]:
    """The same, as numbers of mpmath.

    One that is far smaller than the others would be lost in the rounding errors of the product. So the product is
    formed with as many digits more as it grows by.
    """
    growth = sum(math.log10(np.linalg.cond(step)) for step in steps)
    with mpmath.workdps(30 + math.ceil(growth)):
        product = functools.reduce(
            lambda before, step: mpmath.matrix(step.tolist()) * before, steps, mpmath.eye(steps.shape[1])
        )
        return list(mpmath.eig(product, left=False, right=False))
