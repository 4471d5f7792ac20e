"""What Numba's language lacks: pointers to the numbers of an array, and what the compiler may assume of a function.

Numba counts the references to an array atomically in each function that an array is handed to, and for each part of it
that is named. In functions that take some nanoseconds this was two thirds of the time; a pointer is not counted.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from vibrokit.kernels.options import prefer_widest_registers


@intrinsic
def pointer_to(_context: Any, array: Any) -> Any:
    """Return a pointer to the first number of a contiguous array, which must outlive it: use the array afterwards."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return cgutils.create_struct_proxy(signature.args[0])(context, builder, value=arguments[0]).data

    return types.CPointer(array.dtype)(array), generate


@intrinsic
def offset_by(_context: Any, pointer: Any, count: Any) -> Any:
    """Return the pointer to the number that is `count` further."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.gep(arguments[0], [arguments[1]])

    return pointer(pointer, types.intp), generate


@intrinsic
def promise_no_overlap(_context: Any) -> Any:
    """Promise that what the function that calls this writes by one of its pointers, it reads by no other."""

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        for argument in builder.function.args:
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


@intrinsic
def use_widest_registers(_context: Any) -> Any:
    """Let the function that calls this fill registers of 512 bits, if the processor has them.

    LLVM keeps to 256 bits on most of those that have them, since in code with few vector operations a lower clock rate
    costs more than it gains. In loops over lanes, nearly all operations are vector operations. Results do not change.
    """

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        prefer_widest_registers(builder.function)
        return context.get_dummy_value()

    return types.void(), generate
