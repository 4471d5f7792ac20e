"""Noise from a measured record: Welch's estimate of its spectrum, and the model whose spectrum fits it best.

A Welch estimate is S times a gamma variable with mean 1 and ν degrees, about the number of averaged periodograms, so
that the parameters of largest likelihood minimize Σ ν (ln S + Ŝ/S), the likelihood of Whittle (P. D. Welch, *IEEE
Trans. Audio Electroacoust.* 15 (1967) 70; P. Whittle, *Ark. Mat.* 2 (1953) 423).
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.optimize
import scipy.signal
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.errors import ParameterError
from vibrokit.measured.record import checked_record

if TYPE_CHECKING:
    from vibrokit.plots.spectra import SpectrumArtists

_FEWEST = 512  # samples
_SEGMENTS = 8  # of half overlap, in a record laid end to end: 15 periodograms
_FIRST = 2  # frequencies left out, which the mean that is taken off has changed
_HIGHEST = 0.3  # of the Nyquist frequency: above, what is sampled may be folded back, or filtered by the instrument
_FINE = 4  # points of a model in a step of frequency, over which the window averages
# A Hann window at half overlap: of so many periodograms each estimate is, and so many estimates tell the same.
_PER_AVERAGE = 1 / (1 + 2 / 36)
_SHARED = 1 + 2 * ((2 / 3) ** 2 + (1 / 6) ** 2)
_FAINT = 1 / 30  # of the largest density of a model: where it is less, an instrument's own noise may be more
_STARTS = 24  # rates, over the frequencies used
_RATES = ("rad s^-1", "s^-1")
_RATIOS = np.geomspace(0.003, 3.0, 7)

Array = NDArray[np.float64]
Model = Callable[..., Any]
"""Makes noise of the parameters given by name, the intensity first."""


@dataclasses.dataclass(frozen=True, eq=False)
class NoiseEstimate:
    """Noise of a measured record, with errors and the fit.

    Attributes
    ----------
    noise : NoiseModel
        The model whose spectrum fits best.
    standard_errors : mapping of str to float
        By parameter; of the likelihood, so that they hold if the model describes the record.
    frequencies : array (count,)
        In Hz; those that were fitted.
    measured : array (count,)
        Welch's estimate of the one-sided density there, (m/s²)²/Hz.
    fitted : array (count,)
        The density of the model there, averaged as by the window.
    misfit : float
        Mean square of (measured − fitted)/fitted, times the number of averaged periodograms: about 1 where the model
        describes the record.
    """

    noise: Any
    standard_errors: Mapping[str, float]
    frequencies: Array
    measured: Array
    fitted: Array
    misfit: float

    def __str__(self) -> str:
        values = self.noise.parameters
        parts = (f"{name} = {values[name]:.4g} ± {error:.2g}" for name, error in self.standard_errors.items())
        return f"{type(self.noise).__name__}: {', '.join(parts)}; misfit {self.misfit:.2f}"

    @called
    def plot(self, ax: Any = None) -> SpectrumArtists:
        """Draw the measured spectrum and the fitted one; see `vibrokit.plots.spectra.fitted_spectrum`."""
        from vibrokit.plots.spectra import fitted_spectrum

        return fitted_spectrum(self.frequencies, self.measured, self.fitted, name=str(self), ax=ax)


class _Spectrum:
    """Welch's estimate, and the likelihood of parameters."""

    def __init__(self, owner: str, model: Model, t: Any, a: Any) -> None:
        record = checked_record(owner, t, a, _FEWEST)
        if not np.ptp(record.values) > 0:
            raise ParameterError(f"{owner}: the record is {record.values[0]:.6g} throughout; there is no noise in it.")
        self.model, self.length = model, 2 * (len(record.values) // _SEGMENTS // 2)
        found = scipy.signal.welch(record.values, 1 / record.step, nperseg=self.length, detrend="constant")
        used = slice(_FIRST, int(_HIGHEST * len(found[0])))
        self.frequencies, self.measured = (np.asarray(one, dtype=np.float64)[used] for one in found)
        self.width = float(found[0][1])  # Hz, between frequencies
        self.kept = np.ones(len(self.measured), dtype=bool)
        self.averages = _PER_AVERAGE * (2 * len(record.values) // self.length - 1)

    def density(self, parameters: Array) -> Array:
        """The density of a model as its Welch estimate has it: averaged by the spectrum of the window."""
        offsets = np.arange(-3 * _FINE, 3 * _FINE + 1) / _FINE
        kernel = (np.sinc(offsets) + np.sinc(offsets - 1) / 2 + np.sinc(offsets + 1) / 2) ** 2
        fine = self.width / _FINE * np.arange(_FINE * (_FIRST - 3), _FINE * (_FIRST + len(self.measured) + 2) + 1)
        values = self.model(*parameters).density(2 * np.pi * np.abs(fine))
        averaged = np.convolve(values, kernel / kernel.sum(), mode="valid")[::_FINE]
        return np.asarray(averaged[: len(self.measured)], dtype=np.float64)

    def profiled(self, shape: Array) -> tuple[float, float]:
        """The best intensity for the other parameters, and the loss there."""
        density = self.density(np.array([1.0, *shape]))
        with np.errstate(divide="ignore", invalid="ignore"):
            intensity = float(np.mean((self.measured / density)[self.kept]))
            known = 0 < intensity < math.inf
            loss = float(np.mean(np.log(density[self.kept])) + math.log(intensity)) if known else math.inf
        return intensity, loss if math.isfinite(loss) else math.inf

    def errors(self, parameters: Array) -> Array:
        """Standard errors by Fisher's information, in the logarithms of the parameters."""
        slopes = []
        for number in range(len(parameters)):
            moved = [parameters * np.exp(sign * 1e-4 * (np.arange(len(parameters)) == number)) for sign in (1, -1)]
            slopes.append(np.log(self.density(moved[0]) / self.density(moved[1]))[self.kept] / 2e-4)
        information = self.averages / _SHARED * np.array(slopes) @ np.array(slopes).T
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(information))), dtype=np.float64)


