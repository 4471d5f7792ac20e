"""From the syntax tree of a checked formula to a SymPy expression."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import sympy

from vibrokit.errors import FormulaError, shown
from vibrokit.parts.formula import LARGEST_EXPONENT, OPERATIONS, fold, read, refusal

_LARGEST_DENOMINATOR = 64  # of a number that is exact as a decimal, such as 1.5
LONGEST_EXACT_CONSTANT = 20  # nodes of a SymPy tree

_SYMPY_NAMES = {"abs": "Abs", "min": "Min", "max": "Max"}
_FAILURES = (ArithmeticError, AttributeError, NotImplementedError, RecursionError, TypeError, ValueError)


def expression(text: object, values: Mapping[str, Any]) -> sympy.Expr:
    """Check a formula and return it as a SymPy expression, with `values` for the names that it may use.

    FormulaError is raised if the formula or a value is not allowed, or the expression is not finite and real.
    """
    source, tree = read(text, values)
    symbols = {name: _value(name, value) for name, value in values.items()}

    def visit(node: ast.expr, parts: list[Any]) -> Any:
        try:
            return _stable(_built(node, parts, symbols))
        except _FAILURES as error:
            raise refusal(source, node.col_offset, f"it has no expression here: {error}") from error

    whole = fold(tree, visit)
    try:
        _check(whole)
    except ValueError as error:
        raise refusal(source, 0, str(error)) from error
    return whole


def _value(name: str, value: Any) -> sympy.Expr:
    try:  # strict: SymPy would evaluate text as code
        found = _float(value) if isinstance(value, float) else sympy.sympify(value, strict=True)
    except sympy.SympifyError:
        found = None
    if not isinstance(found, sympy.Expr) or (found.is_number and not _is_finite(found)):
        raise FormulaError(f"The value of {name} is {shown(value)}; give a SymPy expression or a finite real number.")
    return found


def _float(value: float) -> sympy.Float:
    """Return the same double, with the fewest digits that read back as it: 0.7, not 0.69999999999999996."""
    return next(
        (sympy.Float(value, digits) for digits in (15, 16) if float(f"{value:.{digits}g}") == value),
        sympy.Float(value, 17),
    )


def _built(node: ast.expr, parts: list[Any], symbols: Mapping[str, Any]) -> Any:
    """Return the expression of one node from those of its operands."""
    match node:
        case ast.Constant(value=float() as number):
            return _float(number)
        case ast.Constant(value=number):
            return sympy.Integer(number)
        case ast.Name(id=name):
            return sympy.pi if name == "pi" else symbols[name]
        case ast.BinOp(op=ast.Pow()):
            return _power(*parts)
        case ast.BinOp(op=operation) | ast.UnaryOp(op=operation):
            return OPERATIONS[type(operation)](*parts)
        case ast.Call(func=ast.Name(id=name)):
            return getattr(sympy, _SYMPY_NAMES.get(name, name))(*parts)
    raise TypeError(f"{type(node).__name__} is not arithmetic")


def _power(base: Any, exponent: Any) -> Any:
    """Return a power; exponents such as 1.5 become exact, so that half-integer powers stay roots."""
    _check_exponent(exponent)
    found = exact(float(exponent)) if exponent.is_Float else exponent
    return base ** (found if found.is_Rational else exponent)


def exact(value: Any) -> Any:
    """Return a float such as 1.5, with a denominator of at most 64, as an exact fraction."""
    if isinstance(value, float):
        fraction = Fraction(value)
        if fraction.denominator <= _LARGEST_DENOMINATOR:
            return sympy.Rational(fraction.numerator, fraction.denominator)
        return sympy.Float(value, 17)
    return value


def _stable(expression: sympy.Expr) -> sympy.Expr:
    """Check a constant, and replace constants on which SymPy would not end.

    Long nested roots cost it exponential time, and a power of a product of a Float and a root of an integer,
    such as sqrt(0.7*sqrt(2*x)), never returns (SymPy 1.14): beside a Float, constants become Floats.
    """
    has_float = expression.has(sympy.Float)
    if expression.is_number:
        _check_finite(expression)
        is_long = sum(1 for _ in sympy.preorder_traversal(expression)) > LONGEST_EXACT_CONSTANT
        return _float(float(expression)) if has_float or is_long else expression
    if has_float:
        roots = [power for power in expression.atoms(sympy.Pow) if _is_finite(power)]
        return expression.xreplace({root: _float(float(root)) for root in roots})
    return expression


def _check(expression: sympy.Expr) -> None:
    """Refuse what appears only once SymPy has simplified the whole, such as 1/(x - x)."""
    for part in expression.atoms(sympy.Number, sympy.Pow, type(sympy.zoo), type(sympy.I)):
        if part.is_number:
            _check_finite(part)
        if part.is_Pow:
            _check_exponent(part.exp)


def _check_finite(constant: sympy.Expr) -> None:
    if not _is_finite(constant):
        value = shown(constant).replace("zoo", "infinity")
        raise ValueError(f"a part of it evaluates to {value}; give one that is real and below 1.8e308")


def _check_exponent(exponent: sympy.Expr) -> None:
    if exponent.is_number and abs(float(exponent)) > LARGEST_EXPONENT:
        allowed = f"-{LARGEST_EXPONENT} to {LARGEST_EXPONENT}"
        raise ValueError(f"an exponent evaluates to {shown(exponent)}; allowed are {allowed}")


def _is_finite(expression: sympy.Expr) -> bool:
    """Whether an expression is a number, real, and in the range of doubles."""
    try:
        return bool(expression.is_number) and math.isfinite(float(expression))
    except (TypeError, ValueError, OverflowError):
        return False
