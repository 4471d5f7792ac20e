"""BLAS uses one thread while work is under way: sums of long vectors would depend on the number of threads."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from vibrokit.progress import working


def threads():
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_one_thread_during_work_and_as_many_as_before_after_it():
    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        with working():
            assert threads() == {1}
            with working():
                assert threads() == {1}
            assert threads() == {1}
        assert threads() == before


def test_the_threads_come_back_after_an_error():
    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        with pytest.raises(KeyboardInterrupt), working():
            raise KeyboardInterrupt
        assert threads() == before


def test_a_long_sum_has_the_same_bits_with_any_number_of_threads():
    long = np.random.default_rng(0).normal(size=40_000)
    sums = set()
    for limit in (1, 2):
        with threadpool_limits(limits=limit, user_api="blas"), working():
            sums.add(float(long @ long))
    assert len(sums) == 1
