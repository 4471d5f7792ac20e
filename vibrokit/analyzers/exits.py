"""Exits: what counts as leaving."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.at_saddle import SaddleGoal
from vibrokit.analyzers.polishing.destinations import Goal
from vibrokit.analyzers.polishing.touch import TouchGoal
from vibrokit.analyzers.screening.grids import Grids
from vibrokit.analyzers.screening.touching import ways_to_touch
from vibrokit.analyzers.screening.ways_out import Way, home, ways_to_leave
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Stop
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import LEFT_BASIN, LEFT_REGION
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.saddle import Saddle
from vibrokit.results.structure import Structure

_LOOKS = 16  # exit tests per unit of time where no section sets them
_LOOKS_FOR_TOUCH = 32  # per period: a mass that turns back between two looks has gone little further

_NEUTRAL = 1e-6  # of a multiplier: that of a shift along a limit cycle is 1

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Exit(ABC):
    """What counts as leaving an attractor. Abstract."""

    leaving: ClassVar[int]
    """Status, of `vibrokit.kernels.stopping`, with which a trajectory that has left ends."""

    @abstractmethod
    def check(self, osc: Oscillator, structure: Structure) -> None:
        """Raise StructureError if this exit cannot be asked for in this scene."""

    @abstractmethod
    def stop(self, osc: Oscillator, structure: Structure, home: int) -> Stop:
        """Return the kernel's test for a trajectory that started at the attractor `home`."""

    @abstractmethod
    def looks(self, osc: Oscillator) -> int:
        """Return how many times in a section interval the test is made."""

    @abstractmethod
    def goals(self, osc: Oscillator, structure: Structure, home: int) -> tuple[tuple[Goal, ...], tuple[str, ...]]:
        """Return what a path of least action from the attractor `home` may end on, and what is left out, in words."""

    @abstractmethod
    def scene(self, osc: Oscillator) -> Oscillator:
        """Return the scene as far as paths know it before they leave."""

    @abstractmethod
    def ways(self, osc: Oscillator, structure: Structure, attractor: Attractor, stepper: Stepper) -> list[Way]:
        """Return what a graph has to reach, from where its paths are followed back."""

    @abstractmethod
    def within(
        self, osc: Oscillator, structure: Structure, attractor: Attractor, stepper: Stepper, grids: Grids, phase: int
    ) -> NDArray[np.bool_]:
        """Return which nodes of a phase of a graph lie before the exit, shape (nx, nv)."""

    @abstractmethod
    def beyond(self, osc: Oscillator, states: Array) -> NDArray[np.bool_]:
        """Return which states, at whatever phase, count as exits by themselves; shape of ``states[..., 0]``."""


@dataclasses.dataclass(frozen=True)
class LeaveBasin(Exit):
    """Leaving the basin of attraction, seen at the section, for the basin of another attractor."""

    leaving: ClassVar[int] = LEFT_BASIN

    def check(self, osc: Oscillator, structure: Structure) -> None:
        """Refuse a structure of one attractor."""
        if len(structure.attractors) < 2:
            raise StructureError(
                "the structure has one attractor only, so there is no other basin to leave for; widen the region, "
                "change the scene, or ask for the first contact with a stop (exit=FirstContact())."
            )

    def stop(self, osc: Oscillator, structure: Structure, home: int) -> Stop:
        """Return the test by the basin grid."""
        basins = structure.basins
        return Stop(region=basins.region.bounds, labels=basins.labels, home=home)

    def looks(self, osc: Oscillator) -> int:
        """Once: the basins are those of the section; 16 times where any time is as good."""
        return _LOOKS if osc.autonomous else 1

    def goals(self, osc: Oscillator, structure: Structure, home: int) -> tuple[tuple[Goal, ...], tuple[str, ...]]:
        """The unstable orbits on the basin's boundary.

        Where it has none that can be named, those between other basins: what leads there has left on its way.
        """
        between = [(number, saddle) for number, saddle in enumerate(structure.saddles) if saddle.on_boundary]
        own = [(number, saddle) for number, saddle in between if home in saddle.leads_to]
        words = tuple(f"Attractor {home}: {_unnamed(number, s)}" for number, s in own if not _named(s))
        named = [(number, saddle) for number, saddle in own if _named(saddle)]
        if not named:
            named = [(number, saddle) for number, saddle in between if _named(saddle)]
            words += (f"Attractor {home}: no orbit on its basin's edge is known; those of others were taken.",)
        return tuple(
            SaddleGoal(number, tuple(dict.fromkeys(label for label in saddle.leads_to if label != home)), saddle)
            for number, saddle in named
        ), words

    def scene(self, osc: Oscillator) -> Oscillator:
        """The scene as it is."""
        return osc

    def ways(self, osc: Oscillator, structure: Structure, attractor: Attractor, stepper: Stepper) -> list[Way]:
        """The saddles on the basin's boundary, and basins that none leads to."""
        return ways_to_leave(osc, structure, attractor, stepper)

    def within(
        self, osc: Oscillator, structure: Structure, attractor: Attractor, stepper: Stepper, grids: Grids, phase: int
    ) -> NDArray[np.bool_]:
        """Those of the basin."""
        return home(osc, structure, attractor, stepper, grids, phase)

    def beyond(self, osc: Oscillator, states: Array) -> NDArray[np.bool_]:
        """None: only where the motion leads to tells."""
        return np.zeros(np.shape(states)[:-1], dtype=bool)


