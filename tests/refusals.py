"""How quickly a bad input is refused."""

import time

import pytest


def quickest_refusal(kind, call):
    """Return the message of the error that `call` raises, and the least processor time of three calls.

    One call alone may pay for a garbage collection of everything that other tests have left.
    """
    times = []
    for _ in range(3):
        start = time.process_time()
        with pytest.raises(kind) as caught:
            call()
        times.append(time.process_time() - start)
    return str(caught.value), min(times)
