"""When two paths cost the same."""

from __future__ import annotations

POLISHED = 1e-6
"""Relative difference of the actions, and of the places, of one path or orbit that was solved for twice."""


def same_action(one: float, other: float, within: float = POLISHED) -> bool:
    """Return whether two actions differ by no more than a part of the first."""
    return abs(one - other) <= within * one
