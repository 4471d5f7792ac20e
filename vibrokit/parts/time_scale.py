"""The reference frequency of a scene: ω_n, or another one where it has none."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from vibrokit.parts.spring import Spring

if TYPE_CHECKING:
    from vibrokit.parts.scene import Scene


def reference_frequency(scene: Scene) -> float:
    """Return the frequency (s⁻¹) by which times, and speeds and displacements of a scene are compared.

    It is ω_n. A scene without ω_n has the frequency √|k| of the slope k of its spring at x = 0; without that, of the
    excitation with the shortest period; without that, the damping c; and without that 1 s⁻¹. No motion depends on it.
    """
    periods = [part.period for part in scene.excitations if part.period is not None and math.isfinite(part.period)]
    return (
        scene.own_frequency
        or (0.0 if scene.spring is None else math.sqrt(abs(_slope_at_rest(scene.spring))))
        or (2 * math.pi / min(periods) if periods else 0.0)
        or scene.linear_damping
        or 1.0
    )


def _slope_at_rest(spring: Spring) -> float:
    """The derivative of the force by x at x = 0 and v = 0; 0 where it has none that is finite."""
    import sympy

    x = sympy.Symbol("x", real=True)
    try:
        slope = float(sympy.diff(spring.force(x, sympy.Integer(0)), x).subs(x, 0))
    except (ArithmeticError, TypeError, ValueError):
        return 0.0
    return slope if math.isfinite(slope) else 0.0
