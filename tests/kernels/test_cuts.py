"""Kernels return to Python before long, and go on: time limits and interrupts are seen, and no bit depends on it."""

import _thread
import signal
import threading
import time

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.kernels import kernel as module
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.streams import streams_of
from vibrokit.progress import Work, opened
from vibrokit.structure.continuation import continuation
from vibrokit.symbolic.flow_kind import Flow

LEAST = 2.0  # s after a limit in which a kernel must have returned; it aims at a tenth of a second
STARTS = np.random.default_rng(0).uniform(-0.6, 0.6, (70, 2))


def cut(monkeypatch, most):
    """Let kernels return after so many steps or attempts."""
    monkeypatch.setattr(module, "_FIRST_WORK", most)
    monkeypatch.setattr(module, "_FASTER", 1)


@pytest.mark.parametrize("stepper", [vk.RK4(256), vk.Order8(1e-7), vk.FreeFlight(1e-7)], ids=lambda s: s.name)
def test_cuts_change_no_bit(monkeypatch, stepper):
    osc, found = vk.load_scene("hertz-0.570"), []
    for most in (10**9, 1, 50):
        cut(monkeypatch, most)
        ended = run_ensemble(osc, Flow.STATE, stepper, STARTS, np.arange(70) % 4, visits=2)
        path = record(osc, Flow.STATE, stepper, STARTS[0], 0.3, 0.7, 9)
        found.append([ended.states, ended.intervals, ended.visits, path])
    for other in found[1:]:
        for one, again in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(again, one)


def test_cuts_change_no_noise(monkeypatch):
    osc, found = vk.load_scene("hertz-0.570"), []
    for most in (10**9, 1):
        cut(monkeypatch, most)
        streams = streams_of(3, np.arange(70))
        ended = run_ensemble(osc, Flow.NOISY, vk.RK4(256), STARTS, np.arange(70) % 4, streams=streams)
        found.append([ended.states, ended.streams])
    for one, again in zip(*found, strict=True):
        np.testing.assert_array_equal(again, one)


def test_an_interval_of_very_many_steps_is_cut_too(monkeypatch):
    """The steps of one interval are taken in several goes; x″ = −x turns once."""
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0)
    cut(monkeypatch, 1)
    (end,) = run_ensemble(osc, Flow.STATE, vk.RK4(20_000), np.array([[1.0, 0.0]]), 1).states
    np.testing.assert_allclose(end, [1.0, 0.0], atol=1e-11)


def test_a_flight_of_very_many_terms_pauses():
    """Against the closed form of the forced motion, in 4000 turns of a free oscillation."""
    slow = 1 / 4000
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.0,
        barriers=(vk.Barrier(vk.Hertz(50.0), 50.0, "right"),),
        excitations=(vk.Harmonic(0.1, slow),),
    )
    swing = 0.1 / (1 - slow**2)
    (end,) = run_ensemble(osc, Flow.STATE, vk.FreeFlight(1e-12), np.array([[1.0, 0.0]]), 1).states
    time_ = osc.section_interval
    expected = [swing + (1 - swing) * np.cos(time_), -(1 - swing) * np.sin(time_)]
    np.testing.assert_allclose(end, expected, atol=1e-7)


def endless(osc, work):
    """Work of hours in one call, on a stop so stiff that a period takes many steps."""
    with opened(work):
        run_ensemble(osc, Flow.STATE, vk.Order8(1e-12), np.array([[0.3, 0.1]] * 300), 10**7)


def check_that_it_stops(osc, work):
    with pytest.raises(KeyboardInterrupt):
        endless(osc, work)
    assert work.seconds < 0.3 + LEAST


@pytest.fixture(scope="module")
def bouncing():
    """A ball on a stiff table that vibrates, whose kernel is compiled."""
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.0,
        spring=vk.LinearSpring(0.0),
        barriers=(vk.Barrier(vk.CustomLaw("k*depth + c*rate", k=1e8, c=1400.0), 0.0, "left"),),
        excitations=(vk.Constant(-1.0), vk.Harmonic(1.2, 1.0, -np.pi / 2)),
    )
    run_ensemble(osc, Flow.STATE, vk.Order8(1e-12), np.array([[0.3, 0.1]]), 0)
    return osc


def test_a_time_limit_is_seen_during_a_call(bouncing):
    check_that_it_stops(bouncing, Work(time_limit=0.3))


def test_an_interrupt_that_is_asked_for_is_seen_during_a_call(bouncing):
    work = Work()
    threading.Timer(0.3, work.interrupt).start()
    check_that_it_stops(bouncing, work)


@pytest.fixture
def python_handles_sigint():
    """The processes of pytest-xdist ignore Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("python_handles_sigint")
def test_ctrl_c_is_seen_during_a_call(bouncing):
    work = Work()
    threading.Timer(0.3, _thread.interrupt_main).start()
    check_that_it_stops(bouncing, work)
    began = time.perf_counter()
    run_ensemble(bouncing, Flow.STATE, vk.Order8(1e-12), np.array([[0.3, 0.1]]), 0)  # nothing runs on
    assert time.perf_counter() - began < LEAST


@pytest.mark.long
def test_the_time_limit_of_a_continuation_holds_on_a_stiff_table(bouncing):
    """A public report's ball on a table with k = 1e8."""
    found = continuation(bouncing, "excitations.1.amplitude", [1.2, 1.3], time_limit=5.0)
    assert not found.complete
    assert found.seconds < 5.0 + 10 * LEAST  # kernels may be compiled meanwhile
