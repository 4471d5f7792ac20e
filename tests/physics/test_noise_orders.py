"""Weak and strong order of the noisy steps, against exact moments and coupled Brownian paths."""

import math

import numpy as np
import pytest
import scipy.linalg

import vibrokit as vk
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.streams import streams_of
from vibrokit.symbolic.flow_kind import Flow

pytestmark = pytest.mark.slow

LEVELS = (16, 32, 64, 128, 256)


def path_end(osc, start, steps, normals):
    """State after one section interval, driven by given normals."""
    interval = osc.section_interval
    return record(osc, Flow.NOISY, vk.RK4(steps), np.array(start), 0.0, interval, 1, normals=normals)[-1]


def coarser(normals, step, factor):
    """The same Brownian path for steps `factor` times as long: its increments ΔW and ∫W dt, as normals."""
    dw = math.sqrt(step) * normals[:, 0]
    dz = 0.5 * step**1.5 * (normals[:, 0] + normals[:, 1] / math.sqrt(3))
    dw, dz = dw.reshape(-1, factor), dz.reshape(-1, factor)
    before = np.cumsum(dw, axis=1) - dw
    long, whole, area = factor * step, dw.sum(axis=1), (dz + step * before).sum(axis=1)
    first = whole / math.sqrt(long)
    return np.column_stack([first, math.sqrt(3) * (2 * area / long**1.5 - first)])


def fitted_order(errors, levels=LEVELS):
    return -np.polyfit(np.log2(levels), np.log2(errors), 1)[0]


def strong_errors(osc, starts, seed, levels=LEVELS):
    finest = 8 * levels[-1]
    step = osc.section_interval / finest
    rng = np.random.default_rng(seed)
    gaps = np.zeros((len(starts), len(levels)))
    for row, start in enumerate(starts):
        normals = rng.standard_normal((finest, 2))
        reference = path_end(osc, start, finest, normals)
        for column, steps in enumerate(levels):
            driven = coarser(normals, step, finest // steps)
            gaps[row, column] = np.linalg.norm(path_end(osc, start, steps, driven) - reference)
    return np.sqrt(np.mean(gaps**2, axis=0))


def linear_scene(**changes):
    return vk.Oscillator(natural_frequency=1.0, damping_ratio=0.2, excitations=(vk.Harmonic(0.3, 0.8),), **changes)


def test_weak_order_two_on_exact_moments():
    """The end is linear in the normals, so that single kicks give its covariance without sampling."""
    intensity = 0.04
    osc = linear_scene(noise=vk.WhiteNoise(intensity))
    drift = np.array([[0.0, 1.0], [-1.0, -0.4]])
    noise = np.diag([0.0, intensity])
    time = osc.section_interval
    block = scipy.linalg.expm(time * np.block([[-drift, noise], [np.zeros((2, 2)), drift.T]]))
    exact = block[2:, 2:].T @ block[:2, 2:]
    errors = []
    for steps in LEVELS:
        still = path_end(osc, [0.1, 0.2], steps, np.zeros((steps, 2)))
        kicks = np.zeros((2 * steps, steps, 2))
        kicks.reshape(2 * steps, -1)[np.arange(2 * steps), np.arange(2 * steps)] = 1.0
        response = np.array([path_end(osc, [0.1, 0.2], steps, kick) for kick in kicks]) - still
        errors.append(np.abs(response.T @ response - exact).max() / np.abs(exact).max())
    print("weak errors", errors, "order", fitted_order(errors))
    assert fitted_order(errors) == pytest.approx(2.0, abs=0.15)


def test_strong_order_two_for_additive_noise():
    osc = linear_scene(noise=vk.WhiteNoise(0.04))
    errors = strong_errors(osc, [(0.1, 0.2)] * 50, seed=1)
    print("strong errors", errors, "order", fitted_order(errors))
    assert fitted_order(errors) == pytest.approx(2.0, abs=0.2)


def test_strong_order_one_where_noise_drives_its_own_amplitude():
    osc = linear_scene(noise=vk.StateDependentNoise(0.04, "1 + c*v", c=1.0))
    errors = strong_errors(osc, [(0.1, 0.2)] * 100, seed=2)
    print("strong errors", errors, "order", fitted_order(errors))
    assert fitted_order(errors) == pytest.approx(1.0, abs=0.2)


def test_strong_order_through_hertz_contacts():
    """Every path hits a stop; the force is smooth but for its second derivative, and the order stays above 3/2."""
    osc = vk.load_scene("hertz-0.570").replace({"noise.intensity": 1e-4})
    rng = np.random.default_rng(3)
    starts = np.column_stack([rng.uniform(0.3, 0.45, 60), rng.uniform(0.2, 0.5, 60)])
    for start in starts:
        assert osc.trajectory(start, 1, rng=0).x.max() > 0.5
    levels = (64, 128, 256, 512, 1024)  # a contact lasts about a twelfth of a period: fewer steps do not resolve it
    errors = strong_errors(osc, starts, 4, levels)
    print("strong errors", errors, "order", fitted_order(errors, levels))
    assert fitted_order(errors, levels) > 1.5


def test_ito_not_stratonovich():
    """For dv = v √D dW without drift the mean of v stays; in Stratonovich's reading it would grow like exp(DT/2)."""
    osc = vk.Oscillator(natural_frequency=1e-3, damping_ratio=0.0, noise=vk.StateDependentNoise(0.5, "v"))
    count = 40_000
    time = 2.0
    interval_share = time / osc.section_interval
    starts = np.tile([0.0, 1.0], (count, 1))
    stepper = vk.RK4(round(64 / interval_share))
    ended = run_ensemble(
        osc, Flow.NOISY, stepper, starts, 1, interval=time, streams=streams_of(5, np.arange(len(starts)))
    )
    # E v = 1, E v² = exp(D T) = e.
    v = ended.states[:, 1]
    assert v.mean() == pytest.approx(1.0, abs=5 * v.std() / math.sqrt(count))
    assert np.mean(v**2) == pytest.approx(math.e, rel=0.15)