@dataclasses.dataclass(frozen=True)
class FirstContact(Exit):
    """Touching a stop, for the first time since the attractor was left; asked of scenes with one attractor too.

    Parameters
    ----------
    side : str, optional
        ``"left"`` or ``"right"``; by default whichever stop is touched first.
    """

    leaving: ClassVar[int] = LEFT_REGION

    side: str | None = None

    def __post_init__(self) -> None:
        if self.side not in ("left", "right", None):
            raise StructureError(f"FirstContact: side is {self.side!r}; give 'left', 'right' or None for either.")

    def check(self, osc: Oscillator, structure: Structure) -> None:
        """Refuse a scene without the stop."""
        if not self.walls(osc):
            which = f"no {self.side} stop" if self.side else "no stop"
            raise StructureError(f"the scene has {which}, so there is no contact to wait for; add a barrier.")

    def walls(self, osc: Oscillator) -> dict[str, float]:
        """Positions (m) of the stops that count, by side."""
        return {b.side: b.position for b in osc.barriers if self.side in (None, b.side)}

    def stop(self, osc: Oscillator, structure: Structure, home: int) -> Stop:
        """Return the test by position."""
        return Stop(region=np.array([self._bounds(osc), (-math.inf, math.inf)]))

    def looks(self, osc: Oscillator) -> int:
        """Many in a period, for the mass is at the stop for a short time."""
        return _LOOKS_FOR_TOUCH

    def goals(self, osc: Oscillator, structure: Structure, home: int) -> tuple[tuple[Goal, ...], tuple[str, ...]]:
        """The stops."""
        return tuple(TouchGoal(-1, (-1,), side, position) for side, position in self.walls(osc).items()), ()

    def scene(self, osc: Oscillator) -> Oscillator:
        """The scene without the stops that count, which nothing knows of before it touches."""
        return dataclasses.replace(osc, barriers=tuple(b for b in osc.barriers if b.side not in self.walls(osc)))

    def ways(self, osc: Oscillator, structure: Structure, attractor: Attractor, stepper: Stepper) -> list[Way]:
        """The stops, at whatever time."""
        return ways_to_touch(self.scene(osc), attractor, self.walls(osc).values(), stepper)

    def within(
        self, osc: Oscillator, structure: Structure, attractor: Attractor, stepper: Stepper, grids: Grids, phase: int
    ) -> NDArray[np.bool_]:
        """Those that touch no stop."""
        return ~self.beyond(osc, grids.nodes(phase))

    def beyond(self, osc: Oscillator, states: Array) -> NDArray[np.bool_]:
        """Those at a stop or in it."""
        low, high = self._bounds(osc)
        return (states[..., 0] <= low) | (states[..., 0] >= high)

    def _bounds(self, osc: Oscillator) -> tuple[float, float]:
        walls = self.walls(osc)
        return walls.get("left", -math.inf), walls.get("right", math.inf)


def _named(saddle: Saddle) -> bool:
    """Whether it is an orbit, or an equilibrium, that paths may come to at a rate."""
    return saddle.kind != "chaotic" and not (saddle.period == 1 and _is_cycle(saddle))


def _is_cycle(saddle: Saddle) -> bool:
    return bool(saddle.duration > 0) and bool(np.any(np.abs(np.abs(saddle.multipliers) - 1) < _NEUTRAL))


def _unnamed(number: int, saddle: Saddle) -> str:
    what = "a limit cycle" if _is_cycle(saddle) else "chaotic"
    return f"saddle {number} on its basin's boundary is {what}, and no path is polished to it."
