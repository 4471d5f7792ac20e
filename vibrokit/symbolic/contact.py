"""Properties of a contact law that are derived from its formula."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import sympy

from vibrokit.errors import DerivationError
from vibrokit.parts.barrier import Barrier
from vibrokit.parts.formula_expression import exact
from vibrokit.symbolic.formulas import derived_formula
from vibrokit.symbolic.jumps import refuse_jumps

DEPTH = sympy.Symbol("depth", positive=True)
RATE = sympy.Symbol("rate", real=True)

_ROOTS = (1, 2, 4)  # of time and depth, that contacts are stepped in
_BRANCHES = (sympy.Max, sympy.Min, sympy.Abs, sympy.sign, sympy.Heaviside, sympy.Piecewise)
_ANALYTIC = (sympy.exp, sympy.sin, sympy.cos, sympy.sinh, sympy.cosh, sympy.tanh, sympy.atan)  # on the real axis


@dataclasses.dataclass(frozen=True)
class DerivedContact:
    """The formula of the law of one stop, and its properties.

    Attributes
    ----------
    law : sympy.Expr
        Force as a function of DEPTH > 0 and RATE.
    jumps : bool
        True if the force jumps at first touch: its limit for depth → 0 at non-zero rate is not zero.
    clamped : bool
        True if the law may pull and the barrier is not adhesive, so that negative forces are set to zero.
    exponent : sympy.Expr or None
        Leading power of depth at first touch at non-zero rate; None if unknown.
    root : int
        The force is smooth in this root of the depth, 1, 2 or 4; 4 also where it is smooth in none. Contacts are
        stepped in that root of time and depth.
    smooth : bool
        True if the force is smooth in that root, so that located contacts keep the full order of a stepper.
    values : mapping
        Values of the parameters of the law.
    """

    law: sympy.Expr
    jumps: bool
    clamped: bool
    exponent: sympy.Expr | None
    root: int
    smooth: bool
    values: Mapping[sympy.Symbol, sympy.Expr]

    @property
    def conservative(self) -> bool:
        """True if the force does not depend on the rate."""
        return RATE not in self.law.free_symbols

    @property
    def bends(self) -> bool:
        """True if first derivatives of the force jump, at first touch or where the force is set to zero."""
        return self.clamped or self.jumps or _bends(self.law, self.values)

    @property
    def steep(self) -> bool:
        """True if the slope of the force in depth is infinite at first touch."""
        slope = _at_touch(sympy.diff(self.law, DEPTH), self.values)
        return slope is not None and slope.has(sympy.oo, -sympy.oo, sympy.zoo)


def derive_contact(barrier: Barrier, symbols: dict[str, sympy.Symbol], frequency: float) -> DerivedContact:
    """Derive the formula and the properties of the law of a barrier in a scene of this reference frequency (s⁻¹).

    Signs of its parameters are known; a minimum or a maximum that they do not decide at touch is decided by values.
    Raises DerivationError if the force is unbounded at first touch, or jumps in the depth or the rate.
    """
    values = {symbol: exact(barrier.law.parameters[name]) for name, symbol in symbols.items()}
    law = derived_formula(barrier.law, "force", symbols, (DEPTH, RATE))
    refuse_jumps(barrier.law, law, (DEPTH, RATE), symbols, frequency)
    law = law.xreplace({symbol: sympy.Integer(0) for symbol in values if symbol.is_zero})
    jumps = _jumps(law, values)
    root = next((root for root in _ROOTS if _smooth_in(law, root)), None)
    return DerivedContact(
        law=law,
        jumps=jumps,
        clamped=not barrier.adhesive and not law.is_nonnegative,
        exponent=_leading_power(law),
        root=root or _ROOTS[-1],
        smooth=root is not None,
        values=values,
    )


def refuse_steep_touch(contact: DerivedContact) -> None:
    """Raise DerivationError if derivatives of the motion cannot be followed under the force of a contact.

    They need the slope of the force times the rate of the fourth root of time, which is infinite at first touch for
    powers of the depth below 1/4.
    """
    slope = sympy.diff(contact.law, DEPTH)
    if not slope.has(DEPTH):
        return
    scaled = _at_touch(sympy.powsimp(sympy.expand(slope * DEPTH ** sympy.Rational(3, 4))), contact.values)
    if scaled is not None and scaled.has(sympy.oo, -sympy.oo, sympy.zoo):
        raise DerivationError(
            f"the contact force {contact.law} rises more steeply at first touch than the fourth root of the depth, and "
            "no stepper follows the derivatives of the motion across that, which orbits, their multipliers, saddles "
            "and exit paths need; give powers of depth of 0.25 or more, or a law that is smooth there, as "
            "(depth + d)**p - d**p with a small d."
        )


def _smooth_in(law: sympy.Expr, root: int) -> bool:
    """Whether a law has a power series in a root of the depth."""
    variable = sympy.Symbol("root", positive=True)
    return _analytic(sympy.powdenest(law.subs(DEPTH, variable**root), force=True), variable)


def _analytic(expression: sympy.Expr, variable: sympy.Symbol) -> bool:
    """Whether an expression has a power series in `variable` at 0: no part of it is singular there."""
    for node in sympy.preorder_traversal(expression):
        if variable not in node.free_symbols:
            continue
        if isinstance(node, sympy.Pow):
            if node.exp.is_Integer and node.exp.is_nonnegative:
                continue
            if node.base.subs(variable, 0).is_zero is not False:  # the base vanishes
                return False
        elif isinstance(node, (sympy.Add, sympy.Mul, sympy.Symbol, *_ANALYTIC)):
            continue
        elif isinstance(node, sympy.log | sympy.tan | sympy.asin | sympy.acos):
            at_touch = node.args[0].subs(variable, 0)
            singular = {sympy.log: at_touch, sympy.tan: sympy.cos(at_touch)}.get(node.func, 1 - at_touch**2)
            if singular.is_zero is not False:
                return False
        else:  # kinks, jumps and unknown functions
            return False
    return True


def _jumps(law: sympy.Expr, values: Mapping[sympy.Symbol, sympy.Expr]) -> bool:
    at_touch = _at_touch(law, values)
    if at_touch is None:
        return True
    if at_touch.has(sympy.oo, -sympy.oo, sympy.zoo):
        raise DerivationError(
            f"the contact force {law} is unbounded at first touch, so no motion can be integrated through it; give a "
            "law that is finite at depth 0."
        )
    return sympy.simplify(at_touch) != 0


def _bends(law: sympy.Expr, values: Mapping[sympy.Symbol, sympy.Expr]) -> bool:
    at_touch = _at_touch(sympy.diff(law, DEPTH), values)
    return at_touch is None or (at_touch.is_infinite is not True and sympy.simplify(at_touch) != 0)


def _at_touch(expression: sympy.Expr, values: Mapping[sympy.Symbol, sympy.Expr]) -> sympy.Expr | None:
    """Limit at first touch from inside; None if SymPy cannot find it."""
    try:
        value = expression.subs(DEPTH, 0)
        if value.has(sympy.nan, sympy.zoo, sympy.oo):
            value = sympy.limit(expression, DEPTH, 0, "+")
    except (NotImplementedError, ValueError):
        return None
    if value.has(sympy.Limit):
        return None
    undecided = {node for node in value.atoms(*_BRANCHES) if node.free_symbols <= values.keys()}
    return value.xreplace({node: node.subs(values) for node in undecided})


def _leading_power(law: sympy.Expr) -> sympy.Expr | None:
    terms = sympy.Add.make_args(sympy.expand(law))
    powers = [term.as_independent(DEPTH)[1].as_base_exp() for term in terms]
    exponents = [exponent if base == DEPTH else sympy.Integer(0) for base, exponent in powers]
    known = all(base in (DEPTH, 1) for base, _ in powers) and all(exponent.is_number for exponent in exponents)
    return min(exponents) if known else None
