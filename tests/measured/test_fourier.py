"""The Fourier series of measured records: against series that are known, and records that have none."""

import math

import numpy as np
import pytest
from scipy.special import iv

import vibrokit as vk
from vibrokit.errors import ParameterError

PERIOD = 2.5
KNOWN = {"c_1": 0.7, "s_1": -0.2, "c_2": 0.0, "s_2": 0.1, "c_3": -0.05, "s_3": 0.3}
RNG = np.random.default_rng(0)


def known(t):
    turn = 2 * math.pi / PERIOD * np.asarray(t)
    waves = (KNOWN[f"c_{k}"] * np.cos(k * turn) + KNOWN[f"s_{k}"] * np.sin(k * turn) for k in (1, 2, 3))
    return 0.4 + sum(waves)


RECORDS = {
    "one period, ends alike": (np.linspace(1.0, 1.0 + PERIOD, 65), None),
    "one period, last sample left out": (np.linspace(0.0, PERIOD, 64, endpoint=False), PERIOD),
    "four periods": (np.linspace(-3.0, -3.0 + 4 * PERIOD, 150), PERIOD),
    "unequal steps": (np.sort(np.r_[0.0, RNG.uniform(0, 3 * PERIOD, 200), 3 * PERIOD]), PERIOD),
}


@pytest.mark.parametrize(("t", "period"), RECORDS.values(), ids=RECORDS)
def test_a_series_is_found_again(t, period):
    found = vk.Periodic.from_samples(t, known(t), error=1e-6, period=period)
    assert found.harmonics == 3
    values = found.excitation.parameters
    assert values.pop("frequency") == pytest.approx(2 * math.pi / PERIOD, rel=1e-12)
    assert values == pytest.approx(KNOWN | {"mean": 0.4}, abs=1e-9)
    assert found.rms_error < 1e-7


@pytest.mark.parametrize("error", [0.3, 0.05, 0.01, 1e-4])
def test_the_number_of_harmonics_follows_from_the_error(error):
    """exp(cos τ) = I_0(1) + 2 Σ I_k(1) cos kτ (Abramowitz & Stegun, 9.6.34)."""
    t = np.linspace(0.0, 2 * math.pi, 257)
    found = vk.Periodic.from_samples(t, np.exp(np.cos(t)), error=error)
    powers = 2 * iv(np.arange(1, 30), 1.0) ** 2
    left = [math.sqrt(powers[k:].sum() / powers.sum()) for k in range(1, 20)]
    assert found.harmonics == 1 + next(k for k, share in enumerate(left) if share <= error)
    assert found.left_out == pytest.approx(left[found.harmonics - 1], rel=0.05)  # 256 samples, one twice
    for k in range(1, found.harmonics + 1):
        assert found.excitation.parameters[f"c_{k}"] == pytest.approx(2 * iv(k, 1.0), abs=0.02 * error)


def test_noise_of_the_record_is_left_out_and_coefficients_are_within_their_error():
    t = np.linspace(0.0, 8 * PERIOD, 4000, endpoint=False)
    deviation = 0.02
    found = vk.Periodic.from_samples(t, known(t) + RNG.normal(0, deviation, len(t)), error=0.04, period=PERIOD)
    assert (found.harmonics, found.samples, found.periods) == (3, 4000, 8)
    assert found.rms_error == pytest.approx(deviation, rel=0.05)  # four standard errors
    assert found.coefficient_error == pytest.approx(deviation * math.sqrt(2 / 4000), rel=0.05)
    changes = [found.excitation.parameters[name] - value for name, value in KNOWN.items()]
    assert np.abs(changes).max() < 4 * found.coefficient_error
    assert "3 harmonics of 2.51327 rad/s from 4000 samples in 8 periods" in str(found)


def test_a_linear_mass_answers_each_harmonic():
    part = vk.Periodic(0.6, 0.3, c_1=0.2, s_2=-0.1, c_7=0.05)
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=[part])
    sizes, rates = np.array([0.3, 0.2, 0.1j, 0.05]), 0.6 * np.array([0, 1, 2, 7])
    responses = sizes / (1 - rates**2 + 0.2j * rates)
    expected = [responses.sum().real, (1j * rates * responses).sum().real]
    np.testing.assert_allclose(osc.section_map([[0.0, 0.0]], 30)[0], expected, atol=1e-6)
    flown = osc.trajectory(expected, periods=3, samples=2, stepper=vk.FreeFlight(1e-12))
    np.testing.assert_allclose(flown.states[-1], expected, atol=1e-10)
    assert part.frequencies == pytest.approx(0.6 * np.array([1, 2, 7]))


