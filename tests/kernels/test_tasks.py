"""Tasks that the caller, other threads or an executor carry out."""

import concurrent.futures
import multiprocessing
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from vibrokit.kernels import tasks as tasks_module
from vibrokit.kernels.tasks import carry
from vibrokit.progress import count, working


@pytest.fixture(autouse=True)
def four_processors(monkeypatch):
    """Threads that help, whatever machine this is."""
    monkeypatch.setattr(tasks_module, "processors", lambda: 4)


def _slowly(number):
    time.sleep(0.01 * (number % 3))
    count(tasks=1)
    return number, threading.get_ident()


def test_the_caller_and_other_threads_share_tasks_and_yield_them_in_order():
    with working() as work:
        found = list(carry(_slowly, [(number,) for number in range(24)]))
        assert work.counts["tasks"] == 24
    assert [number for number, _ in found] == list(range(24))
    threads = {thread for _, thread in found}
    assert threading.get_ident() in threads
    assert 1 < len(threads) <= 4


def test_an_error_is_raised_at_its_place():
    carried = carry(lambda number: 1 // (number - 3), [(number,) for number in range(9)])
    assert [next(carried) for _ in range(3)] == [-1, -1, -1]
    with pytest.raises(ZeroDivisionError):
        next(carried)


def test_an_interrupt_starts_no_more_tasks_and_waits_for_those_under_way():
    begun, ended, caller = [], [], threading.get_ident()

    def work(number):
        begun.append(number)
        if threading.get_ident() == caller:
            raise KeyboardInterrupt
        time.sleep(0.05)
        ended.append(number)

    with pytest.raises(KeyboardInterrupt):
        list(carry(work, [(number,) for number in range(100)]))
    after = len(begun)
    assert len(ended) == after - 1 <= 4
    time.sleep(0.1)
    assert len(begun) == after


def test_closing_starts_no_more_tasks():
    begun = []
    carried = carry(lambda number: begun.append(number) or time.sleep(0.01), [(number,) for number in range(100)])
    next(carried)
    carried.close()
    after = len(begun)
    time.sleep(0.05)
    assert len(begun) == after < 100


def _nested(number):
    return sum(carry(abs, [(-number,), (-1,)]))


def test_tasks_of_tasks_do_not_wait_for_themselves():
    """More tasks than threads, each of which has tasks of its own."""
    assert list(carry(_nested, [(number,) for number in range(50)])) == [number + 1 for number in range(50)]


class _Losing(ThreadPoolExecutor):
    """Threads whose results are lost with one of several errors, the first times a task is submitted."""

    def __init__(self, losses):
        super().__init__(2)
        self.losses, self.submitted = losses, {}

    def submit(self, work, *task):
        number = self.submitted[task] = self.submitted.get(task, 0) + 1
        if number > self.losses:
            return super().submit(work, *task)
        lost = concurrent.futures.Future()
        if len(self.submitted) % 2:
            lost.cancel()
            lost.set_running_or_notify_cancel()
        else:
            lost.set_exception(ValueError("lost on the way"))
        return lost


def test_a_lost_task_is_submitted_a_second_time():
    tasks = [(number,) for number in range(-5, 0)]
    with _Losing(1) as executor:
        assert list(carry(abs, tasks, executor)) == [5, 4, 3, 2, 1]
        assert set(executor.submitted.values()) == {2}
    with _Losing(2) as executor, pytest.raises((concurrent.futures.CancelledError, ValueError)):
        list(carry(abs, tasks, executor))


@pytest.mark.skipif(sys.platform == "win32", reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own():
    tasks = [(-1,), (-2,)]
    assert list(carry(abs, tasks)) == [1, 2]  # starts the threads
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("fork")) as pool:
        assert pool.submit(_nested, 3).result(timeout=60) == 4
