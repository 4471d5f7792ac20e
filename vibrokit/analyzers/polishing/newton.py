"""Newton: extremal paths by multiple shooting, with all segments and both ends matched at once."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import scipy.sparse.linalg
from numpy.typing import ArrayLike, NDArray

from vibrokit.analyzers.paths.gauss_newton import sparse_blocks
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ending import Ending
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit
from vibrokit.analyzers.polishing.tolerances import TOLERANCES
from vibrokit.analyzers.polishing.undetermined import NearNullDirection, TimeGauge
from vibrokit.errors import StructureError
from vibrokit.progress import count
from vibrokit.structure.linear_map import HamiltonianMap

_EXACT = 1e-13  # misfit that is rounding
_SMALL = 1e-11  # Newton step, relative: the next one would be rounding

Array = NDArray[np.float64]


class NotConverged(StructureError):
    """No extremal path is near the guess; raised with the relative misfit that is left, and what is accepted."""

    @property
    def misfit(self) -> float:
        return float(self.args[0])

    def __str__(self) -> str:
        misfit, accepted = self.args
        return (
            f"Newton's method found no extremal path near the guess: the relative misfit stays at {misfit:.1e}, above "
            f"{accepted:g}. The guess is too far off, or the path grazes a stop."
        )


def extremal_path(
    propagator: SegmentPropagator,
    source: LinearizedOrbit,
    first: int,  # phase of the first node, in pieces from node 0 of the source
    ending: Ending,
    points: Array,  # (nodes, 2n): guess of (q, p), a piece apart
    last: float,  # duration of the last piece (s); a guess where it is free
    *,
    evaluations: int = TOLERANCES.evaluations,  # of the misfits, at most
    accepted: float = TOLERANCES.accepted,  # misfit
    nearly: float = 0.0,  # misfit from which a path that begins nearer to its source is tried
) -> ExtremalPath:
    """Solve for a path: continuity, n conditions at the source, the conditions of the ending.

    The Jacobian is sparse, its blocks the variational equations of H over one piece. Source of the method: Stoer and
    Bulirsch, Introduction to Numerical Analysis, 7.3; the damping is Deuflhard's (Newton Methods for Nonlinear
    Problems, 3.3). Where two manifolds meet at a small angle, the error of a linearized start can be more than any
    change of the path makes up for; such a path begins ten times as near to its source then.

    Raises NotConverged if the misfit stays above `accepted`.
    """
    found = _Matching(propagator, source, first, ending, points, last).solve(points, evaluations, accepted)
    if accepted < found.residual < nearly and not source.start_on_orbit:
        added = math.ceil(math.log(10.0) / (source.slowest_rate * propagator.grain)) * propagator.grain
        points = np.concatenate([source.continued(found.points[0], first, -added), found.points])
        first -= added
        found = _Matching(propagator, source, first, ending, points, found.last).solve(points, evaluations, accepted)
    if not found.residual <= accepted:
        raise NotConverged(found.residual, accepted)
    return found


@dataclasses.dataclass(frozen=True, eq=False)
class _Evaluation:
    """Points of a path, the number that is unknown besides, and how far they are from solving the equations."""

    points: Array  # (nodes, 2n)
    number: Array  # (1,), or (0,) if none is unknown
    source: LinearizedOrbit  # so shifted in time, if it may be, that the first point is nearest to its phase
    ending: Ending  # shifted likewise
    carried: HamiltonianMap
    unknown: NDArray[np.intp]  # nodes
    misfits: Array
    largest: float


class _Matching:
    """The equations, their derivatives, and Newton's method on them.

    Unknown are the points and at most one number: the duration of the last piece where it is free, or the slack. A
    point in a short contact is no unknown but the image of the point before it: there a state changes within a fraction
    of the contact's duration, so that Newton's steps would have to be tiny.
    """

    def __init__(
        self,
        propagator: SegmentPropagator,
        source: LinearizedOrbit,
        first: int,
        ending: Ending,
        guess: Array,
        last: float,
    ) -> None:
        self.propagator, self.source, self.first, self.ending, self.last = propagator, source, first, ending, last
        self.gauge: TimeGauge | None = None
        self.scale = _sizes(guess[self._unknown(guess)], source.point(first))
        if propagator.osc.autonomous and ending.period_nodes > 0:
            self.gauge = TimeGauge(propagator, guess, self.scale)
        self.start_of_last = float((first + len(guess) - 2) % propagator.pieces) * propagator.piece

    def _unknown(self, points: Array) -> NDArray[np.intp]:
        """Return the nodes whose points are unknown: all but those in a short contact."""
        short = self.propagator.in_short_contact(points)
        if self.gauge is not None:
            short[self.gauge.node] = False
        return np.flatnonzero(~short)

    def _joined(self, points: Array, unknown: NDArray[np.intp]) -> Array:
        """Return the points with those that are no unknowns replaced by the images of the points before them."""
        short = np.setdiff1d(np.arange(len(points)), unknown)
        if short.size:
            points = points.copy()
            points[short] = self.propagator.extremal_from(points[short - 1], self.first + short - 1, None).images
        return points

    def _arranged(self, points: Array, number: Array) -> _Evaluation:
        """Choose what is unknown by where the points are, and evaluate them."""
        unknown = self._unknown(points)
        return self.evaluate(self._joined(points, unknown), number, unknown)

    def evaluate(self, points: Array, number: Array, unknown: NDArray[np.intp]) -> _Evaluation:
        """Carry all pieces and compare."""
        last = self._last(number)
        if not 0 < last < 3.0 * self.propagator.piece:
            nothing = HamiltonianMap(points, points, points)
            return _Evaluation(points, number, self.source, self.ending, nothing, unknown, points, math.inf)
        carried = self.propagator.extremal(points[:-1], self.first, last)
        source, ending = self.source.through(points[0], self.first, leaving=True), self.ending.through(points[-1])
        parts = [
            source.misfit(points[0], self.first, self.scale, leaving=True),
            ((points[1:] - carried.images) / self.scale)[unknown[1:] - 1].ravel(),
            ending.misfit(points[-1], self.start_of_last + last, self.scale),
        ]
        if self.gauge is not None:
            parts[1][self._jump(unknown)] -= number[0] * self.gauge.normal
            parts.append(np.array([self.gauge.rate @ (points[self.gauge.node] / self.scale - self.gauge.point)]))
        misfits = np.concatenate(parts)
        largest = float(np.abs(misfits).max())
        largest = largest if math.isfinite(largest) else math.inf
        return _Evaluation(points, number, source, ending, carried, unknown, misfits, largest)

    def derivatives(self, current: _Evaluation) -> scipy.sparse.csc_array:
        """Derivatives of the misfits in the scaled points and the number."""
        points, number, unknown, double = current.points, current.number, current.unknown, len(self.scale)
        at_start = current.source.misfit_derivatives(points[0], self.first, self.scale, leaving=True)
        pieces = len(unknown) - 1
        size, ahead = double * (pieces + 1), len(at_start)
        below, end = ahead + pieces * double, self.start_of_last + self._last(number)
        at_end, in_time = current.ending.derivatives(points[-1], end, self.scale)
        over_one = current.carried.derivatives * self.scale / self.scale[:, None]
        steps = over_one[unknown[:-1]]
        over_two = np.flatnonzero(np.diff(unknown) == 2)
        steps[over_two] = over_one[unknown[over_two] + 1] @ steps[over_two]
        starts, ones = double * np.arange(pieces), np.arange(pieces * double)
        table: list[tuple[Array, ArrayLike, ArrayLike]] = [
            (at_start, 0, 0),
            (-steps, ahead + starts, starts),
            (np.ones((len(ones), 1, 1)), ahead + ones, double + ones),
            (at_end, below, size - double),
        ]
        if self.ending.free_time:
            rate = self.propagator.rate(current.carried.images[-1], end) / self.scale
            table += [(in_time, below, size), (-rate[:, None], below - double, size)]
        if self.gauge is not None:
            jump = self._jump(unknown).start
            table.append((self.gauge.rate[None], below + len(at_end), jump + double))
            table.append((-self.gauge.normal[:, None], ahead + jump, size))
        side = size + len(number)
        return sparse_blocks(table, (side, side))

    def solve(self, points: Array, evaluations: int, accepted: float) -> ExtremalPath:
        """Newton's method, each step as long as the one after it would be shorter (Deuflhard's natural test).

        Where the motion is nearly autonomous, paths that leave at other phases nearly solve the equations too, and one
        direction is nearly undetermined. A long step in that direction waits until all else is matched; then the misfit
        may be small enough already. If not, the path moves along the family, a short step at a time.
        """
        number = np.array([self.last] if self.ending.free_time else [0.0] if self.gauge is not None else [])
        current, flat, before = self._arranged(points, number), False, math.inf
        while evaluations > 0 and _EXACT < current.largest < math.inf:
            count(newton_iterations=1)
            try:
                factors = scipy.sparse.linalg.splu(self.derivatives(current))
            except RuntimeError:  # singular: the guess is far from any path
                break
            step = -factors.solve(current.misfits)
            null = NearNullDirection.of(factors, step)
            rest = null.without(step)
            if null.flat or null.most < np.abs(null.direction @ step):
                # Worth a step in all other directions: what is left of it, or what the last one has gained.
                if np.linalg.norm(rest) > 1e-4 * null.most or accepted < current.largest < before / 10.0:
                    step, before = rest, current.largest
                elif current.largest <= accepted:
                    flat = True
                    break
                else:
                    step = rest + null.limited(step) * null.direction
            tries, tried = self._shortened(current, step, factors, null)
            evaluations -= tries
            if tried is None:
                break
            current = tried
            if float(np.linalg.norm(step)) < _SMALL * math.sqrt(len(step)):
                break
            if not np.array_equal(self._unknown(current.points), current.unknown):
                current = self._arranged(current.points, current.number)
        slack = 0.0 if self.gauge is None else abs(float(current.number[0]))
        return ExtremalPath(
            current.source, self.first, current.ending, current.points, self._last(current.number),
            current.carried.derivatives, current.carried.actions, _over_jumps(current.points, current.carried.images),
            current.largest, slack, self.scale, flat,
        )  # fmt: skip

    def _shortened(
        self, current: _Evaluation, step: Array, factors: scipy.sparse.linalg.SuperLU, null: NearNullDirection
    ) -> tuple[int, _Evaluation | None]:
        """How many shares of a step were tried, and the evaluation after the first that makes the next step shorter.

        No share is longer than the path, beyond which the motion may grow without bound; None if 1e-4 is too long.
        """
        length, tries = float(np.linalg.norm(step)), 0
        share = min(1.0, 1.0 / max(float(np.abs(step).max()), _SMALL))
        while share > 1e-4:
            tried = self._moved(current, share * step)
            tries += 1
            if math.isfinite(tried.largest):
                ahead = float(np.linalg.norm(null.without(factors.solve(tried.misfits))))
                if ahead <= (1 - share / 4) * length or tried.largest < _EXACT:
                    return tries, tried
            share /= 2
        return tries, None

    def _last(self, number: Array) -> float:
        return float(number[0]) if self.ending.free_time else self.last

    def _moved(self, current: _Evaluation, step: Array) -> _Evaluation:
        moved, parted = current.points.copy(), len(current.unknown) * len(self.scale)
        moved[current.unknown] += self.scale * step[:parted].reshape(-1, len(self.scale))
        number = current.number + step[parted:]
        return self.evaluate(self._joined(moved, current.unknown), number, current.unknown)

    def _jump(self, unknown: NDArray[np.intp]) -> slice:
        """The misfits at the node where H may jump."""
        assert self.gauge is not None
        place, double = int(np.searchsorted(unknown, self.gauge.node)), len(self.scale)
        return slice((place - 1) * double, place * double)


def _over_jumps(points: Array, images: Array) -> float:
    n = points.shape[1] // 2
    return float(np.sum(points[1:, n:] * (points[1:, :n] - images[:, :n])))


def _sizes(points: Array, origin: Array) -> Array:
    """Extent of a path in each coordinate, at least 1e-6 of the others."""
    n = len(origin) // 2
    sizes = np.abs(points - origin).max(axis=0)
    for part in (slice(0, n), slice(n, 2 * n)):
        sizes[part] = np.maximum(sizes[part], 1e-6 * sizes[part].max())
    return np.where(sizes > 0, sizes, 1.0)