@pytest.mark.slow
@pytest.mark.parametrize("stepper", [None, vk.FreeFlight(1e-12)])
def test_a_series_of_many_harmonics_is_followed(stepper):
    rates, sizes = 0.6 * np.arange(1, 31), 0.3 / np.arange(1, 31) ** 2
    part = vk.Periodic(0.6, **{f"c_{k}": size for k, size in enumerate(sizes, 1)})
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=[part])
    responses = sizes / (1 - rates**2 + 0.2j * rates)
    steady = [responses.sum().real, (1j * rates * responses).sum().real]
    path = osc.trajectory(steady, periods=1, samples=2, stepper=stepper)
    np.testing.assert_allclose(path.states[-1], steady, atol=1e-8)


def test_coefficients_in_a_scene_file_and_by_path(tmp_path):
    part = vk.Periodic(0.6, s_10=-0.1, c_2=0.05)
    assert list(part.parameters) == ["frequency", "mean", "c_2", "s_10"]
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=[part])
    vk.save_scene(osc, tmp_path / "record.toml")
    assert vk.load_scene(tmp_path / "record.toml") == osc
    assert osc.replace(c_2=0.06).excitations[0] == vk.Periodic(0.6, s_10=-0.1, c_2=0.06)


def test_coefficients_with_units_are_divided_by_the_mass():
    part = vk.Periodic("0.1 Hz", c_1="0.5 N", s_2="3 m/s^2")
    osc = vk.Oscillator(mass="0.25 kg", stiffness="0.25 N/m", damping_ratio=0.1, excitations=[part])
    found = osc.excitations[0].parameters
    assert found == pytest.approx({"frequency": 0.2 * math.pi, "mean": 0.0, "c_1": 2.0, "s_2": 3.0}, rel=1e-14)


LINE = np.linspace(0.0, PERIOD, 65)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"t": LINE[:3], "f": known(LINE[:3])}, "8 samples or more, got 3"),
        ({"f": known(LINE)[:-1]}, "same length, got shapes"),
        ({"t": "noon"}, "sequences of real numbers"),
        ({"f": np.where(LINE[7] == LINE, math.nan, known(LINE))}, "values must be finite numbers, got nan at place 7"),
        ({"t": np.where(LINE[7] == LINE, math.inf, LINE)}, "times must be finite numbers, got inf at place 7"),
        ({"t": LINE[::-1]}, "times must rise, got .* after 2.5"),
        ({"period": 1.9}, "no whole number of periods of 1.9 s, but 1.316 of them"),
        ({"period": 2 * PERIOD}, "no whole number of periods of 5 s, but 0.5 of them"),
        ({"period": 0.0}, "period must be a finite number greater than 0, got 0"),
        ({"period": PERIOD / 2}, "harmonics, as many as 65 samples allow, leave out .* check the period, 1.25 s"),
        ({"f": LINE}, "the ends do not match: the force would change by 2.5"),
        ({"f": np.sign(np.sin(2 * math.pi / PERIOD * LINE))}, "leave out .* more than error = 0.01"),
        ({"f": np.ones(65)}, "the force is 1 at all times; give Constant"),
        ({"t": np.arange(40.0) / 3, "f": np.cos(np.arange(40) * 2.0), "period": 2 / 3}, "too few for a period of 0.66"),
        ({"error": 0.0}, "error must be a number from 1e-06 to 0.5, got 0.0"),
    ],
)
def test_records_without_a_series(given, said):
    with pytest.raises(ParameterError, match=rf"^Periodic: .*{said}.*\.$"):
        vk.Periodic.from_samples(**({"t": LINE, "f": known(LINE)} | given))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: vk.Periodic(1.0), "no coefficient is given"),
        (lambda: vk.Periodic(1.0, c_0=0.1), "c_1, s_1, c_2, ... to s_100, got 'c_0'"),
        (lambda: vk.Periodic(1.0, c_101=0.1), "got 'c_101'"),
        (lambda: vk.Periodic(1.0, c_1=math.nan), "c_1 must be a finite number, got nan"),
        (lambda: vk.Periodic(0.0, c_1=1.0), "frequency must be a finite number greater than 0, got 0"),
    ],
)
def test_what_is_no_series(make, said):
    with pytest.raises(ParameterError, match=f"^Periodic: .*{said}"):
        make()
