"""Checks that constructors enforce the declared ranges of parameters."""

from __future__ import annotations

import math
from typing import Any

from vibrokit.errors import VibrokitError
from vibrokit.parts.parameter import Parameter
from vibrokit.parts.part import Part
from vibrokit.testing.report import ConformanceError


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
