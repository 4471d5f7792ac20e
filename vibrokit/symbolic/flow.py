"""Equations of each flow, derived from the model."""

from __future__ import annotations

import dataclasses
from functools import cached_property

import sympy

from vibrokit.parts.scene import Scene
from vibrokit.symbolic.contact import DEPTH, RATE, DerivedContact
from vibrokit.symbolic.equations import Equations
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.forcing import Forcing

ACTION = sympy.Symbol("S", real=True)


@dataclasses.dataclass(frozen=True)
class FlowEquations:
    """Rates of a flow, with one symbol per contact term."""

    variables: tuple[sympy.Symbol, ...]
    rates: tuple[sympy.Expr, ...]  # in the variables, the parameters, functions of time and the symbols of `contacts`
    contacts: dict[sympy.Symbol, tuple[int, int, int]]  # stop, orders in x and in v of each needed contact term
    covariances: tuple[sympy.Symbol, ...]  # among the variables


class ReversedEquations(Equations):
    """The motion of a scene backwards in time.

    With s = −t and w = −v the motion is again x′ = w, w′ = f(x, −w, −s): the acceleration keeps its sign, so steppers
    integrate it and locate its contacts as for any scene. The symbols v and t of this model stand for w and s. A law
    is evaluated at the rate of the forward motion, which decides where it would pull. Forces that jump at first touch
    jump at release instead; x′ is continuous at both, so the backward motion is unique.
    """

    @cached_property
    def contacts(self) -> tuple[DerivedContact, ...]:
        """Derived contact of each stop, with the rate reversed in the law."""
        return tuple(dataclasses.replace(c, law=c.law.xreplace({RATE: -RATE})) for c in super().contacts)

    @cached_property
    def smooth_force(self) -> sympy.Expr:
        """Acceleration without stops and without forces that vary in time."""
        return self._reversed(super().smooth_force)

    @cached_property
    def in_time(self) -> Forcing:
        """The forces of the excitations; the steady one is that of the forward motion, as `smooth_force` needs it."""
        forward = super().in_time
        functions = {symbol: self._reversed(function) for symbol, function in forward.functions.items()}
        return forward._replace(
            varying=self._reversed(forward.varying),
            functions=functions,
            in_functions=self._reversed(forward.in_functions),
        )

    @cached_property
    def _extra_drift(self) -> tuple[sympy.Expr, ...]:
        return tuple(-self._reversed(rate) for rate in super()._extra_drift)

    @cached_property
    def amplitude(self) -> sympy.Matrix:
        """Column σ(q), the factor of √D dW."""
        return super().amplitude.applyfunc(self._reversed)

    def _reversed(self, expression: sympy.Expr) -> sympy.Expr:
        return sympy.sympify(expression).xreplace({self.state[1]: -self.state[1], self.time: -self.time})


def model_for(scene: Scene, flow: Flow) -> Equations:
    """Return the model of a flow: that of the scene, or of the scene backwards in time."""
    return ReversedEquations(scene) if flow.reversed else Equations(scene)


def derive_flow(model: Equations, flow: Flow) -> FlowEquations:
    """Derive the equations of a flow from its model, as returned by `model_for`."""
    if flow.differentiates:
        model.check_derivatives()
    opaque = model.opaque_forces
    drift = model.drift_with(model.in_time.in_functions, opaque)
    variables: tuple[sympy.Symbol, ...] = model.state
    rates = list(drift)
    linear = drift.jacobian(list(model.state)) if flow.has_derivatives else None
    if flow.has_momenta:
        hamiltonian = model.hamiltonian_with(drift)
        phase = (*model.state, *model.momenta)
        rates = [sympy.diff(hamiltonian, p) for p in model.momenta]
        rates += [-sympy.diff(hamiltonian, q) for q in model.state]
        if flow is Flow.HAMILTONIAN_VARIATIONAL:
            linear = sympy.Matrix(rates).jacobian(list(phase))
        variables = (*phase, ACTION)
        rates.append(model.action_rate)
    if linear is not None:
        size = linear.shape[0]
        matrix = sympy.Matrix(size, size, lambda i, j: sympy.Symbol(f"m_{i}{j}", real=True))
        variables = (*variables, *matrix)
        rates += list(linear * matrix)
    covariances: tuple[sympy.Symbol, ...] = ()
    if flow.has_covariance:
        size = len(model.state)
        places = [(row, column) for row in range(size) for column in range(row, size)]
        covariance = sympy.Matrix(size, size, lambda i, j: sympy.Symbol(f"W{min(i, j)}{max(i, j)}", real=True))
        carried = drift.jacobian(list(model.state)) * covariance
        gathered = carried + carried.T + model.diffusion
        covariances = tuple(covariance[place] for place in places)
        variables = (*variables, *covariances)
        rates += [gathered[place] for place in places]
    rates, contacts = _with_plain_contacts(model, opaque, rates)
    return FlowEquations(variables, tuple(rates), contacts, covariances)


def _with_plain_contacts(
    model: Equations, opaque: tuple[sympy.Expr, ...], rates: list[sympy.Expr]
) -> tuple[list[sympy.Expr], dict[sympy.Symbol, tuple[int, int, int]]]:
    """Replace the force of each stop and its derivatives by one symbol each, and say which; what is 0 is left out."""
    x, v = model.state[:2]
    contacts: dict[sympy.Symbol, tuple[int, int, int]] = {}
    replacements = {}
    orders = [(a, b) for total in (2, 1, 0) for a in range(total, -1, -1) for b in (total - a,)]
    for index, function in enumerate(opaque):
        law = model.contacts[index].law
        for a, b in orders:
            term = sympy.diff(function, (x, a), (v, b))
            if any(rate.has(term) for rate in rates):
                if sympy.diff(law, (DEPTH, a), (RATE, b)) == 0:
                    replacements[term] = sympy.Integer(0)
                    continue
                symbol = sympy.Symbol(f"C{index}" + ("_" if a + b else "") + "x" * a + "v" * b, real=True)
                replacements[term] = symbol
                contacts[symbol] = (index, a, b)
    rates = [rate.doit().xreplace(replacements) for rate in rates]
    needed = set().union(*(rate.free_symbols for rate in rates))
    return rates, {s: c for s, c in contacts.items() if s in needed}
