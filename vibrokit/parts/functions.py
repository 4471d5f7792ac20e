"""Functions for the formulas of parts.

Each calls the SymPy function of the same name. SymPy is imported at the first call, not with the module that defines
a part, because a scene whose kernels are cached on disk does not need it. Your own parts may also import these names
from SymPy.
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
Mod = _sympy_function("Mod")
Piecewise = _sympy_function("Piecewise")
And = _sympy_function("And")
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
