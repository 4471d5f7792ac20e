"""Action descent between stiff stops, whose contacts are much shorter than the pieces of a path."""

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long
from vibrokit.analyzers.paths.action_descent import descend_action
from vibrokit.analyzers.paths.gauss_newton import gauss_newton
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator

pytestmark = pytest.mark.slow

STIFF = vk.Hertz(1e5)  # at 0.5 m/s a contact lasts 0.03 s, and a piece 0.6 s or less
OSC = vk.Oscillator(
    natural_frequency=1.0, damping_ratio=0.05, excitations=(vk.Harmonic(0.2533, 1.25),),
    barriers=(vk.Barrier(STIFF, 0.5, "right"), vk.Barrier(STIFF, -0.5, "left")), noise=vk.WhiteNoise(1e-4),
)  # fmt: skip


def descended(start, end, intervals, pieces):
    """The path of least action that was found, and its action; the guess is free motion but for its end."""
    propagator = SegmentPropagator(OSC, vk.Order8(), pieces)
    states = propagator.onward(np.array(start), 0, intervals * pieces)
    states[-1] = end
    guess, _ = gauss_newton(propagator, 0, states)
    return propagator, *descend_action(propagator, 0, guess)


@pytest.mark.parametrize(
    ("start", "end", "intervals"),
    [
        ((0.0, 0.55), (0.2, 0.3), 2), long((0.2, 0.5), (0.3, -0.3), 2),
        long((0.0, 0.55), (0.3, -0.3), 3), long((0.2, 0.5), (0.0, 0.6), 3),
    ],
)  # fmt: skip
def test_impacts_move_from_one_piece_to_another(start, end, intervals):
    """Whatever the pieces, descent ends at one path, and it solves Hamilton's equations."""
    actions = []
    for pieces in (8, 16, 32):
        propagator, points, action = descended(start, end, intervals, pieces)
        images = propagator.extremal(points[:-1], 0).images
        assert np.all(np.abs(images - points[1:]) < 1e-3 * np.ptp(points, axis=0))
        assert points[0, :2] == pytest.approx(start)
        assert points[-1, :2] == pytest.approx(end)
        actions.append(action)
    assert actions == pytest.approx([actions[0]] * 3, rel=1e-6)


def test_a_guess_that_no_segments_join_is_returned_as_it_is():
    propagator = SegmentPropagator(OSC, vk.Order8(), 8)
    points = np.hstack([np.full((9, 2), [40.0, 0.0]), np.zeros((9, 2))])
    points[1::2, 0] = -40.0
    found, action = descend_action(propagator, 0, points)
    assert np.isnan(action)
    np.testing.assert_array_equal(found, points)
