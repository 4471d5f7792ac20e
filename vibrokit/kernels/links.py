"""Calls from the driver of a kernel into the code of a scene, by address.

A driver holds what scenes have in common: the loop over trajectories, the sums of a step, and the events. It compiles
once for all of them, and finds the code of a scene through addresses that stand before the parameters in memory. Before
the addresses are facts of the scene, and before these is how far the parameters are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

_F8, _I8 = types.float64, types.int64
_NUMBERS, _SWITCHES = types.CPointer(types.float64), types.CPointer(types.uint8)
_SIGNATURES = {
    "rhs": types.none(_F8, _NUMBERS, _SWITCHES, _NUMBERS, _NUMBERS),
    "law": _F8(_I8, _F8, _F8, _NUMBERS),
    "slopes_lanes": types.none(_F8, _NUMBERS, _NUMBERS, _NUMBERS),
    "flight_rate": _F8(_NUMBERS),
    "taylor": types.none(_F8, _NUMBERS, _NUMBERS, _NUMBERS),
    "tabulate": types.none(_F8, _F8, _I8, _NUMBERS, _NUMBERS),
    "step_lanes": types.none(_NUMBERS, _NUMBERS, _NUMBERS, _NUMBERS, _F8, _I8),
}
LINKS = len(_SIGNATURES)


def addresses(functions: dict[str, Any]) -> NDArray[np.int64]:
    """Compile those of the functions of a scene that a driver may call; return all addresses, 0 for one not there."""
    found = np.zeros(LINKS, dtype=np.int64)
    for place, (name, signature) in enumerate(_SIGNATURES.items()):
        if name in functions:
            function = functions[name]
            function.compile(signature.args)
            compiled = function.overloads[signature.args]
            found[place] = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
    return found


def linked(theta: NDArray[np.float64], links: NDArray[np.int64], facts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Put the facts that a driver needs to know, and the addresses, before the parameters."""
    return np.concatenate([[1.0 + len(facts) + len(links)], facts, links.view(np.float64), theta])


def _call(name: str, parameters: int) -> tuple[Any, Any]:
    """Return the signature of a function of a scene, and the code of a call; `parameters` is the place of theta."""
    signature, place = _SIGNATURES[name], list(_SIGNATURES).index(name) - LINKS

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = context.call_conv.get_function_type(signature.return_type, signature.args)
        slot = builder.gep(arguments[parameters], [ir.Constant(ir.IntType(64), place)])
        function = builder.load(builder.bitcast(slot, ir.PointerType(ir.PointerType(kind))))
        _, result = context.call_conv.call_function(
            builder, function, signature.return_type, signature.args, arguments
        )  # these functions raise nothing
        return result

    return signature, generate


@intrinsic
def rhs(_context: Any, t: Any, z: Any, pushing: Any, theta: Any, out: Any) -> Any:
    """Write the slopes of the variables z, with the stops that push."""
    return _call("rhs", 3)


@intrinsic
def law(_context: Any, i: Any, depth: Any, rate: Any, theta: Any) -> Any:
    """Return the force of a stop."""
    return _call("law", 3)


@intrinsic
def slopes_lanes(_context: Any, node: Any, lanes: Any, slopes: Any, theta: Any) -> Any:
    """Write the slopes of each lane at its point of a stage, along its course."""
    return _call("slopes_lanes", 3)


@intrinsic
def flight_rate(_context: Any, theta: Any) -> Any:
    """Return a bound of the rates of the free motion."""
    return _call("flight_rate", 0)


@intrinsic
def taylor(_context: Any, t: Any, z: Any, theta: Any, series: Any) -> Any:
    """Write the Taylor series of the free motion."""
    return _call("taylor", 2)


@intrinsic
def tabulate(_context: Any, start: Any, h: Any, steps: Any, theta: Any, table: Any) -> Any:
    """Write the forcing at the nodes of every step."""
    return _call("tabulate", 3)


@intrinsic
def step_lanes(_context: Any, z: Any, forces: Any, normals: Any, theta: Any, h: Any, steps: Any) -> Any:
    """Take steps in each lane."""
    return _call("step_lanes", 3)
