"""The quasi-potential on grids: known on and near the attractor, and by value iteration elsewhere."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from vibrokit.analyzers.graph.grids import Grids
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.paths.local_potential import local_potential
from vibrokit.kernels.ensemble import carry
from vibrokit.kernels.sweeps import evaluate_rows, interpolate_all, sweep_rows
from vibrokit.progress import advance
from vibrokit.results.attractor import Attractor
from vibrokit.structure.orbits import refine_orbit

_SEED_REACH = 2.6  # nodes that the ellipse of seeds covers in x and in v: enough for interpolation next to it
_PER_NODE = 4  # points of a curve between two nodes
_ANGLES = 24  # directions in which linearity is tested
_NONLINEAR = 0.02  # relative to the distance from the orbit: deviation of an image from the linear one that is accepted
_LOWER, _LOWERINGS = 0.25, 40  # factor and number of trials for a smaller ellipse
_ROWS = 16  # of one task; fixed, so that the result is the same on any number of processors
_ROWS_EVALUATED = 64  # of one task that only evaluates V
_NEIGHBOURHOOD = 7  # nodes across in which a change is felt: interpolation reaches 2 to each side, predecessors move 1
_TOLERANCE = 1e-5  # relative change of V that is not passed on; far below the error of interpolation
_REACH = 8  # nodes to each side among which a sweep looks for cheaper predecessors
_CYCLE = 4  # periods from one wide search for predecessors, and one test of convergence, to the next
# Cycles in which every period improves the predecessors; later only the first of a cycle does. On ten scenes that took
# half to four fifths of the time, and V was the same within a tenth of its error.
_IMPROVING = 3
_WIDE_SEARCHES = 4  # each evaluates up to (2 · 8 + 1)² nodes for every node, many times what following costs
_CONVERGED = 2e-5  # relative change of the mean of √V over a cycle; 10 times less changes V by at most 0.1 %
_MOST_PERIODS = 400
_BLUR = 2  # nodes within which a grid does not resolve V
_NEARBY = 2  # nodes: what lies farther from where V is low has no part in interpolation there

Array = NDArray[np.float64]
Flags = NDArray[np.uint8]
Mask = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class Seeds:
    """What is known of the potential beforehand."""

    values: list[Array]  # (nx, nv) for each phase; infinite at nodes where the potential is not known
    orbit: Array  # (count, 2): the orbit from phase to phase, where paths may start; empty for a set


def seeds(model: StepModel, attractor: Attractor, grids: Grids) -> Seeds:
    """Return what is known of the potential at the nodes of each phase.

    Near the points of an orbit or of an equilibrium the potential is ½ δqᵀ Σ⁻¹ δq, with Σ carried from phase to phase
    by M Σ Mᵀ + C, as far as the motion is linear there. An attractor that meets the section in a curve or a cloud has
    the potential 0 at the nodes next to it. Raises StructureError if the attractor is not hyperbolic.
    """
    if attractor.is_fixed:
        return _around_orbit(model, attractor, grids)
    points = attractor.points[:, :2] if attractor.kind != "limit cycle" else _dense(attractor.orbit, grids)
    values = []
    for phase in range(grids.phases):
        known = np.full(grids.shape, np.inf)
        corner = np.floor(grids.index(phase, points[grids.inside(phase, points)])).astype(np.int64)
        for more in ((0, 0), (0, 1), (1, 0), (1, 1)):
            known[tuple((corner + more).T)] = 0.0
        values.append(known)
        points = model.images(points, grids.time(phase), grids.step)
    return Seeds(values, np.empty((0, 2)))


@dataclasses.dataclass(frozen=True, eq=False)
class _Visit:
    """One point of the orbit: its phase, Σ there, and the derivative M of the step from there."""

    phase: int
    point: Array
    covariance: Array
    slope: Array


def _around_orbit(model: StepModel, attractor: Attractor, grids: Grids) -> Seeds:
    visits = _visits(model, attractor, grids)
    level = max(
        0.5 * float(np.max(np.diag(np.linalg.inv(visit.covariance)) * (_SEED_REACH * grids.spacing(visit.phase)) ** 2))
        for visit in visits
    )
    level = _linear_level(model, grids, visits, level)
    values = [np.full(grids.shape, np.inf) for _ in range(grids.phases)]
    for visit in visits:
        offset = grids.nodes(visit.phase) - visit.point
        form = 0.5 * np.einsum("...i,ij,...j->...", offset, np.linalg.inv(visit.covariance), offset)
        known = values[visit.phase]
        np.copyto(known, np.minimum(form, known), where=form <= level)
    return Seeds(values, np.array([visit.point for visit in visits]))


def _visits(model: StepModel, attractor: Attractor, grids: Grids) -> list[_Visit]:
    orbit = refine_orbit(model.scene, attractor.points[0], attractor.period, model.stepper)
    covariance, point = local_potential(model.scene, orbit, model.stepper).covariance, orbit.point
    visits = []
    for number in range(attractor.period * grids.phases // len(grids.sections)):
        phase = number % grids.phases
        step = model.linear(point[None], grids.time(phase), grids.step)
        slopes = step.derivatives[0]
        visits.append(_Visit(phase, point, covariance, slopes))
        point, covariance = step.images[0], slopes @ covariance @ slopes.T + step.covariances[0]
    return visits


def _linear_level(model: StepModel, grids: Grids, visits: list[_Visit], level: float) -> float:
    """Lower a level until the motion on its ellipses is linear in every step; 0 if it never is."""
    levels = level * _LOWER ** np.arange(_LOWERINGS)
    angles = np.linspace(0, 2 * np.pi, _ANGLES, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)])
    sizes = np.sqrt(2 * levels)[:, None, None]
    worst = np.zeros(_LOWERINGS)
    for visit, after in zip(visits, [*visits[1:], visits[0]], strict=True):
        offsets = sizes * (np.linalg.cholesky(visit.covariance) @ circle).T  # (levels, angles, 2)
        states = visit.point + offsets
        images = model.images(states.reshape(-1, 2), grids.time(visit.phase), grids.step).reshape(states.shape)
        deviations = (images - after.point - offsets @ visit.slope.T) / sizes
        distances = np.linalg.norm(np.linalg.solve(np.linalg.cholesky(after.covariance), deviations.mT), axis=1)
        worst = np.maximum(worst, np.where(np.isfinite(distances), distances, np.inf).max(axis=1))
    linear = worst <= _NONLINEAR
    return float(levels[np.argmax(linear)]) if linear.any() else 0.0


def _dense(curve: Array, grids: Grids) -> Array:
    """Points along a curve, several from node to node."""
    lengths = np.linalg.norm(np.diff(curve[:, :2], axis=0) / grids.spacing(0), axis=1)
    between = max(1, int(np.ceil(_PER_NODE * lengths.max())))
    at = np.linspace(0, len(curve) - 1, between * (len(curve) - 1) + 1)
    return np.column_stack([np.interp(at, np.arange(len(curve)), curve[:, axis]) for axis in (0, 1)])


def _on_nodes(rows: Array, kept: Mask) -> Array:
    """Put rows at the nodes that were kept, NaN at the others."""
    found = np.full((*kept.shape, *rows.shape[1:]), np.nan)
    found[kept] = rows
    return found


@dataclasses.dataclass(frozen=True, eq=False)
class Potential:
    """Least action V from an attractor to every node of every phase."""

    grids: Grids
    values: list[Array]  # (nx, nv) for each phase; `ceiling` where no cheaper path is known
    predecessors: list[Array]  # (nx, nv, 2) for each phase: where the best step to a node of the next starts, as index
    seeded: NDArray[np.bool_]  # (nx, nv): nodes of phase 0 whose V is known beforehand
    orbit: Array  # (count, 2): states of the attractor from phase to phase if it is an orbit; else empty
    ceiling: float  # V up to which paths are searched

    def reached(self, grids: Grids, level: float) -> list[Mask]:
        """Return which nodes of each phase of other grids lie near nodes where V is below a level and the ceiling.

        Nodes outside of its own grids count as reached; where these have other phases, all do.
        """
        every, rest = divmod(self.grids.phases, grids.phases)
        if rest or len(self.grids.sections) != len(grids.sections):
            return [np.ones(grids.shape, dtype=bool)] * grids.phases
        most, last, found = min(level, self.ceiling), np.array(self.grids.shape) - 1, []
        for phase in range(grids.phases):
            below = ndimage.maximum_filter(self.values[every * phase] < most, size=2 * _NEARBY + 1)
            index = np.rint(self.grids.index(every * phase, grids.nodes(phase))).astype(int)
            inside = np.clip(index, 0, last)
            found.append(below[inside[..., 0], inside[..., 1]] | np.any(index != inside, axis=-1))
        return found

    def at(self, phase: int, states: Array) -> Array:
        """Return V at states (count, ≥ 2); NaN outside the grid."""
        index = np.where(self.grids.inside(phase, states)[:, None], self.grids.index(phase, states), np.nan)
        return interpolate_all(self.values[phase], np.ascontiguousarray(index))

    def on_section(self) -> tuple[Array, Array]:
        """Return nodes (nx, nv, 2) on the section, and V there: the least in any section interval."""
        grids = self.grids
        if len(grids.sections) == 1:
            return grids.nodes(0), self.values[0]
        boxes = grids.boxes[list(grids.sections)]
        whole = dataclasses.replace(
            grids, boxes=np.stack([boxes[..., 0].min(axis=0), boxes[..., 1].max(axis=0)], -1)[None]
        )
        nodes = whole.nodes(0)
        states = nodes.reshape(-1, 2)
        values = np.fmin.reduce([self.at(phase, states) for phase in grids.sections])
        return nodes, np.where(np.isnan(values), self.ceiling, values).reshape(nodes.shape[:2])

    def rise(self, phase: int, state: Array) -> float:
        """Return how much V rises within the nodes next to a state, which the grid cannot distinguish from it."""
        return float(self._near(phase, state, (_BLUR, _BLUR)).max() - self.at(phase, state[None])[0])

    def fall(self, phase: int, state: Array, distance: Array) -> float:
        """Return how much V falls within some distance in x and in v of a state."""
        wide, high = np.ceil(distance / self.grids.spacing(phase)).astype(int)
        return float(self.at(phase, state[None])[0] - self._near(phase, state, (int(wide), int(high))).min())

    def _near(self, phase: int, state: Array, reach: tuple[int, int]) -> Array:
        i, j = np.rint(self.grids.index(phase, state)).astype(int)
        return self.values[phase][max(i - reach[0], 0) : i + reach[0] + 1, max(j - reach[1], 0) : j + reach[1] + 1]


class ValueIteration:
    """Value iteration on some grids; raises StructureError if the attractor is not hyperbolic.

    V is computed at the nodes (nx, nv) of each phase that are wanted, by default at all; elsewhere it is the ceiling.
    """

    def __init__(
        self, model: StepModel, attractor: Attractor, grids: Grids, wanted: Sequence[Mask] | None = None
    ) -> None:
        self.grids = grids
        self.sweeps = max(grids.phases, grids.steps)  # over all phases, or a section interval
        known = seeds(model, attractor, grids)
        self.orbit = known.orbit
        self.fixed = [np.isfinite(values) for values in known.values]
        self.bounds = [np.full(grids.shape, np.inf) for _ in known.values]  # of V: costs of one step from the orbit
        self.centres, self.roots, self.predecessors, self.uphill = [], [], [], []
        last = np.array(grids.shape) - 2.0
        for phase in range(grids.phases):
            after = (phase + 1) % grids.phases
            kept = np.ones(grids.shape, dtype=bool) if wanted is None else wanted[after]
            costs = model.into(grids.nodes(after)[kept], grids, phase)
            for visit in grids.index(phase, known.orbit[phase :: grids.phases]):
                np.fmin(self.bounds[after], _on_nodes(costs.cost(visit), kept), out=self.bounds[after])
            self.centres.append(_on_nodes(costs.centres, kept))
            self.roots.append(_on_nodes(costs.roots, kept))
            self.predecessors.append(np.clip(np.nan_to_num(self.centres[-1], nan=1.0), 1.0, last))
            self.uphill.append(np.clip(_on_nodes(costs.uphill, kept), 1.0, last))
        self.known = known.values

    def up_to(self, ceiling: float) -> Potential:
        """Return V, as far as it is below a ceiling; a higher one than before begins with the predecessors known.

        It does not begin with the values known: next to a ceiling they are too small, and a value that is too small
        stays where motion without noise returns to, in the basin of another attractor.
        """
        self.ceilings = [np.minimum(bound, ceiling) for bound in self.bounds]
        self.values = [np.minimum(*both) for both in zip(self.known, self.ceilings, strict=True)]
        self.predecessors = [known.copy() for known in self.predecessors]
        self._improve()
        return Potential(self.grids, self.values, self.predecessors, self.fixed[0], self.orbit, ceiling)

    def _improve(self) -> None:
        """Sweep, period by period, until V stays the same even after every node was evaluated once more."""
        active, risen = self._all(), False
        before, at_rest = self._level(), np.inf
        for period in range(_MOST_PERIODS):
            # V falls, except where it changes between predecessors that cost almost the same: then all must improve.
            improving = risen or period < _CYCLE * _IMPROVING or period % _CYCLE == 0
            changes = self._period(period, active, improving=improving)
            advance(self.sweeps)
            if period % _CYCLE == _CYCLE - 1:
                level = self._level()
                if changes == 0 or abs(before - level) <= _CONVERGED * level:
                    if abs(at_rest - level) <= _CONVERGED * level:
                        break
                    at_rest, active = level, self._all()
                risen, before = risen or level > before, level

    def _all(self) -> list[Flags]:
        return [np.ones(self.grids.shape, dtype=np.uint8) for _ in range(self.grids.phases)]

    def _period(self, period: int, active: list[Flags], *, improving: bool) -> int:
        """Sweep over all phases; return the number of nodes that changed.

        A node takes over predecessors from neighbours that the same task has evaluated before it. The order of the
        nodes and the rows where tasks begin change from period to period, so that no row stops this.
        """
        turn = (period + period // _CYCLE) % 4
        order, begin = (1, -1)[turn % 2], -(turn // 2) * _ROWS // 2
        wide = period % _CYCLE == 0 and period < _CYCLE * _WIDE_SEARCHES
        reach = _REACH if wide else 0
        changes = 0
        for sweep in range(self.sweeps):
            phase = sweep % self.grids.phases
            if improving:
                changes += self._sweep(sweep_rows, _ROWS, begin, phase, active, (self.uphill[phase], order, reach))
            else:
                changes += self._sweep(evaluate_rows, _ROWS_EVALUATED, 0, phase, active, ())
        return changes

    def _sweep(
        self,
        work: Callable[..., None],
        rows: int,
        begin: int,
        phase: int,
        active: list[Flags],
        more: tuple[Any, ...],
    ) -> int:
        """Advance V by one step of time, so many rows in a task; return the number of nodes that changed."""
        after = (phase + 1) % self.grids.phases
        before = self.values[phase] if after != phase else self.values[phase].copy()
        changed = np.zeros(self.grids.shape, dtype=np.uint8)
        arrays = (
            before,
            self.values[after],
            self.centres[phase],
            self.roots[phase],
            self.predecessors[phase],
            self.ceilings[after],
            self.fixed[after].view(np.uint8),
            active[phase],
            changed,
        )
        last = len(before)
        tasks = [
            (*arrays, max(0, first), min(first + rows, last), _TOLERANCE, *more) for first in range(begin, last, rows)
        ]
        for _ in carry(work, tasks):
            pass
        active[after] = ndimage.maximum_filter(changed, size=_NEIGHBOURHOOD)
        return int(changed.sum())

    def _level(self) -> float:
        """Mean of √V on the section, which weights small values: a number that shows whether V has converged."""
        return float(np.mean(np.sqrt(self.values[0])))
