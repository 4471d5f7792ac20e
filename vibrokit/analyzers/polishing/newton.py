"""Newton: all pieces of an extremal path matched at once, with both its ends."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.carrier import Carrier, Extremal
from vibrokit.analyzers.polishing.endings import ComesTo, Ending, normals_of
from vibrokit.analyzers.polishing.ends import End
from vibrokit.errors import StructureError

_LOOKS = 200  # of Newton's method
_EXACT = 1e-13
_SMALL = 1e-11  # Newton step, relative: the next one would be rounding
_LEAST_SHARE = 1e-4
_ACCEPTED = 1e-9
_LONGEST_LAST = 3.0  # pieces

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Extremum:
    """A path that solves Hamilton's equations between two ends.

    Attributes
    ----------
    source : End
        The orbit that it leaves.
    first : int
        Phase of the first node, in pieces from point 0 of that orbit.
    ending : Ending
    points : array (nodes, 2n)
        (q, p), a piece apart.
    free : array
        The ending's free numbers.
    slopes : array (nodes − 1, 2n, 2n)
        Derivatives of the pieces.
    actions : array (nodes − 1,)
        What each piece pays.
    residual : float
        Largest misfit, relative to the size of what is matched.
    slack : float
        Without forcing H is the same along the path: one condition follows from the others, and the time is free. The
        time is fixed, and the path may jump at one node in the direction of ∇H by this much, relative to its size. It
        comes out as small as the linearised ends are wrong.
    scale : array (2n,)
        That size.
    """

    source: End
    first: int
    ending: Ending
    points: Array
    free: Array
    slopes: Array
    actions: Array
    residual: float
    slack: float
    scale: Array

    @property
    def action(self) -> float:
        """From the source on: the pieces, and what the linearised equations pay before and after them."""
        return self.head + float(np.sum(self.actions)) + self.ending.tail(self.points[-1])

    @property
    def head(self) -> float:
        """½ p δq at the first node."""
        n = self.points.shape[1] // 2
        offset = self.points[0] - self.source.point(self.first)
        return 0.5 * float(offset[n:] @ offset[:n])


@dataclasses.dataclass(frozen=True, eq=False)
class _Look:
    carried: Extremal
    misfits: Array
    largest: float


@dataclasses.dataclass(frozen=True, eq=False)
class _Pin:
    """Without forcing: the node where the time is fixed and H may jump, all in units of the path's extent."""

    node: int
    point: Array
    rate: Array
    normal: Array

    @classmethod
    def at(cls, carrier: Carrier, points: Array, scale: Array) -> _Pin:
        """At the node that the path passes fastest: there both are best determined."""
        n = len(scale) // 2
        if len(points) < 3:
            raise StructureError("the guessed path is shorter than three pieces.")
        node = 1 + int(np.argmax(np.linalg.norm((points[2:] - points[:-2]) / scale, axis=1)))
        rate = carrier.rate(points[node], 0.0)
        normal = np.concatenate([-rate[n:], rate[:n]]) * scale  # ∇H = (−p′, q′)
        direction = rate / scale
        return cls(
            node, points[node] / scale, direction / np.linalg.norm(direction), normal / np.linalg.norm(normal)
        )  # fmt: skip


