"""NoiseFilter: the extra states of noise as a linear filter between white noise and the force."""

from __future__ import annotations

import dataclasses
from typing import Self

import numpy as np
import sympy

from vibrokit.symbolic.equations import Equations


@dataclasses.dataclass(frozen=True, eq=False)
class NoiseFilter:
    """y′ = A y + B √D W′ with the force C y, at the parameters of a scene.

    Attributes
    ----------
    rates, driven, force : sympy Matrix
        A, B and C.
    """

    rates: sympy.Matrix
    driven: sympy.Matrix
    force: sympy.Matrix

    @classmethod
    def of(cls, equations: Equations) -> Self | None:
        """Return the filter; None if there is none, or if the motion of the mass or anything not linear enters it."""
        extra = list(equations.state[2:])
        drift = equations.drift[2:, :].subs(equations.numbers)
        rates, driven = drift.jacobian(extra or [sympy.Dummy()]), equations.amplitude[2:, :].subs(equations.numbers)
        force = sympy.Matrix([equations.smooth_force.subs(equations.numbers)]).jacobian(extra or [sympy.Dummy()])
        constant = not any(part.free_symbols for part in (rates, driven, force))
        if not extra or not constant or (drift - rates * sympy.Matrix(extra)).applyfunc(sympy.simplify).norm() != 0:
            return None
        return cls(rates, driven, force)

    @property
    def peak_gain(self) -> float:
        """The largest gain |C (iω − A)⁻¹ B| at any frequency; infinite if the filter is not stable.

        What leaves the filter has at most its square times the energy of what enters (Zhou, Doyle and Glover, *Robust
        and Optimal Control*, 1996).
        """
        if not all(sympy.re(value) < 0 for value in sympy.Matrix(self.rates).evalf().eigenvals(multiple=True)):
            return float("inf")
        frequency = sympy.Symbol("omega", real=True)
        resolved = (sympy.I * frequency * sympy.eye(len(self.driven)) - self.rates).LUsolve(self.driven)
        squared = sympy.cancel(sympy.expand_complex(sympy.Abs((self.force * resolved)[0]) ** 2))
        above, below = sympy.fraction(sympy.together(squared))
        slope = sympy.Poly(sympy.diff(above, frequency) * below - above * sympy.diff(below, frequency), frequency)
        turns = np.roots([float(number) for number in slope.all_coeffs()]).real
        return max(float(sympy.sqrt(squared.subs(frequency, turn))) for turn in (0.0, *turns))
