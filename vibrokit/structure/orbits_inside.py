"""Unstable orbits inside a chaotic set, from its close returns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.errors import StructureError
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.structure.orbits import EQUAL, Orbit, least_period, refine_orbit, same_point, visited

Array = NDArray[np.float64]


def orbits_inside(osc: Oscillator, points: Array, stepper: Stepper, most: int, longest: int) -> tuple[Orbit, ...]:
    """Find unstable periodic orbits inside a chaotic set, the shortest periods first, `most` at most.

    A chaotic motion passes near each of them: where it nearly returns after some periods, Newton's method finds the
    orbit (Lathrop & Kostelich, Phys. Rev. A 40, 4028, 1989). The points (count, n) sample the set on the section: one
    motion, or several one after the other, in the order of time. Periods are at most `longest`.
    """
    spacing = float(np.median(cKDTree(points).query(points, k=2)[0][:, 1]))
    found: list[Orbit] = []
    known = np.empty((0, points.shape[1]))
    for period in range(1, min(longest, len(points) - 1) + 1):
        apart = np.linalg.norm(points[period:] - points[:-period], axis=1)
        for start in np.argsort(apart)[:4]:
            if apart[start] > 4 * max(spacing, float(apart.min())) or apart[start] > 0.1 * np.ptp(points):
                break
            try:
                orbit = refine_orbit(osc, points[start], period, stepper)
                orbit = least_period(osc, orbit, stepper)
                if len(known) and same_point(osc, orbit.point, known, EQUAL):
                    continue
                visits = visited(osc, orbit, stepper)
            except StructureError:
                continue
            unstable = float(np.abs(orbit.multipliers).max()) > 1
            if unstable and cKDTree(points).query(visits)[0].max() < 50 * spacing:
                found.append(orbit)
                known = np.concatenate([known, visits])
            if len(found) == most:
                return tuple(found)
    return tuple(found)
