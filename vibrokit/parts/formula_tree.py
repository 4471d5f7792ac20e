"""The syntax tree of a formula, and the checks of its constants and powers."""

from __future__ import annotations

import ast
import math
import operator
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from vibrokit.parts.formula_text import FUNCTIONS, FormulaError, refusal

LARGEST_EXPONENT = 64

OPERATIONS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.UAdd: operator.pos, ast.USub: operator.neg,
}  # fmt: skip


def syntax_tree(text: str) -> ast.expr:
    """Syntax tree of a checked text; the parenthesis put in front makes ``col_offset`` the column, from 1."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return ast.parse(f"({text})", mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise refusal(text, 1, f"it cannot be parsed ({error}); make it simpler") from None


def operands(node: ast.expr) -> list[ast.expr]:
    """What an operation or a function is applied to; nothing for numbers and names."""
    match node:
        case ast.BinOp():
            return [node.left, node.right]
        case ast.UnaryOp():
            return [node.operand]
        case ast.Call():
            return node.args
    return []


def bottom_up(tree: ast.expr) -> Iterator[ast.expr]:
    """Nodes of a tree, each after its operands; no recursion, because a sum may be 250 levels deep."""
    nodes = [tree]
    for node in nodes:
        nodes.extend(operands(node))
    return reversed(nodes)


def _is_power(node: ast.expr) -> bool:
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow)


def check_constants(text: str, tree: ast.expr) -> None:
    """Refuse constant parts without a finite real value, and powers that could grow without bound."""
    constants: dict[ast.expr, float | None] = {}
    degrees: dict[ast.expr, float] = {}  # largest product of exponents on a way down from the node
    for node in bottom_up(tree):
        parts = operands(node)
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
        constants[node] = _constant(text, node, [constants[part] for part in parts])


def _check_exponent(text: str, exponent: ast.expr, value: float | None) -> None:
    if any(map(_is_power, bottom_up(exponent))):
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
            function = OPERATIONS[type(operation)]
        case _:
            raise no_arithmetic(text, node)
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


def no_arithmetic(text: str, node: ast.expr) -> FormulaError:
    """Return the error for a node that should not have come this far."""
    problem = f"{type(node).__name__} has no meaning in a formula; only arithmetic has"
    return refusal(text, node.col_offset, problem)
