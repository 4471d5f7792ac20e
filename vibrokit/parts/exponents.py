"""Finds the parameters of a part that stand in exponents, and so decide how smooth its formulas are."""

from __future__ import annotations

import functools
from typing import Any


@functools.lru_cache(maxsize=256)
def exponents(cls: Any, fixed: tuple[tuple[str, Any], ...]) -> frozenset[str]:
    """Return the names of parameters in exponents of what varies with the arguments of a formula.

    The formulas are called on a twin whose parameters are symbols, but for the `fixed` ones, given by name and value.
    A class whose formulas cannot be called so has none: the derivation meets the same error, and has the words for it.
    """
    import sympy

    part, known = object.__new__(cls), dict(fixed)
    parameters = {d.name: sympy.Symbol(d.name, positive=True) for d in cls._declared if d.name not in known}
    try:
        found = part.twin(known | parameters).formulas(lambda name: sympy.Dummy(name, real=True))
        powers = [power for formula in found for power in sympy.sympify(formula).atoms(sympy.Pow)]
    except Exception:
        return frozenset()
    varying = [power.exp.free_symbols for power in powers if power.base.atoms(sympy.Dummy)]
    return frozenset(name for name, symbol in parameters.items() if any(symbol in symbols for symbols in varying))
