"""Formulas given as text: Python's parser makes the syntax tree, and a whitelist admits it node by node.

A formula has arithmetic (``+ - * / **``), numbers, `pi`, names, and the functions sqrt, exp, log, sin, cos, tan, asin,
acos, atan, sinh, cosh, tanh, abs, sign, min and max. Formulas come from strangers, so nothing is compiled or run. The
limits bound the time and memory that the parser, these checks and SymPy need.
"""

from __future__ import annotations

import ast
import functools
import itertools
import keyword
import math
import operator
import re
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

from vibrokit.errors import FormulaError, nearest, shown

LONGEST_TEXT = 2000
DEEPEST = 50  # open parentheses
MOST_NODES = 500
MOST_DIGITS = 15  # of a whole number: every such number is exact as a double
MOST_COMPARED = 24  # SymPy compares all arguments of min and max in pairs
LARGEST_EXPONENT = 64
LONGEST_NAME = 60
MOST_PARAMETERS = 100

# What each function does to constants; SymPy's functions of the same names make the expression.
FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "sqrt": math.sqrt, "exp": math.exp, "log": math.log,
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos,
    "atan": math.atan, "sinh": math.sinh, "cosh": math.cosh, "tanh": math.tanh,
    "abs": abs, "sign": lambda x: float((x > 0) - (x < 0)), "min": min, "max": max,
}  # fmt: skip
OPERATIONS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.UAdd: operator.pos, ast.USub: operator.neg,
}  # fmt: skip

_ALLOWED = "a formula has numbers, names, functions, + - * / ** ( ) and commas"
_STRANGE = re.compile(r"[^\w +\-*/(),.]", re.ASCII)
_NUMBER = re.compile(r"(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")  # among Python's constants: not 0x10, 1_000, 1j or True

_LOGARITHM = "log()"  # among names: that of something that varies

T = TypeVar("T")


def refusal(text: str, offset: int, problem: str) -> FormulaError:
    """Return the error for a problem in a formula, `offset` characters from its start."""
    start = max(0, min(offset - 30, len(text) - 60))
    excerpt = f"{'...' * (start > 0)}{text[start : start + 60]!r}{'...' * (start + 60 < len(text))}"
    return FormulaError(f"The formula {excerpt} is refused at column {offset + 1}: {problem.rstrip('.')}.")


def check_parameter_names(names: Sequence[str], taken: Sequence[str]) -> None:
    """Raise FormulaError unless a formula may have these parameters besides the names `taken`."""
    if len(names) > MOST_PARAMETERS:
        raise FormulaError(f"The formula has {len(names)} parameters; at most {MOST_PARAMETERS} are allowed.")
    taken = (*taken, *FUNCTIONS, "pi", "nan", "inf")
    for name in names:
        is_word = len(name) <= LONGEST_NAME and name.isascii() and name.isidentifier() and name[0] != "_"
        if not is_word or name in taken or name.lower() in taken[-2:] or keyword.iskeyword(name):
            raise FormulaError(
                f"The parameter name {shown(name)} is not allowed; give an ASCII letter, then up to {LONGEST_NAME - 1} "
                f"letters, digits and underscores, but no Python keyword and none of {', '.join(taken)}."
            )


def read(text: object, known: Collection[str]) -> tuple[str, ast.expr]:
    """Check a formula in `known` names; return it without outer spaces, and its syntax tree, which is arithmetic only.

    The FormulaError for any other text gives its value, its column and what is allowed.
    """
    source = _checked_text(text)
    tree = _parsed(source)
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.expr)]
    if len(nodes) > MOST_NODES:
        raise refusal(source, 0, f"it has {len(nodes)} numbers, names, calls and operations; allowed are {MOST_NODES}")
    fold(tree, functools.partial(_admit, source, known))
    compared = sum(len(node.args) for node in nodes if isinstance(node, ast.Call) and len(node.args) > 1)
    if compared > MOST_COMPARED:
        raise refusal(source, 0, f"min and max have {compared} arguments in all; at most {MOST_COMPARED} are allowed")
    return source, tree


