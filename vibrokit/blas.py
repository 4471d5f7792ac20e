"""One thread of BLAS while work is under way.

The threads of this process integrate trajectories; more of them only compete. And a sum over several threads depends on
their number, so that results would differ from machine to machine.
"""

from __future__ import annotations

from contextlib import AbstractContextManager

from threadpoolctl import threadpool_limits


def one_blas_thread() -> AbstractContextManager[object]:
    """Return a context in which the libraries of BLAS that are loaded use one thread."""
    limits: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return limits
