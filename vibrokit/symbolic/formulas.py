"""The formula of a part: its method is called on a twin with symbols, and the result is checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy
from sympy.concrete.expr_with_limits import ExprWithLimits

from vibrokit.errors import DerivationError
from vibrokit.parts.formula_expression import exact
from vibrokit.parts.part import Part
from vibrokit.parts.scene import Scene
from vibrokit.symbolic.printer import FUNCTIONS
from vibrokit.symbolic.symbols import parameter_symbols

_CALLS = (sympy.Function, ExprWithLimits, sympy.Derivative, sympy.Subs)


def derived_formula(
    part: Any, method: str, values: Mapping[str, sympy.Expr], arguments: tuple[sympy.Symbol, ...]
) -> sympy.Expr:
    """Return what a formula method of `part` gives for `arguments` and the symbols `values` of its numeric parameters.

    Structural parameters keep their values. DerivationError is raised if the method fails for symbols, or the result is
    not an expression in the given symbols that compiled code can evaluate.
    """
    title = f"{type(part).__name__}.{method}"
    return _checked(title, _evaluated(title, part, method, values, arguments), {*arguments, *values.values()})


def derived_rates(
    part: Any, method: str, values: Mapping[str, sympy.Expr], arguments: tuple[sympy.Symbol, ...], count: int
) -> tuple[sympy.Expr, ...]:
    """Return the `count` formulas of a method that gives several; the rest as for `derived_formula`."""
    title = f"{type(part).__name__}.{method}"
    rates = _evaluated(title, part, method, values, arguments)
    if not isinstance(rates, tuple | list | sympy.Tuple) or len(rates) != count:
        raise DerivationError(f"{title} must return a tuple of {count} rates, one per extra state, got {rates!r}.")
    return tuple(_checked(title, rate, {*arguments, *values.values()}) for rate in rates)


def _evaluated(
    title: str, part: Any, method: str, values: Mapping[str, sympy.Expr], arguments: tuple[sympy.Symbol, ...]
) -> Any:
    named = {d.name: values.get(d.name, exact(part.parameters[d.name])) for d in part.declared()}
    try:
        answer = getattr(part.twin(named), method)(*arguments)
        return answer if isinstance(answer, tuple | list) else sympy.sympify(answer, strict=True)
    except Exception as error:
        raise DerivationError(
            f"{title} failed when called with symbols ({type(error).__name__}: {error}); use arithmetic and functions "
            "of vibrokit.parts.functions or SymPy, without branches on values."
        ) from error


def _checked(title: str, answer: Any, known: set[Any]) -> sympy.Expr:
    """Return a formula with exact exponents; refuse what is not one in the `known` symbols, real and finite."""
    try:
        answer = sympy.sympify(answer, strict=True)
    except sympy.SympifyError:
        answer = None
    if not isinstance(answer, sympy.Expr):
        raise DerivationError(f"{title} must return a SymPy expression, got {answer!r}.")
    if answer.has(ExprWithLimits):
        answer = answer.doit()
    strange = answer.free_symbols - known
    if strange:
        raise DerivationError(
            f"{title} uses {', '.join(sorted(map(str, strange)))}, neither an argument nor a parameter; declare it as "
            "a field with parameter(...)."
        )
    if answer.has(sympy.I, sympy.nan, sympy.oo, -sympy.oo, sympy.zoo):
        raise DerivationError(f"{title} must be real and finite, got {answer}.")
    others = {
        node for node in sympy.preorder_traversal(answer) if isinstance(node, _CALLS) and node.func not in FUNCTIONS
    }
    if others:
        raise DerivationError(
            f"{title} uses {', '.join(sorted(map(str, others)))}, which compiled code cannot evaluate; use arithmetic, "
            f"minimum, maximum and {', '.join(sorted(function.__name__ for function in FUNCTIONS))}."
        )
    return answer.replace(  # floating-point exponents, as in depth**1.5
        lambda node: isinstance(node, sympy.Pow) and isinstance(node.exp, sympy.Float),
        lambda power: sympy.Pow(power.base, exact(float(power.exp))),
    )


def formulas_of(scene: Scene, path: str, part: Part) -> str:
    """Return text of all formulas of a part of a scene; "" where they fail, for then the derivation fails too."""
    symbols = parameter_symbols(scene)
    values = {name: symbols.get(f"{path}.{name}", exact(value)) for name, value in part.parameters.items()}
    try:
        found = part.twin(values).formulas(lambda name: sympy.Symbol(name, real=True, positive=name == "depth" or None))
        return str(sympy.srepr(found))
    except Exception:
        return ""
