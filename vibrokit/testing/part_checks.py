"""Checks for parts of every kind."""

from __future__ import annotations

import copy
import dataclasses
import itertools
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
from vibrokit.parts.formula_part import FormulaPart
from vibrokit.parts.part import Part
from vibrokit.registry import Group, name_of
from vibrokit.scene_file import load_scene, save_scene
from vibrokit.symbolic.formulas import derived_formula
from vibrokit.testing.other_process import outcome, outcomes_in_other_process
from vibrokit.testing.precise import CLOSE, DIGITS, Function, Reference, derivative, difference, relative_distance
from vibrokit.testing.report import Check, ConformanceError, guarded
from vibrokit.testing.samples import check_inside, check_refused, outside, samples

P = TypeVar("P", bound=Part)
Rng = int | np.random.Generator | None

ORDERS = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))  # of the derivatives that kernels use, in two arguments


class PartChecks(ABC, Generic[P]):
    """The checks of one part or class of parts; `rng` draws parameter values and points."""

    kind: ClassVar[type[Part]]
    group: ClassVar[Group]
    method: str = "force"
    arguments: tuple[sympy.Symbol, ...]
    place: ClassVar[str]
    """Path of the part in its scene."""
    reach: ClassVar[float] = 2.0
    count: ClassVar[int] = 12
    """Range and number of random points."""

    def __init__(self, part: P | type[P], rng: Rng = 0) -> None:
        cls = part if isinstance(part, type) else type(part)
        if not issubclass(cls, self.kind):
            raise TypeError(f"part must be an instance or a subclass of {self.kind.__name__}, got {part!r}.")
        self.part = part
        self.cls = cls
        self.rng = np.random.default_rng(rng)

    def checks(self) -> tuple[Check, ...]:
        """Every check, as (name, function)."""
        checks = (
            Check("construction", self.construction),
            Check("symbols and units", self.declared),
            Check("ranges", self.ranges),
            Check("formula", self.formula),
            Check("numbers as symbols", self.numbers),
            *self.physics(),
            Check("frozen", self.frozen),
            Check("pickle", self.pickled),
            Check("parameters and back", self.round_trip),
            Check("another process", self.other_process),
        )
        return tuple(Check(name, guarded(perform)) for name, perform in checks)

    @abstractmethod
    def physics(self) -> tuple[Check, ...]:
        """Checks of this kind of part."""

    @abstractmethod
    def scene(self, part: P) -> Oscillator:
        """A small scene that contains the part."""

    @abstractmethod
    def compiled_distances(self, part: P) -> Iterator[float]:
        """Compare compiled code with the formula; yield relative distances."""

    def points(self) -> list[tuple[float, ...]]:
        """Random arguments of the formula."""
        places = self.rng.uniform(-self.reach, self.reach, (self.count, len(self.arguments)))
        return [tuple(place) for place in places.tolist()]

    @cached_property
    def samples(self) -> tuple[P, ...]:
        """Instances with random parameter values."""
        return samples(self.part, self.rng)  # type: ignore[return-value]

    # -- formulas -------------------------------------------------------------------------------------------------

    def symbols(self, part: P) -> dict[str, sympy.Symbol]:
        """A symbol for each numeric parameter, with the assumptions that its range allows."""
        model = self.scene(part).model
        return {d.name: model.symbols[f"{self.place}.{d.name}"] for d in part.declared() if not d.structural}

    def values(self, part: P) -> dict[sympy.Symbol, float]:
        """Value of each symbol."""
        return {symbol: part.parameters[name] for name, symbol in self.symbols(part).items()}

    def expression(self, part: P) -> sympy.Expr:
        """The formula of a part."""
        return derived_formula(part, self.method, self.symbols(part), self.arguments)

    def reference(self, part: P, formula: sympy.Expr | None = None) -> Reference:
        """The formula of a part, or another in its symbols."""
        return Reference(self.expression(part) if formula is None else formula, self.arguments, self.values(part))

    def each(self) -> Iterator[tuple[P, Function]]:
        """Each sample with its formula as a function at sixty digits."""
        for part in self.samples:
            yield part, self.reference(part).exact

    # -- checks of every part -------------------------------------------------------------------------------------

    def construction(self) -> str:
        """The class accepts any values in its declared ranges."""
        return f"{len(self.samples)} sets of parameters"

    def declared(self) -> str:
        """Every parameter has a unit, unless it is a constant of a formula as text, and a symbol valid in code."""
        part = self.samples[0]
        constants: dict[str, Any] = dict(part.constants) if isinstance(part, FormulaPart) else {}
        for declared in part.declared():
            name = f"{self.cls.__name__}.{declared.name}"
            if declared.unit is None and declared.name not in constants:
                raise ConformanceError(
                    f'{name} has no unit; declare it with parameter(symbol, unit), with unit "" if dimensionless.'
                )
            symbol = declared.symbol
            if not symbol.isidentifier() or (keyword.iskeyword(symbol) and symbol != "lambda"):
                raise ConformanceError(
                    f'{name}: symbol must be a name that SymPy can print, such as "k" or "omega", got {symbol!r}.'
                )
        shown = (f"{d.symbol} [{d.unit or '1'}]" for d in part.declared() if not d.structural and d.unit is not None)
        return ", ".join(shown)

    def ranges(self) -> str:
        """Values in the declared range are kept, and values outside it are refused."""
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
        """The formula has no symbols other than its arguments and parameters."""
        return "; ".join(dict.fromkeys(str(self.expression(part)) for part in self.samples))

    def numbers(self) -> str:
        """The formula has the same value for numbers as for symbols."""
        worst = 0.0
        for part in self.samples:
            values = {d.name: _as_number(part.parameters[d.name]) for d in part.declared()}
            reference = self.reference(part)
            for point in self.points():
                given = (sympy.Float(number, DIGITS) for number in point)
                found = sympy.sympify(getattr(part.twin(values), self.method)(*given)).evalf(DIGITS)
                distance, accepted = reference.compare(point, mpmath.mpmathify(found))
                worst = max(worst, distance)
                if not accepted:
                    raise ConformanceError(
                        f"{part!r} returns {mpmath.nstr(found, 17)} for the numbers {point}, but "
                        f"{mpmath.nstr(reference.exact(*point), 17)} from its formula for symbols, "
                        f"{self.expression(part)}; write a formula that does not depend on the type of an argument."
                    )
        return f"within {worst:.1g}"

    def frozen(self) -> str:
        """A part cannot be changed, and equal parts have the same hash."""
        for part in self.samples:
            try:
                twin = type(part)(**part.parameters)
            except Exception:  # `round_trip` reports it
                twin = copy.copy(part)
            for field in dataclasses.fields(part):  # type: ignore[arg-type]
                try:
                    setattr(twin, field.name, None)
                except AttributeError:
                    continue
                raise ConformanceError(f"The field {field.name!r} of {part!r} can be changed; parts must be frozen.")
            try:
                same = twin == part and hash(twin) == hash(part)
            except TypeError as error:
                raise ConformanceError(f"{part!r} has no hash ({error}); use tuples instead of lists.") from error
            if not same:
                raise ConformanceError(
                    f"A copy of {part!r} is not equal to it or has another hash; do not define __eq__ or __hash__."
                )
        return ""

    def pickled(self) -> str:
        """Pickling preserves a part."""
        for part in self.samples:
            try:
                again = pickle.loads(pickle.dumps(part))
            except Exception as error:
                raise ConformanceError(
                    f"{part!r} cannot be pickled ({type(error).__name__}: {error}); define its class at the top level "
                    "of a module."
                ) from error
            if again != part or again.parameters != part.parameters:
                raise ConformanceError(f"Pickling changes {part!r} into {again!r}.")
        return ""

    def round_trip(self) -> str:
        """A part can be made again from its parameters and, if its class is registered, from a scene file."""
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
                raise ConformanceError(f"{part!r}, made again from its own parameters, becomes {again!r}.")
            if registered:
                self._check_scene_file(part)
        return "also from a scene file" if registered else "no scene file, because the class is not registered"

    def _check_scene_file(self, part: P) -> None:
        scene = self.scene(part)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "scene.toml"
            save_scene(scene, path)
            again = load_scene(path)
        if again != scene:
            raise ConformanceError(f"A scene file changes {scene!r} into {again!r}.")

    def other_process(self) -> str:
        """Another process derives the same code from the part, and computes the same bits."""
        if self.cls.__module__ == "__main__":
            return "not checked: another process cannot import a class that is defined in the main script"
        for part in self.samples:
            self.expression(part)
        scenes = [self.scene(part) for part in self.samples]
        for part, scene, there in zip(self.samples, scenes, outcomes_in_other_process(scenes), strict=True):
            here = outcome(scene)
            if here != there:
                what = "numbers" if here[0] == there[0] else "code"
                raise ConformanceError(
                    f"Another process has other {what} for {part!r}; let its formula depend only on its fields, not on "
                    "the hash of a text, the time or the process."
                )
        return f"{len(scenes)} scenes, same bits"

    # -- checks for several kinds ---------------------------------------------------------------------------------

    def finite(self) -> str:
        """The formula is finite and real at random points and at zero."""
        for _, value in self.each():
            for point in [*self.points(), (0.0,) * len(self.arguments)]:
                value(*point)
        return ""

    def derivatives(self) -> str:
        """Derivatives agree with finite differences of the formula."""
        worst = 0.0
        for part, value in self.each():
            formula = self.expression(part)
            derived = [(orders, self.reference(part, derivative(formula, self.arguments, orders))) for orders in ORDERS]
            points = self.points()
            for (orders, reference), point in itertools.product(derived, points):
                scale = abs(value(*point))
                for order, size in zip(orders, point, strict=True):
                    scale /= mpmath.mpf(abs(size)) ** order
                by_formula, by_difference = reference.exact(*point), difference(value, point, orders)
                if max(abs(by_formula), abs(by_difference)) <= 1e-18 * scale:  # the error of a finite difference
                    continue
                distance = relative_distance(by_formula, by_difference)
                worst = max(worst, distance)
                if distance > CLOSE:
                    raise ConformanceError(
                        f"The derivative of orders {orders} of {part!r} at {point} is {mpmath.nstr(by_formula, 15)} by "
                        f"its formula, but {mpmath.nstr(by_difference, 15)} by finite differences."
                    )
        return f"within {worst:.1g} of differences at 60 digits"

    def compiled(self) -> str:
        """Compiled code agrees with the formula."""
        return f"within {max(max(self.compiled_distances(part)) for part in self.samples):.1g}"


def _as_number(value: Any) -> Any:
    return value if isinstance(value, str) else sympy.Float(value, DIGITS)
