"""The second-order form of a flow as Python text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import sympy

from vibrokit.symbolic.flow import FlowEquations
from vibrokit.symbolic.printer import assignments, unpack
from vibrokit.symbolic.second_order import SecondOrderForm
from vibrokit.symbolic.symbols import code_name


class PlacedPair(NamedTuple):
    """Places of a pair among the variables, and the number of its constants."""

    position: int
    velocity: int
    kind: int


class SecondOrderWriter:
    """Writes `accelerations` and `constants_of`.

    `pairs` are the pairs, and `integrals` the places of the variables that are integrals.
    """

    def __init__(self, form: SecondOrderForm, equations: FlowEquations, places: Mapping[sympy.Symbol, int]) -> None:
        self._form, self._equations, self._places = form, equations, places
        self._kinds = list(dict.fromkeys(pair.constants for pair in form.pairs))
        self.kinds, self.integrals = len(self._kinds), form.integrals
        self.pairs = [
            PlacedPair(pair.position, pair.velocity, self._kinds.index(pair.constants)) for pair in form.pairs
        ]

    def text(self, parameters: Sequence[str], *, forced: bool) -> str:
        """Functions `accelerations(positions…, f, parameters…)` and `constants_of(theta, out)`.

        The first returns F of each pair and the rates of the integrals, the second writes own, turned and damping of
        each kind of pair.
        """
        variables, rates = self._equations.variables, self._equations.rates
        values = {f"a{n}": pair.acceleration(variables[pair.position]) for n, pair in enumerate(self._form.pairs)}
        values |= {f"r{n}": rates[place] for n, place in enumerate(self.integrals)}
        lines, texts = assignments(values, "c")
        arguments = [code_name(variables[pair.position]) for pair in self._form.pairs]
        arguments += [*["f"] * forced, *parameters]
        head = ["@njit(**INLINED)", f"def accelerations({', '.join(arguments)}):"]
        result = f"    return ({', '.join(texts.values())},)"
        return "\n".join([*head, *lines, result, "", "", *self._constants(), ""])

    def _constants(self) -> list[str]:
        every = {f"out[{k}, {n}]": each for k, kind in enumerate(self._kinds) for n, each in enumerate(kind)}
        shared, texts = assignments(every, "c")
        lines = ["@njit(**INNER)", "def constants_of(theta, out):", *unpack(every.values(), self._places), *shared]
        return [*lines, *(f"    {target} = {value}" for target, value in texts.items())]
