"""Work and precision of densities."""

import math

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import double_well
from vibrokit.trade.densities import measure_densities

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def trade():
    well = double_well(noise=vk.WhiteNoise(intensity=1e-2))  # a fifth of ΔU: the cores hardly matter
    structure = vk.find_structure(well, cells=(40, 40), manifolds=False, rng=0)
    return measure_densities(well, structure, source=0, nodes=(0.6, 1.0), steps=(), samples=(20,))


def test_more_nodes_take_longer_and_err_less(trade):
    coarse, fine = (row for row in trade.rows if "samples" not in row.setting)
    assert fine.error < coarse.error
    assert fine.memory > coarse.memory
    assert fine.default
    assert not coarse.default


def test_the_reference_is_the_finest(trade):
    assert math.isnan(trade.reference.error)
    assert all(np.isfinite(row.error) for row in trade.rows if not row.failure)
    assert trade.reference.estimated < 0.1


def test_a_table_names_every_setting(trade):
    text = str(trade)
    assert all(row.setting in text for row in (*trade.rows, trade.reference))


def test_a_scene_without_noise_has_nothing_to_measure():
    with pytest.raises(vk.errors.SceneError, match="no noise"):
        measure_densities(double_well(noise=None))