class _Matching:
    """The equations, their derivatives, and Newton's method on them."""

    def __init__(self, carrier: Carrier, source: End, first: int, ending: Ending, guess: Array) -> None:
        self.carrier, self.source, self.first, self.ending = carrier, source, first, ending
        self.scale = _sizes(guess, source.point(first))
        self.normals = normals_of(source.leaving[source.node(first)], self.scale)
        self.count = len(guess) - 1
        self.pin = None
        if carrier.osc.autonomous and isinstance(ending, ComesTo):
            self.pin = _Pin.at(carrier, guess, self.scale)

    def look(self, points: Array, free: Array) -> _Look:
        """Carry all pieces and compare."""
        own, slack = self._parted(free)
        last = self.ending.last(own, self.carrier.piece)
        if not 0 < last < _LONGEST_LAST * self.carrier.piece:
            return _Look(Extremal(points, points, points), points, math.inf)
        carried = self.carrier.extremal(points[:-1], self.first, last)
        parts = [
            self.normals.T @ ((points[0] - self.source.point(self.first)) / self.scale),
            ((points[1:] - carried.images) / self.scale).ravel(),
            self.ending.misfit(points[-1], own, self.scale),
        ]
        if self.pin is not None:
            parts[1][self._jump] -= slack * self.pin.normal
            parts.append(np.array([self.pin.rate @ (points[self.pin.node] / self.scale - self.pin.point)]))
        misfits = np.concatenate(parts)
        largest = float(np.abs(misfits).max())
        return _Look(carried, misfits, largest if math.isfinite(largest) else math.inf)

    @property
    def _jump(self) -> slice:
        """Which of the misfits of the pieces belong to the one that ends at the pinned node."""
        assert self.pin is not None
        double = len(self.scale)
        return slice((self.pin.node - 1) * double, self.pin.node * double)

    def _parted(self, free: Array) -> tuple[Array, float]:
        """The ending's free numbers, and the slack."""
        return (free, 0.0) if self.pin is None else (free[:-1], float(free[-1]))

    def _start_of_last(self) -> float:
        return float((self.first + self.count - 1) % self.carrier.pieces) * self.carrier.piece

    def derivatives(self, points: Array, free: Array, look: _Look) -> scipy.sparse.csc_array:
        """Derivatives of the misfits in the scaled points and the free numbers."""
        count, double = points.shape[0] - 1, points.shape[1]
        size = double * (count + 1)
        steps = look.carried.slopes * self.scale / self.scale[:, None]
        at_end, in_free = self.ending.slopes(self.scale)
        ahead = len(self.normals.T)
        numbers, grid = np.arange(count), np.arange(double)
        rows = ahead + numbers[:, None, None] * double + grid[:, None] + np.zeros(double, dtype=int)
        columns = numbers[:, None, None] * double + grid + np.zeros((double, 1), dtype=int)
        diagonal = np.arange(count * double)
        below = ahead + count * double
        table = [
            (self.normals.T, *np.indices(self.normals.T.shape)),
            (-steps, rows, columns),
            (np.ones(count * double), ahead + diagonal, double + diagonal),
            _placed(at_end, below, size - double),
        ]
        own, _ = self._parted(free)
        if len(own):
            time = self._start_of_last() + self.ending.last(own, self.carrier.piece)
            moved = self.ending.moves(self.carrier, look.carried.images[-1], time) / self.scale[:, None]
            table += [_placed(in_free, below, size), _placed(-moved, below - double, size)]
        if self.pin is not None:
            table.append(_placed(self.pin.rate[None], below + len(at_end), self.pin.node * double))
            table.append(_placed(-self.pin.normal[:, None], ahead + self._jump.start, size + len(own)))
        values, places, others = (np.concatenate([part[k].ravel() for part in table]) for k in range(3))
        side = size + len(free)
        return scipy.sparse.csc_array((values, (places, others)), shape=(side, side))

    def solve(self, points: Array, last: float, looks: int) -> Extremum:
        """Newton's method, each step as long as the one after it would be shorter (Deuflhard's natural test)."""
        free = np.concatenate([self.ending.free(last), np.zeros(int(self.pin is not None))])
        look = self.look(points, free)
        while looks > 0 and _EXACT < look.largest < math.inf:
            try:
                factors = scipy.sparse.linalg.splu(self.derivatives(points, free, look))
            except RuntimeError:  # singular: the path's guess is nothing like a path
                break
            step = -factors.solve(look.misfits)
            length, share = float(np.linalg.norm(step)), 1.0
            while share > _LEAST_SHARE:
                moved = self._moved(points, free, share * step)
                tried = self.look(*moved)
                looks -= 1
                if math.isfinite(tried.largest):
                    ahead = float(np.linalg.norm(factors.solve(tried.misfits)))
                    if ahead <= (1 - share / 4) * length or tried.largest < _EXACT:
                        break
                share /= 2
            else:
                break
            points, free = moved
            look = tried
            if length < _SMALL * math.sqrt(len(step)):
                break
        own, slack = self._parted(free)
        return Extremum(
            self.source, self.first, self.ending, points, own,
            look.carried.slopes, look.carried.actions, look.largest, abs(slack), self.scale,
        )  # fmt: skip

    def _moved(self, points: Array, free: Array, step: Array) -> tuple[Array, Array]:
        return points + self.scale * step[: points.size].reshape(points.shape), free + step[points.size :]


def extremal_path(
    carrier: Carrier,
    source: End,
    first: int,
    ending: Ending,
    points: Array,
    *,
    last: float | None = None,
    looks: int = _LOOKS,
) -> Extremum:
    """Solve for the path by multiple shooting: continuity, n conditions at the source, the ending's conditions.

    The Jacobian is sparse, its blocks the variational equations of H over one piece. Source of the method: Stoer and
    Bulirsch, Introduction to Numerical Analysis, 7.3; the damping is Deuflhard's (Newton Methods for Nonlinear
    Problems, 3.3).

    Parameters
    ----------
    carrier : Carrier
    source : End
        The orbit that the path leaves in its unstable space.
    first : int
        Phase of the first node, in pieces from point 0 of the source.
    ending : Ending
    points : array (nodes, 2n)
        Guess of (q, p), a piece apart.
    last : float, optional
        Guess of the length of the last piece (s), where that is free.
    looks : int
        How often the misfits are found at most.

    Raises
    ------
    StructureError
        It did not converge.
    """
    matching = _Matching(carrier, source, first, ending, points)
    found = matching.solve(points, carrier.piece if last is None else last, looks)
    if not found.residual <= _ACCEPTED:
        raise StructureError(
            f"Newton's method found no extremal path near the guess: the misfit stays at {found.residual:.1e}, "
            f"relative to the path's size, where {_ACCEPTED:g} is wanted. The guess is too far off, or the path "
            "grazes a stop."
        )
    return found


def _sizes(points: Array, origin: Array) -> Array:
    """Extent of a path in each coordinate, none taken for less than a rounding of the others."""
    n = len(origin) // 2
    sizes = np.abs(points - origin).max(axis=0)
    for part in (slice(0, n), slice(n, 2 * n)):
        sizes[part] = np.maximum(sizes[part], 1e-6 * sizes[part].max())
    return np.where(sizes > 0, sizes, 1.0)


def _placed(block: Array, row: int, column: int) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    rows, columns = np.indices(block.shape, dtype=np.int64)
    return block, np.asarray(rows + row), np.asarray(columns + column)
