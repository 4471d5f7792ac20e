"""The contact-free linear response of a scene about its position of rest, in closed form."""

from __future__ import annotations

import cmath
import dataclasses
import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_lyapunov

from vibrokit.errors import NoSectionError
from vibrokit.oscillator import Oscillator
from vibrokit.parts.barrier import Barrier
from vibrokit.structure.one_variable import Tone, bracketed_roots, tones
from vibrokit.symbolic.numeric import amplitude_at, drift_at, excitation_of, jacobian_of

_UNDAMPED = 1e-12  # of a rate: damping of that size is rounding

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class LinearResponse:
    """Free and forced motion of the linearized scene without stops: x″ + c x′ + κ x about its rest."""

    rest: float  # stable position of rest nearest to x = 0 under the constant forces (m)
    stiffness: float  # κ (s⁻²)
    damping: float  # c (s⁻¹)
    left: float  # largest forced displacements from the rest (m), not negative
    right: float
    speed: float  # largest of the forced motion (m s⁻¹)
    noise: float  # standard deviation of x by noise (m); NaN without noise, and where it is not bounded or varies

    def reach(self, side: str) -> float:
        """Largest forced displacement towards a stop (m)."""
        return self.right if side == "right" else self.left

    def gap(self, barrier: Barrier) -> float:
        """Distance from the rest to a stop (m); negative where the rest is inside."""
        return barrier.sign * (barrier.position - self.rest)


def linear_response(osc: Oscillator) -> LinearResponse | None:
    """Return the linear response about the rest nearest to x = 0; None if there is no stable rest without contact.

    Rests that are clear of the stops come first. Forces that vary in time with the state have their mean.
    """
    _, mean = _tones(osc)
    drift, extra = drift_at(osc.model), len(osc.model.state) - 2

    def force(x: float) -> float:
        return drift([x, 0.0, *[0.0] * extra])[1] + mean

    away = np.geomspace(1e-12, 1e12, 24 * 32 + 1)  # distances (m) at which forces at rest are compared with 0
    places = np.concatenate([-away[::-1], [0.0], away])
    values = np.array([force(float(place)) for place in places])
    if not values.any():  # no spring: it rests anywhere
        return None
    jacobian = jacobian_of(osc.model)

    def preferred(x: float) -> tuple[int, float]:  # a rest inside a stop only where there is no other
        return sum(barrier.sign * (x - barrier.position) > 0 for barrier in osc.barriers), abs(x)

    for rest in sorted(bracketed_roots(force, places, values), key=preferred):
        state = [rest, 0.0, *[0.0] * extra]
        matrix = np.array(jacobian(state))
        if not np.isfinite(matrix).all() or matrix[1, 0] >= 0:
            continue
        rates = np.linalg.eigvals(matrix)
        if rates.real.max() <= _UNDAMPED * np.abs(rates).max():
            left, right, speed = _forced(osc, _tones(osc, rest)[0], float(-matrix[1, 0]), float(-matrix[1, 1]))
            noise = math.nan if osc.model.in_time.modulated else _noise(osc, matrix, state)
            return LinearResponse(rest, float(-matrix[1, 0]), float(-matrix[1, 1]), left, right, speed, noise)
    return None


def _tones(osc: Oscillator, rest: float = 0.0) -> tuple[list[Tone], float]:
    """Tones of the excitations at a rest, and the sum of the means of those of time alone, without constants."""
    found, mean, modulated = list[Tone](), 0.0, osc.model.in_time.modulated
    for index, part in enumerate(osc.excitations):
        if part.period is not None and math.isfinite(part.period):
            # At most 63 tones of each, none below 1e-9 of the largest.
            own, more = tones(excitation_of(osc.model, index, rest), part.period, 63, 1e-9)
            found, mean = found + more, mean + (0.0 if part.depends_on_state and modulated else own)
    return found, mean


def _forced(osc: Oscillator, found: list[Tone], stiffness: float, damping: float) -> tuple[float, float, float]:
    """Largest displacements to the left and the right, and largest speed, of the response to all tones."""
    with np.errstate(divide="ignore", invalid="ignore"):
        waves = [(w, np.complex128(f) / (stiffness - w * w + 1j * w * damping)) for w, f in found]
    if not waves:
        return 0.0, 0.0, 0.0
    try:
        period = osc.period or math.inf
    except NoSectionError:
        period = math.inf
    most = period * max(w for w, _ in waves) / (2 * math.pi)
    if not most <= 1024 or not all(cmath.isfinite(a) for _, a in waves):
        reach = float(sum(abs(a) for _, a in waves))  # so many waves meet in phase at some time
        return reach, reach, float(sum(w * abs(a) for w, a in waves))
    count = math.ceil(512 * most)  # in the shortest wave 512: a parabola through the highest errs by 5e-10
    phases = 2j * np.pi * np.arange(count) / count
    turns = [np.exp(phases * round(w * period / (2 * math.pi))) for w, _ in waves]
    x = sum((a * turn).real for (_, a), turn in zip(waves, turns, strict=True))
    v = sum((1j * w * a * turn).real for (w, a), turn in zip(waves, turns, strict=True))
    return _peak(-x), _peak(x), max(_peak(v), _peak(-v))


def _peak(values: Array) -> float:
    """Largest value of a periodic series, by a parabola through its largest sample and the two beside it."""
    at = int(np.argmax(values))
    before, top, after = values[at - 1], values[at], values[(at + 1) % len(values)]
    bend = before - 2 * top + after
    return max(0.0, float(top - (after - before) ** 2 / (8 * bend) if bend < 0 else top))


def _noise(osc: Oscillator, matrix: Array, state: list[float]) -> float:
    """Standard deviation of x in the linear scene."""
    rates = np.linalg.eigvals(matrix)
    if osc.noise is None or rates.real.max() >= -_UNDAMPED * np.abs(rates).max():
        return math.nan
    natural = math.sqrt(-matrix[1, 0])
    units = np.array([natural, *[1.0] * (len(matrix) - 1)])  # in ω_n x and ω_n t, for matrices of any unit
    scaled = matrix * units[:, None] / units / natural
    column = np.array(amplitude_at(osc.model, state))[:, None]
    variance = solve_continuous_lyapunov(scaled, -column @ column.T)[0, 0] * osc.noise.intensity / natural**3
    return math.sqrt(variance) if variance >= 0 else math.nan


def departure(osc: Oscillator, response: LinearResponse, reach: float, speed: float) -> float:
    """Return how far forces depart from the linear ones at a distance (m) and a speed (m s⁻¹), as a part of these.

    It is infinite for forces that vary in time with the state: no linear response is that of a constant system then.
    """
    if osc.model.in_time.modulated:
        return math.inf
    drift, extra = drift_at(osc.model), [0.0] * (len(osc.model.state) - 2)
    at_rest, largest = drift([response.rest, 0.0, *extra])[1], 0.0
    for x, v in ((reach, 0.0), (-reach, 0.0), (0.0, speed), (0.0, -speed)):
        linear = -response.stiffness * x - response.damping * v
        force = drift([response.rest + x, v, *extra])[1] - at_rest
        if abs(force - linear) > 1e-12 * (abs(at_rest) + abs(linear)):  # more than rounding
            largest = max(largest, abs(force - linear) / abs(linear) if linear else math.inf)
        if math.isnan(force):
            return math.inf
    return largest
