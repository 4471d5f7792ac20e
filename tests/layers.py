"""Cases of a test that belong to another layer than the rest."""

import pytest


def slow(*values):
    """A case that `make test-slow` runs."""
    return pytest.param(*values, marks=pytest.mark.slow)


def long(*values):
    """A case that `make test-long` runs."""
    return pytest.param(*values, marks=pytest.mark.long)
