"""Checks that every part must pass, whatever its kind."""

from __future__ import annotations

import copy
import dataclasses
import keyword
import pickle
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

import mpmath
import numpy as np
import sympy

from vibrokit.oscillator import Oscillator
from vibrokit.parts.part import Part
from vibrokit.registry import Group, name_of
from vibrokit.scene_file import load_scene, save_scene
from vibrokit.symbolic.formulas import ask
from vibrokit.testing.elsewhere import outcome, outcomes_elsewhere
from vibrokit.testing.precise import CLOSE, DIGITS, Function, apart, function, rounding
from vibrokit.testing.ranges import check_inside, check_refused, outside
from vibrokit.testing.report import Check, ConformanceError, told
from vibrokit.testing.samples import samples

P = TypeVar("P", bound=Part)
Rng = int | np.random.Generator | None


class PartChecks(ABC, Generic[P]):
    """The checks of one part.

    Parameters
    ----------
    part : Part, or a class of parts
    rng : int or numpy.random.Generator, optional
        For the random parameters and points.
    """

    kind: ClassVar[type[Part]]
    group: ClassVar[Group]
    method: ClassVar[str] = "force"
    arguments: ClassVar[tuple[sympy.Symbol, ...]]

    def __init__(self, part: P | type[P], rng: Rng = 0) -> None:
        cls = part if isinstance(part, type) else type(part)
        if not issubclass(cls, self.kind):
            raise TypeError(f"{part!r} is no {self.kind.__name__}; give an instance or a subclass of it.")
        self.part = part
        self.cls = cls
        self.rng = np.random.default_rng(rng)

    def checks(self) -> tuple[Check, ...]:
        """Every check, as (name, function)."""
        general = (
            Check("construction", self.construction),
            Check("symbols and units", self.declared),
            Check("ranges", self.ranges),
            Check("formula", self.formula),
            Check("numbers as symbols", self.numbers),
        )
        return tuple(Check(name, told(make)) for name, make in (*general, *self.physics(), *self._travels()))

    def _travels(self) -> tuple[Check, ...]:
        return (
            Check("frozen", self.frozen),
            Check("pickle", self.pickled),
            Check("parameters and back", self.round_trip),
            Check("another process", self.elsewhere),
        )

    @abstractmethod
    def physics(self) -> tuple[Check, ...]:
        """Checks of this kind of part."""

    @abstractmethod
    def scene(self, part: P) -> Oscillator:
        """A small scene in which the part acts."""

    @abstractmethod
    def points(self) -> list[tuple[float, ...]]:
        """Random arguments of the formula."""

    @cached_property
    def samples(self) -> tuple[P, ...]:
        """Instances with random parameters."""
        return samples(self.part, self.rng)  # type: ignore[return-value]

    # -- what follows from a formula ------------------------------------------------------------------------------

    def symbols(self, part: P) -> dict[str, sympy.Symbol]:
        """A symbol for each parameter that is a number, with the assumptions that its range allows."""
        model = self.scene(part).model
        place = self.place
        return {d.name: model.symbols[f"{place}.{d.name}"] for d in part.declared() if not d.structural}

    @property
    @abstractmethod
    def place(self) -> str:
        """Path of the part in its scene."""

    def values(self, part: P) -> dict[sympy.Symbol, float]:
        """Value of each symbol."""
        return {symbol: part.parameters[name] for name, symbol in self.symbols(part).items()}

    def expression(self, part: P) -> sympy.Expr:
        """The formula of a part."""
        return ask(part, self.method, self.symbols(part), self.arguments)

    def precise(self, part: P, formula: sympy.Expr | None = None) -> Function:
        """The formula, or one that was derived from it, as a function at sixty digits."""
        return function(self.expression(part) if formula is None else formula, self.arguments, self.values(part))

    def each(self) -> Iterator[tuple[P, Function]]:
        """Each sample with its formula."""
        for part in self.samples:
            yield part, self.precise(part)

    # -- the checks -----------------------------------------------------------------------------------------------

    def construction(self) -> str:
        """The class can be made from any values that its declared ranges allow."""
        return f"{len(self.samples)} sets of parameters"

    def declared(self) -> str:
        """Every parameter has a symbol that can stand in code, and a unit."""
        for declared in self.samples[0].declared():
            if declared.unit is None:
                raise ConformanceError(
                    f"{self.cls.__name__}.{declared.name} has no unit; declare it with parameter(symbol, unit), "
                    'where the unit "" is dimensionless.'
                )
            symbol = declared.symbol
            if not symbol.isidentifier() or (keyword.iskeyword(symbol) and symbol != "lambda"):
                raise ConformanceError(
                    f"{self.cls.__name__}.{declared.name} has the symbol {symbol!r}, which is no name; give a letter "
                    'or a word as SymPy writes it, such as "k" or "omega".'
                )
        return ", ".join(f"{d.symbol} [{d.unit or '1'}]" for d in self.samples[0].declared() if not d.structural)

    def ranges(self) -> str:
        """Values are kept as given, and those outside the declared range are refused."""
        count = 0
        for part in self.samples:
            for declared in part.declared():
                value = part.parameters[declared.name]
                if isinstance(value, str):
                    continue
                check_inside(self.cls.__name__, declared, value)
                for wrong in outside(declared):
                    check_refused(part, declared, wrong)
                    count += 1
        return f"{count} wrong values refused"

    def formula(self) -> str:
        """The formula is made of arguments and parameters only."""
        return "; ".join(dict.fromkeys(str(self.expression(part)) for part in self.samples))

    def numbers(self) -> str:
        """The formula gives for numbers what it gives for symbols: it does not ask which of them it was given."""
        worst = 0.0
        for part, exact in self.each():
            values = {d.name: _as_number(part.parameters[d.name]) for d in part.declared()}
            bound = self.precise(part, rounding(self.expression(part)))
            for point in self.points():
                given = [sympy.Float(number, DIGITS) for number in point]
                found = sympy.sympify(getattr(part.twin(values), self.method)(*given)).evalf(DIGITS)
                right = exact(*point)
                worst = max(worst, distance := apart(mpmath.mpmathify(found), right))
                if distance > CLOSE and not abs(mpmath.mpmathify(found) - right) <= bound(*point):
                    raise ConformanceError(
                        f"{part!r} gives {mpmath.nstr(found, 17)} for the numbers {point}, but its formula for "
                        f"symbols, {self.expression(part)}, gives {mpmath.nstr(right, 17)} there; write one formula "
                        "for all values, without asking what an argument or a field is."
                    )
        return f"within {worst:.1g}"

    def frozen(self) -> str:
        """A part cannot be changed; equal parts are one key of a dict."""
        for part in self.samples:
            twin = type(part)(**part.parameters) if self._remakes(part) else copy.copy(part)
            for field in dataclasses.fields(part):  # type: ignore[arg-type]
                try:
                    setattr(twin, field.name, None)
                except AttributeError:
                    continue
                raise ConformanceError(f"{part!r} lets its field {field.name!r} be changed; parts must be frozen.")
            try:
                same = twin == part and hash(twin) == hash(part)
            except TypeError as error:
                raise ConformanceError(f"{part!r} cannot be hashed ({error}); hold tuples, not lists.") from error
            if not same:
                raise ConformanceError(f"{part!r} differs from its own copy, in == or in hash; write neither by hand.")
        return ""

    @staticmethod
    def _remakes(part: Part) -> bool:
        try:
            type(part)(**part.parameters)
        except Exception:
            return False
        return True

    def pickled(self) -> str:
        """A part comes back from pickling as it was."""
        for part in self.samples:
            try:
                again = pickle.loads(pickle.dumps(part))
            except Exception as error:
                raise ConformanceError(
                    f"{part!r} cannot be pickled ({type(error).__name__}: {error}); define its class at the top level "
                    "of a module."
                ) from error
            if again != part or again.parameters != part.parameters:
                raise ConformanceError(f"{part!r} comes back from pickling as {again!r}.")
        return ""

    def round_trip(self) -> str:
        """A part comes back from its parameters and, if its class is registered, from a scene file."""
        registered = ":" not in name_of(self.group, self.cls)
        for part in self.samples:
            try:
                again = type(part)(**part.parameters)
            except Exception as error:
                raise ConformanceError(
                    f"{part!r} cannot be made from its own parameters {part.parameters} ({type(error).__name__}: "
                    f"{error}); let the constructor take the parameters by their names."
                ) from error
            if again != part:
                raise ConformanceError(f"{part!r} comes back from its own parameters as {again!r}.")
            if registered:
                self._check_scene_file(part)
        return "scene file too" if registered else "not registered, so in no scene file"

    def _check_scene_file(self, part: P) -> None:
        scene = self.scene(part)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "scene.toml"
            save_scene(scene, path)
            again = load_scene(path)
        if again != scene:
            raise ConformanceError(f"A scene file gives back {again!r} for {scene!r}.")

    def elsewhere(self) -> str:
        """Another process derives the same code from the part, and computes the same bits."""
        if self.cls.__module__ == "__main__":
            return "not told: the class is defined in the main script, which no other process can import"
        scenes = [self.scene(part) for part in self.samples]
        for scene in scenes:
            self.expression(self.part_in(scene))
        for scene, there in zip(scenes, outcomes_elsewhere(scenes), strict=True):
            here = outcome(scene)
            if here != there:
                what = "numbers" if here[0] == there[0] else "code"
                raise ConformanceError(
                    f"Another process has other {what} for {self.part_in(scene)!r}; let its formula depend on its "
                    "fields alone, not on the hash of a text, the time, or the process."
                )
        return f"{len(scenes)} scenes, same bits"

    @abstractmethod
    def part_in(self, scene: Oscillator) -> P:
        """The part that a scene was made for."""


def _as_number(value: Any) -> Any:
    return value if isinstance(value, str) else sympy.Float(value, DIGITS)
