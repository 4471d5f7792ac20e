"""Deferred compilation: functions compiled only inside their callers, by parts of Numba that are not public.

Kernels use private parts of Numba and llvmlite here and nowhere else. `options` tests the version, and can do without.

Functions are compiled only as a part of those that call them, and each part is optimised once. Numba optimises each
function together with all that it calls, and makes machine code of it, though only its callers use it. In a stepper of
seventy small functions, each would be optimised as often as the calls above it are deep.

Numba also optimises each function by itself before all that it calls is linked to it. A short loop over lanes is then
repeated for each lane, because the calls in it look small, and becomes vector code no more.
"""

from __future__ import annotations

import ctypes
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.typed_passes import AnnotateTypes


class _Unnamed:
    """The code generator of a function without machine code, which has no place for its Python environment."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def set_env(self, name: str, environment: Any) -> None:
        """Nothing refers to it: these functions do not raise exceptions."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)


@ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.py_object, ctypes.py_object)
def _refuse(*_arguments: Any) -> None:
    raise TypeError("this function is compiled only as a part of those that call it; Python cannot call it.")


_REFUSED = ctypes.cast(_refuse, ctypes.c_void_p).value


class _Library(JITCodeLibrary):
    """The code of a function and of all that it calls, which is optimised once, as a whole."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        manager, builder = self._codegen._module_pass_manager()
        manager.run(self._final_module, builder)


class _DeferredLibrary(_Library):
    """The code of a function and of all that it calls, as lowered."""

    @property
    def codegen(self) -> Any:
        return _Unnamed(self._codegen)

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return _REFUSED or 0

    def _optimize_final_module(self) -> None:
        """Left to the callers, which are optimised with all that is linked to them."""

    def _finalize_final_module(self) -> None:
        self._finalized = True


class _Pass(LoweringPass):
    """Gives a function a library of a kind."""

    library: type[_Library]

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        codegen = state.targetctx.codegen()
        state.library = self.library(codegen, state.func_id.func_qualname)
        state.library.enable_object_caching()
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _Defer(_Pass):
    _name, library = "vibrokit_defer", _DeferredLibrary


@register_pass(mutates_CFG=True, analysis_only=False)
class _OptimiseOnce(_Pass):
    _name, library = "vibrokit_optimise_once", _Library


class _Compiler(CompilerBase):
    choice: type[_Pass]

    def define_pipelines(self) -> list[PassManager]:
        """Numba's own passes, with a library of ours."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(self.choice, AnnotateTypes)
        passes.finalize()
        return [passes]


class DeferredCompiler(_Compiler):
    """The compiler of a function that only compiled functions call: Python must not, for there is no code to call."""

    choice = _Defer


class Compiler(_Compiler):
    """The compiler of a function that is called from Python or by address."""

    choice = _OptimiseOnce


def prefer_widest_registers(function: Any) -> None:
    """Let a function fill registers of 512 bits; llvmlite refuses such attributes, but writes what its set holds."""
    set.add(function.attributes, '"prefer-vector-width"="512"')
