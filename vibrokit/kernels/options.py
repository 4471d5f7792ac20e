"""Options with which the functions of kernels are compiled."""

from typing import Any

from vibrokit.kernels.deferred import Compiler, DeferredCompiler

# Each operation rounds by itself, so that the bits do not depend on which functions the compiler inlines.
_EXACT: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
# In lanes, contraction of a product and a sum saves a quarter of the time. A function that is compiled both inline and
# on its own may then round differently in the two versions, so functions of lanes are either inlined or kept apart.
_CONTRACT = {"fastmath": {"contract", "nsz", "arcp"}}
_UNWRAPPED = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}

# Called from Python.
OPTIONS = {**_EXACT, "cache": True, "pipeline_class": Compiler}
CONTRACTED = {**OPTIONS, **_CONTRACT}
# Called by address: Numba need not wrap them for Python.
LINKED = {**OPTIONS, **_UNWRAPPED}
LINKED_LANES = {**CONTRACTED, **_UNWRAPPED}
# Called by functions of the same module only.
INNER = {**_EXACT, **_UNWRAPPED, "pipeline_class": DeferredCompiler}
INNER_LANES = {**INNER, **_CONTRACT}
INLINED = {**INNER_LANES, "forceinline": True}
# As the last, and called from Python.
INLINED_AND_CALLED = {**CONTRACTED, "forceinline": True}
