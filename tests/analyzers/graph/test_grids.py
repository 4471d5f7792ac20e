"""Grids: fractional indices, and which part of the section they cover."""

import numpy as np
import pytest

from vibrokit.analyzers.graph.grids import Grids

BOXES = np.array([[[-1.0, 1.0], [-2.0, 4.0]], [[0.0, 0.5], [-1.0, 1.0]], [[-1.0, 0.0], [2.0, 3.0]], [[0, 1], [0, 1]]])
GRIDS = Grids(BOXES, (5, 13), 0.25, 2)


def mask(*where):
    wanted = np.zeros(GRIDS.shape, dtype=bool)
    for i, j in where:
        wanted[i, j] = True
    return wanted


EMPTY = mask()


def test_the_outermost_nodes_lie_on_the_bounds():
    nodes = GRIDS.nodes(0)
    assert nodes.shape == (5, 13, 2)
    np.testing.assert_array_equal(nodes[0, 0], [-1.0, -2.0])
    np.testing.assert_array_equal(nodes[-1, -1], [1.0, 4.0])
    np.testing.assert_allclose(GRIDS.spacing(0), [0.5, 0.5])
    assert [GRIDS.time(phase) for phase in range(GRIDS.phases)] == [0.0, 0.25, 0.5, 0.75]


@pytest.mark.parametrize("phase", range(4))
def test_indices_of_nodes_are_whole_and_lead_back(phase):
    index = GRIDS.index(phase, GRIDS.nodes(phase))
    np.testing.assert_allclose(index[..., 0], np.arange(5)[:, None] * np.ones(13), atol=1e-12)
    np.testing.assert_allclose(index[..., 1], np.arange(13) * np.ones((5, 1)), atol=1e-12)
    np.testing.assert_allclose(GRIDS.states(phase, index), GRIDS.nodes(phase), atol=1e-12)


def test_states_of_the_noise_do_not_count():
    np.testing.assert_array_equal(GRIDS.index(0, np.array([0.0, 1.0, 99.0])), [2.0, 6.0])


def test_inside_is_a_node_away_from_the_edge():
    states = np.array([[0.0, 1.0], [-0.5, 1.0], [-0.6, 1.0], [0.0, 3.5], [0.0, 3.6], [9.0, 9.0]])
    assert GRIDS.inside(0, states).tolist() == [True, True, False, True, False, False]


def test_only_the_sides_with_needed_nodes_are_widened():
    wider = GRIDS.widened([mask((0, 6)), mask((2, 12)), EMPTY, EMPTY])
    np.testing.assert_allclose(wider.boxes[0], [[-1.6, 1.0], [-2.0, 4.0]])
    np.testing.assert_allclose(wider.boxes[1, 1], [-1.0, 1.6])
    np.testing.assert_array_equal(wider.boxes[2:], BOXES[2:])
    assert wider.shape == GRIDS.shape


def test_grids_wide_enough_stay_the_same():
    tall = Grids(BOXES, (13, 13), 0.25, 2)
    middle = np.zeros((13, 13), dtype=bool)
    middle[4:9, 4:9] = True
    assert tall.widened([middle] * 4) is tall


def test_zoomed_grids_cover_the_needed_nodes_with_a_margin_and_nothing_outside():
    tall = Grids(BOXES, (41, 41), 0.25, 2)
    wanted = np.zeros((41, 41), dtype=bool)
    wanted[20:25, 0:3] = True
    closer = tall.zoomed([wanted, *[np.zeros_like(wanted)] * 3])
    low, high = tall.nodes(0)[20, 0], tall.nodes(0)[24, 2]
    margin = 0.1 * (high - low) + 3 * tall.spacing(0)
    np.testing.assert_allclose(closer.boxes[0, 0], [low[0] - margin[0], high[0] + margin[0]])
    np.testing.assert_allclose(closer.boxes[0, 1], [-2.0, high[1] + margin[1]])
    np.testing.assert_array_equal(closer.boxes[1:], BOXES[1:])
    assert closer.area < tall.area


def test_double_steps_take_every_second_grid():
    doubled = GRIDS.with_double_step()
    assert (doubled.phases, doubled.step, doubled.steps) == (2, 0.5, 1)
    np.testing.assert_array_equal(doubled.boxes, BOXES[::2])
    alone = Grids(BOXES[:1], (5, 13), 0.25, 2).with_double_step()
    assert (alone.phases, alone.step) == (1, 0.5)
    assert GRIDS.with_shape((7, 9)).spacing(0) == pytest.approx((2 / 6, 6 / 8))


def test_several_section_intervals_have_sections_of_their_own():
    assert list(GRIDS.sections) == [0, 2]
    apart = GRIDS.unfolded(3)
    assert (apart.phases, list(apart.sections)) == (12, [0, 2, 4, 6, 8, 10])
    np.testing.assert_array_equal(apart.boxes, np.concatenate([BOXES] * 3))
    assert apart.area == pytest.approx(3 * GRIDS.area)
