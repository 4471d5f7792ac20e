"""Exits: what counts as leaving an attractor."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.escape import escape_faces, escapes
from vibrokit.analyzers.path_ends import AtFace, AtSaddle, InBasin, PathEnd
from vibrokit.construction import Constructed
from vibrokit.errors import StructureError, shown
from vibrokit.kernels.ensemble import UNBOUNDED, Stop
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import ESCAPED
from vibrokit.results.structure import Structure
from vibrokit.structure.along_x import apart
from vibrokit.structure.scales import turns_of

_CHECKS_WITHOUT_SECTION = 16  # exit tests per unit of time where no section sets them
_CHECKS_BY_POSITION = 32  # per turn of the free mass: if it turns back between two tests it has gone little further

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
@dataclasses.dataclass(frozen=True)
class Exit(ABC, metaclass=Constructed):
    """What counts as leaving an attractor: a value that every method asks the same few questions. Abstract.

    A subclass becomes a frozen dataclass by itself; no decorator is needed.

    For developers
    --------------
    An exit answers whether a state is out, where a path may end, and what the kernel tests. An exit that consists in
    leaving a rectangle of (x, v) inherits from `LeaveRegion` and writes `bounds` alone.
    """

    by_position: ClassVar[bool] = False
    """Whether position and velocity decide, at any time; otherwise the basin decides, on the section."""

    @property
    def at_boundary(self) -> bool:
        """Whether a state has left as soon as it is in another basin; otherwise, when it has settled there."""
        return False

    @property
    @abstractmethod
    def event(self) -> str:
        """What is counted, as rates name it."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        dataclasses.dataclass(frozen=True)(cls)

    def check_scene(self, osc: Oscillator) -> None:
        """Raise StructureError if the scene has no such exit, whatever its structure."""

    def check(self, osc: Oscillator, structure: Structure) -> None:
        """Raise StructureError if the structure has no such exit."""

    def scene(self, osc: Oscillator) -> Oscillator:
        """Return the scene that a path moves in until it leaves."""
        return osc

    @abstractmethod
    def is_out(self, osc: Oscillator, states: Array) -> Mask:
        """Return which states have left, by position alone; shape of ``states[..., 0]``."""

    def beyond(self, osc: Oscillator, states: Array) -> Array:
        """Return how far states have left: 0 on the edge of what `is_out`, positive beyond, in any unit.

        Densities are more exact where this changes smoothly across the edge; by default it is 1 beyond and −1 before.
        """
        return np.where(self.is_out(osc, states), 1.0, -1.0)

    def faces(self, osc: Oscillator, structure: Structure, source: int) -> Array:
        """Return the bounds of x and of v beyond which a state has left the attractor `source`, shape (2, 2).

        They are infinite if there are none.
        """
        return UNBOUNDED

    @abstractmethod
    def stop(self, osc: Oscillator, structure: Structure, source: int) -> Stop:
        """Return the kernel's test for trajectories that start at the attractor `source`."""

    @abstractmethod
    def path_ends(self, osc: Oscillator, structure: Structure, source: int) -> tuple[PathEnd, ...]:
        """Return where a path of least action from the attractor `source` may end."""

    def targets(self, structure: Structure, source: int) -> tuple[Attractor, ...]:
        """Return the attractors that may be reached; by default all others. An exit by position has no use for them."""
        return tuple(attractor for attractor in structure.attractors if attractor.label != source)

    def checks_per_period(self, osc: Oscillator) -> int:
        """Return how many times in a section interval the test is made."""
        if self.by_position:
            return _CHECKS_BY_POSITION * 2 ** max(0, math.floor(math.log2(max(turns_of(osc), 1.0))))
        return _CHECKS_WITHOUT_SECTION if osc.autonomous else 1

    def holds_at(self, osc: Oscillator, attractor: Attractor) -> bool:
        """Return whether an attractor already satisfies the exit condition, without noise."""
        return bool(self.is_out(osc, attractor.orbit).any())


def beyond_faces(faces: Array, states: Array) -> Array:
    """Return how far states (…, n) are beyond the bound of x or of v that they exceed most; negative between all."""
    low, high = faces.T
    distance: Array = np.maximum(low - states[..., :2], states[..., :2] - high).max(axis=-1)
    return distance


