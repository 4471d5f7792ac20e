"""From the syntax tree of a checked formula to a SymPy expression."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import sympy

from vibrokit.parts.formula_text import FormulaError, refusal
from vibrokit.parts.formula_tree import LARGEST_EXPONENT, OPERATIONS, bottom_up, no_arithmetic, operands

LARGEST_EXACT_DENOMINATOR = 64
LONGEST_EXACT_CONSTANT = 20  # nodes of a SymPy tree

_SYMPY_NAMES = {"abs": "Abs", "min": "Min", "max": "Max"}
_FAILURES = (ArithmeticError, AttributeError, NotImplementedError, RecursionError, TypeError, ValueError)


def build(text: str, tree: ast.expr, names: Sequence[str], values: Mapping[str, Any]) -> sympy.Expr:
    """Return the expression of `tree`, with `values` for its `names`; what Formula.expression does."""
    symbols = {name: _value(name, values) for name in names}
    built: dict[ast.expr, Any] = {}
    for node in bottom_up(tree):
        parts = [built[part] for part in operands(node)]
        try:
            built[node] = _settled(text, node, _built(text, node, parts, symbols))
        except FormulaError:
            raise
        except _FAILURES as error:
            problem = f"SymPy makes no expression of this part ({error}); write it in another way"
            raise refusal(text, node.col_offset, problem) from error
    _check_expression(text, built[tree])
    return built[tree]


def _value(name: str, values: Mapping[str, Any]) -> sympy.Expr:
    """What stands for `name`; text is refused, because SymPy would run it."""
    if name not in values:
        raise FormulaError(f"The formula uses {name}, which has no value; give a SymPy expression for it.")
    value = values[name]
    try:
        expression = _float(value) if isinstance(value, float) else sympy.sympify(value, strict=True)
    except sympy.SympifyError:
        expression = None
    if not isinstance(expression, sympy.Expr):
        kind = type(value).__name__
        raise FormulaError(f"The value of {name} is of type {kind}; give a SymPy expression or a number.")
    if expression.is_number and not _is_finite(expression):
        raise FormulaError(f"The value of {name} is {_brief(expression)}; give a finite real number.")
    return expression


def _float(value: float) -> sympy.Float:
    """The same double, with the fewest digits that read back as it: 0.7 is not printed as 0.69999999999999996."""
    if not math.isfinite(value):
        return sympy.Float(value)
    numbers = (sympy.Float(value, digits) for digits in (15, 16, 17))
    return next(number for number in numbers if float(str(number)) == value)


def _built(text: str, node: ast.expr, parts: list[Any], symbols: Mapping[str, Any]) -> Any:
    """Expression of one node from those of its operands."""
    match node:
        case ast.Constant(value=int() as number):
            return sympy.Integer(number)
        case ast.Constant(value=float() as number):
            return _float(number)
        case ast.Name(id="pi"):
            return sympy.pi
        case ast.Name(id=name):
            return symbols[name]
        case ast.BinOp(op=ast.Pow()):
            return _power(text, node, *parts)
        case ast.BinOp(op=operation) | ast.UnaryOp(op=operation):
            return OPERATIONS[type(operation)](*parts)
        case ast.Call(func=ast.Name(id=name)):
            return getattr(sympy, _SYMPY_NAMES.get(name, name))(*parts)
    raise no_arithmetic(text, node)


def _power(text: str, node: ast.BinOp, base: Any, exponent: Any) -> Any:
    """Power with exponents such as 1.5 made exact, so that half-integer powers stay roots."""
    if exponent.is_number and abs(float(exponent)) > LARGEST_EXPONENT:
        problem = f"an exponent comes to {_brief(exponent)}; allowed are"
        raise refusal(text, node.right.col_offset, f"{problem} -{LARGEST_EXPONENT} to {LARGEST_EXPONENT}")
    if exponent.is_Float:
        exact = Fraction(float(exponent))
        if exact.denominator <= LARGEST_EXACT_DENOMINATOR:
            exponent = sympy.Rational(exact.numerator, exact.denominator)
    return base**exponent


def _settled(text: str, node: ast.expr, expression: sympy.Expr) -> sympy.Expr:
    """Check a constant, and keep constants away from what takes SymPy for ever.

    Long nested roots cost it exponential time, and a power of a product of a Float and a root of an integer,
    such as sqrt(0.7*sqrt(2*x)), never returns (SymPy 1.14): beside a Float, constants are Floats.
    """
    has_float = expression.has(sympy.Float)
    if expression.is_number:
        if not _is_finite(expression):
            problem = f"a part of it comes to {_brief(expression)}, which is no finite real number"
            raise refusal(text, node.col_offset, problem)
        is_long = sum(1 for _ in sympy.preorder_traversal(expression)) > LONGEST_EXACT_CONSTANT
        return _float(float(expression)) if has_float or is_long else expression
    if has_float:
        roots = [power for power in expression.atoms(sympy.Pow) if _is_finite(power)]
        return expression.xreplace({root: _float(float(root)) for root in roots})
    return expression


def _is_finite(expression: sympy.Expr) -> bool:
    """Whether an expression is a number, real, and in the range of doubles."""
    try:
        return bool(expression.is_number) and math.isfinite(float(expression))
    except (TypeError, ValueError, OverflowError):
        return False


def _brief(expression: sympy.Expr) -> str:
    try:
        text = str(expression).replace("zoo", "infinity")
    except ValueError:  # Python prints no integer of more than 4300 digits
        return "a number of thousands of digits"
    return text if len(text) <= 60 else text[:60] + "..."


def _check_expression(text: str, expression: sympy.Expr) -> None:
    """Refuse what only SymPy's simplifications bring to light, such as 1/(x - x)."""
    if expression.has(sympy.zoo, sympy.nan, sympy.oo, -sympy.oo, sympy.I):
        raise refusal(text, 1, f"it comes to {_brief(expression)}, which is not finite and real")
    for number in expression.atoms(sympy.Number):
        if not _is_finite(number):
            raise refusal(text, 1, f"it holds the number {_brief(number)}; numbers must be below 1.8e308")
    for power in expression.atoms(sympy.Pow):
        if power.is_number and not _is_finite(power):
            raise refusal(text, 1, f"a part of it comes to {_brief(power)}, which is no finite real number")
        if power.exp.is_number and abs(float(power.exp)) > LARGEST_EXPONENT:
            problem = f"its powers combine to an exponent of {_brief(power.exp)}; allowed are"
            raise refusal(text, 1, f"{problem} -{LARGEST_EXPONENT} to {LARGEST_EXPONENT}")
