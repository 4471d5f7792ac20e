"""A unique symbol for every parameter of a scene."""

from __future__ import annotations

import keyword
import re
from collections import Counter

import sympy

from vibrokit.parts.scene import Entry, Scene

_SPELLED = {"lambda": "lamda"}  # the spelling of SymPy; lambda is a Python keyword
# Names in generated code: variables, momenta, matrix entries, stops, arrays, functions. None ends in an underscore, so
# that a parameter with such a name gets one.
_IN_CODE = re.compile(
    r"(?!.*_$)(_.*|[xvtzfhS]|[A-Z]{3,}|[pm]_\d+|[CUW]\d+(_\w+)?|k\d_\w+|f\d|(even|odd|rate)\d*|depth|other|nearer|side"
    r"|touching|pushing|lanes?|on\d+|theta|out|series|once|share|product|first|second|later|half|size|start|table|node|slopes"
    r"|rates|excitation|forcing|derivative|rhs|stop|law|amplitude|slope|crossed|tabulate|taylor|flight_rate|step_lanes|kick_\w+|record|advance"
    r"|njit|np|min|max|abs|range|sign|a?(sin|cos|tan)h?|exp|log|sqrt|copysign)"
)


def parameter_symbols(scene: Scene) -> dict[str, sympy.Symbol]:
    """Map the path of every numeric parameter to its symbol.

    A symbol that several parts declare gets the index of the part or the side of its stop: k_r, k_l; f_0, f_1.
    """
    entries = [entry for entry in scene.entries if not entry.declared.structural]
    letters = Counter(entry.declared.symbol for entry in entries)
    taken = set(scene.noise.extra_states if scene.noise else ())
    symbols = {}
    for entry in entries:
        name = entry.declared.symbol
        if letters[name] > 1 or name in taken or _IN_CODE.fullmatch(name):
            name = f"{name}_{_suffix(scene, entry)}"
        while name in taken or keyword.iskeyword(name) or _IN_CODE.fullmatch(name):
            name = _SPELLED.get(name, f"{name}_")
        taken.add(name)
        symbols[entry.path] = _symbol(name, entry)
    return symbols


def _suffix(scene: Scene, entry: Entry) -> str:
    head, *rest = entry.path.split(".")
    if head == "barriers":
        return scene.barriers[int(rest[0])].side[0]
    if head == "excitations":
        return rest[0]
    return {"spring": "s", "noise": "xi"}.get(head, "")


def _symbol(name: str, entry: Entry) -> sympy.Symbol:
    above, minimum = entry.declared.above, entry.declared.minimum
    if above is not None and above >= 0:
        return sympy.Symbol(name, positive=True)
    if above is None and minimum is not None and minimum >= 0:
        return sympy.Symbol(name, nonnegative=True)
    return sympy.Symbol(name, real=True)
