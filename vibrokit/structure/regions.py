"""Regions of (x, v) that follow from a scene and from its attractors."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.oscillator import Oscillator
from vibrokit.parts.barrier import Barrier
from vibrokit.results.attractor import Attractor
from vibrokit.results.region import Region
from vibrokit.structure.along_x import between_borders, turn_of
from vibrokit.structure.basins.landings import on_circle, without_copies
from vibrokit.structure.basins.stop_cells import MARGIN, is_extended
from vibrokit.structure.rest import SteadyForce, tops_around
from vibrokit.structure.scales import length_of, units_of
from vibrokit.structure.validation import DEFAULT_CELLS

_ROOM = 1.5  # width of a region, in units of that of what it is made to contain
_RESOLVED = 2 * MARGIN + 1  # cells: fewer do not lead to one attractor with all those around them

Array = NDArray[np.float64]


def search_region(osc: Oscillator) -> Region:
    """Return a region for starts: it contains the stops, and the reach of a linear oscillator under the same forces."""
    reach = length_of(osc)
    speed = max(reach * osc.reference_frequency, _speed_of_turning(osc))
    return _without_deep_contact(osc, between_borders(osc, Region((-reach, reach), (-speed, speed))))


def regions_over_tops(osc: Oscillator, searched: Region) -> list[Region]:
    """Return a region for starts that contains the tops of potential barriers around a region; none for no tops."""
    low, high = over_tops(osc, (), *searched.x)
    if (low, high) == searched.x:
        return []
    speed = max(osc.reference_frequency * max(-low, high), SteadyForce(osc).speed_to_reach(low, high))
    return [_without_deep_contact(osc, between_borders(osc, Region((low, high), (-speed, speed))))]


def _speed_of_turning(osc: Oscillator) -> float:
    """Largest of the mean speeds (m/s) that a steady force or one turn in each period of the forcing gives; or 0."""
    turn, damping = turn_of(osc), osc.linear_damping
    if not turn:
        return 0.0
    places = np.stack([np.linspace(0.0, turn, 64, endpoint=False), np.zeros(64)], axis=1)
    drift = abs(float(SteadyForce(osc)(places).mean())) / damping if damping else 0.0
    return _ROOM * max(drift, turn / osc.section_interval)


def frame_of(osc: Oscillator, attractors: Sequence[Attractor]) -> Region:
    """Return a region that contains the attractors' points and the stops, with a margin around them.

    It contains the largest speed of each attractor at any phase, since other motions pass the section there. It is at
    least as wide as the gap between two stops. Without two stops it is at least as wide as the widest motion,
    or, if all attractors are at rest, as the length scale of the scene. Beyond a stop it ends at the depth that its
    largest speed can reach. Where the force of the spring repeats along x, as that of a pendulum, it contains the copy
    of each attractor that is nearest to x = 0, and is at least one turn wide; exactly that if an attractor turns over.
    It contains the tops of the potential barriers around the attractors, as far as a grid then resolves what is inside,
    and the speeds at which the mass reaches them and the stops.
    """
    attractors = without_copies(osc, attractors)
    if on_circle(osc, attractors, None):
        return _turn_around(osc, attractors)
    cycles = [attractor.orbit for attractor in attractors if attractor.kind == "limit cycle"]
    points = np.concatenate([*(attractor.points[:, :2] for attractor in attractors), *cycles])
    places = [barrier.position for barrier in osc.barriers]
    x, v = points.T
    low, high = over_tops(osc, attractors, min([x.min(), *places]), max([x.max(), *places]))
    least = _least_half_width(osc, attractors)
    middle, half = 0.5 * (low + high), _ROOM * max(0.5 * (high - low), least)
    swing = float(np.abs(x - x.mean()).max())
    fastest = max(float(np.abs(attractor.orbit[:, 1]).max()) for attractor in attractors)
    crossing = SteadyForce(osc).speed_to_reach(low, high)
    speed = _ROOM * max(osc.reference_frequency * max(swing, least), float(np.abs(v).max()), fastest, crossing)
    region = Region((float(middle - half), float(middle + half)), (-speed, speed))
    region = between_borders(osc, region, x.tolist())
    return _without_deep_contact(osc, region, (float(x.min()), float(x.max())))


def _least_half_width(osc: Oscillator, attractors: Sequence[Attractor]) -> float:
    """Half the gap between two stops, or a turn, or else the widest motion, or the length of a scene at rest."""
    places = [barrier.position for barrier in osc.barriers]
    gap = float(np.ptp(places)) if len(places) == 2 else 0.0
    widest = max(0.5 * float(np.ptp(attractor.orbit[:, 0])) for attractor in attractors)
    return 0.5 * max(gap, turn_of(osc)) or (widest if widest > 1e-3 * length_of(osc) else length_of(osc))


def over_tops(osc: Oscillator, attractors: Sequence[Attractor], low: float, high: float) -> tuple[float, float]:
    """Return a range of x (m) extended to the next tops of potential barriers on both sides, the lower first.

    A top is left out where a grid around it would not resolve the attractors, the stops, and the lower top.
    """
    held = bool(osc.barriers)
    for top in tops_around(osc, low, high, length_of(osc)):
        wider = min(low, top.place), max(high, top.place)
        widths = _ROOM * np.array([wider[1] - wider[0], 2 * top.speed])
        inside = [np.array([high - low, 2 * SteadyForce(osc).speed_to_reach(low, high)])] if held else []
        cells = np.abs(np.array([*inside, *_differences(osc, attractors)]).reshape(-1, 2)) / (widths / DEFAULT_CELLS)
        if np.all(cells[: len(inside)] >= _RESOLVED) and np.all(cells[len(inside) :].max(axis=1) >= _RESOLVED):
            low, high, held = *wider, True
    return low, high


def _differences(osc: Oscillator, attractors: Sequence[Attractor]) -> list[Array]:
    """Return the differences (x, v) of the nearest points of each two attractors, and the extent of each wide one."""
    found = [np.ptp(_met(one), axis=0) for one in attractors if is_extended(one)]
    for one, other in itertools.combinations(attractors, 2):
        offsets = (_met(one)[:, None] - _met(other)[None]).reshape(-1, 2)
        found.append(offsets[np.argmin(np.linalg.norm(offsets / units_of(osc)[:2], axis=1))])
    return found


def _met(one: Attractor) -> Array:
    """Points of an attractor on the section, at most 256; of a limit cycle, those of its orbit."""
    points = one.orbit if one.kind == "limit cycle" else one.points[:, :2]
    return points[:: -(-len(points) // 256)]


def _turn_around(osc: Oscillator, attractors: Sequence[Attractor]) -> Region:
    """Return one turn along x around the attractors that do not turn over, to half a turn, and all their speeds."""
    turn = turn_of(osc)
    resting = [each for each in attractors if not each.turns] or attractors
    middle = 0.5 * turn * round(float(resting[0].points[:, 0].mean()) / (0.5 * turn))
    fastest = max(float(np.abs(each.orbit[:, 1]).max()) for each in attractors)
    speed = _ROOM * max(fastest, osc.reference_frequency * 0.5 * turn)
    return Region((middle - 0.5 * turn, middle + 0.5 * turn), (-speed, speed))


def _without_deep_contact(osc: Oscillator, region: Region, kept: tuple[float, float] = (math.inf, -math.inf)) -> Region:
    """Return the part of a region that the mass reaches with the region's largest speed; `kept` stays inside.

    A state deeper in a stiff stop has more energy than any state of interest: it is thrown out at a speed far above
    those of the region, and strikes the stops many times in each period before it is back.
    """
    (low, high), speed = region.x, max(region.v)
    for barrier in osc.barriers:
        edge = high if barrier.side == "right" else low
        most = barrier.sign * (edge - barrier.position)
        if most <= 0:
            continue
        end = barrier.position + barrier.sign * _ROOM * _reached_depth(osc, barrier, speed, most)
        if barrier.side == "right":
            high = min(high, max(end, kept[1]))
        else:
            low = max(low, min(end, kept[0]))
    return Region((low, high), region.v)


def _reached_depth(osc: Oscillator, barrier: Barrier, speed: float, most: float) -> float:
    """Depth (m), at most `most`, at which the force beyond that at first touch has stopped a mass of some speed."""
    steady, depths = SteadyForce(osc), most * np.concatenate([[0.0], np.geomspace(1e-9, 1.0, 400)])
    places = barrier.position + barrier.sign * depths
    touching = barrier.sign * float(steady.at_rest(places[:1])[0])
    energy = depths * touching - np.concatenate([[0.0], np.cumsum(steady.work(places)[1])])
    beyond = np.flatnonzero(~(energy <= 0.5 * speed**2))
    return float(depths[beyond[0]]) if beyond.size else most
