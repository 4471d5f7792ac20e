"""Options with which the functions of kernels are compiled."""

import warnings
from typing import Any

from numba import version_info

TESTED = ((0, 62), (0, 69))
"""The oldest version of Numba with which `deferred` was tested, and the first with which it was not."""

_WHOLE: dict[str, Any] = {}
_DEFERRED: dict[str, Any] = {}


def prefer_widest_registers(function: Any) -> None:
    """Let a function fill registers of 512 bits, where this Numba is one that was tested."""
    if _WHOLE:
        deferred.prefer_widest_registers(function)


if TESTED[0] <= version_info.short < TESTED[1]:
    from vibrokit.kernels import deferred

    _WHOLE, _DEFERRED = {"pipeline_class": deferred.Compiler}, {"pipeline_class": deferred.DeferredCompiler}
else:
    oldest, newest = (".".join(map(str, version)) for version in TESTED)
    warnings.warn(
        f"vibrokit was tested with Numba from {oldest} to below {newest}, and this is {version_info.string}. Kernels "
        "compile by the public interfaces of Numba alone, which takes longer and makes slower code; install a tested "
        "version to get both back.",
        stacklevel=2,
    )

# Each operation rounds by itself, so that the bits do not depend on which functions the compiler inlines.
_EXACT: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
# In lanes, contraction of a product and a sum saves a quarter of the time. A function that is compiled both inline and
# on its own may then round differently in the two versions, so functions of lanes are either inlined or kept apart.
_CONTRACT = {"fastmath": {"contract", "nsz", "arcp"}}

# Called from Python, or by address.
OPTIONS = {**_EXACT, "cache": True, **_WHOLE}
CONTRACTED = {**OPTIONS, **_CONTRACT}
# Called by functions of the same module only; Numba need not wrap them for Python.
INNER = {**_EXACT, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, **_DEFERRED}
INNER_LANES = {**INNER, **_CONTRACT}
INLINED = {**INNER_LANES, "forceinline": True}
# As the last, and called from Python.
INLINED_AND_CALLED = {**CONTRACTED, "forceinline": True}
