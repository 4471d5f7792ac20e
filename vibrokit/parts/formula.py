"""Formulas as text: arithmetic and a list of functions, checked before anything is made of them.

The text may come from a stranger's scene file. `formula_text` reads it token by token; what is arithmetic
by then becomes a syntax tree, whose constants and powers are checked here, and the tree becomes a SymPy
expression. Nothing is ever compiled or run, and SymPy is imported only when an expression is built.
"""

from __future__ import annotations

import ast
import dataclasses
import math
import operator
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from vibrokit.parts.formula_text import (
    FUNCTIONS,
    FormulaError,
    check_parameter_name,
    check_parameter_names,
    check_text,
    refusal,
)

if TYPE_CHECKING:
    import sympy

__all__ = ["Formula", "FormulaError", "check_parameter_name", "parse_formula"]

LARGEST_EXPONENT = 64
LARGEST_EXACT_DENOMINATOR = 64
LONGEST_EXACT_CONSTANT = 20  # nodes of a SymPy tree

_OPERATIONS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.UAdd: operator.pos, ast.USub: operator.neg,
}  # fmt: skip
_SYMPY_NAMES = {"abs": "Abs", "min": "Min", "max": "Max"}


@dataclasses.dataclass(frozen=True)
class Formula:
    """A formula that has passed every check.

    Attributes
    ----------
    text : str
        The formula as written.
    variables, parameters : tuple of str
        Names that it may use.
    names : tuple of str
        Those that it does use, in order of first use.
    """

    text: str
    variables: tuple[str, ...]
    parameters: tuple[str, ...] = ()
    names: tuple[str, ...] = dataclasses.field(init=False)

    def __post_init__(self) -> None:
        check_parameter_names(self.parameters, self.variables)
        object.__setattr__(self, "names", check_text(self.text, (*self.variables, *self.parameters)))
        _check_constants(self.text, _tree(self.text))

    def expression(self, values: Mapping[str, Any]) -> sympy.Expr:
        """Return the formula as a SymPy expression.

        Parameters
        ----------
        values : mapping of str to sympy.Expr
            What stands for each name that the formula uses; real symbols as a rule. Numbers are accepted,
            text is not.

        Raises
        ------
        FormulaError
            If a name has no value, or the formula comes to something infinite or not real.
        """
        symbols = {name: _value(name, values) for name in self.names}
        built: dict[ast.expr, Any] = {}
        for node in _bottom_up(_tree(self.text)):
            parts = [built[part] for part in _operands(node)]
            try:
                built[node] = _built(self.text, node, parts, symbols)
            except FormulaError:
                raise
            except (ArithmeticError, AttributeError, RecursionError, TypeError, ValueError) as error:
                problem = f"SymPy makes no expression of this part ({error}); write it in another way"
                raise refusal(self.text, node.col_offset, problem) from error
            if parts and built[node].is_number:
                built[node] = _checked_number(self.text, node, built[node])
        _check_expression(self.text, built[node])
        return built[node]


def parse_formula(text: str, variables: Sequence[str], parameters: Sequence[str] = ()) -> Formula:
    """Check a formula and return it; SymPy is not imported.

    Parameters
    ----------
    text : str
        Arithmetic (``+ - * / **``), numbers, `pi`, names, and the functions sqrt, exp, log, sin, cos, tan,
        asin, acos, atan, sinh, cosh, tanh, abs, sign, min and max.
    variables, parameters : sequence of str
        Names that it may use.

    Raises
    ------
    FormulaError
        If anything else is in it; the message says what, where, and what is allowed.

    Examples
    --------
    >>> parse_formula("k*depth**1.5*(1 + c*rate)", ("depth", "rate"), ("k", "c")).names
    ('k', 'depth', 'c', 'rate')
    """
    return Formula(text, tuple(variables), tuple(parameters))


