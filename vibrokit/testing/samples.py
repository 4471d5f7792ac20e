"""Random instances of a part, with values from the declared ranges of its parameters; checks of these ranges."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from vibrokit.errors import ParameterError, VibrokitError
from vibrokit.parts.contact import CustomLaw
from vibrokit.parts.noise import StateDependentNoise
from vibrokit.parts.parameter import Parameter
from vibrokit.parts.part import Part
from vibrokit.parts.periodic import Periodic
from vibrokit.parts.spring import CustomSpring
from vibrokit.testing.report import ConformanceError

_SAMPLES = 3
_ATTEMPTS = 100

# Instances of classes with a formula, which cannot be drawn at random.
REPRESENTATIVES: dict[type[Part], Callable[[], Part]] = {
    Periodic: lambda: Periodic(0.9, 0.1, c_1=0.2, s_1=-0.1, s_3=0.05),
    CustomLaw: lambda: CustomLaw("k*depth**1.5*(1 + c*rate) + k*tanh(depth)/3", k=50.0, c=0.1),
    CustomSpring: lambda: CustomSpring("x + e*x**5 + d*v**3 + sin(x)/2", e=0.2, d=0.1),
    StateDependentNoise: lambda: StateDependentNoise(1e-3, "sqrt(1 + c*x**2)*exp(-v**2/8)", c=0.5),
}


def samples(part: Part | type[Part], rng: np.random.Generator) -> tuple[Part, ...]:
    """Return instances to check.

    For a class: several, with random parameter values, the first with its default values. For an instance: itself, then
    copies with random values of the parameters that declare a range; for others, only its own values are known to be
    meaningful. ConformanceError is raised if the class refuses values in its declared ranges.
    """
    if isinstance(part, type):
        if part in REPRESENTATIVES:
            return samples(REPRESENTATIVES[part](), rng)
        required = _required(part)
        return tuple(_drawn(part, part, required if index == 0 else part._declared, rng) for index in range(_SAMPLES))
    ranged = [declared for declared in part.declared() if _has_range(declared)]
    again = (_drawn(type(part), part.replace, ranged, rng) for _ in range(_SAMPLES - 1))
    return (part, *again) if ranged else (part,)


def value_for(declared: Parameter, rng: np.random.Generator) -> float:
    """Draw a value in the range of a parameter, of moderate size and not at the lower end."""
    if declared.structural:
        fitting = [value for value in (1.0, 1.5, 2.0, 2.5, 3.0, 1.25, 0.5) if _allowed(declared, value)]
        if fitting:
            return float(rng.choice(fitting))
    low = declared.above if declared.above is not None else declared.minimum
    size = math.exp(rng.uniform(math.log(0.1), math.log(100.0)))
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


def _required(cls: type[Part]) -> list[Parameter]:
    """Parameters without default values."""
    accepted = inspect.signature(cls).parameters
    for declared in cls._declared:
        if declared.name not in accepted:
            raise ConformanceError(
                f"The constructor of {cls.__name__} has no argument {declared.name!r}, which the class declares; "
                "use the constructor of the dataclass, or add the argument."
            )
    return [d for d in cls._declared if accepted[d.name].default is inspect.Parameter.empty]


def _drawn(
    cls: type[Part], make: Callable[..., Part], parameters: Sequence[Parameter], rng: np.random.Generator
) -> Part:
    """Make an instance with random values of some parameters; repeat while the part refuses the combination."""
    refusal = ""
    for _ in range(_ATTEMPTS):
        values = {declared.name: value_for(declared, rng) for declared in parameters}
        try:
            return make(**values)
        except VibrokitError as error:
            refusal = str(error)
        except Exception as error:
            raise ConformanceError(
                f"{cls.__name__} cannot be made from {values}, which its declared ranges allow "
                f"({type(error).__name__}: {error}); if a parameter is a text, check an instance."
            ) from error
    raise ConformanceError(
        f"{cls.__name__} refused {_ATTEMPTS} random sets of values in its declared ranges, the last with: {refusal} "
        "Declare narrower ranges."
    )


def check_inside(owner: str, declared: Parameter, value: Any) -> None:
    """Raise ConformanceError if a part holds a value outside the range of its parameter."""
    try:
        declared.checked(owner, value)
    except VibrokitError as error:
        raise ConformanceError(f"{error} The constructor accepted it; call super().__post_init__().") from error


def outside(declared: Parameter) -> list[Any]:
    """Values outside the range of a parameter."""
    wrong: list[Any] = [math.nan, math.inf, "1", None]
    wrong += [] if declared.minimum is None else [declared.minimum - 1.0]
    wrong += [] if declared.above is None else [declared.above]
    return wrong + ([] if declared.maximum is None else [declared.maximum + 1.0])


def check_refused(part: Part, declared: Parameter, wrong: Any) -> None:
    """Raise ConformanceError unless the constructor refuses a value with an error of the toolkit."""
    try:
        made = type(part)(**(part.parameters | {declared.name: wrong}))
    except VibrokitError:
        return
    except Exception as error:
        raise ConformanceError(
            f"{type(part).__name__} with {declared.name} = {wrong!r} raises {type(error).__name__}: {error}; check the "
            "range first, so that a ParameterError is raised."
        ) from error
    raise ConformanceError(
        f"The constructor must refuse {declared.name} = {wrong!r} (allowed: {declared.allowed}), but made {made!r}."
    )