class LeaveBasin(Exit):
    """Leaving the basin of attraction, tested on the section, for the basin of another attractor, or by escape.

    Motion escapes if it leaves the region of the structure and never comes back without noise. At finite noise a state
    has escaped when, at any time, x is beyond all motion that comes back: where the first escaping motion settles, but
    at most as far beyond the barrier as the attractors are before it. It has also escaped when motion ended, as at a
    pole.

    Parameters
    ----------
    for_good : bool
        Whether a state at finite noise has left only when it has settled around another attractor. Otherwise it has
        left at its first section point in another basin. Where that basin has thin arms, noise often brings the state
        back, so that this rate is larger. The activation energy is the same.
    to : int or str, optional
        Label or name of the attractor that must be reached; by default any other. Motion on a third attractor goes on.
        It serves states that noise exchanges quickly: together they are metastable, and only leaving all of them
        counts.
    """

    for_good: bool = True
    to: int | str | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.for_good, bool):
            raise StructureError(f"LeaveBasin: for_good must be True or False, got {shown(self.for_good)}.")

    @property
    def at_boundary(self) -> bool:
        """Whether the first state in another basin counts."""
        return not self.for_good

    @property
    def event(self) -> str:
        """``"commitment"``, or ``"basin"`` if the first state in another basin counts."""
        return "commitment" if self.for_good else "basin"

    def check(self, osc: Oscillator, structure: Structure) -> None:
        """Refuse a structure of one attractor that no motion escapes from."""
        if len(structure.attractors) < 2 and not escapes(structure):
            low, high = structure.region.x
            instead = f"ask for the first time that x passes a bound (exit=LeaveBounds(x=({low:.3g}, {high:.3g})))"
            if osc.barriers:
                instead = f"ask for the first contact with a stop (exit=FirstContact()), or {instead}"
            if not structure.complete:
                raise StructureError(
                    "the structure is incomplete, because its search was stopped: only one attractor and no way out "
                    f"are known; find the structure with more time, or {instead}."
                )
            raise StructureError(
                "the structure has only one attractor, and no motion escapes from its region, so there is no other "
                f"basin to leave for; widen the region, change the scene, or {instead}."
            )
        if self.to is not None:
            structure.attractor(self.to)

    def targets(self, structure: Structure, source: int) -> tuple[Attractor, ...]:
        """The one that must be reached, or all others; raises StructureError if that one is the source."""
        if self.to is None:
            return super().targets(structure, source)
        wanted = structure.attractor(self.to)
        if wanted.label == source:
            raise StructureError(f"LeaveBasin: to={self.to!r} is the attractor that is left; give another one.")
        return (wanted,)

    def is_out(self, osc: Oscillator, states: Array) -> Mask:
        """No state: only the attractor that it leads to decides."""
        return np.zeros(np.shape(states)[:-1], dtype=bool)

    def faces(self, osc: Oscillator, structure: Structure, source: int) -> Array:
        """Bounds of x beyond which motion has escaped from the region for good."""
        return escape_faces(osc, structure, structure.attractors[source])

    def stop(self, osc: Oscillator, structure: Structure, source: int) -> Stop:
        """Test the basin grid."""
        basins, reached = structure.basins, [attractor.label for attractor in self.targets(structure, source)]
        labels = np.where((basins.labels < 0) | np.isin(basins.labels, reached), basins.exits, source)
        return Stop().with_cells(basins.region.bounds, labels, home=source)

    def path_ends(self, osc: Oscillator, structure: Structure, source: int) -> tuple[PathEnd, ...]:
        """The saddles on basin boundaries, this basin's first; then target basins to which none of its own leads."""
        own, others = [], []
        start, allowed = float(structure.attractors[source].points[0, 0]), self.targets(structure, source)
        wanted = [each.label for each in allowed if not apart(osc, start, float(each.points[0, 0]))]
        # Without a wanted one, motion that leaves the region counts too. What did not settle is no exit.
        counting = {*wanted, *(() if self.to is not None else (ESCAPED,))}
        for number, saddle in enumerate(structure.saddles):
            targets = tuple(dict.fromkeys(one for one in saddle.leads_to if one in counting))
            if source in saddle.leads_to and targets:
                own.append(AtSaddle(targets, number, embedded=saddle.embedded))
            elif saddle.on_boundary:
                others.append(AtSaddle(targets, number, on_own_boundary=False, embedded=saddle.embedded))
        reached = {source, *(label for end in own for label in end.targets)}
        basins = [InBasin((label,)) for label in wanted if label not in reached]
        return (*own, *others, *basins)


