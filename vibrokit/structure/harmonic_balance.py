"""Periodic motions x = c + A cos(ωt + θ) that one tone of an excitation keeps up, by harmonic balance."""

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
from vibrokit.structure.rest import SteadyForce
from vibrokit.structure.roots import bracketed_roots
from vibrokit.structure.tones import Tone, tones

_AMPLITUDES, _PHASES = 200, 128  # of the trial motions

Array = NDArray[np.float64]


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


def tones_of(osc: Oscillator, count: int = 8) -> list[Tone]:
    """Return the tones of the periodic excitations, the lowest of each, without those a thousand times weaker."""
    force = VectorField(osc).excitation
    periods = {index: part.period for index, part in enumerate(osc.excitations) if part.period is not None}
    known = {index: period for index, period in periods.items() if math.isfinite(period)}
    return [tone for i, period in known.items() for tone in tones(partial(force, i), period, count, 1e-3)[1]]


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
    return tuple(one for tone in tones_of(osc) for rest in rests for one in _about(osc, steady, tone, rest))


def _about(osc: Oscillator, steady: SteadyForce, tone: Tone, rest: float) -> Iterator[Balance]:
    """The motions about one rest that one tone keeps up."""
    natural = osc.natural_frequency
    deflection, damping = tone.force / natural**2, 2 * osc.damping_ratio * natural * tone.frequency
    most = min(1e3 * deflection, tone.force / damping if damping else math.inf)
    if not most > 0:
        return
    # To twice what the damping allows, so that the curve of needed force turns back before the end.
    amplitudes = np.geomspace(1e-3 * min(most, deflection), 2 * most, _AMPLITUDES)
    centres = [rest]
    for amplitude in amplitudes:
        centres.append(_centre(steady, tone.frequency, amplitude, centres[-1]))

    def motion_at(logarithm: float) -> tuple[float, complex]:
        """Centre of the motion of an amplitude, and the negative of the force that keeps it up."""
        amplitude = math.exp(logarithm)
        near = int(np.searchsorted(amplitudes, amplitude))
        centre = _centre(steady, tone.frequency, amplitude, centres[min(near, _AMPLITUDES)])
        return centre, _missing(steady, tone.frequency, amplitude, centre)

    def excess(logarithm: float) -> float:
        return abs(motion_at(logarithm)[1]) - tone.force

    places = np.log(amplitudes)
    values = np.array([excess(place) for place in places])
    for root in bracketed_roots(excess, places, values):
        centre, missing = motion_at(root)
        yield Balance(centre, math.exp(root), tone.frequency, tone.phase - cmath.phase(-missing))


def _motion(frequency: float, amplitude: float, centre: float) -> Array:
    """States (phases, 2) of a motion."""
    phases = 2 * math.pi / _PHASES * np.arange(_PHASES)
    return np.stack([centre + amplitude * np.cos(phases), -amplitude * frequency * np.sin(phases)], axis=-1)


def _missing(steady: SteadyForce, frequency: float, amplitude: float, centre: float) -> complex:
    """The part of the force on a motion at its own frequency that balances no inertia, as 2⟨… e^(−iτ)⟩."""
    phases = 2 * math.pi / _PHASES * np.arange(_PHASES)
    inertia = amplitude * frequency**2 * np.cos(phases)
    force = steady(_motion(frequency, amplitude, centre))
    return complex(2 * np.mean((inertia + force) * np.exp(-1j * phases)))


def _centre(steady: SteadyForce, frequency: float, amplitude: float, centre: float) -> float:
    """Centre of the motion of an amplitude on which the mean force is 0, by Newton steps from a centre near it."""
    for _ in range(4):
        motion = _motion(frequency, amplitude, centre)
        force, slope = float(np.mean(steady(motion))), float(np.mean(steady.slope(motion)[:, 0]))
        step = -force / slope if slope else math.nan
        if not math.isfinite(step) or step == 0.0:
            break
        centre += float(np.clip(step, -amplitude, amplitude))
    return centre
