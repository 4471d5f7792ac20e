"""Labels of basins at states."""

import numpy as np

from vibrokit.results.basins import UNSETTLED, Basins
from vibrokit.results.region import Region

BASINS = Basins(Region((0.0, 4.0), (-1.0, 1.0)), np.arange(8, dtype=np.int16).reshape(4, 2))


def test_states_have_the_label_of_their_cell():
    states = np.array([[0.5, -0.5], [0.5, 0.5], [3.99, -0.01], [3.99, 0.01]])
    assert BASINS.at(states).tolist() == [0, 1, 6, 7]
    assert BASINS.at(states.reshape(2, 2, 2)).tolist() == [[0, 1], [6, 7]]


def test_outside_the_region_nothing_has_settled():
    assert BASINS.at(np.array([[-0.1, 0.0], [4.1, 0.0], [1.0, 1.5], [np.nan, 0.0]])).tolist() == [UNSETTLED] * 4


def test_several_cells_made_one_have_one_label():
    assert BASINS.at(np.array([[1.5, 0.5], [0.5, -0.5], [2.5, 0.5]]), every=2).tolist() == [0, 0, 4]