def fitted_noise(cls: Any, t: Any, a: Any) -> NoiseEstimate:
    """Return the noise of a class whose spectrum fits a record best, with the errors of its parameters.

    The intensity follows from the other parameters, which are positive: rates, tried at all frequencies of the record,
    and numbers. The best start is refined, and again where the density of that model is not too small.

    Raises
    ------
    ParameterError
        The record is too short, not finite or not equally spaced, or does not determine the parameters.
    """
    owner, declared = f"{cls.__name__}.from_record", cls._declared
    spectrum = _Spectrum(owner, cls, t, a)
    shape = _refined(spectrum, _best_start(spectrum, declared[1:]), declared[1:])
    first = spectrum.density(np.array([1.0, *shape]))
    spectrum.kept = first >= _FAINT * first.max()
    shape = _refined(spectrum, shape, declared[1:])
    _check_inside(owner, spectrum, declared[1:], shape)
    parameters = np.array([spectrum.profiled(shape)[0], *shape])
    noise = cls(*parameters)
    reason = noise.unresolved(2 * math.pi * spectrum.width)
    if reason:
        raise ParameterError(f"{owner}: {reason}")
    errors = parameters * spectrum.errors(parameters)
    measured, fitted = spectrum.measured[spectrum.kept], spectrum.density(parameters)[spectrum.kept]
    return NoiseEstimate(
        noise,
        {one.name: float(error) for one, error in zip(declared, errors, strict=True)},
        spectrum.frequencies[spectrum.kept],
        measured,
        fitted,
        spectrum.averages * float(np.mean((measured / fitted - 1) ** 2)),
    )


def _tried(spectrum: _Spectrum, declared: Sequence[Any]) -> list[Array]:
    """Values of each parameter from which the best fit is looked for."""
    low, high = 2 * math.pi * spectrum.frequencies[[0, -1]]
    return [np.geomspace(low, high, _STARTS) if one.unit in _RATES else _RATIOS for one in declared]


def _best_start(spectrum: _Spectrum, declared: Sequence[Any]) -> Array:
    starts = itertools.product(*_tried(spectrum, declared))
    return np.array(min(starts, key=lambda place: spectrum.profiled(np.array(place))[1]))


def _refined(spectrum: _Spectrum, shape: Array, declared: Sequence[Any]) -> Array:
    if not declared:
        return shape
    found = scipy.optimize.minimize(
        lambda logs: spectrum.profiled(np.exp(logs))[1], np.log(shape), method="Nelder-Mead",
        bounds=[(math.log(one[0] / 4), math.log(one[-1] * 4)) for one in _tried(spectrum, declared)],
        options={"xatol": 1e-6, "fatol": 1e-10},
    )  # fmt: skip
    return np.asarray(np.exp(found.x), dtype=np.float64)


def _check_inside(owner: str, spectrum: _Spectrum, declared: Sequence[Any], shape: Array) -> None:
    """Refuse rates at an end of the frequencies of the record."""
    low, high = 2 * math.pi * spectrum.frequencies[[0, -1]]
    for one, value in zip(declared, shape, strict=True):
        if one.unit in _RATES and not low < value < high:
            raise ParameterError(
                f"{owner}: the record does not tell the {one.name}: its spectrum from {low:.4g} to {high:.4g} rad/s "
                f"fits best with {value:.4g}; take a longer record, shorter steps, or another model."
            )
