"""Second-order form: equations of a flow as u″ = d u′ + F(u, t), for Runge–Kutta–Nyström steps."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import sympy

from vibrokit.symbolic.flow import FlowEquations
from vibrokit.symbolic.flow_kind import Flow

_PLANE = 2  # variables of a state without extra noise states


@dataclasses.dataclass(frozen=True)
class Pair:
    """A variable u with u′ = own u + turned w and w′ = damping w + force, the force a function of such u and t."""

    position: int  # place of u among the variables of the flow
    velocity: int  # place of w
    own: sympy.Expr
    turned: sympy.Expr
    damping: sympy.Expr
    force: sympy.Expr

    @property
    def constants(self) -> tuple[sympy.Expr, sympy.Expr, sympy.Expr]:
        """What stages depend on besides the force."""
        return self.own, self.turned, self.damping

    def acceleration(self, position: sympy.Symbol) -> sympy.Expr:
        """F of u″ = (own + damping) u′ + F."""
        return self.turned * self.force - self.own * self.damping * position


@dataclasses.dataclass(frozen=True)
class SecondOrderForm:
    """All variables of a flow: pairs, and integrals of functions of the positions."""

    pairs: tuple[Pair, ...]
    integrals: tuple[int, ...]  # places among the variables


def second_order_form(equations: FlowEquations, flow: Flow) -> SecondOrderForm | None:
    """Return the second-order form of a flow; None where a force depends on a velocity otherwise than linearly.

    The position that goes with the velocity v is x. That which goes with the momentum p_x is p_v, since p_v′ = −p_x +
    2ζω_n p_v and p_x′ is a force. Derivatives of both pair likewise, by columns. A covariance has no such form.
    """
    if flow.has_covariance or flow is Flow.NOISY:
        return None
    places = list(_places(flow))
    integrals = (2 * _PLANE,) if flow.has_momenta else ()
    if len(equations.variables) != 2 * len(places) + len(integrals):
        return None  # the noise has states of its own
    positions = {equations.variables[position] for position, _ in places}
    others = set(equations.variables) - positions
    pairs = [_pair(equations, position, velocity, others) for position, velocity in places]
    if any(pair is None for pair in pairs):
        return None
    if any(equations.rates[place].free_symbols & others for place in integrals):
        return None
    return SecondOrderForm(tuple(pair for pair in pairs if pair is not None), integrals)


def _places(flow: Flow) -> Iterator[tuple[int, int]]:
    """Places of positions and velocities among the variables of a flow."""
    plain = ((0, 1), (3, 2)) if flow.has_momenta else ((0, 1),)
    yield from plain
    if flow.has_derivatives or flow is Flow.HAMILTONIAN_VARIATIONAL:
        size = 2 * len(plain)
        begin = size + int(flow.has_momenta)
        for position, velocity in plain:
            yield from ((begin + position * size + k, begin + velocity * size + k) for k in range(size))


def _pair(equations: FlowEquations, position: int, velocity: int, others: set[sympy.Symbol]) -> Pair | None:
    variables, rates = equations.variables, equations.rates
    u, w = variables[position], variables[velocity]
    own, turned = sympy.diff(rates[position], u), sympy.diff(rates[position], w)
    damping, given = sympy.diff(rates[velocity], w), {*variables, *equations.contacts}
    if turned == 0 or any(each.free_symbols & given for each in (own, turned, damping)):
        return None
    force = rates[velocity].xreplace({w: sympy.Integer(0)})
    rest = rates[position].xreplace({u: sympy.Integer(0), w: sympy.Integer(0)})
    if sympy.expand(rest) != 0 or force.free_symbols & others:
        return None
    return Pair(position, velocity, own, turned, damping, force)
