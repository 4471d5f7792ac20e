"""Random valid instances of a part, drawn from the ranges that its parameters declare."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from vibrokit.errors import ParameterError, VibrokitError
from vibrokit.parts.contact.custom import CustomLaw
from vibrokit.parts.noise.state_dependent import StateDependentNoise
from vibrokit.parts.parameter import Parameter
from vibrokit.parts.part import Part
from vibrokit.parts.spring.custom import CustomSpring
from vibrokit.testing.report import ConformanceError

P = TypeVar("P", bound=Part)

_SAMPLES = 3
_ATTEMPTS = 100
_SMALLEST, _LARGEST = 0.1, 100.0
_EXPONENTS = (1.0, 1.5, 2.0, 2.5, 3.0, 1.25, 0.5)  # what structural numbers usually are

# A class whose parameters include a formula cannot be drawn at random; these stand for it.
REPRESENTATIVES: dict[type[Part], Callable[[], Part]] = {
    CustomLaw: lambda: CustomLaw("k*depth**1.5*(1 + c*rate) + k*tanh(depth)/3", k=50.0, c=0.1),
    CustomSpring: lambda: CustomSpring("x + e*x**5 + d*v**3 + sin(x)/2", e=0.2, d=0.1),
    StateDependentNoise: lambda: StateDependentNoise(1e-3, "sqrt(1 + c*x**2)*exp(-v**2/8)", c=0.5),
}


def samples(part: Part | type[Part], rng: np.random.Generator) -> tuple[Part, ...]:
    """Return instances to check.

    Of a class: several, with random parameters. Of an instance: itself, then copies of it whose parameters are
    drawn anew where they declare a range; where they declare none, its own values are the only ones known to be
    meant.

    Raises
    ------
    ConformanceError
        The class refuses what its declared ranges allow.
    """
    if isinstance(part, type):
        represented = REPRESENTATIVES.get(part)
        if represented is not None:
            return samples(represented(), rng)
        return tuple(_drawn(part, rng, usual=index == 0) for index in range(_SAMPLES))
    again = (_redrawn(part, rng) for _ in range(_SAMPLES - 1))
    return (part, *again) if any(map(_has_range, part.declared())) else (part,)


def value_for(declared: Parameter, rng: np.random.Generator) -> float:
    """Draw a value that a parameter may have: of moderate size, never just on the edge of its range."""
    if declared.structural:
        fitting = [value for value in _EXPONENTS if _allowed(declared, value)]
        if fitting:
            return float(rng.choice(fitting))
    low = declared.above if declared.above is not None else declared.minimum
    size = math.exp(rng.uniform(math.log(_SMALLEST), math.log(_LARGEST)))
    if low is not None and declared.maximum is not None:
        return float(rng.uniform(low + 0.01 * (declared.maximum - low), declared.maximum))
    if low is not None:
        return low + size
    if declared.maximum is not None:
        return declared.maximum - size
    return size / 10 * float(rng.choice((-1.0, 1.0)))


def _allowed(declared: Parameter, value: float) -> bool:
    try:
        declared.checked("", value)
    except ParameterError:
        return False
    return True


def _has_range(declared: Parameter) -> bool:
    bounds = (declared.minimum, declared.above, declared.maximum)
    return not declared.structural and any(bound is not None for bound in bounds)


def _drawn(cls: type[Part], rng: np.random.Generator, *, usual: bool) -> Part:
    """An instance with random parameters; if `usual`, defaults are left as they are."""
    accepted = inspect.signature(cls).parameters
    values: dict[str, Any] = {}
    for declared in cls._declared:
        if declared.name not in accepted:
            raise ConformanceError(
                f"The constructor of {cls.__name__} has no argument {declared.name!r}, though the class declares that "
                "parameter; let the dataclass write the constructor, or take an argument of that name."
            )
        if not (usual and accepted[declared.name].default is not inspect.Parameter.empty):
            values[declared.name] = value_for(declared, rng)
    return _made(lambda: cls(**values), cls, values, lambda: _drawn_again(cls, values, rng))


def _drawn_again(cls: type[Part], values: dict[str, Any], rng: np.random.Generator) -> None:
    values.update({d.name: value_for(d, rng) for d in cls._declared if d.name in values})


def _redrawn(part: Part, rng: np.random.Generator) -> Part:
    changes: dict[str, Any] = {}

    def draw() -> None:
        changes.update({d.name: value_for(d, rng) for d in part.declared() if _has_range(d)})

    draw()
    return _made(lambda: part.replace(**changes), type(part), changes, draw)


def _made(make: Callable[[], P], cls: type, values: dict[str, Any], draw: Callable[[], None]) -> P:
    for _ in range(_ATTEMPTS):
        try:
            return make()
        except VibrokitError as error:  # parameters may have to fit together
            refusal = str(error)
            draw()
        except Exception as error:
            raise ConformanceError(
                f"{cls.__name__} cannot be made from {values}: {type(error).__name__}: {error}. The ranges that its "
                "parameters declare allow these values; if one is a text, give an instance to be checked."
            ) from error
    raise ConformanceError(
        f"{cls.__name__} refused {_ATTEMPTS} random sets of values that its parameters' ranges allow, at last with: "
        f"{refusal} Declare the range that is meant."
    )
