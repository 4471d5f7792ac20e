"""Escape: bounds of x beyond which motion has left a region for good, found from motion without noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.ensemble import UNBOUNDED, run_ensemble
from vibrokit.kernels.stopping import COMPLETED, DIVERGED
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import ESCAPED, UNSETTLED
from vibrokit.results.structure import Structure
from vibrokit.symbolic.flow_kind import Flow

Array = NDArray[np.float64]


def escapes(structure: Structure) -> bool:
    """Whether motion without noise escapes from the region of a structure, from a saddle or from any cell."""
    leaves = any(ESCAPED in saddle.leads_to for saddle in structure.saddles)
    return leaves or bool((structure.basins.exits == ESCAPED).any())


def escape_faces(osc: Oscillator, structure: Structure, attractor: Attractor) -> Array:
    """Return bounds of x that escaping motion passes and motion to an attractor does not, shape (2, 2).

    Cells of the region are samples of both motions. A side through which no motion escapes has an infinite bound. A
    bound is where the first escaping motion settles, as at the bottom of the next well. It is at most as far beyond the
    barrier as the barrier is from the attractors, unless motion returns from there, and at most halfway to a pole. On
    the circle no bound is finite, because there is no outside along x.
    """
    faces = UNBOUNDED.copy()
    low, high = osc.model.domain.around(float(attractor.points[0, 0]))
    centres = structure.region.cell_centres(structure.basins.labels.shape)
    labels = np.where((centres[:, 0] > low) & (centres[:, 0] < high), structure.basins.exits.ravel(), UNSETTLED)
    outgoing = _some(centres[labels == ESCAPED])
    if structure.circle or not len(outgoing):
        return faces
    orbits = np.concatenate([one.orbit[:, 0] for one in structure.attractors])
    orbits = orbits[(orbits > low) & (orbits < high)]
    kept, _ = _followed(osc, _some(centres[labels >= 0]), (low, high))
    _, late = _followed(osc, outgoing, (low, high))
    known = [saddle.orbit[:, 0] for saddle in structure.saddles if ESCAPED in saddle.leads_to]
    tops = np.concatenate([*known, orbits[:0]])
    for side, border in enumerate((low, high)):
        sign = 1.0 if side else -1.0
        returns = float(np.max(sign * np.append(kept, orbits)))
        around = (late[:, 0] < orbits.min()) & (late[:, 1] > orbits.max())
        farthest, middle = sign * late[around, side], sign * late[~around].mean(axis=1)
        settled = [*(0.5 * (returns + farthest)), *middle[middle > np.max(sign * orbits)]]
        if settled:
            inner = float(np.max(sign * orbits))
            top = float(np.max(sign * tops, initial=inner, where=(tops > low) & (tops < high)))
            most = max(2.0 * (top if top > inner else returns) - inner, returns)
            faces[0, side] = sign * min(max(min(settled), returns), most, 0.5 * (returns + sign * border))
    return faces


def _some(states: Array, most: int = 256) -> Array:
    """At most so many of the states, evenly chosen."""
    return states[np.unique(np.linspace(0, len(states) - 1, min(len(states), most)).astype(int))]


def _followed(osc: Oscillator, states: Array, borders: tuple[float, float]) -> tuple[Array, Array]:
    """Least and largest x of motions from some states (count, 2): over all time, and over the last 8 section intervals.

    Both have shape (count, 2). Motions are followed for 256 section intervals at most, which is 7 relaxations at a
    damping ratio of 0.0045, and seen at 16 places in each. Motion that ends, at a pole or because it diverges, is
    placed at the border ahead of it.
    """
    started = np.zeros((len(states), 2 + len(osc.noise.extra_states if osc.noise else ())))
    started[:, :2] = states
    stepper, going = ensemble_stepper(osc, Flow.STATE), np.arange(len(states))
    extent = np.repeat(states[:, :1], 2, axis=1)
    late = extent.copy()
    count = 8 * 16
    for number in range(256 // 8):
        if not len(going):
            break
        ended = run_ensemble(
            osc, Flow.STATE, stepper, started[going], count, interval=osc.section_interval / 16, visits=count,
            phases=number * count,
        )  # fmt: skip
        x = np.where(np.arange(count) < ended.intervals[:, None], ended.visits[:, :, 0], np.nan)
        x = np.where(np.isfinite(x), x, ended.states[:, :1])
        late[going] = np.stack([x.min(axis=1), x.max(axis=1)], axis=1)
        extent[going] = np.stack(
            [np.minimum(extent[going, 0], late[going, 0]), np.maximum(extent[going, 1], late[going, 1])], axis=1
        )
        over = ended.status == DIVERGED
        ahead = np.where(ended.states[over, 1] > 0, borders[1], borders[0])
        late[going[over]] = ahead[:, None]
        started[going] = ended.states
        going = going[ended.status == COMPLETED]
    return extent, late
