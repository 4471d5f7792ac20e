"""The equations of a scene, derived from its parts."""

from __future__ import annotations

from functools import cached_property

import sympy

from vibrokit.parts.friction import Friction
from vibrokit.parts.scene import Scene
from vibrokit.parts.spring import Spring
from vibrokit.symbolic.borders import Border, borders_of
from vibrokit.symbolic.contact import DEPTH, RATE, DerivedContact, derive_contact, refuse_steep_touch
from vibrokit.symbolic.excitations import excitation_force, refuse_moving_borders, support_displacement
from vibrokit.symbolic.forcing import Forcing, forcing_of
from vibrokit.symbolic.formulas import derived_formula, derived_rates
from vibrokit.symbolic.jumps import refuse_jumps
from vibrokit.symbolic.removable import without_removable
from vibrokit.symbolic.roughness import Roughness, refuse_rough, roughness_of
from vibrokit.symbolic.symbols import parameter_symbols, state_symbols


class Equations:
    """Drift, diffusion and Hamiltonian as SymPy expressions, and the borders of the formulas.

    Large-deviation convention: ε = D, dq = b(q, t) dt + √D σ(q) dW, a = σσᵀ, and

        H(q, p, t) = p·b(q, t) + ½ pᵀ a(q) p,   q′ = ∂H/∂p,   p′ = −∂H/∂q,   S′ = ½ pᵀ a p

    (Freidlin & Wentzell, *Random Perturbations of Dynamical Systems*).

    Parameters
    ----------
    scene : Scene
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.symbols = parameter_symbols(scene)
        self.time = sympy.Symbol("t", real=True)
        self.state = state_symbols(scene)

    @cached_property
    def numbers(self) -> dict[sympy.Symbol, float]:
        """The values of the parameters of the scene."""
        values = self.scene.parameters
        return {symbol: values[path] for path, symbol in self.symbols.items()}

    def _symbols_of(self, prefix: str) -> dict[str, sympy.Symbol]:
        paths = (path for path in self.symbols if path.startswith(f"{prefix}."))
        return {path.removeprefix(f"{prefix}."): self.symbols[path] for path in paths}

    @cached_property
    def contacts(self) -> tuple[DerivedContact, ...]:
        """Derived contact of each stop."""
        return tuple(
            derive_contact(barrier, self._symbols_of(f"barriers.{index}.law"), self.scene.reference_frequency)
            for index, barrier in enumerate(self.scene.barriers)
        )

    def guarded_force(self, index: int, in_x: int = 0, in_v: int = 0) -> sympy.Expr:
        """Force of stop `index` on the mass: zero without contact, and where a clamped law would pull.

        `in_x` and `in_v` are orders of differentiation in x and in v.
        """
        x, v = self.state[:2]
        sign, position = self.scene.barriers[index].sign, self.symbols[f"barriers.{index}.position"]
        force = -sign * self.contacts[index].law.subs({DEPTH: sign * (x - position), RATE: sign * v})
        touching = x > position if sign > 0 else x < position
        if self.contacts[index].clamped:
            touching = sympy.And(touching, -sign * force > 0)
        return sympy.Piecewise((sympy.diff(force, (x, in_x), (v, in_v)), touching), (0, True))

    @cached_property
    def smooth_force(self) -> sympy.Expr:
        """Acceleration without stops and without forces that vary in time."""
        extra = self.state[2:]
        push = self._noise_formula("force", tuple(extra)) if extra else 0
        return -self._own_damping - self._own_spring - sum(self._forces_of_state.values()) + self.in_time.steady + push

    @property
    def _own_frequency(self) -> sympy.Expr:
        """ω_n in the number that the scene gives; 0 where it has none."""
        symbols, given = self.symbols, self.scene.own_frequency > 0
        omega = symbols.get("natural_frequency") or sympy.sqrt(symbols.get("stiffness", 0))
        return omega if given else sympy.Integer(0)

    @property
    def _own_spring(self) -> sympy.Expr:
        """ω_n² x or κ x, unless a spring takes its place."""
        stiffness = self.symbols.get("stiffness", self._own_frequency**2)
        return stiffness * self.state[0] if self.scene.spring is None else sympy.Integer(0)

    @property
    def _own_damping(self) -> sympy.Expr:
        """2ζω_n v or c v."""
        if self.scene.damping is not None:
            return self.symbols["damping"] * self.state[1]
        return 2 * self.symbols["damping_ratio"] * self._own_frequency * self.state[1]

    @cached_property
    def _forces_of_state(self) -> dict[str, sympy.Expr]:
        """The force of the spring and of friction, those that are given, by their paths."""
        return {path: self._force_of_state(path, part) for path, part in self.scene.forces_of_state.items()}

    def _force_of_state(self, path: str, part: Spring | Friction) -> sympy.Expr:
        symbols, (x, v) = self._symbols_of(path), self.state[:2]
        force = without_removable(derived_formula(part, "force", symbols, (x, v)), (x, v))
        refuse_jumps(part, force, (v,), symbols, self.scene.reference_frequency)
        return force

    @cached_property
    def _roughnesses(self) -> dict[str, Roughness]:
        """Where the force of the spring and that of friction are least smooth."""
        return {
            path: roughness_of(part, self._forces_of_state[path], self.state[:2], self._symbols_of(path))
            for path, part in self.scene.forces_of_state.items()
        }

    @property
    def roughness(self) -> Roughness:
        """Where the forces of spring and friction are least smooth."""
        return min(self._roughnesses.values(), key=lambda found: found.power, default=Roughness())

    def check_derivatives(self) -> None:
        """Raise DerivationError if derivatives of the motion, or momenta, cannot be followed under a force."""
        for path, part in self.scene.forces_of_state.items():
            refuse_rough(part, self._forces_of_state[path], self._roughnesses[path], self._symbols_of(path))
        for contact in self.contacts:
            refuse_steep_touch(contact)

    @cached_property
    def excitations(self) -> tuple[sympy.Expr, ...]:
        """Force of each excitation as an expression in the time, and in x and v where it depends on them."""
        reference, plane = self.scene.reference_frequency, self.state[:2]
        found, moved = list[sympy.Expr](), sympy.Integer(0)
        for index, part in enumerate(self.scene.excitations):
            symbols = self._symbols_of(f"excitations.{index}")
            force = excitation_force(part, symbols, self.time, plane, reference)
            if part.moves_support:
                before, moved = moved, moved + support_displacement(part, symbols, self.time)
                force += self._held_at(before) - self._held_at(moved)
            found.append(force)
        return tuple(found)

    def _held_at(self, place: sympy.Expr) -> sympy.Expr:
        """The force of spring and damper, whose foot is at a place that depends on time."""
        x, v = self.state[:2]
        held = self._own_damping + self._own_spring + self._forces_of_state.get("spring", 0)
        if place != 0:
            refuse_moving_borders(held, (x, v))
        return held.subs({x: x - place, v: v - sympy.diff(place, self.time)}, simultaneous=True)

    @cached_property
    def in_time(self) -> Forcing:
        """The forces of the excitations, split by what they depend on."""
        return forcing_of(self.excitations, self.time, self.state)

    @property
    def forcing(self) -> sympy.Expr:
        """Sum of the forces that vary in time."""
        return self.in_time.varying

    def drift_with(self, forcing: sympy.Expr, contacts: tuple[sympy.Expr, ...]) -> sympy.Matrix:
        """Drift b for a given forcing and given forces of the stops."""
        v = self.state[1]
        acceleration = self.smooth_force + forcing + sum(contacts, sympy.Integer(0))
        return sympy.Matrix([v, acceleration, *self._extra_drift])

    @cached_property
    def _extra_drift(self) -> tuple[sympy.Expr, ...]:
        noise, extra = self.scene.noise, self.state[2:]
        if noise is None or not extra:
            return ()
        symbols = self._symbols_of("noise")
        rates = derived_rates(noise, "drift", symbols, self.state, len(extra))
        for rate in rates:
            refuse_jumps(noise, rate, self.state, symbols, self.scene.reference_frequency)
        return rates

    @cached_property
    def drift(self) -> sympy.Matrix:
        """Drift b(q, t) with stops as `Piecewise`, a column of length n."""
        return self.drift_with(self.forcing, tuple(map(self.guarded_force, range(len(self.scene.barriers)))))

    @cached_property
    def borders(self) -> tuple[Border, ...]:
        """Where motion without noise ends: the poles of the forces, and the edges of their domains."""
        x, v = self.state[:2]
        found = dict.fromkeys(one for rate in (self.smooth_force, *self._extra_drift) for one in self._borders(rate))
        for index, (contact, barrier) in enumerate(zip(self.contacts, self.scene.barriers, strict=True)):
            depth = barrier.sign * (x - self.symbols[f"barriers.{index}.position"])
            for one in borders_of(contact.law, (DEPTH, RATE)):
                gauge = one.gauge.subs({DEPTH: sympy.Max(depth, 0), RATE: barrier.sign * v}, simultaneous=True)
                found[Border(gauge, one.pole)] = None
        return tuple(found)

    @cached_property
    def noise_borders(self) -> tuple[Border, ...]:
        """Where noisy motion ends besides: the borders of the amplitude of the noise."""
        return tuple(one for one in self._borders(sum(self.amplitude)) if one not in self.borders)

    def _borders(self, expression: sympy.Expr) -> tuple[Border, ...]:
        return borders_of(sympy.sympify(expression), self.state)

    @cached_property
    def amplitude(self) -> sympy.Matrix:
        """Column σ(q), the factor of √D dW."""
        column = [sympy.Integer(0)] * len(self.state)
        if self.scene.noise is not None:
            column[-1 if len(self.state) > 2 else 1] = self._noise_formula("amplitude", self.state[:2])
        return sympy.Matrix(column)

    def _noise_formula(self, method: str, state: tuple[sympy.Symbol, ...]) -> sympy.Expr:
        symbols = self._symbols_of("noise")
        formula = derived_formula(self.scene.noise, method, symbols, state)
        refuse_jumps(self.scene.noise, formula, state, symbols, self.scene.reference_frequency)
        return formula

    @cached_property
    def diffusion(self) -> sympy.Matrix:
        """Diffusion matrix a = σσᵀ, n × n, without the factor D."""
        return self.amplitude * self.amplitude.T

    @cached_property
    def momenta(self) -> tuple[sympy.Symbol, ...]:
        """Momenta conjugate to the state; none in a scene without noise."""
        if self.scene.noise is None:
            return ()
        return tuple(sympy.Symbol(f"p_{index + 1}", real=True) for index in range(len(self.state)))

    def hamiltonian_with(self, drift: sympy.Matrix) -> sympy.Expr:
        """H for a given drift."""
        return (sympy.Matrix(self.momenta).T * drift)[0] + self.action_rate if self.momenta else sympy.Integer(0)

    @cached_property
    def hamiltonian(self) -> sympy.Expr:
        """H(q, p, t) = p·b + ½ pᵀ a p."""
        return self.hamiltonian_with(self.drift)

    @cached_property
    def action_rate(self) -> sympy.Expr:
        """S′ = ½ pᵀ a p along Hamilton's equations."""
        p = sympy.Matrix(self.momenta)
        return (p.T * self.diffusion * p)[0] / 2 if self.momenta else sympy.Integer(0)

    @property
    def opaque_forces(self) -> tuple[sympy.Expr, ...]:
        """The force of each stop as an undefined function of x and v."""
        return tuple(sympy.Function(f"C{index}")(*self.state[:2]) for index in range(len(self.scene.barriers)))
