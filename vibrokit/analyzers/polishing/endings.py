"""Ending: what is asked of the last point of an exit path. Where it must come to, and what is free there."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.ends import End

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Ending(ABC):
    """Conditions on the last point of a path. Abstract.

    With the n conditions at the source and those of continuity, n conditions here make the problem square; each free
    number adds one.
    """

    @abstractmethod
    def free(self, last: float) -> Array:
        """Return the first guess of the free numbers; `last` is the guessed length of the last piece (s)."""

    @abstractmethod
    def last(self, free: Array, piece: float) -> float:
        """Return the length of the last piece (s)."""

    @abstractmethod
    def misfit(self, point: Array, free: Array, scale: Array) -> Array:
        """Return the misfits, relative to `scale` (of q and p)."""

    @abstractmethod
    def slopes(self, scale: Array) -> tuple[Array, Array]:
        """Return the derivatives of the misfits in the last point over `scale`, and in the free numbers."""

    @abstractmethod
    def moves(self, carrier: Carrier, point: Array, time: float) -> Array:
        """Return the derivatives (2n, free) of the image of the last piece, at `point`, in the free numbers."""

    @abstractmethod
    def tail(self, point: Array) -> float:
        """Return the action that is paid after the last point."""

    @abstractmethod
    def closing(self, size: int) -> tuple[Array, Array | None]:
        """Return a state, and the quadratic form of what it costs to end elsewhere; None where that is forbidden."""

    @abstractmethod
    def incoming(self, rate: Array, scale: Array) -> Array:
        """Return a basis (2n, n) of the changes of the last point that the ending allows; `rate` is that in time."""


@dataclasses.dataclass(frozen=True, eq=False)
class ComesTo(Ending):
    """The last point lies in the stable space of an orbit.

    Attributes
    ----------
    end : End
    phase : int
        Of the last point, in pieces from point 0 of the orbit.
    """

    end: End
    phase: int

    @property
    def point(self) -> Array:
        """The point of the orbit, (q, p)."""
        return self.end.point(self.phase)

    def free(self, last: float) -> Array:
        """Nothing."""
        return np.zeros(0)

    def last(self, free: Array, piece: float) -> float:
        """A piece like any other."""
        return piece

    def misfit(self, point: Array, free: Array, scale: Array) -> Array:
        """What is out of the stable space."""
        return self._normals(scale).T @ ((point - self.point) / scale)

    def slopes(self, scale: Array) -> tuple[Array, Array]:
        """Normals of the stable space."""
        normals = self._normals(scale).T
        return normals, np.zeros((len(normals), 0))

    def moves(self, carrier: Carrier, point: Array, time: float) -> Array:
        """None."""
        return np.zeros((len(point), 0))

    def tail(self, point: Array) -> float:
        """−½ p δq: what the linearised equations pay from here on."""
        offset, n = point - self.point, len(point) // 2
        return -0.5 * float(offset[n:] @ offset[:n])

    def closing(self, size: int) -> tuple[Array, Array | None]:
        """What the linearised equations pay from there on."""
        basis = self.end.coming[self.end.node(self.phase)]
        form = -np.linalg.solve(basis[:size].T, basis[size:].T).T
        return self.point[:size], (form + form.T) / 2

    def incoming(self, rate: Array, scale: Array) -> Array:
        """The stable space."""
        return self.end.coming[self.end.node(self.phase)]

    def _normals(self, scale: Array) -> Array:
        return normals_of(self.end.coming[self.end.node(self.phase)], scale)


@dataclasses.dataclass(frozen=True, eq=False)
class Touches(Ending):
    """The last point is at a stop, at the turning point, with no momentum but that of x: the least action to be there.

    x = b, v = 0, p₂ = 0 and no momentum of extra states, at a time that is free. Without forcing the time is free
    anyway and v = 0 follows from H = 0: neither is asked.

    Attributes
    ----------
    position : float
        b (m).
    size : int
        n.
    timed : bool
        Whether the time of the touch is a free number.
    """

    position: float
    size: int
    timed: bool = True

    def free(self, last: float) -> Array:
        """The length of the last piece."""
        return np.array([last]) if self.timed else np.zeros(0)

    def last(self, free: Array, piece: float) -> float:
        """The free number."""
        return float(free[0]) if self.timed else piece

    def misfit(self, point: Array, free: Array, scale: Array) -> Array:
        """x − b, v, p₂, …"""
        goal = np.zeros_like(point)
        goal[0] = self.position
        return ((point - goal) / scale)[self._asked]

    def slopes(self, scale: Array) -> tuple[Array, Array]:
        """Of single coordinates."""
        asked = self._asked
        return np.eye(2 * self.size)[asked], np.zeros((len(asked), int(self.timed)))

    def moves(self, carrier: Carrier, point: Array, time: float) -> Array:
        """The rate of change at the end."""
        return carrier.rate(point, time)[:, None] if self.timed else np.zeros((len(point), 0))

    def tail(self, point: Array) -> float:
        """Nothing: the path ends here."""
        return 0.0

    def closing(self, size: int) -> tuple[Array, Array | None]:
        """The turning point, and nothing else: the velocity is freed by `misfit` only."""
        target = np.zeros(size)
        target[0] = self.position
        return target, None

    def incoming(self, rate: Array, scale: Array) -> Array:
        """What leaves the asked coordinates alone, and the direction of time where that is free."""
        kept = [number for number in range(2 * self.size) if number not in self._asked]
        basis = np.eye(2 * self.size)[:, kept]
        return np.hstack([basis, rate[:, None]]) if self.timed else basis

    @property
    def _asked(self) -> list[int]:
        return [0, *([1] if self.timed else []), *range(self.size + 1, 2 * self.size)]


def normals_of(basis: Array, scale: Array) -> Array:
    """Return an orthonormal basis (2n, n), in units of `scale`, of what is normal to a space."""
    full = np.linalg.qr(basis / scale[:, None], mode="complete")[0]
    return full[:, basis.shape[1] :]
