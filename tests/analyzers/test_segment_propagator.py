"""Nodes of a path carried over one piece each, whatever their phases."""

import dataclasses

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import slow
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.structure.linear_map import hamiltonian_map, joined

OSC = vk.load_scene("hertz-0.570")
POINTS = np.random.default_rng(3).normal(size=(150, 4)) * [0.3, 0.2, 1e-3, 1e-3]  # more than a block of an ensemble
PHASES = np.random.default_rng(4).integers(0, 40, size=150)


def one_by_one(propagator, lengths):
    """Each node on its own, from the time of its phase."""
    starts = PHASES % propagator.pieces * propagator.piece
    return joined(
        [
            hamiltonian_map(OSC, point[None], propagator.stepper, start_time=start, interval=length)
            for point, start, length in zip(POINTS, starts, lengths, strict=True)
        ]
    )


@pytest.mark.parametrize("stepper", [vk.FreeFlight(1e-10), slow(vk.RK4(256)), vk.RK8(128)], ids=repr)
@pytest.mark.parametrize("last", [slow(None), 0.3])
def test_nodes_of_all_phases_are_carried_together(stepper, last):
    propagator = SegmentPropagator(OSC, stepper)
    found = propagator.extremal_from(POINTS, PHASES, last)
    lengths = np.full(len(POINTS), propagator.piece)
    lengths[-1] = propagator.piece if last is None else last
    for field in dataclasses.fields(found):
        each = getattr(one_by_one(propagator, lengths), field.name)
        np.testing.assert_allclose(getattr(found, field.name), each, rtol=1e-7, atol=1e-9 * np.abs(each).max())


def test_where_a_node_is_left_out_two_pieces_are_carried_as_one():
    propagator = SegmentPropagator(OSC, vk.FreeFlight(1e-10))
    nodes, points = np.array([0, 1, 3, 4, 6, 7]), POINTS[:5]
    found, between = propagator.extremal_between(points, nodes, first=5, last=0.3)
    lengths = propagator.piece * np.array([1, 2, 1, 2, 0]) + [0, 0, 0, 0, 0.3]
    starts = (5 + nodes[:-1]) % propagator.pieces * propagator.piece
    for number, (point, start, length) in enumerate(zip(points, starts, lengths, strict=True)):
        once = hamiltonian_map(OSC, point[None], propagator.stepper, start_time=start, interval=length)
        for field in dataclasses.fields(found):
            each = getattr(once, field.name)[0]
            np.testing.assert_allclose(
                getattr(found, field.name)[number], each, rtol=1e-7, atol=1e-9 * np.abs(each).max()
            )
    halfway = propagator.extremal_from(points[[1, 3]], 5 + nodes[[1, 3]]).images
    np.testing.assert_array_equal(between, halfway)