def _checked_text(text: object) -> str:
    """Return a text without outer spaces; refuse it if it is too long, too deep, or has other characters."""
    if not isinstance(text, str):
        raise FormulaError(f"The formula is {shown(text)} ({type(text).__name__}); give text, such as 'k*depth**1.5'.")
    if len(text) > LONGEST_TEXT:
        raise FormulaError(f"The formula has {len(text)} characters; at most {LONGEST_TEXT} are allowed.")
    text = text.strip(" ")
    if not text:
        raise FormulaError("The formula is empty; give text, such as 'k*depth**1.5'.")
    if strange := _STRANGE.search(text):
        hint = "write ** for a power" if strange.group() == "^" else _ALLOWED
        raise refusal(text, strange.start(), f"the character {strange.group()!a} is not allowed; {hint}")
    for offset, depth in enumerate(itertools.accumulate((c == "(") - (c == ")") for c in text)):
        if depth > DEEPEST:
            raise refusal(text, offset, f"{depth} parentheses are open; at most {DEEPEST} are allowed")
    return text


def _parsed(text: str) -> ast.expr:
    with warnings.catch_warnings():  # Python warns of "1if k else 2", which `_admit` refuses
        warnings.simplefilter("ignore")
        try:
            return ast.parse(text, mode="eval").body
        except SyntaxError as error:
            reason = re.split("[.;] ", error.msg)[0]
            raise refusal(text, (error.offset or len(text)) - 1, f"{reason}; {_ALLOWED}") from None
        except (ValueError, RecursionError, MemoryError):
            raise refusal(text, 0, "it is nested too deeply; make it simpler") from None


@functools.lru_cache(maxsize=256)
def in_exponents(text: str, variables: tuple[str, ...]) -> frozenset[str]:
    """Return the names in exponents of what varies with `variables`, in a formula that was read before.

    They decide how smooth the formula is, as numbers in their places would. ``exp(n*log(x))`` is a power too.
    """
    found: set[str] = set()

    def names(node: ast.expr, parts: list[frozenset[str]]) -> frozenset[str]:
        below = frozenset[str]().union(*parts)
        match node:
            case ast.BinOp(op=ast.Pow()) if not parts[0].isdisjoint(variables):
                found.update(parts[1])
            case ast.Call(func=ast.Name(id="log")) if not below.isdisjoint(variables):
                return below | {_LOGARITHM}
            case ast.Call(func=ast.Name(id="exp")) if _LOGARITHM in below:
                found.update(below)
            case ast.Name(id=name):
                return frozenset((name,))
        return below

    fold(_parsed(text.strip(" ")), names)
    return frozenset(found - {*variables, "pi", _LOGARITHM})


def evaluate(text: str, values: Mapping[str, float]) -> float:
    """Return the number that a formula that was read before has for some values of its names; NaN if it has none."""

    def number(node: ast.expr, parts: list[float]) -> float:
        match node:
            case ast.Constant(value=int() | float() as value):
                return float(value)
            case ast.Name(id=name):
                return math.pi if name == "pi" else float(values[name])
            case ast.Call(func=ast.Name(id=name)):
                return float(FUNCTIONS[name](*parts))
            case ast.BinOp(op=operation) | ast.UnaryOp(op=operation):
                return float(OPERATIONS[type(operation)](*parts))
        raise TypeError(f"{type(node).__name__} is not arithmetic")

    try:
        return fold(_parsed(text.strip(" ")), number)
    except (ArithmeticError, ValueError, TypeError):  # a power may be complex
        return math.nan


def fold(tree: ast.expr, visit: Callable[[ast.expr, list[T]], T]) -> T:
    """Apply ``visit(node, results of its operands)`` from the leaves to the root.

    A loop instead of recursion, because an admitted tree may be 500 levels deep.
    """
    nodes = [tree]
    for node in nodes:
        nodes.extend(_operands(node))
    results: dict[ast.expr, T] = {}
    for node in reversed(nodes):
        results[node] = visit(node, [results[operand] for operand in _operands(node)])
    return results[tree]


