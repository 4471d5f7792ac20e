"""Where an exit path may end, as plain values; each method knows what it makes of them."""

from __future__ import annotations

import dataclasses
from abc import ABC

from vibrokit.errors import StructureError, shown


@dataclasses.dataclass(frozen=True)
class PathEnd(ABC):
    """A place where an exit path may end. Abstract.

    Attributes
    ----------
    targets : tuple of int
        Labels of the attractors that are reached from there; −1 for another exit, −2 for escape.
    """

    targets: tuple[int, ...]

    @property
    def saddle(self) -> int:
        """Which of the structure's saddles it is; −1 for an end that is no saddle."""
        return -1

    @property
    def last_resort(self) -> bool:
        """Whether paths end there only where no other end can be used."""
        return False

    @property
    def one_of_many(self) -> bool:
        """Whether it belongs to a set all of which ends exits: a path to it gives an upper bound of their energy."""
        return False


@dataclasses.dataclass(frozen=True)
class AtSaddle(PathEnd):
    """A saddle on a basin boundary.

    Attributes
    ----------
    number : int
        Its place among the structure's saddles.
    on_own_boundary : bool
        Whether it lies on the boundary of the basin that is left; a saddle between two other basins is a last resort.
    embedded : bool
        Whether it is an orbit inside a chaotic set on the boundary, which is another of the structure's saddles.
    """

    number: int
    on_own_boundary: bool = True
    embedded: bool = False

    @property
    def saddle(self) -> int:
        """Its place among the structure's saddles."""
        return self.number

    @property
    def last_resort(self) -> bool:
        """A saddle between two other basins is one."""
        return not self.on_own_boundary

    @property
    def one_of_many(self) -> bool:
        """An orbit inside a chaotic set is one."""
        return self.embedded


@dataclasses.dataclass(frozen=True)
class InBasin(PathEnd):
    """Any state of the target's basin, for a target that no known saddle leads to.

    Raises StructureError if a target is not an attractor, since only attractors have basins.
    """

    def __post_init__(self) -> None:
        if min(self.targets) < 0:
            raise StructureError(
                f"InBasin: targets must be labels of attractors, 0 or more, got {shown(self.targets)}; an exit that is "
                "no basin ends at saddles or on faces."
            )


@dataclasses.dataclass(frozen=True)
class AtFace(PathEnd):
    """A face of a region in (x, v), reached for the first time.

    Attributes
    ----------
    axis : int
        0 for a bound of x, 1 for a bound of v.
    level : float
        The bound (m or m s⁻¹).
    outward : int
        +1 if the region lies below the bound, −1 if it lies above.
    """

    axis: int
    level: float
    outward: int
