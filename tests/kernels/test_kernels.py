"""Ensembles: the same bits however the work is split; numbers out of range are reported, with time and state."""

import math
import warnings
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import impacting, scene
from vibrokit.errors import IntegrationError
from vibrokit.kernels import ensemble
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.kernel import kernel_for
from vibrokit.kernels.streams import streams_of
from vibrokit.symbolic.flow_kind import Flow


def stopped(**more):
    return scene(vk.Barrier(vk.Hertz(50.0), 0.5, "right"), **more)


# --- the same bits, wherever and however the work is split

CASES = {
    "rk4 state": (vk.RK4(64), Flow.STATE), "rk4 hamiltonian": (vk.RK4(64), Flow.HAMILTONIAN),
    "rk4 noisy": (vk.RK4(64), Flow.NOISY), "order8": (vk.Order8(1e-10), Flow.STATE),
    "free flight": (vk.FreeFlight(1e-10), Flow.STATE),
}  # fmt: skip
COUNT = 333  # no multiple of any block or lane count


def work(case, executor=None, first=0, count=COUNT):
    """Every trajectory's end, with budgets of their own so that lanes are refilled."""
    stepper, flow = CASES[case]
    rng = np.random.default_rng(5)
    starts = rng.uniform(-0.7, 0.7, (COUNT, 2))
    if flow is Flow.HAMILTONIAN:
        starts = np.hstack([starts, rng.uniform(-1e-3, 1e-3, (COUNT, 2)), np.zeros((COUNT, 1))])
    chosen = slice(first, first + count)
    ended = run_ensemble(
        impacting(), flow, stepper, starts[chosen], (np.arange(COUNT) % 5)[chosen],
        streams=streams_of(11, np.arange(COUNT)[chosen]) if flow is Flow.NOISY else None, executor=executor,
    )  # fmt: skip
    assert ended.intervals.tolist() == (np.arange(COUNT) % 5)[chosen].tolist()
    assert np.isfinite(ended.states).all()
    assert len(np.unique(ended.states[:, 0])) == count
    return ended.states.tobytes()


class Serial(Executor):
    """Does the work at once, in this thread."""

    def submit(self, function, /, *args, **kwargs):
        future = Future()
        future.set_result(function(*args, **kwargs))
        return future


@pytest.fixture(scope="module", params=CASES)
def case(request):
    """A stepper and a flow, and the bits of the ensemble when nothing is split."""
    return request.param, work(request.param, Serial())


@pytest.fixture(scope="module")
def processes():
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        yield pool


def test_bits_in_threads_and_processes(case, processes):
    name, bits = case
    assert work(name) == bits
    with ThreadPoolExecutor(3) as pool:
        assert work(name, pool) == bits
    assert work(name, processes) == bits


def test_bits_in_blocks_and_parts(case, monkeypatch):
    name, bits = case
    for size in (64, 7, 1, 4096):
        monkeypatch.setattr(ensemble, "_BLOCK", size)
        monkeypatch.setattr(ensemble, "_SMALLEST_BLOCK", size)
        assert work(name, Serial()) == bits
    assert b"".join(work(name, first=first, count=111) for first in (0, 111, 222)) == bits


def test_noise_depends_on_seed_and_index():
    osc, starts = impacting(), np.zeros((4, 2))
    one, again, other = (osc.section_map(starts, stepper=vk.RK4(steps=64), rng=seed) for seed in (1, 1, 2))
    assert one.tobytes() == again.tobytes()
    assert len(np.unique(np.concatenate([one, other])[:, 0])) == 8


# --- numbers out of range


RUNAWAY = {"spring": vk.CubicSpring(1.0, -1.0), "barriers": ()}


def test_a_runaway_is_reported_with_time_and_state():
    osc = stopped(**RUNAWAY)
    with pytest.raises(IntegrationError) as error:
        osc.trajectory((2.0, 1.0), periods=3, stepper=vk.RK4())
    assert 0.0 < error.value.time < 2.0
    assert all(map(math.isfinite, error.value.state))
    assert f"t = {error.value.time:g}" in str(error.value)


def test_a_runaway_leaves_the_others_alone():
    osc = stopped(**RUNAWAY)
    starts = np.random.default_rng(3).uniform(-0.3, 0.3, (100, 2))
    alone = run_ensemble(osc, Flow.STATE, vk.RK4(), starts, 5)
    starts[17] = 2.0, 1.0
    together = run_ensemble(osc, Flow.STATE, vk.RK4(), starts, 5)
    others = np.arange(100) != 17
    assert together.states[others].tobytes() == alone.states[others].tobytes()
    assert together.status[17] == 4
    assert together.intervals[17] == 0
    assert together.states[17].tolist() == [2.0, 1.0]  # the last good state
    assert (together.status[others] == 0).all()


@pytest.mark.parametrize("flow", [Flow.NOISY, Flow.HAMILTONIAN], ids=lambda flow: flow.value)
def test_runaways_of_other_flows(flow):
    osc = stopped(**RUNAWAY, noise=vk.WhiteNoise(1e-3))
    starts = np.array([[2.0, 1.0, 0.0, 0.0, 0.0]])[:, : 5 if flow is Flow.HAMILTONIAN else 2]
    ended = run_ensemble(
        osc, flow, vk.RK4(), starts, 3, streams=streams_of(1, np.arange(1)) if flow is Flow.NOISY else None
    )
    assert ended.status.tolist() == [4]
    assert np.isfinite(ended.states).all()


def test_no_warning_is_let_out_of_a_runaway():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(IntegrationError):
            stopped(**RUNAWAY).section_map([[2.0, 1.0]], periods=2, stepper=vk.RK4())


def test_nothing_to_do():
    assert stopped().section_map(np.empty((0, 2)), stepper=vk.RK4()).shape == (0, 2)
    assert stopped().section_map([[0.1, 0.2]], periods=0, stepper=vk.RK4()).tolist() == [[0.1, 0.2]]


def test_read_only_and_strided_arrays_compile_nothing_new():
    osc, stepper = stopped(), vk.RK4(steps=64)
    starts = np.random.default_rng(0).uniform(-0.4, 0.4, (10, 2))
    plain = run_ensemble(osc, Flow.STATE, stepper, starts, 2)
    compiled = kernel_for(osc, Flow.STATE, stepper).driver.module.advance.signatures
    spread = np.zeros((10, 4))
    spread[:, ::2] = starts
    starts.setflags(write=False)
    region = np.array([[-9.0, 9.0], [-9.0, 9.0]])
    region.setflags(write=False)
    for given in (starts, spread[:, ::2], np.asfortranarray(starts)):
        ended = run_ensemble(osc, Flow.STATE, stepper, given, np.full(10, 2), stop=ensemble.Stop(region))
        assert ended.states.tobytes() == plain.states.tobytes()
    assert kernel_for(osc, Flow.STATE, stepper).driver.module.advance.signatures == compiled
    assert len(compiled) == 1