def _operands(node: ast.expr) -> list[ast.expr]:
    function = node.func if isinstance(node, ast.Call) else None
    return [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr) and child is not function]


class _Branch(NamedTuple):
    value: float | None  # None if it depends on a variable or a parameter
    degree: float = 0.0  # largest product of the exponents of nested powers; 0 without a power


def _admit(text: str, known: Collection[str], node: ast.expr, parts: list[_Branch]) -> _Branch:
    """Refuse a node that is not on the whitelist, has no finite real value, or raises powers without bound."""
    offset, source = node.col_offset, text[node.col_offset : node.end_col_offset]
    degree = max((part.degree for part in parts), default=0.0)
    match node:
        case ast.Constant(value=int() | float() as value) if number := _NUMBER.fullmatch(source):
            too_small = value == 0 and re.search("[1-9]", number[1])
            if too_small or value == math.inf or (isinstance(value, int) and value >= 10**MOST_DIGITS):
                allowed = f"at most {MOST_DIGITS} digits in a whole number, 5e-324 to 1.8e308 otherwise"
                raise refusal(text, offset, f"the number {shown(source)} is out of range; allowed are {allowed}")
            return _Branch(float(value))
        case ast.Name(id=name):
            if name != "pi" and name not in known:
                raise refusal(text, offset, f"the name {shown(name)} is unknown{nearest(name, ('pi', *known))}")
            return _Branch(math.pi if name == "pi" else None)
        case ast.Call(func=ast.Name(id=name), keywords=[]):
            if name not in FUNCTIONS:
                raise refusal(text, offset, f"the function {shown(name)} is unknown{nearest(name, FUNCTIONS)}")
            if len(parts) < 2 if name in ("min", "max") else len(parts) != 1:
                allowed = "2 or more" if name in ("min", "max") else "1"
                raise refusal(text, offset, f"the number of arguments of {name} is {len(parts)}; allowed is {allowed}")
            function = FUNCTIONS[name]
        case ast.BinOp(op=ast.Div(), right=divisor) if parts[1].value == 0:
            raise refusal(text, divisor.col_offset, "it divides by zero; give another divisor")
        case ast.BinOp(op=ast.Pow(), right=exponent):
            degree = _degree(text, exponent.col_offset, *parts)
            function = operator.pow
        case ast.BinOp(op=operation) | ast.UnaryOp(op=operation) if type(operation) in OPERATIONS:
            function = OPERATIONS[type(operation)]
        case _:
            raise refusal(text, offset, f"{shown(source)} is not arithmetic; {_ALLOWED}")
    if any(part.value is None for part in parts):
        return _Branch(None, degree)
    try:
        value = float(function(*(part.value for part in parts)))
    except (ArithmeticError, ValueError, TypeError):
        value = math.nan
    if not math.isfinite(value):
        raise refusal(text, offset, f"its constant part {shown(source)} has no finite real value")
    return _Branch(value, degree)


def _degree(text: str, offset: int, base: _Branch, exponent: _Branch) -> float:
    """Check a power and return its degree."""
    if exponent.degree > 0:
        raise refusal(text, offset, "an exponent contains a power; write the exponent without one")
    size = abs(exponent.value or 1.0)
    if size > LARGEST_EXPONENT:
        problem = f"an exponent is {exponent.value:g}; allowed are -{LARGEST_EXPONENT} to {LARGEST_EXPONENT}"
        raise refusal(text, offset, problem)
    degree = max(1.0, base.degree) * max(1.0, size)
    if degree > LARGEST_EXPONENT:
        raise refusal(text, offset, f"nested exponents multiply to {degree:g}; at most {LARGEST_EXPONENT} is allowed")
    return degree
