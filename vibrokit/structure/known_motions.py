"""Motions of a scene with periodic excitation that are known in closed form, as guesses of its orbits.

They are the linear response to all tones together, and the motions x = c + A cos(ωt + θ) that one tone keeps up, by
harmonic balance. They are found however small their basins are, which a grid of starts may miss.
"""

from __future__ import annotations

import cmath
import functools
import math
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.region import Region
from vibrokit.structure.along_x import connected, states_at
from vibrokit.structure.one_variable import Tone, bracketed_roots, tones
from vibrokit.structure.rest import SteadyForce

Array = NDArray[np.float64]


def known_motions(osc: Oscillator, region: Region, length: float) -> Array:
    """Return states (count, n) on the section from which motion that is known in closed form starts.

    They are the linear response about each rest within a length to all tones together, the same response grown or
    shrunk until it just touches a stop, and the motions of harmonic balance. Those beyond a border of the forces, where
    no motion from the region comes, are left out.
    """
    steady = SteadyForce(osc)
    starts = [one.start for one in balances_of(osc, length)]
    for rest in steady.rests(length):
        starts += _responses(osc, steady, rest)
    return states_at(osc, np.array([start for start in starts if connected(osc, region, start[0])]).reshape(-1, 2))


def _responses(osc: Oscillator, steady: SteadyForce, rest: float) -> list[tuple[float, float]]:
    """States at t = 0 of the linear response about a rest, and of the motions of its shape that touch a stop."""
    slope = steady.slope(np.array([[rest, 0.0]]))[0]
    times = osc.section_interval * np.arange(1024) / 1024
    motion = np.zeros((len(times), 2))
    for tone in tones_of(osc, 64):
        inertia = -(tone.frequency**2) - slope[0] - 1j * tone.frequency * slope[1]
        if not inertia:
            return []
        waves = tone.amplitude * np.exp(1j * tone.frequency * times) / inertia
        motion += np.stack([waves.real, (1j * tone.frequency * waves).real], axis=1)
    if not np.isfinite(motion).all():
        return []
    ratios = [1.0]
    for barrier in osc.barriers:
        reach, gap = float((barrier.sign * motion[:, 0]).max()), barrier.sign * (barrier.position - rest)
        if reach > 0 and gap > 0:
            ratios.append(1.01 * gap / reach)
    return [(rest + ratio * float(motion[0, 0]), ratio * float(motion[0, 1])) for ratio in ratios]


def tones_of(osc: Oscillator, count: int = 8) -> list[Tone]:
    """Return the tones of the periodic excitations, the lowest of each, without those a thousand times weaker."""
    force = VectorField(osc).excitation
    periods = {index: part.period for index, part in enumerate(osc.excitations) if part.period is not None}
    known = {index: period for index, period in periods.items() if math.isfinite(period)}
    return [tone for i, period in known.items() for tone in tones(partial(force, i), period, count, 1e-3)[1]]


class Balance(NamedTuple):
    """A motion x = c + A cos(ωt + θ)."""

    centre: float
    amplitude: float
    frequency: float
    phase: float

    @property
    def start(self) -> tuple[float, float]:
        """Its state (x, v) at t = 0."""
        swing = self.amplitude * cmath.exp(1j * self.phase)
        return self.centre + swing.real, -self.frequency * swing.imag


@functools.lru_cache(maxsize=256)
def balances_of(osc: Oscillator, length: float) -> tuple[Balance, ...]:
    """Return the motions that the tones of the excitations keep up, each tone alone, about the rests within a length.

    A resonance of a nonlinear spring has several amplitudes; the largest one is limited by the damping (A. H. Nayfeh
    and D. T. Mook, "Nonlinear Oscillations", 1979, section 4.1). About a rest, the centre of a motion moves with its
    amplitude. All amplitudes are found at which the force needed is that of the tone: changes of sign are bracketed,
    and so is where the curve of needed force falls below the force of the tone between two trial amplitudes.
    """
    steady = SteadyForce(osc)
    rests = steady.rests(length)
    return tuple(one for tone in tones_of(osc) for rest in rests for one in _balances_about(steady, tone, rest))


def _balances_about(steady: SteadyForce, tone: Tone, rest: float) -> Iterator[Balance]:
    """The motions about one rest that one tone keeps up."""
    deflection = tone.force / steady.osc.reference_frequency**2
    damping = steady.osc.linear_damping * tone.frequency
    most = min(1e3 * deflection, tone.force / damping if damping else math.inf)
    if not most > 0:
        return
    # To twice what the damping allows, so that the curve of needed force turns back before the end.
    amplitudes = np.geomspace(1e-3 * min(most, deflection), 2 * most, 200)
    centres = [rest]
    for amplitude in amplitudes:
        centres.append(_Swing(steady, tone.frequency, amplitude).centre_near(centres[-1]))

    def motion_at(logarithm: float) -> tuple[float, complex]:
        """Centre of the motion of an amplitude, and the negative of the force that keeps it up."""
        swing = _Swing(steady, tone.frequency, math.exp(logarithm))
        near = int(np.searchsorted(amplitudes, swing.amplitude))
        centre = swing.centre_near(centres[min(near, len(amplitudes))])
        return centre, swing.missing(centre)

    def excess(logarithm: float) -> float:
        return abs(motion_at(logarithm)[1]) - tone.force

    places = np.log(amplitudes)
    values = np.array([excess(place) for place in places])
    for root in bracketed_roots(excess, places, values):
        centre, missing = motion_at(root)
        yield Balance(centre, math.exp(root), tone.frequency, tone.phase - cmath.phase(-missing))


class _Swing:
    """A trial motion c + A cos ωt, without its centre c."""

    def __init__(self, steady: SteadyForce, frequency: float, amplitude: float) -> None:
        self.steady, self.frequency, self.amplitude = steady, frequency, amplitude
        self.phases = 2 * math.pi / 128 * np.arange(128)
        cosine, sine = np.cos(self.phases), np.sin(self.phases)
        self.states = np.stack([amplitude * cosine, -amplitude * frequency * sine], axis=-1)

    def about(self, centre: float) -> Array:
        return self.states + np.array([centre, 0.0])

    def centre_near(self, centre: float) -> float:
        """The centre on which the mean force is 0, by Newton steps from one near it."""
        for _ in range(4):
            motion = self.about(centre)
            force, slope = float(np.mean(self.steady(motion))), float(np.mean(self.steady.slope(motion)[:, 0]))
            step = -force / slope if slope else math.nan
            if not math.isfinite(step) or step == 0.0:
                break
            centre += float(np.clip(step, -self.amplitude, self.amplitude))
        return centre

    def missing(self, centre: float) -> complex:
        """The part of the force at the motion's own frequency that balances no inertia, as 2⟨… e^(−iτ)⟩."""
        inertia = self.frequency**2 * self.states[:, 0]
        force = self.steady(self.about(centre))
        return complex(2 * np.mean((inertia + force) * np.exp(-1j * self.phases)))
