"""Forces that vary in time: which functions of time they need, so that each is evaluated once for all trajectories."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import sympy

FORCING = sympy.Symbol("f", real=True)
"""The sum of all forces of time alone."""


class Forcing(NamedTuple):
    """The forces of the excitations, split by what they depend on."""

    steady: sympy.Expr  # what does not depend on time
    varying: sympy.Expr  # the rest, in the time and the state
    functions: dict[sympy.Symbol, sympy.Expr]  # functions of time: first FORCING, where there is such, then others
    in_functions: sympy.Expr  # the varying force in these symbols and the state, without the time

    @property
    def modulated(self) -> bool:
        """Whether a force that varies in time depends on the state."""
        return self.in_functions not in (FORCING, sympy.S.Zero)


def forcing_of(forces: Iterable[sympy.Expr], time: sympy.Symbol, state: Sequence[sympy.Symbol]) -> Forcing:
    """Split the forces of excitations.

    A force that depends on time and state is written with functions of time in the place of every part of it that
    depends on time alone, as it stands or multiplied out, whichever needs fewer: λ cos(ωt) x with cos(ωt), ω²(x − y(t))
    with ω² y(t), which is a force of time alone, and β(x − y(t))³ with y(t).
    """
    forces = tuple(forces)
    alone = [force for force in forces if time not in force.free_symbols or force.free_symbols.isdisjoint(state)]
    mixed = sum((force for force in forces if force not in alone), sympy.S.Zero)
    if mixed == 0:
        return _split(alone, mixed, time, state)
    found = [_split(alone, form, time, state) for form in (sympy.expand(mixed), mixed)]
    return min(found, key=lambda one: len(one.functions))


def _split(
    alone: Sequence[sympy.Expr], mixed: sympy.Expr, time: sympy.Symbol, state: Sequence[sympy.Symbol]
) -> Forcing:
    """Split forces of time or state alone, and one of both as it is written."""
    terms = [] if mixed == 0 else sympy.Add.make_args(mixed)
    varying = [term for term in terms if time in term.free_symbols]
    both = sum((term for term in varying if not term.free_symbols.isdisjoint(state)), sympy.S.Zero)
    pure = sum((force for force in alone if time in force.free_symbols), sympy.S.Zero)
    pure += sum((term for term in varying if term.free_symbols.isdisjoint(state)), sympy.S.Zero)
    steady = sum((force for force in (*alone, *terms) if time not in force.free_symbols), sympy.S.Zero)
    functions = _Functions(time, state)
    in_functions = functions.written(both) + (FORCING if pure != 0 else 0)
    own = {symbol: function for function, symbol in functions.symbols.items()}
    return Forcing(steady, pure + both, ({FORCING: pure} if pure != 0 else {}) | own, in_functions)


class _Functions:
    """Functions of time, each with a symbol."""

    def __init__(self, time: sympy.Symbol, state: Sequence[sympy.Symbol]) -> None:
        self.time, self.state = time, frozenset(state)
        self.symbols: dict[sympy.Expr, sympy.Symbol] = {}

    def written(self, node: sympy.Basic) -> sympy.Basic:
        """Return an expression with a symbol for each of its largest parts that depend on time alone.

        Of a sum, constants are among these parts; a constant factor is not, so that one function serves several.
        """
        if self.time not in node.free_symbols:
            return node
        if self._is_of_time(node):
            return self._symbol(node)
        if isinstance(node, sympy.Add | sympy.Mul):
            timed = [arg for arg in node.args if self._is_of_time(arg)]
            if timed:
                if node.is_Add:
                    timed = [arg for arg in node.args if self.state.isdisjoint(arg.free_symbols)]
                rest = [self.written(arg) for arg in node.args if arg not in timed]
                return node.func(*rest, self._symbol(node.func(*timed)))
        return node.func(*map(self.written, node.args))

    def _is_of_time(self, node: sympy.Basic) -> bool:
        symbols = node.free_symbols
        return isinstance(node, sympy.Expr) and self.time in symbols and self.state.isdisjoint(symbols)

    def _symbol(self, function: sympy.Expr) -> sympy.Symbol:
        return self.symbols.setdefault(function, sympy.Symbol(f"f{len(self.symbols) + 1}", real=True))
