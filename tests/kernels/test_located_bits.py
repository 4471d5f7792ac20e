"""The steppers that locate contacts give the same bits serially, on threads and in processes."""

import concurrent.futures
import multiprocessing

import numpy as np
import pytest

import vibrokit as vk


@pytest.mark.parametrize("stepper", [vk.FreeFlight(tolerance=1e-10), vk.Order8(tolerance=1e-10)], ids=lambda s: s.name)
def test_same_bits(stepper):
    osc = vk.load_scene("hertz-0.570")
    states = np.random.default_rng(0).uniform(-0.6, 0.6, (200, 2))
    alone = np.concatenate([osc.section_map(states[k : k + 10], 3, stepper=stepper) for k in range(0, 200, 10)])
    with concurrent.futures.ThreadPoolExecutor(3) as threads:
        np.testing.assert_array_equal(osc.section_map(states, 3, stepper=stepper, executor=threads), alone)
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as processes:
        np.testing.assert_array_equal(osc.section_map(states, 3, stepper=stepper, executor=processes), alone)
