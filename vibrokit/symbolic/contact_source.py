"""Source text of contact forces and their derivatives, in the two forms that steppers need."""

from __future__ import annotations

import sympy

from vibrokit.symbolic.contact import DEPTH, RATE
from vibrokit.symbolic.equations import Equations
from vibrokit.symbolic.flow import FlowEquations
from vibrokit.symbolic.printer import SourcePrinter, assignments, printable
from vibrokit.symbolic.symbols import code_name

_TINY = "1e-300"
_SIDE = sympy.Symbol("side")


class ContactWriter:
    """Writes the contact terms that a flow needs."""

    def __init__(self, model: Equations, equations: FlowEquations) -> None:
        self.model = model
        self.needed = equations.contacts
        self.stops = sorted({stop for stop, _, _ in equations.contacts.values()})

    @property
    def merged(self) -> bool:
        """Whether two stops share one law, so that lanes evaluate it only once, for the nearer stop.

        The mass never touches both stops at once, because they are not crossed.
        """
        if len(self.stops) != 2:
            return False
        first, second = (self.model.contacts[stop] for stop in self.stops)
        swapped = first.law.subs(dict(self._partners()), simultaneous=True)
        return first.clamped == second.clamped and swapped == second.law

    def used(self) -> set[sympy.Symbol]:
        """Parameters of the contact terms."""
        symbols: set[sympy.Symbol] = set()
        for stop in self.stops:
            symbols |= self.model.contacts[stop].law.free_symbols - {DEPTH, RATE}
            symbols.add(self.model.symbols[f"barriers.{stop}.position"])
        return symbols

    def lines(self, switched: bool) -> tuple[list[str], set[sympy.Symbol]]:
        """Branch-free lines, and the contact terms that are zero because another term holds their sum.

        A stop pushes where it is touched, or, if ``switched``, where the caller says so by ``on0``, ``on1`` …
        """
        if self.merged:
            second = {symbol for symbol, (stop, _, _) in self.needed.items() if stop == self.stops[1]}
            return self._merged_lines(switched), second
        lines = []
        for stop in self.stops:
            depth, rate = self._depth_and_rate(stop)
            side = sympy.Integer(self.model.scene.barriers[stop].sign)
            touching = f"on{stop}" if switched else ""
            lines += [f"    depth = {depth}", *self._guarded_terms(stop, side, rate, f"d{stop}_", touching)]
        return lines, set()

    def _partners(self) -> list[tuple[sympy.Symbol, sympy.Symbol]]:
        """Parameters of the first law, each with the same parameter of the second."""
        first, second = (f"barriers.{stop}.law." for stop in self.stops)
        symbols = self.model.symbols
        pairs = [(symbols[p], symbols.get(second + p.removeprefix(first))) for p in symbols if p.startswith(first)]
        return [(one, other) for one, other in pairs if other is not None]

    def _terms(self, stop: int, side: sympy.Expr) -> dict[str, sympy.Expr]:
        """Each needed derivative of the force of a stop: −side^(1 + orders) times that of the law."""
        law = self.model.contacts[stop].law
        terms = {}
        for symbol, (index, in_x, in_v) in self.needed.items():
            if index == stop:
                sign = side if (1 + in_x + in_v) % 2 else sympy.Integer(1)
                terms[str(symbol)] = -sign * sympy.diff(law, (DEPTH, in_x), (RATE, in_v))
        return terms

    def _depth_and_rate(self, stop: int) -> tuple[str, str]:
        position = code_name(self.model.symbols[f"barriers.{stop}.position"])
        if self.model.scene.barriers[stop].sign > 0:
            return f"x - {position}", "v"
        return f"{position} - x", "-v"

    def _guarded_terms(self, stop: int, side: sympy.Expr, rate: str, temporary: str, touching: str) -> list[str]:
        """Lines that compute the terms of a stop at ``depth``, and set them to zero where it does not push.

        It pushes if ``touching``; where that text is empty, depth and law decide.
        """
        terms, contact = self._terms(stop, side), self.model.contacts[stop]
        guard = [f"    touching = {touching or 'depth > 0.0'}"]
        guard += [f"    depth = depth if depth > {_TINY} else {_TINY}"] if touching else []
        guard += ["    depth = depth if touching else 1.0"]
        clamped = contact.clamped and not touching
        if clamped or _uses_rate(terms):
            guard.append(f"    rate = {rate}")
        if clamped:
            guard.append(f"    touching = touching and {SourcePrinter().doprint(printable(contact.law))} > 0.0")
        lines, texts = assignments(terms, temporary)
        return [*guard, *lines, *(f"    {name} = {text} if touching else 0.0" for name, text in texts.items())]

    def _merged_lines(self, switched: bool) -> list[str]:
        first, second = self.stops
        (near, _), (far, _) = self._depth_and_rate(first), self._depth_and_rate(second)
        sign = float(self.model.scene.barriers[first].sign)
        head = [f"    depth = {near}", f"    other = {far}"]
        head += [f"    nearer = on{first}" if switched else "    nearer = depth > other"]
        head += ["    depth = depth if nearer else other", f"    side = {sign} if nearer else {-sign}"]
        partners = [(code_name(one), code_name(other)) for one, other in self._partners()]
        head += [f"    {one} = {one} if nearer else {other}" for one, other in partners]
        touching = f"on{first} or on{second}" if switched else ""
        return [*head, *self._guarded_terms(first, _SIDE, "side*v", "d", touching)]


def _uses_rate(terms: dict[str, sympy.Expr]) -> bool:
    return any(RATE in printable(term).free_symbols for term in terms.values())
