"""Symbols for what users name: every parameter of a scene, and the states that a noise model adds."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

import sympy

from vibrokit.parts.parameter import Entry
from vibrokit.parts.scene import Scene

_PREFIX = "u_"  # no name of generated code begins so
# What equations show besides: a name like these gets an underscore, so that a reader can tell both apart.
_SHOWN = re.compile(r"[xvtSH]|p_\d+|depth|rate")


class Named(sympy.Symbol):
    """A symbol with a name that a user chose, any text.

    It is equal to no symbol of ours, whatever its name, and it has a name of its own in generated code.
    """

    @classmethod
    def class_key(cls) -> tuple[int, int, str]:
        """Sorted among other symbols, by name."""
        return 2, 0, sympy.Symbol.__name__


def code_name(symbol: sympy.Symbol) -> str:
    """Return the name of a symbol in generated code: a user's name with a prefix, as ASCII letters and digits."""
    return f"{_PREFIX}{plain(symbol.name)}" if isinstance(symbol, Named) else str(symbol.name)


def plain(text: str) -> str:
    """Return text with the code point of every character that is not an ASCII letter or digit, or an underscore."""
    return re.sub(r"\W", lambda found: f"_{ord(found.group()):x}_", text, flags=re.ASCII)


def state_symbols(scene: Scene) -> tuple[sympy.Symbol, ...]:
    """Return the symbols of x, v and the extra states of the noise."""
    plane = tuple(sympy.Symbol(name, real=True) for name in ("x", "v"))
    taken: set[str] = set()
    extra = scene.noise.extra_states if scene.noise else ()
    return (*plane, *(Named(_free(name, taken), real=True) for name in extra))


def parameter_symbols(scene: Scene) -> dict[str, Named]:
    """Map the path of every numeric parameter to its symbol.

    A symbol that several parts declare gets the index of the part or the side of its stop: k_r, k_l; f_0, f_1.
    """
    entries = [entry for entry in scene.entries if not entry.declared.structural]
    letters = Counter(entry.declared.symbol for entry in entries)
    taken = {plain(symbol.name) for symbol in state_symbols(scene)}
    symbols = {}
    for entry in entries:
        name = entry.declared.symbol
        if letters[name] > 1 or plain(name) in taken or _SHOWN.fullmatch(name):
            name = f"{name}_{_suffix(scene, entry)}"
        symbols[entry.path] = Named(_free(name, taken), **_assumptions(entry))
    return symbols


def is_of_law(path: str) -> bool:
    """Whether a parameter is one of a contact law."""
    return ".law." in path


def _free(name: str, taken: set[str]) -> str:
    """Return a name that is like no other one, also in generated code, and take it."""
    while plain(name) in taken or _SHOWN.fullmatch(name):
        name = f"{name}_"
    taken.add(plain(name))
    return name


def _suffix(scene: Scene, entry: Entry) -> str:
    head, *rest = entry.path.split(".")
    if head == "barriers":
        return scene.barriers[int(rest[0])].side[0]
    if head == "excitations":
        return rest[0]
    return {"spring": "s", "friction": "mu", "noise": "xi"}.get(head, "")


def _assumptions(entry: Entry) -> dict[str, Any]:
    if is_of_law(entry.path):  # the limits of a law depend on the signs of its parameters
        return {"positive": True} if entry.value > 0 else {"negative": True} if entry.value < 0 else {"zero": True}
    above, minimum = entry.declared.above, entry.declared.minimum
    if above is not None and above >= 0:
        return {"positive": True}
    if above is None and minimum is not None and minimum >= 0:
        return {"nonnegative": True}
    return {"real": True}
