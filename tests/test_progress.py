"""Stages, counts, time limits and interrupts of long work."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from vibrokit.display import Display
from vibrokit.errors import OutOfTime, StructureError, VibrokitError
from vibrokit.progress import Deadline, Work, advance, compiling, count, current, put_off, report, stage, working


def test_updates_tell_stage_subject_and_counts():
    updates = []
    with working(updates.append), stage("graph", subject="clear", unit="sweeps", total=4):
        advance()
        advance(2, "trajectories")  # of another unit
        report(3)
    seen = [(u.stage, u.subject, u.done, u.total, u.unit, u.finished) for u in updates]
    assert seen == [("graph", "clear", done, 4, "sweeps", done == 3 and last) for done, last in
                    [(0, False), (1, False), (1, False), (3, False), (3, True)]]  # fmt: skip


def test_the_time_left_never_grows_and_is_unknown_at_first_and_without_a_total(clock):
    updates = []
    with working(updates.append):
        with stage("saddles"):
            clock.now += 50
            advance()
        with stage("basins", total=10):
            for seconds in (0.5, 3.5, 5, 1, 1, 30):
                clock.now += seconds
                advance()
    left = [u.remaining for u in updates]
    assert left == [*[None] * 5, 16.0, 16.0, 15.0, 11.0, 11.0, 11.0]


def test_stages_inside_take_their_subject_and_their_time(clock):
    with working() as work:
        with stage("graph", subject="clear"):
            clock.now += 1
            with working() as inner, stage("basins"):
                assert inner.stages[-1].subject == "clear"
                clock.now += 10
                count(newton_iterations=3)
                with compiling():
                    clock.now += 100
        assert inner.stats.seconds == {"basins": 10, "compiling": 100}
    assert work.stats.seconds == {"graph": 1, "basins": 10, "compiling": 100}
    assert work.stats.newton_iterations == inner.stats.newton_iterations == 3


def test_inner_work_counts_for_itself():
    with working() as outer:
        count(trajectories=5)
        with working() as inner:
            count(trajectories=7)
        assert inner.stats.trajectories == 7
    assert outer.stats.trajectories == 12
    assert current() is not outer


def test_a_time_limit_is_raised_once_at_a_time_also_in_inner_work(clock):
    with working(time_limit=10), working(), stage("graph"):
        advance()
        clock.now += 11
        with pytest.raises(Deadline):
            advance()
        advance()


def out_of_time(clock):
    """Work that goes on after its limit, whatever errors its steps raise."""
    with working(time_limit=10), working(), stage("graph"):
        clock.now += 11
        try:
            advance()
        except Exception:
            pytest.fail("a time limit is no failure of a step")


def test_users_see_a_time_limit_without_a_result_as_an_error_of_ours(clock):
    with pytest.raises(OutOfTime) as raised:
        out_of_time(clock)
    assert isinstance(raised.value, VibrokitError)
    assert isinstance(raised.value, TimeoutError)
    assert not isinstance(raised.value, KeyboardInterrupt)


def test_limits_can_be_put_off_but_not_forgotten(clock):
    with working(time_limit=10), working():
        with put_off():
            clock.now += 11
            advance()
        with pytest.raises(Deadline):
            advance()


def test_an_interrupt_is_raised_once_at_a_time_at_the_next_report():
    with working() as work, working(), stage("graph"):
        work.interrupt()
        with pytest.raises(KeyboardInterrupt) as raised:
            advance()
        assert type(raised.value) is KeyboardInterrupt
        advance()
    with working() as work:
        work.interrupt()
        with pytest.raises(KeyboardInterrupt), stage("graph"):
            pytest.fail("the stage began")
        assert work.stages == []  # it is closed


def test_what_nobody_listens_to_costs_nothing():
    with stage("graph", total=3):
        advance()
        report(2)
        count(steps=1)
    assert current().stats == Work().stats


@pytest.mark.parametrize("limit", [0, -1, True, float("nan"), float("inf"), "10"])
def test_time_limits_are_positive_numbers(limit):
    with pytest.raises(StructureError, match="time_limit"), working(time_limit=limit):
        pass


def test_progress_is_true_none_or_a_function():
    with working(True) as work:
        assert type(work.listener) is Display
    with pytest.raises(StructureError, match="progress"), working(3):
        pass


def threads():
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_blas_has_one_thread_during_work_and_as_many_as_before_after_it():
    """Sums of long vectors would depend on the number of threads."""
    long, sums = np.random.default_rng(0).normal(size=40_000), set()
    for limit in (1, 2):
        with threadpool_limits(limits=limit, user_api="blas"):
            before = threads()
            with working():
                with working():
                    assert threads() == {1}
                assert threads() == {1}
                sums.add(float(long @ long))
            assert threads() == before
            with pytest.raises(KeyboardInterrupt), working():
                raise KeyboardInterrupt
            assert threads() == before
    assert len(sums) == 1
