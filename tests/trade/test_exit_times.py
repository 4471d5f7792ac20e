"""Work and precision of simulated exit times."""

import math

import pytest

import vibrokit as vk
from tests.scenes import scene
from vibrokit.trade.exit_times import measure_exit_times

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def trade():
    well = scene(damping_ratio=0.2, spring=vk.CubicSpring(linear=-1.0, cubic=1.0), noise=vk.WhiteNoise(intensity=0.04))
    structure = vk.find_structure(well, cells=(40, 40), manifolds=False, rng=0)
    return measure_exit_times(well, structure, source=0, errors=(0.4, 0.3))


def test_every_error_is_of_the_size_that_is_estimated(trade):
    """The chance of more than four standard errors is 6e-5."""
    for row in trade.rows:
        assert row.error <= 4 * math.hypot(row.estimated, trade.reference.estimated)


def test_direct_simulation_estimates_what_was_asked_for(trade):
    asked = {"0.4": 0.4, "0.3": 0.3}
    for row in trade.rows:
        if "splitting=False" in row.setting:
            (error,) = (value for text, value in asked.items() if f"target_error={text}," in row.setting)
            assert row.estimated == pytest.approx(error, rel=0.1)


def test_a_table_names_every_setting(trade):
    assert all(row.setting in str(trade) for row in (*trade.rows, trade.reference))
    assert len(trade.rows) == 4
