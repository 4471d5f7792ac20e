"""Formulas as text: arithmetic and a list of functions, checked before anything is made of them.

The text may come from a stranger's scene file. `formula_text` reads it token by token; what is arithmetic
by then becomes the syntax tree of `formula_tree`, whose constants and powers are checked, and `formula_expression`
makes a SymPy expression of it. Nothing is ever compiled or run, and SymPy is imported only when an expression is built.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from vibrokit.parts.formula_text import FormulaError, check_parameter_name, check_parameter_names, check_text
from vibrokit.parts.formula_tree import check_constants, syntax_tree

if TYPE_CHECKING:
    import sympy

__all__ = ["Formula", "FormulaError", "check_parameter_name", "parse_formula"]  # for users of formulas


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
        check_constants(self.text, syntax_tree(self.text))

    def expression(self, values: Mapping[str, Any]) -> sympy.Expr:
        """Return the formula as a SymPy expression.

        Parameters
        ----------
        values : mapping of str to sympy.Expr
            What stands for each name that the formula uses; real symbols as a rule. Numbers are accepted, as
            doubles; text is not.

        Raises
        ------
        FormulaError
            If a name has no value, or the formula comes to something infinite or not real.
        """
        from vibrokit.parts.formula_expression import build

        return build(self.text, syntax_tree(self.text), self.names, values)


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
