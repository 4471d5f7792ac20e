"""What a compiled function may assume, so that its loops become vector code."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def use_widest_registers(_context: Any) -> Any:
    """Let the function that calls this fill registers of 512 bits, if the processor has them.

    LLVM keeps to 256 bits on most of those that have them, since in code with few vector operations a lower clock rate
    costs more than it gains. In loops over lanes, nearly all operations are vector operations. Results do not change.
    """

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        # llvmlite knows no attributes of this form and refuses them, but writes what its set holds.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.void(), generate


@intrinsic
def promise_no_overlap(_context: Any) -> Any:
    """Promise that what the function that calls this writes by one of its pointers, it reads by no other."""

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        for argument in builder.function.args[2:]:  # after those for the result and for exceptions
            if isinstance(argument.type, ir.PointerType):
                argument.add_attribute("noalias")
        return context.get_dummy_value()

    return types.void(), generate


@intrinsic
def keep_apart(_context: Any) -> Any:
    """Never compile the function that calls this into its callers.

    Where the compiler may contract a product and a sum, it decides by the operations around them. So a copy within
    another function could round differently.
    """

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return types.void(), generate
