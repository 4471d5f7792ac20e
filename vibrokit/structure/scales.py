"""How large the motions of a scene are, so that nothing depends on the units it is given in."""

from __future__ import annotations

import math

from vibrokit.oscillator import Oscillator

_STRENGTHS = ("amplitude", "force")
_RESONANCE = 5.0


def length_of(osc: Oscillator) -> float:
    """Return how far the mass may be expected to go (m): twice to the stops, or what the forces do to a spring ω_n².

    Where two stops do not limit it, a resonance makes more of the forces. A scene that has neither stops nor forces
    says nothing of its size, which is taken for 1.
    """
    push = 0.0
    for part in osc.excitations:
        strength = sum(abs(value) for name, value in part.parameters.items() if name in _STRENGTHS)
        resonant = len(osc.barriers) < 2 and part.period is not None
        push += strength * (_RESONANCE if resonant else 1.0) / osc.natural_frequency**2
    return max([push, *(2 * abs(barrier.position) for barrier in osc.barriers)]) or 1.0


def size_of(osc: Oscillator) -> float:
    """Return the size of states (x, v) that goes with it, x and v taken together."""
    return length_of(osc) * math.hypot(1.0, osc.natural_frequency)
