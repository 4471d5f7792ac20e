"""Links: the driver of a kernel, shared by all scenes, calls the code of one scene by its address.

A driver holds what scenes have in common: the loop over trajectories, the sums of a step, and the events. It compiles
once for all of them, and finds the code of a scene through addresses that stand before the parameters in memory. Before
the addresses are facts of the scene, and before these is how far the parameters are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import cfunc, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from vibrokit.kernels.options import CONTRACTED, OPTIONS

_F8, _I8 = types.float64, types.int64
_NUMBERS, _SWITCHES = types.CPointer(types.float64), types.CPointer(types.uint8)
_SIGNATURES = {
    "rhs": types.void(_F8, _NUMBERS, _SWITCHES, _NUMBERS, _NUMBERS),
    "law": _F8(_I8, _F8, _F8, _NUMBERS),
    "slopes_lanes": types.void(_F8, _NUMBERS, _NUMBERS, _NUMBERS),
    "flight_rate": _F8(_NUMBERS),
    "taylor": types.void(_F8, _NUMBERS, _NUMBERS, _NUMBERS),
    "tabulate": types.void(_F8, _F8, _I8, _NUMBERS, _NUMBERS),
    "step_lanes": types.void(_NUMBERS, _NUMBERS, _NUMBERS, _NUMBERS, _F8, _I8),
}
_OF_LANES = ("slopes_lanes", "tabulate", "step_lanes")
LINKS = len(_SIGNATURES)


def callbacks(functions: dict[str, Any]) -> tuple[Any, ...]:
    """Compile those of the functions of a scene that a driver may call; None for each that the scene lacks."""
    links = []
    for name, signature in _SIGNATURES.items():
        function, options = functions.get(name), CONTRACTED if name in _OF_LANES else OPTIONS
        plain = getattr(function, "py_func", function)  # Python calls some of them too
        links.append(None if plain is None else cfunc(signature, **options)(plain))
    return tuple(links)


def linked(theta: NDArray[np.float64], links: tuple[Any, ...], facts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Put the facts that a driver needs to know, and the addresses, before the parameters."""
    addresses = np.array([0 if link is None else link.address for link in links], dtype=np.int64)
    return np.concatenate([[1.0 + len(facts) + len(links)], facts, addresses.view(np.float64), theta])


def _call(name: str, parameters: int) -> tuple[Any, Any]:
    """Return the signature of a function of a scene, and the code of a call; `parameters` is the place of theta."""
    signature, place = _SIGNATURES[name], list(_SIGNATURES).index(name) - LINKS

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        returned = ir.VoidType() if signature.return_type == types.void else ir.DoubleType()
        kind = ir.FunctionType(returned, [argument.type for argument in arguments])
        slot = builder.gep(arguments[parameters], [ir.Constant(ir.IntType(64), place)])
        function = builder.load(builder.bitcast(slot, ir.PointerType(ir.PointerType(kind))))
        result = builder.call(function, arguments)
        return context.get_dummy_value() if signature.return_type == types.void else result

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
