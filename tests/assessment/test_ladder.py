"""Noise intensities of an assessment."""

import math

import pytest

from vibrokit.assessment.ladder import barrier, ladder


@pytest.mark.parametrize(
    ("energies", "intensity", "decisive"),
    [
        ((3.5e-9, 6e-5), 2e-5, 6e-5),  # noise passes the first at once
        ((6e-5, 3.5e-9), 1e-9, 3.5e-9),
        ((3.5e-9, 2e-9), 2e-5, 2e-9),  # both at once: of weaker noise at least something is said
        ((9e-5,), 2e-5, 9e-5),
        ((), 2e-5, math.inf),
    ],
)
def test_an_exit_that_noise_passes_at_once_does_not_decide(energies, intensity, decisive):
    assert barrier(energies, intensity) == decisive


@pytest.mark.parametrize("unit", [1.0, 1e-6])
def test_the_ladder_has_the_noise_of_the_scene_where_it_is_in_range(unit):
    found = ladder(8e-5 * unit, 1e-5 * unit)
    assert 1e-5 * unit in found
    assert list(found) == sorted(found, reverse=True)
    assert 1e-9 * unit not in ladder(8e-5 * unit, 1e-9 * unit)
