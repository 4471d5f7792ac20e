"""Mean times between and beyond computed intensities, against exact laws."""

import math

import numpy as np
import pytest

from tests.builders import energy
from vibrokit.comparison.mean_times import MeanTimes, intensity_for, most_certain
from vibrokit.errors import StructureError
from vibrokit.results.exit_rate import ExitRate

BARRIER = 8e-5
D = np.array([2e-5, 1.2e-5, 8e-6])
CERTAIN = energy(0, 1, BARRIER, lower=BARRIER, upper=BARRIER)


def rates(power=0.0, error=0.01, target=1, shift=0.0, barrier=BARRIER):
    """Rates of τ = 30 s · D^−power · exp(ΔU/D)."""
    logs = -(math.log(30.0) - power * np.log(D / 1e-5) + barrier / D + shift)
    return [ExitRate(0, target, d, float(log), error, "commitment", "made") for d, log in zip(D, logs, strict=True)]


def exact(intensity, power=0.0):
    return math.log(30.0) - power * math.log(intensity / 1e-5) + BARRIER / intensity


@pytest.mark.parametrize("intensity", [2e-5, 1.9e-5, 1.2e-5, 9e-6, 8e-6])
def test_between_computed_intensities_the_law_is_exact(intensity):
    found = MeanTimes.of(rates(), "made").at(intensity)
    assert found.value == pytest.approx(exact(intensity), rel=1e-12)
    assert found.upper - found.lower == pytest.approx(0.04, rel=0.01)
    assert not found.extrapolated


@pytest.mark.parametrize("power", [-1.0, 0.5, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("intensity", [1e-4, 4e-5, 1.5e-5, 1e-5, 4e-6, 1e-6, 1e-7])
def test_intervals_contain_the_time_where_the_prefactor_depends_on_the_noise(intensity, power):
    found = MeanTimes.of(rates(power), "made").at(intensity, CERTAIN)
    assert found.lower <= exact(intensity, power) <= found.upper


def test_beyond_them_the_interval_grows_with_that_of_the_energy():
    times = MeanTimes.of(rates(), "made")
    loose = energy(0, 1, BARRIER, lower=0.9 * BARRIER, upper=1.05 * BARRIER)
    sure, unsure = (times.at(2e-6, one) for one in (CERTAIN, loose))
    assert sure.extrapolated
    assert unsure.lower - sure.lower == pytest.approx(-0.1 * BARRIER * (1 / 2e-6 - 1 / 8e-6), rel=1e-9)
    assert unsure.upper - sure.upper == pytest.approx(0.05 * BARRIER * (1 / 2e-6 - 1 / 8e-6), rel=1e-9)
    assert times.at(2e-6) is None


def test_rates_to_several_targets_add_up():
    both = MeanTimes.of([*rates(), *rates(target=2, shift=math.log(3.0))], "made")
    assert both.log_times == pytest.approx([exact(d) - math.log(4.0 / 3.0) for d in D])
    # independent errors of shares 3/4 and 1/4
    assert both.upper - both.log_times == pytest.approx(0.02 * math.hypot(0.75, 0.25), rel=0.02)


def test_rates_of_different_events_are_refused():
    other = ExitRate(0, 1, 3e-5, -5.0, 0.1, "basin", "made")
    with pytest.raises(StructureError, match="one event"):
        MeanTimes.of([*rates(), other], "made")
    with pytest.raises(StructureError, match="no rate"):
        MeanTimes.of([], "made")


def test_the_narrowest_interval_is_taken_and_one_that_contradicts_it_is_added():
    narrow, wide, wrong = (
        MeanTimes.of(rates(error=error, shift=shift), name)
        for name, error, shift in (("narrow", 0.01, 0.0), ("wide", 0.1, 0.1), ("wrong", 0.02, 1.0))
    )
    agreed = most_certain([wide, narrow], 1e-5, CERTAIN)
    assert agreed.methods == ("narrow",)
    spread = most_certain([wide, narrow, wrong], 1e-5, CERTAIN)
    assert spread.methods == ("narrow", "wrong")
    assert spread.lower == pytest.approx(agreed.lower)
    assert spread.upper == pytest.approx(exact(1e-5) + 1.04, abs=1e-6)
    assert most_certain([], 1e-5, CERTAIN) is None


@pytest.mark.parametrize("intensity", [5e-5, 1.5e-5, 9e-6, 3e-6, 4e-7])
def test_the_intensity_of_a_mean_time(intensity):
    found, lower, upper = intensity_for([MeanTimes.of(rates(), "made")], exact(intensity), CERTAIN)
    assert found.intensity == pytest.approx(intensity, rel=1e-9)
    assert lower < intensity < upper
    inside = [MeanTimes.of(rates(), "made").at(one, CERTAIN) for one in (lower, upper) if 0 < one < math.inf]
    assert all(min(abs(one.lower - exact(intensity)), abs(one.upper - exact(intensity))) < 1e-6 for one in inside)


def test_a_mean_time_that_no_noise_gives():
    assert intensity_for([MeanTimes.of(rates(), "made")], math.log(1e-3), CERTAIN) is None
    assert intensity_for([MeanTimes.of(rates(), "made")], exact(1e-6)) is None
