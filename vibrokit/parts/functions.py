"""Functions for the formulas of parts.

Each forwards to the SymPy function of its name when it is called, so that a module that defines a part can be
imported without importing SymPy: a scene whose kernels are on disk never needs it. A part of yours may as well
import the same names from SymPy.
"""

from typing import Any


def _sympy_function(name: str) -> Any:
    def forward(*arguments: Any) -> Any:
        import sympy

        return getattr(sympy, name)(*arguments)

    forward.__name__ = forward.__qualname__ = name
    forward.__doc__ = f"SymPy's ``{name}``, imported when it is called."
    return forward


Rational = _sympy_function("Rational")
Abs = _sympy_function("Abs")
Max = _sympy_function("Max")
Min = _sympy_function("Min")
sqrt = _sympy_function("sqrt")
exp = _sympy_function("exp")
log = _sympy_function("log")
sin = _sympy_function("sin")
cos = _sympy_function("cos")
tan = _sympy_function("tan")
atan = _sympy_function("atan")
sinh = _sympy_function("sinh")
cosh = _sympy_function("cosh")
tanh = _sympy_function("tanh")