class LeaveRegion(Exit):
    """Leaving a rectangle of (x, v), at any time. Abstract.

    For developers
    --------------
    Write `bounds`; infinite bounds are no faces. Paths, simulations and densities all follow from it, so that a class
    with a region of another shape, or another test, is refused with a StructureError.
    """

    by_position: ClassVar[bool] = True

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        for name in ("is_out", "beyond", "faces", "stop", "path_ends"):
            if name in vars(cls):
                raise StructureError(
                    f"{cls.__name__} has its own {name}, which exit paths would not follow; write bounds alone, the "
                    "rectangle in (x, v) that is left."
                )

    @property
    def event(self) -> str:
        """``"contact"``."""
        return "contact"

    @abstractmethod
    def bounds(self, osc: Oscillator) -> Array:
        """Return the bounds of x and of v, shape (2, 2)."""

    def is_out(self, osc: Oscillator, states: Array) -> Mask:
        """States on a face or beyond it."""
        out: Mask = self.beyond(osc, states) >= 0
        return out

    def beyond(self, osc: Oscillator, states: Array) -> Array:
        """Distance beyond the face that is exceeded most, in x or in v."""
        return beyond_faces(np.asarray(self.bounds(osc), dtype=float), states)

    def faces(self, osc: Oscillator, structure: Structure, source: int) -> Array:
        """The bounds."""
        return np.asarray(self.bounds(osc), dtype=float)

    def check_scene(self, osc: Oscillator) -> None:
        """Raise StructureError if `bounds` returns no rectangle."""
        given = self.bounds(osc)
        try:
            found = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            found = np.empty(0)
        if found.shape != (2, 2) or not np.all(found[:, 0] <= found[:, 1]):
            raise StructureError(
                f"{type(self).__name__}: bounds must return ((least x, largest x), (least v, largest v)), got "
                f"{shown(given)}."
            )

    def stop(self, osc: Oscillator, structure: Structure, source: int) -> Stop:
        """Test the bounds."""
        return Stop(region=self.faces(osc, structure, source))

    def path_ends(self, osc: Oscillator, structure: Structure, source: int) -> tuple[PathEnd, ...]:
        """The faces."""
        return tuple(
            AtFace((-1,), axis, float(level), outward)
            for axis, pair in enumerate(self.faces(osc, structure, source))
            for outward, level in zip((-1, 1), pair, strict=True)
            if math.isfinite(level)
        )


class LeaveBounds(LeaveRegion):
    """Passing a bound of x or of v for the first time; a scene with one attractor and no stop has this exit too.

    Parameters
    ----------
    x, v : (float, float), optional
        Least and largest displacement (m) and velocity (m s⁻¹); one may be infinite. By default without bounds.
    """

    x: tuple[float, float] = (-math.inf, math.inf)
    v: tuple[float, float] = (-math.inf, math.inf)

    def __post_init__(self) -> None:
        for name, bounds in (("x", self.x), ("v", self.v)):
            try:
                low, high = map(float, bounds)
            except (TypeError, ValueError) as error:
                raise StructureError(
                    f"LeaveBounds: {name} must be the least and the largest value, got {shown(bounds)}."
                ) from error
            if not low < high:
                raise StructureError(f"LeaveBounds: {name} goes from {low:g} to {high:g}; give the lower bound first.")
            object.__setattr__(self, name, (low, high))
        if not np.isfinite([self.x, self.v]).any():
            raise StructureError("LeaveBounds: there is no bound to pass; give one, such as x=(-0.1, 0.1).")

    def bounds(self, osc: Oscillator) -> Array:
        """The bounds of x and of v."""
        return np.array([self.x, self.v])


class FirstContact(LeaveRegion):
    """Touching a stop for the first time since the attractor was left; scenes with one attractor have this exit too.

    Parameters
    ----------
    side : str, optional
        ``"left"`` or ``"right"``; by default either stop.
    """

    side: str | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.side, str | None) or self.side not in ("left", "right", None):
            raise StructureError(
                f"FirstContact: side must be 'left', 'right' or None for either, got {shown(self.side)}."
            )

    def check_scene(self, osc: Oscillator) -> None:
        """Refuse a scene without the stop."""
        if not self._stops(osc):
            which = f"no {self.side} stop" if self.side else "no stop"
            raise StructureError(f"the scene has {which}, so there is no contact to wait for; add a barrier.")

    def bounds(self, osc: Oscillator) -> Array:
        """Positions of the stops that count."""
        stops = self._stops(osc)
        return np.array([[stops.get("left", -math.inf), stops.get("right", math.inf)], [-math.inf, math.inf]])

    def scene(self, osc: Oscillator) -> Oscillator:
        """The scene without the stops that count: a path feels no force of theirs before it touches."""
        return dataclasses.replace(osc, barriers=tuple(b for b in osc.barriers if b.side not in self._stops(osc)))

    def holds_at(self, osc: Oscillator, attractor: Attractor) -> bool:
        """Whether the orbit touches a stop that counts; samples of the orbit may miss a short contact."""
        hits = sum(attractor.hits.get(side, 0.0) for side in self._stops(osc))
        return hits > 0 or super().holds_at(osc, attractor)

    def _stops(self, osc: Oscillator) -> dict[str, float]:
        return {b.side: b.position for b in osc.barriers if self.side in (None, b.side)}
