"""The steppers that locate contacts give the same bits serially, on threads and in processes."""

import concurrent.futures
import multiprocessing

import numpy as np
import pytest

import vibrokit as vk

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("stepper", [vk.FreeFlight(tolerance=1e-10), vk.Order8(tolerance=1e-10)], ids=lambda s: s.name)
def test_same_bits(stepper):
    # A kernel that no other test has, so that this process compiles what the others load.
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.01,
        barriers=(vk.Barrier(vk.Hertz(50.0), 0.5, "right"), vk.Barrier(vk.Hertz(50.0), -0.5, "left")),
        excitations=(vk.Harmonic(0.18, 0.57), vk.Harmonic(0.02, 1.14), vk.Constant(0.2)),
    )
    states = np.random.default_rng(0).uniform(-0.6, 0.6, (200, 2))
    context = multiprocessing.get_context("spawn")
    alone = np.concatenate([osc.section_map(states[k : k + 10], 3, stepper=stepper) for k in range(0, 200, 10)])
    with concurrent.futures.ThreadPoolExecutor(3) as threads:
        np.testing.assert_array_equal(osc.section_map(states, 3, stepper=stepper, executor=threads), alone)
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as processes:
        np.testing.assert_array_equal(osc.section_map(states, 3, stepper=stepper, executor=processes), alone)
