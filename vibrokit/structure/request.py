"""Request: how a structure is asked for, checked."""

from __future__ import annotations

import dataclasses
from typing import Any

from vibrokit.errors import StructureError

_MOST_CELLS = 10**9


@dataclasses.dataclass(frozen=True)
class Request:
    """Counts and sizes that `find_structure` was given.

    Raises
    ------
    StructureError
        One of them is not what it must be.
    """

    cells: Any
    refine: Any
    margin: Any
    starts: Any
    settling: Any
    budget: Any

    def __post_init__(self) -> None:
        for name in ("cells", "starts"):
            object.__setattr__(self, name, _pair(name, getattr(self, name)))
        settling = self.settling
        if isinstance(settling, bool) or not isinstance(settling, int | float) or not 0 < settling <= 0.5:
            raise StructureError(f"settling is {settling!r}; give a share of the region's size, above 0, at most 0.5.")
        if self.budget is not None and not _whole(self.budget, 1, _MOST_CELLS):
            raise StructureError(f"budget is {self.budget!r}; give a whole number of periods, 1 or more.")
        if not _whole(self.refine, 0, 10):
            raise StructureError(f"refine is {self.refine!r}; give a whole number from 0 to 10.")
        if self.cells[0] * self.cells[1] * 4**self.refine > _MOST_CELLS:
            raise StructureError(
                f"refine is {self.refine}, which makes more than {_MOST_CELLS} cells of {self.cells}; take fewer."
            )
        if self.margin is not None and not _whole(self.margin, 1, 100):
            raise StructureError(f"margin is {self.margin!r}; give a whole number from 1 to 100, or None.")


def _whole(number: Any, least: int, most: int) -> bool:
    return isinstance(number, int) and not isinstance(number, bool) and least <= number <= most


def _pair(name: str, counts: Any) -> tuple[int, int]:
    pair = tuple(counts) if isinstance(counts, tuple | list) else ()
    if len(pair) != 2 or not all(_whole(n, 1, _MOST_CELLS) for n in pair) or pair[0] * pair[1] > _MOST_CELLS:
        raise StructureError(
            f"{name} is {counts!r}; give two whole numbers, 1 or more, whose product is at most {_MOST_CELLS}."
        )
    return pair[0], pair[1]
