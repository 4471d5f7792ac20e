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
from vibrokit.structure.borders import intervals_within
from vibrokit.structure.roots import bracketed_roots
from vibrokit.structure.tones import SAMPLES, Tone, tones

_AMPLITUDES, _PHASES = 200, 128  # of the trial motions
_LEAST_SWING, _MOST_SWING = 1e-3, 1e3  # of the deflection: range of amplitudes, where the damping does not bound it
_BEYOND = 2.0  # times the amplitude that the damping allows, so that the curve of needed force turns back before it
_PLACES, _FARTHEST, _MOST_RESTS = 513, 4.0, 5  # within so many lengths of x = 0, where rests are searched for
_TONES, _LEAST_TONE = 8, 1e-3  # of each excitation, and the least of them, of the largest
_CENTRINGS = 4  # Newton steps for the centre of a motion, from that of the amplitude before

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


def tones_of(osc: Oscillator, count: int = _TONES) -> list[Tone]:
    """Return the tones of the periodic excitations, the lowest of each, without those that are far weaker."""
    force = VectorField(osc).excitation
    periods = {index: part.period for index, part in enumerate(osc.excitations) if part.period is not None}
    known = {index: period for index, period in periods.items() if math.isfinite(period)}
    return [tone for i, period in known.items() for tone in tones(partial(force, i), period, count, _LEAST_TONE)[1]]


class SteadyForce:
    """The force on the mass (m s⁻²) without the periodic part of the excitations."""

    def __init__(self, osc: Oscillator) -> None:
        self.field, self.osc = VectorField(osc), osc
        self._extra = len(osc.noise.extra_states) if osc.noise else 0
        periods = {i: part.period for i, part in enumerate(osc.excitations) if part.period is not None}
        now = sum(self.field.excitation(index, 0.0) for index in periods)
        self._periodic = now - sum(self._mean(*each) for each in periods.items() if math.isfinite(each[1]))

    def _mean(self, index: int, period: float) -> float:
        return float(np.mean([self.field.excitation(index, period * k / SAMPLES) for k in range(SAMPLES)]))

    def __call__(self, states: Array) -> Array:
        """Return the force at states (…, 2)."""
        with np.errstate(all="ignore"):  # a force may be singular
            rates: Array = self.field.rate(self._padded(states))[..., 1] - self._periodic
        return rates

    def slope(self, states: Array) -> Array:
        """Return the derivatives of the force by x and v at states (…, 2), shape (…, 2)."""
        with np.errstate(all="ignore"):
            derivatives: Array = self.field.jacobian(self._padded(states))[..., 1, :2]
        return derivatives

    def _padded(self, states: Array) -> Array:
        return np.concatenate([states, np.zeros((*states.shape[:-1], self._extra))], axis=-1) if self._extra else states

    def rests(self, length: float) -> list[float]:
        """Return the places nearest to x = 0, within some lengths of it, where this force is 0 at rest."""

        def at_rest(x: float) -> float:
            return float(self(np.array([[x, 0.0]]))[0])

        found = list[float]()
        for low, high in intervals_within(self.osc, -_FARTHEST * length, _FARTHEST * length):
            places = np.linspace(low, high, _PLACES)
            values = self(np.stack([places, np.zeros_like(places)], axis=1))
            found += bracketed_roots(at_rest, places, values)
        return sorted(sorted(found, key=abs)[:_MOST_RESTS])


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
    most = min(_MOST_SWING * deflection, tone.force / damping if damping else math.inf)
    if not most > 0:
        return
    amplitudes = np.geomspace(min(most, deflection) * _LEAST_SWING, _BEYOND * most, _AMPLITUDES)
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
    for _ in range(_CENTRINGS):
        motion = _motion(frequency, amplitude, centre)
        force, slope = float(np.mean(steady(motion))), float(np.mean(steady.slope(motion)[:, 0]))
        step = -force / slope if slope else math.nan
        if not math.isfinite(step) or step == 0.0:
            break
        centre += float(np.clip(step, -amplitude, amplitude))
    return centre
