"""Model: the equations of a scene as a user reads them, and what they say of its motion."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import sympy

from vibrokit.symbolic.borders import Border
from vibrokit.symbolic.contact import RATE
from vibrokit.symbolic.domain import Domain, border_ahead
from vibrokit.symbolic.equations import Equations
from vibrokit.symbolic.mathml import definition, rate_equation
from vibrokit.symbolic.noise_filter import NoiseFilter
from vibrokit.symbolic.printer import as_latex, as_text


class Model(Equations):
    """The equations of a scene, where its forces have values, and whether its motion keeps or loses energy.

    Parameters
    ----------
    scene : Scene
    """

    @cached_property
    def equations(self) -> dict[sympy.Symbol, sympy.Expr]:
        """Rate of every variable: Hamilton's equations if the scene has noise, otherwise the equations of motion."""
        if not self.momenta:
            return dict(zip(self.state, self.drift, strict=True))
        # H is differentiated with opaque stop forces, so that their formulas keep the form in which they were written.
        x, v = self.state[:2]
        forces = self.opaque_forces
        hamiltonian = self.hamiltonian_with(self.drift_with(self.forcing, forces))
        rates = {q: sympy.diff(hamiltonian, p) for q, p in zip(self.state, self.momenta, strict=True)}
        rates |= {
            p: sum(sympy.expand_mul(term, deep=False) for term in sympy.Add.make_args(-sympy.diff(hamiltonian, q)))
            for q, p in zip(self.state, self.momenta, strict=True)
        }
        written_out = {
            sympy.diff(force, (x, a), (v, b)): self.guarded_force(index, a, b)
            for index, force in enumerate(forces)
            for a, b in ((1, 0), (0, 1), (0, 0))
        }
        return {variable: rate.xreplace(written_out) for variable, rate in rates.items()}

    def border_ahead(self, state: Sequence[float], time: float, lapse: float) -> str:
        """Return in words the border that the motion from a state (x, v, …) meets within a time (s); "" for none.

        For so short a time the motion is a straight line. A state where the forces have no value is at the border.
        """
        place, borders = dict(zip(self.state, state, strict=True)), [one.at(self.numbers) for one in self.borders]
        met = next(((index, list(state)) for index, one in enumerate(borders) if one.excludes(place)), None)
        if met is None:
            rates = self.drift.subs(self.numbers | place | {self.time: time}).evalf()
            if not all(rate.is_extended_real for rate in rates):  # at no state, or the state were at a border
                return ""
            met = border_ahead(borders, self.state, state, [lapse * float(rate) for rate in rates])
        if met is None:
            return ""
        border, end = self.borders[met[0]], zip(self.state, met[1], strict=True)
        where = ", ".join(f"{q} = {at:.6g}" for q, at in end if q in border.gauge.free_symbols)
        return f"{where}, {border.in_words(as_text(border.gauge))}"

    def _present(self, more: Sequence[Border] = ()) -> list[Border]:
        """The borders that are somewhere, at the parameters of the scene."""
        return [border for border in (*self.borders, *more) if border.at(self.numbers).exists]

    @property
    def conditions(self) -> str:
        """Where the forces have values, such as ``"h - x ≠ 0"``; "" if they have them everywhere."""
        return " and ".join(f"{as_text(border.gauge)} {border.relation} 0" for border in self._present())

    @cached_property
    def domain(self) -> Domain:
        """The intervals of x in which a mass at rest has a force, at the parameters of the scene."""
        at_rest = dict.fromkeys(self.state[1:], sympy.Integer(0)) | self.numbers
        return Domain([border.at(at_rest) for border in self.borders], self.state[0])

    @cached_property
    def jacobian(self) -> sympy.Matrix:
        """∂b/∂q, n × n."""
        return self.drift.jacobian(list(self.state))

    @cached_property
    def noise_filter(self) -> NoiseFilter | None:
        """What white noise passes before it acts on the mass; None if nothing, or no linear filter."""
        return NoiseFilter.of(self)

    @cached_property
    def undamped(self) -> bool:
        """Whether the motion conserves energy at the parameters of the scene: no friction, and conservative stops."""
        varying = sympy.diff(self.forcing.subs(self.numbers), self.state[1])
        return self._friction == 0 and varying == 0 and self._conservative_stops

    @cached_property
    def balance(self) -> sympy.Expr | None:
        """The ratio 2γ/a₂₂ of the action to the energy that it climbs, where detailed balance holds; otherwise None.

        It holds without forcing if the friction γ and the noise are constant and all other forces depend on x only,
        at the parameters of the scene (Freidlin & Wentzell, 4.3).
        """
        if not self._from_potential:
            return None
        noise = self.diffusion[1, 1].subs(self.numbers)
        return None if noise == 0 or noise.free_symbols & {*self.state} else 2 * self._friction / noise

    @cached_property
    def relaxes(self) -> bool:
        """Whether motion without noise loses energy until it rests: constant friction, all other forces of x only."""
        return self._from_potential and bool(self._friction > 0)

    @cached_property
    def _from_potential(self) -> bool:
        """Whether friction is constant and all other forces derive from a potential, at the parameters of the scene."""
        if self.forcing != 0 or len(self.state) > 2 or not self._conservative_stops:
            return False
        return not self._friction.free_symbols & {*self.state}

    @cached_property
    def _friction(self) -> sympy.Expr:
        """γ = −∂v′/∂v without stops, at the parameters of the scene."""
        return -sympy.diff(self.smooth_force.subs(self.numbers), self.state[1])

    @cached_property
    def _conservative_stops(self) -> bool:
        """Whether no force of a stop depends on the rate, at the parameters of the scene."""
        return not any(sympy.expand(contact.law.subs(self.numbers)).has(RATE) for contact in self.contacts)

    @property
    def latex(self) -> str:
        """The equations as an ``aligned`` block of LaTeX."""
        lines = [rf"\dot{{{as_latex(q)}}} &= {as_latex(rate)}" for q, rate in self.equations.items()]
        if self.momenta:
            lines.append(rf"\dot{{S}} &= {as_latex(self.action_rate)}")
        signs = {"≠": r"\neq", ">": ">"}
        present = self._present(self.noise_borders)
        lines += [f"{as_latex(border.gauge)} &{signs[border.relation]} 0" for border in present]
        return r"\begin{aligned}" + r"\\ ".join(lines) + r"\end{aligned}"

    @property
    def mathml(self) -> tuple[str, ...]:
        """The equations as elements ``math`` of MathML, and the Hamiltonian of a scene with noise."""
        lines = [rate_equation(q, rate) for q, rate in self.equations.items()]
        return (*lines, definition("H", self.hamiltonian)) if self.momenta else tuple(lines)

    def _repr_latex_(self) -> str:
        return rf"$\displaystyle {self.latex}$"

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        lines = [f"{q}' = {as_text(rate)}" for q, rate in self.equations.items()]
        if self.momenta:
            lines += [f"S' = {as_text(self.action_rate)}", f"H = {as_text(self.hamiltonian)}"]
        lines += [f"{as_text(border.gauge)} {border.relation} 0" for border in self._present(self.noise_borders)]
        return "\n".join(lines)
