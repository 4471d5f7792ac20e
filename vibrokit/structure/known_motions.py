"""Motions of a scene with periodic excitation that are known in closed form, as guesses of its orbits.

They are found however small their basins are, which a grid of starts may miss.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.oscillator import Oscillator
from vibrokit.results.region import Region
from vibrokit.structure.borders import connected
from vibrokit.structure.harmonic_balance import balances_of, tones_of
from vibrokit.structure.orbits import SAMPLES
from vibrokit.structure.rest import SteadyForce
from vibrokit.structure.scales import length_of, states_at

Array = NDArray[np.float64]


def known_motions(osc: Oscillator, region: Region) -> Array:
    """Return states (count, n) on the section from which motion that is known in closed form starts.

    They are the linear response about each rest to all tones together, the same response grown or shrunk until it just
    touches a stop, and the motions of harmonic balance. Those beyond a border of the forces, where no motion from the
    region comes, are left out.
    """
    length, steady = length_of(osc), SteadyForce(osc)
    starts = [one.start for one in balances_of(osc, length)]
    for rest in steady.rests(length):
        starts += _responses(osc, steady, rest)
    return states_at(osc, np.array([start for start in starts if connected(osc, region, start[0])]).reshape(-1, 2))


def _responses(osc: Oscillator, steady: SteadyForce, rest: float) -> list[tuple[float, float]]:
    """States at t = 0 of the linear response about a rest, and of the motions of its shape that touch a stop."""
    slope = steady.slope(np.array([[rest, 0.0]]))[0]
    times = osc.section_interval / SAMPLES * np.arange(SAMPLES)
    motion = np.zeros((SAMPLES, 2))
    for tone in tones_of(osc, 64):
        inertia = -(tone.frequency**2) - slope[0] - 1j * tone.frequency * slope[1]
        if not inertia:
            return []
        waves = tone.amplitude * np.exp(1j * tone.frequency * times) / inertia
        motion += np.stack([waves.real, (1j * tone.frequency * waves).real], axis=1)
    if not np.isfinite(motion).all():
        return []
    start = (rest + float(motion[0, 0]), float(motion[0, 1]))
    found = [start]
    for barrier in osc.barriers:
        reach, gap = float((barrier.sign * motion[:, 0]).max()), barrier.sign * (barrier.position - rest)
        if reach > 0 and gap > 0:
            ratio = 1.01 * gap / reach
            found.append((rest + ratio * float(motion[0, 0]), ratio * float(motion[0, 1])))
    return found
