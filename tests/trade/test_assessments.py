"""Accuracy of assessments against time."""

import pytest

import vibrokit as vk
from tests.scenes import scene
from vibrokit.trade.assessments import measure_assessments

pytestmark = [pytest.mark.slow, pytest.mark.long]


def test_a_third_costs_at_most_a_third_of_three_hundredths():
    well = scene(damping_ratio=0.2, spring=vk.CubicSpring(linear=-1.0, cubic=1.0), noise=vk.WhiteNoise(intensity=0.025))
    trade = measure_assessments(well, source=0, accuracies=(0.3, 0.03))
    rough, fine = trade.rows
    assert all(row.complete for row in trade.rows)
    assert rough.cpu_seconds <= fine.cpu_seconds / 3
    for row in trade.rows:
        assert row.energies <= row.accuracy
        assert max(row.times.values()) <= 1.1 * row.accuracy
        assert f"{row.accuracy:g}" in str(trade)