def _tree(text: str) -> ast.expr:
    """Syntax tree of a checked text; the parenthesis put in front makes ``col_offset`` the column, from 1."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return ast.parse(f"({text})", mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise refusal(text, 1, f"it cannot be parsed ({error}); make it simpler") from None


def _operands(node: ast.expr) -> list[ast.expr]:
    match node:
        case ast.BinOp():
            return [node.left, node.right]
        case ast.UnaryOp():
            return [node.operand]
        case ast.Call():
            return node.args
    return []


def _bottom_up(tree: ast.expr) -> Iterator[ast.expr]:
    """Nodes of a tree, each after its operands; no recursion, because a sum may be 250 levels deep."""
    nodes = [tree]
    for node in nodes:
        nodes.extend(_operands(node))
    return reversed(nodes)


def _is_power(node: ast.expr) -> bool:
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow)


def _check_constants(text: str, tree: ast.expr) -> None:
    """Refuse constant parts without a finite real value, and powers that could grow without bound."""
    constants: dict[ast.expr, float | None] = {}
    degrees: dict[ast.expr, float] = {}  # largest product of exponents on a way down from the node
    for node in _bottom_up(tree):
        parts = _operands(node)
        constants[node] = _constant(text, node, [constants[part] for part in parts])
        degrees[node] = max((degrees[part] for part in parts), default=1.0)
        if _is_power(node):
            exponent = constants[parts[1]]
            _check_exponent(text, parts[1], exponent)
            degrees[node] *= max(1.0, abs(exponent or 1.0))
            if degrees[node] > LARGEST_EXPONENT:
                problem = f"the exponents of powers within powers multiply to {degrees[node]:g}"
                raise refusal(text, parts[1].col_offset, f"{problem}; at most {LARGEST_EXPONENT} is allowed")
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and constants[node.right] == 0:
            raise refusal(text, node.right.col_offset, "it divides by zero; a divisor must not be 0")


def _check_exponent(text: str, exponent: ast.expr, value: float | None) -> None:
    if any(map(_is_power, _bottom_up(exponent))):
        problem = "an exponent contains another power; an exponent must be free of powers"
        raise refusal(text, exponent.col_offset, problem)
    if value is not None and abs(value) > LARGEST_EXPONENT:
        problem = f"an exponent is {value:g}; allowed are -{LARGEST_EXPONENT} to {LARGEST_EXPONENT}"
        raise refusal(text, exponent.col_offset, problem)


def _constant(text: str, node: ast.expr, parts: list[float | None]) -> float | None:
    """Value of a node that holds no variable and no parameter; None if it holds one."""
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name):
            return math.pi if name == "pi" else None
        case ast.Call(func=ast.Name(id=name)):
            function = FUNCTIONS[name]
        case ast.BinOp(op=operation) | ast.UnaryOp(op=operation):
            function = _OPERATIONS[type(operation)]
        case _:
            raise _no_arithmetic(text, node)
    if any(part is None for part in parts):
        return None
    try:
        value = float(function(*parts))
    except (ArithmeticError, ValueError, TypeError):
        value = math.nan
    if not math.isfinite(value):
        part = text[node.col_offset - 1 : (node.end_col_offset or 0) - 1]
        part = part if len(part) <= 40 else part[:40] + "..."
        problem = f"its constant part {part!r} has no finite real value; write a number or change it"
        raise refusal(text, node.col_offset, problem)
    return value


def _no_arithmetic(text: str, node: ast.expr) -> FormulaError:
    problem = f"{type(node).__name__} has no meaning in a formula; only arithmetic has"
    return refusal(text, node.col_offset, problem)


def _value(name: str, values: Mapping[str, Any]) -> Any:
    """What stands for `name`; text is refused, because SymPy would run it."""
    import sympy  # noqa: PLC0415

    if name not in values:
        raise FormulaError(f"The formula uses {name}, which has no value; give a SymPy expression for it.")
    value = values[name]
    if isinstance(value, float):
        return sympy.Float(value, 17)
    try:
        expression = sympy.sympify(value, strict=True)
    except sympy.SympifyError:
        expression = None
    if isinstance(expression, sympy.Expr) and expression.is_number and not _is_finite(expression):
        raise FormulaError(f"The value of {name} is {_brief(expression)}; give a finite real number.")
    if not isinstance(expression, sympy.Expr):
        kind = type(value).__name__
        raise FormulaError(f"The value of {name} is of type {kind}; give a SymPy expression or a number.")
    return expression


def _built(text: str, node: ast.expr, parts: list[Any], symbols: Mapping[str, Any]) -> Any:
    """SymPy expression of one node from those of its operands."""
    import sympy  # noqa: PLC0415

    match node:
        case ast.Constant(value=int() as number):
            return sympy.Integer(number)
        case ast.Constant(value=float() as number):
            return sympy.Float(number, 17)  # 17 digits: printed and read back, it is the same double
        case ast.Name(id="pi"):
            return sympy.pi
        case ast.Name(id=name):
            return symbols[name]
        case ast.BinOp(op=ast.Pow()):
            return _power(text, node, *parts)
        case ast.BinOp(op=operation) | ast.UnaryOp(op=operation):
            return _OPERATIONS[type(operation)](*parts)
        case ast.Call(func=ast.Name(id=name)):
            return getattr(sympy, _SYMPY_NAMES.get(name, name))(*parts)
    raise _no_arithmetic(text, node)


def _power(text: str, node: ast.BinOp, base: Any, exponent: Any) -> Any:
    """Power with exponents such as 1.5 made exact, so that half-integer powers stay roots."""
    import sympy  # noqa: PLC0415

    if exponent.is_number and abs(float(exponent)) > LARGEST_EXPONENT:
        problem = f"an exponent comes to {_brief(exponent)}; allowed are -{LARGEST_EXPONENT} to {LARGEST_EXPONENT}"
        raise refusal(text, node.right.col_offset, problem)
    if exponent.is_Float:
        exact = Fraction(float(exponent))
        if exact.denominator <= LARGEST_EXACT_DENOMINATOR:
            exponent = sympy.Rational(exact.numerator, exact.denominator)
    return base**exponent


def _checked_number(text: str, node: ast.expr, number: sympy.Expr) -> sympy.Expr:
    """Return a constant, exact if it is rational or short; SymPy takes exponential time over long nested roots."""
    import sympy  # noqa: PLC0415

    if not _is_finite(number):
        problem = f"a part of it comes to {_brief(number)}, which is no finite real number"
        raise refusal(text, node.col_offset, problem)
    is_long = sum(1 for _ in sympy.preorder_traversal(number)) > LONGEST_EXACT_CONSTANT
    return sympy.Float(number.evalf(20), 17) if is_long else number


def _is_finite(expression: sympy.Expr) -> bool:
    try:
        return math.isfinite(float(expression))
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
    import sympy  # noqa: PLC0415

    if expression.has(sympy.zoo, sympy.nan, sympy.oo, -sympy.oo, sympy.I):
        raise refusal(text, 1, f"it comes to {_brief(expression)}, which is not finite and real")
    for number in expression.atoms(sympy.Number):
        if not _is_finite(number):
            raise refusal(text, 1, f"it holds the number {_brief(number)}; numbers must be below 1.8e308")
    for power in expression.atoms(sympy.Pow):
        if power.exp.is_number and abs(float(power.exp)) > LARGEST_EXPONENT:
            problem = f"its powers combine to an exponent of {_brief(power.exp)}; allowed are"
            raise refusal(text, 1, f"{problem} -{LARGEST_EXPONENT} to {LARGEST_EXPONENT}")
