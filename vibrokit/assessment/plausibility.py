"""Plausibility: closed forms of a scene, in which wrong units are visible before any integration."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from enum import StrEnum

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from vibrokit.assessment.linear_response import LinearResponse, departure, linear_response
from vibrokit.assessment.oddities import Oddity, OddityCode
from vibrokit.construction import called
from vibrokit.errors import NoSectionError
from vibrokit.oscillator import Oscillator, check_oscillator
from vibrokit.parts.barrier import Barrier
from vibrokit.parts.spring import LinearSpring
from vibrokit.symbolic.numeric import amplitude_at, contact_force_of
from vibrokit.text_table import text_table
from vibrokit.text_units import STANDARD_GRAVITY

# The correct scenes of tests/assessment/test_plausibility.py lie within these limits, except those counted there.
_FAR = 100.0  # of a ratio of forcing to natural frequency, or of amplitude to gap: two decades from resonance
_NEAR = 2.0  # of f/f_n: where systems with stops are forced; 2π away from it, Hz was given for rad/s
_HEAVY = 0.5  # of the damping ratio: above it there is no resonance, and 0.5 % is 0.005
_NEVER = 1e3  # of ΔU/D: exp(1000) periods is longer than anything
_BRIEF = 1e-4  # of a period: fixed steps that resolve a contact are beyond 10⁵ in a period
_BEYOND = 1.01  # of displacement over gap: tones beyond the 63rd, which the response leaves out, are less
_LINEAR = 0.1  # departure of the forces from linear ones, as a part of these, up to which linear responses are given


class Measure(StrEnum):
    """The quantity of a row, with its heading and its unit."""

    heading: str
    unit: str

    def __new__(cls, value: str, heading: str, unit: str = "") -> Measure:
        member = str.__new__(cls, value)
        member._value_ = value
        member.heading, member.unit = heading, unit
        return member

    NATURAL_HZ = "natural-hz", "natural frequency", "Hz"
    NATURAL_RAD = "natural-rad", "natural frequency", "rad/s"
    QUALITY = "quality", "quality factor 1/2ζ"
    DECAY_TIME = "decay-time", "time of decay", "s"
    FREQUENCY_RATIO = "frequency-ratio", "forcing over natural frequency"
    REST = "rest", "position of rest, where springs are linearized", "m"
    AMPLITUDE = "amplitude", "forced displacement from rest, without contact", "m"
    AMPLITUDE_OVER_GAP = "amplitude-over-gap", "forced displacement over the gap"
    NOISE_RMS = "noise-rms", "rms displacement by noise, without contact", "m"
    NOISE_OVER_GAP = "noise-over-gap", "rms displacement by noise over the gap"
    CONTACT_TIME = "contact-time", "time of a contact", "s"
    CONTACT_OVER_PERIOD = "contact-over-period", "time of a contact over the period"
    FIRST_CONTACT = "first-contact", "ΔU of the first contact", "m² s⁻³"
    FIRST_CONTACT_OVER_D = "first-contact-over-d", "ΔU of the first contact over D"
    PSD = "psd", "noise as one-sided spectral density", "(m/s²)²/Hz"
    PSD_G = "psd-g", "noise as one-sided spectral density", "g_n²/Hz"


@dataclasses.dataclass(frozen=True)
class Row:
    """One number: its quantity, its value, and the stop (by side) or the excitation (by path) that it belongs to."""

    measure: Measure
    value: float
    subject: str = ""

    @property
    def heading(self) -> str:
        """The quantity, and what it belongs to."""
        return self.measure.heading + (f" ({self.subject})" if self.subject else "")

    def __str__(self) -> str:
        return f"{self.heading}: {self.value:.4g} {self.measure.unit}".rstrip()


@dataclasses.dataclass(frozen=True)
class Plausibility:
    """Closed forms of a scene, and which of them are unusual; ``str(plausibility)`` is a table and sentences.

    Attributes
    ----------
    rows : tuple of Row
        Rows that do not apply to the scene are left out.
    oddities : tuple of Oddity
    """

    rows: tuple[Row, ...]
    oddities: tuple[Oddity, ...]

    def value(self, measure: Measure, subject: str = "") -> float:
        """Return the value of a row; NaN if there is no such row."""
        return next((row.value for row in self.rows if (row.measure, row.subject) == (measure, subject)), math.nan)

    def __str__(self) -> str:
        cells = [(row.heading, f"{row.value:.4g} {row.measure.unit}") for row in self.rows]
        return "\n".join([*(text_table(cells) if cells else []), *map(str, self.oddities)])


@called
def plausibility(osc: Oscillator) -> Plausibility:
    """Return closed forms of a scene: frequencies, linear response, contact times, noise. Nothing is compiled.

    The response is that of the scene without stops, linearized about its position of rest nearest to x = 0. It is not
    compared with the gap to a stop if the forces up to that stop depart from linear ones by more than a tenth.
    """
    check_oscillator(osc)
    response = linear_response(osc)
    found: list[Row | Oddity] = [*_frequencies(osc, response), *_noise(osc, response)]
    if response is not None:
        for index, barrier in enumerate(osc.barriers):
            found += _stop(osc, response, index, barrier)
        found += _always_touching(osc, response)
    if osc.damping_ratio is not None and osc.damping_ratio >= _HEAVY:
        found.append(Oddity(OddityCode.HEAVY_DAMPING, {"ratio": osc.damping_ratio}))
    return Plausibility(
        tuple(one for one in found if isinstance(one, Row) and math.isfinite(one.value)),
        tuple(one for one in found if isinstance(one, Oddity)),
    )


def _frequencies(osc: Oscillator, response: LinearResponse | None) -> Iterator[Row | Oddity]:
    if response is None:
        return
    natural = math.sqrt(response.stiffness)
    yield Row(Measure.NATURAL_HZ, natural / (2 * math.pi))
    yield Row(Measure.NATURAL_RAD, natural)
    if response.damping > 0:
        yield Row(Measure.QUALITY, natural / response.damping)
        yield Row(Measure.DECAY_TIME, 2 / response.damping)
    yield Row(Measure.REST, response.rest)
    ratios = {
        f"excitations.{index}": 2 * math.pi / part.period / natural
        for index, part in enumerate(osc.excitations)
        if part.period is not None and math.isfinite(part.period)
    }
    yield from (Row(Measure.FREQUENCY_RATIO, ratio, path) for path, ratio in ratios.items())
    if ratios:
        if not osc.model.in_time.modulated:
            yield Row(Measure.AMPLITUDE, max(response.left, response.right))
        yield from _odd_frequency(min(ratios.values(), key=lambda ratio: abs(math.log(ratio))))


def _odd_frequency(ratio: float) -> Iterator[Oddity]:
    """Unusual ratios of the forcing nearest to resonance."""
    for code, other in (
        (OddityCode.NATURAL_FREQUENCY_IN_HZ, ratio / (2 * math.pi)),
        (OddityCode.FORCING_IN_HZ, ratio * 2 * math.pi),
    ):
        if 1 / _NEAR <= other <= _NEAR and not 1 / _NEAR <= ratio <= _NEAR:
            yield Oddity(code, {"ratio": ratio, "other": other})
    if not 1 / _FAR <= ratio <= _FAR:
        yield Oddity(OddityCode.FREQUENCY_FAR, {"ratio": ratio})


def _noise(osc: Oscillator, response: LinearResponse | None) -> Iterator[Row]:
    if osc.noise is None or not osc.noise.intensity:
        return
    if response is not None:
        yield Row(Measure.NOISE_RMS, response.noise)
    if not osc.noise.extra_states:  # otherwise the force is not white
        factor = amplitude_at(osc.model, (response.rest if response else 0.0, 0.0))[1]
        density = 2 * osc.noise.intensity * factor**2
        yield Row(Measure.PSD, density)
        yield Row(Measure.PSD_G, density / STANDARD_GRAVITY**2)


def _stop(osc: Oscillator, response: LinearResponse, index: int, barrier: Barrier) -> Iterator[Row | Oddity]:
    side, gap = barrier.side, response.gap(barrier)
    natural = math.sqrt(response.stiffness)
    if gap < 0:
        clear = barrier.sign * (-barrier.position - response.rest) > 0
        values = {"side": side, "depth": -gap, "position": barrier.position, "mirrored": -barrier.position}
        yield Oddity(OddityCode.MISSING_SIGN if clear else OddityCode.PRELOADED, values)
    elif gap > 0 and departure(osc, response, gap, min(response.speed, gap * natural)) <= _LINEAR:
        yield from _reach(osc, response, side, gap)
    speed = next((v for v in (response.speed, response.noise * natural, abs(gap) * natural) if 0 < v < math.inf), 0.0)
    duration = contact_time(osc, index, speed) if speed else math.nan
    yield Row(Measure.CONTACT_TIME, duration, side)
    yield Row(Measure.CONTACT_OVER_PERIOD, duration / osc.time_unit, side)
    if duration * natural > math.pi:
        yield Oddity(OddityCode.STOP_SOFT, {"side": side, "ratio": duration * natural / math.pi})
    if duration < _BRIEF * osc.time_unit:
        yield Oddity(OddityCode.CONTACT_BRIEF, {"side": side, "ratio": duration / osc.time_unit})


def _reach(osc: Oscillator, response: LinearResponse, side: str, gap: float) -> Iterator[Row | Oddity]:
    """How far excitations and noise move the mass towards a stop."""
    reach = response.reach(side)
    if response.speed > 0:
        yield Row(Measure.AMPLITUDE_OVER_GAP, reach / gap, side)
        if reach > _FAR * gap:
            yield Oddity(OddityCode.AMPLITUDE_LARGE, {"side": side, "ratio": reach / gap})
        if reach * _FAR < gap:
            yield Oddity(OddityCode.AMPLITUDE_SMALL, {"side": side, "ratio": reach / gap})
    if osc.noise is None or not response.noise > 0:
        return
    yield Row(Measure.NOISE_OVER_GAP, response.noise / gap, side)
    if response.noise > gap:
        yield Oddity(OddityCode.NOISE_STRONG, {"side": side, "ratio": response.noise / gap})
    if reach < gap:  # 2ζω_n³ (b − max x)² for white noise
        ratio = 0.5 * ((gap - reach) / response.noise) ** 2
        yield Row(Measure.FIRST_CONTACT, ratio * osc.noise.intensity, side)
        yield Row(Measure.FIRST_CONTACT_OVER_D, ratio, side)
        if ratio > _NEVER:
            yield Oddity(OddityCode.NOISE_WEAK, {"side": side, "ratio": ratio})


def _always_touching(osc: Oscillator, response: LinearResponse) -> Iterator[Oddity]:
    """The stop that every steady motion reaches, by the largest ratio of displacement to gap, if it is certain.

    A linear scene with damping has one steady motion without contact, which a clear steady state would have to be.
    """
    linear = osc.friction is None and (osc.spring is None or type(osc.spring) is LinearSpring)
    if not linear or response.damping <= 0 or any(part.depends_on_state for part in osc.excitations):
        return
    try:
        if not math.isfinite(osc.period or math.inf):
            return
    except NoSectionError:
        return
    clear = [stop for stop in osc.barriers if response.gap(stop) > 0]
    ratios = {stop.side: response.reach(stop.side) / response.gap(stop) for stop in clear}
    side = max(ratios, key=lambda one: ratios[one], default=None)
    if side is not None and ratios[side] > _BEYOND:
        yield Oddity(OddityCode.NO_CLEAR_STATE, {"side": side, "ratio": ratios[side]})


def contact_time(osc: Oscillator, index: int, speed: float) -> float:
    """Return the time from touch to release at one stop for an impact at some speed (m s⁻¹).

    The force is that at rate 0, which conserves energy. The largest depth d follows from ∫₀ᵈ F dδ = v²/2, and the time
    is 2 ∫₀ᵈ dδ/√(v² − 2∫F). For kδ that is π/√k; for kδ^(3/2) it is 2.94 d/v. NaN if the force does not turn the mass
    back.
    """
    force = contact_force_of(osc.model, index)
    length = speed / osc.reference_frequency  # the depths are searched over twenty decades about it
    nodes, weights = np.polynomial.legendre.leggauss(40)

    def work(low: float, high: float) -> float:
        """∫F dδ, in δ = low + (high − low) s²: smooth at touch for half-integer powers."""
        s = 0.5 * (nodes + 1)
        forces = np.array([max(force(low + (high - low) * each**2, 0.0), 0.0) for each in s])
        return float((high - low) * (weights * s * forces).sum())

    def excess(depth: float) -> float:
        return work(0.0, depth) - 0.5 * speed**2

    low, high = 1e-15 * length, 1e6 * length
    if not excess(low) < 0 < excess(high):
        return math.nan
    logarithm = brentq(lambda each: excess(math.exp(each)), math.log(low), math.log(high), xtol=1e-13)
    depth = math.exp(logarithm)

    def integrand(s: float) -> float:  # δ = d(1 − s²): the speed vanishes like s at the turning point
        remaining = 2 * work(depth * (1 - s * s), depth)
        return 2 * s * depth / math.sqrt(remaining) if remaining > 0 else 0.0

    return 2 * float(quad(integrand, 0.0, 1.0, epsrel=1e-8, limit=50)[0])
