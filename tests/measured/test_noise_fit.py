"""Noise from simulated records of known parameters."""

import functools
import math

import numpy as np
import pytest
import scipy.signal

import vibrokit as vk
from tests.layers import long
from vibrokit.errors import ParameterError

FINE = 8  # steps of the simulation in a sample, so that the instrument's filter has something to keep out
COLOURED = vk.ColouredNoise(0.2, 1.7), 0.1, 8192
NARROW = vk.FilteredNoise(0.2, 1.7, 0.05), 0.1, 16384
WHITE = vk.WhiteNoise(0.2), 0.01, 4096
FILTERS = {  # numerator and denominator of the transfer function, with SciPy's bilinear transformation
    vk.ColouredNoise: lambda one: ([one.rate], [1, one.rate]),
    vk.FilteredNoise: lambda one: (
        [2 * one.damping_ratio * one.frequency, 0],
        [1, 2 * one.damping_ratio * one.frequency, one.frequency**2],
    ),
    vk.WhiteNoise: lambda one: ([1.0], [1.0]),
}


def recorded(noise, step, count, seed):
    """A record of the force behind an instrument's low pass."""
    fine, extra = step / FINE, count * FINE // 4  # until it is stationary
    kicks = np.random.default_rng(seed).standard_normal(count * FINE + extra) * math.sqrt(noise.intensity / fine)
    passed = scipy.signal.bilinear(*FILTERS[type(noise)](noise), 1 / fine)
    force = scipy.signal.lfilter(*passed, kicks)[extra:]
    return step * np.arange(count), scipy.signal.decimate(force, FINE, ftype="fir")


@functools.cache
def estimates(case, seeds):
    return [type(case[0]).from_record(*recorded(*case, seed)) for seed in range(seeds)]


def deviations(case, seeds):
    """By seed and parameter: how many stated errors an estimate is off."""
    known = case[0].parameters
    return np.array(
        [
            [(one.noise.parameters[name] - known[name]) / error for name, error in one.standard_errors.items()]
            for one in estimates(case, seeds)
        ]
    )


@pytest.mark.parametrize("case", [COLOURED, NARROW, WHITE], ids=lambda case: type(case[0]).__name__)
def test_a_record_gives_the_parameters_within_their_errors(case):
    (estimate,) = estimates(case, 1)
    assert list(estimate.standard_errors) == list(case[0].parameters)
    assert np.abs(deviations(case, 1)).max() < 4
    assert 0.3 < estimate.misfit < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("case", [COLOURED, long(NARROW), WHITE], ids=lambda case: type(case[0]).__name__)
def test_stated_errors_cover_the_scatter(case):
    """Of 40 records: 68 % and 95 % lie within one and two errors if these are right; two deviations of 40 are less."""
    off = np.abs(deviations(case, 40))
    assert (off < 1).mean(axis=0).min() > 0.68 - 2 * math.sqrt(0.68 * 0.32 / 40)
    assert (off < 2).mean(axis=0).min() > 0.95 - 2 * math.sqrt(0.95 * 0.05 / 40)
    assert np.sqrt((off**2).mean(axis=0)).max() < 1.5


def test_four_times_the_record_halves_the_errors():
    noise, step, count = COLOURED
    long, short = vk.ColouredNoise.from_record(*recorded(noise, step, 4 * count, 0)), estimates(COLOURED, 1)[0]
    for name in noise.parameters:
        parts = [one.standard_errors[name] / one.noise.parameters[name] for one in (long, short)]
        assert parts[0] / parts[1] == pytest.approx(0.5, rel=0.15)


def test_the_wrong_model_fits_badly():
    assert vk.WhiteNoise.from_record(*recorded(*COLOURED, 0)).misfit > 5.0


def test_the_fit_is_shown():
    (estimate,) = estimates(COLOURED, 1)
    drawn = estimate.plot()
    assert drawn.figure is not None
    np.testing.assert_array_equal(drawn.measured.get_ydata(), estimate.measured)
    np.testing.assert_allclose(
        drawn.fitted.get_ydata(), estimate.noise.density(2 * np.pi * estimate.frequencies), rtol=0.02
    )
    assert "rate = " in str(estimate)
    again = estimate.plot(ax=drawn.ax)
    assert again.ax is drawn.ax


TIMES = 0.1 * np.arange(2048)
VALUES = np.random.default_rng(0).standard_normal(2048)


def changed(array, place, value):
    return np.where(np.arange(len(array)) == place, value, array)


@pytest.mark.parametrize(
    ("kind", "t", "a", "said"),
    [
        (vk.ColouredNoise, [0, 1, 2], [1, 2, 1], "a record must have 512 samples or more, got 3."),
        (vk.WhiteNoise, changed(TIMES, 7, 0.75), VALUES, "times must rise by equal steps, got steps from 0.05 to 0.15"),
        (vk.WhiteNoise, TIMES[::-1], VALUES, "times must rise by equal steps"),
        (vk.WhiteNoise, TIMES, changed(VALUES, 9, math.nan), "values must be finite numbers, got nan at place 9"),
        (vk.WhiteNoise, TIMES, VALUES[1:], "of the same length, got shapes (2048,) and (2047,)"),
        (vk.WhiteNoise, TIMES, ["a"] * 2048, "must be sequences of real numbers, got an array of type"),
        (vk.WhiteNoise, TIMES, np.ones(2048), "the record is 1 throughout; there is no noise in it."),
        (vk.FilteredNoise, TIMES, VALUES, "the spectrum has no peak"),
    ],
)
def test_what_is_no_record(kind, t, a, said):
    with pytest.raises(ParameterError) as caught:
        kind.from_record(t, a)
    assert str(caught.value).startswith(f"{kind.__name__}.from_record: ")
    assert said in str(caught.value)
    assert str(caught.value).endswith(".")


def test_a_record_too_short_for_the_width_of_the_peak():
    sharp = vk.FilteredNoise(0.2, 2 * math.pi, 0.001)
    with pytest.raises(ParameterError, match=r"rad/s wide, and the record resolves .* times as long, or longer\."):
        vk.FilteredNoise.from_record(*recorded(sharp, 0.05, 2048, 0))


def test_a_record_too_short_for_the_rate():
    with pytest.raises(ParameterError, match=r"the record does not tell the rate: .* take a longer record"):
        vk.ColouredNoise.from_record(*recorded(vk.ColouredNoise(0.2, 0.005), 0.1, 2048, 0))
