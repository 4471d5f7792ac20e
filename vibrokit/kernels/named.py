"""Steppers by name and number, as on the command line and in settings."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from vibrokit.errors import StepperError, nearest, shown
from vibrokit.kernels.fixed_steps import RK4, RK8
from vibrokit.kernels.located import FreeFlight, Order8
from vibrokit.kernels.stepper import Stepper

_KINDS: Mapping[str, tuple[Callable[..., Stepper], Callable[[str], float]]] = {
    kind.name.replace("_", "-"): (kind, number)
    for kind, number in ((RK4, int), (RK8, int), (Order8, float), (FreeFlight, float))
}


def name_of(stepper: Stepper) -> str:
    """Return the text from which `named_stepper` makes the same stepper."""
    (setting,) = (getattr(stepper, field.name) for field in dataclasses.fields(stepper))
    return f"{stepper.name.replace('_', '-')}:{setting!r}"


def check_stepper(stepper: Any) -> None:
    """Raise StepperError unless something is a stepper, or None for a default."""
    if stepper is not None and not isinstance(stepper, Stepper):
        raise StepperError(f"stepper must be a Stepper, such as RK4(steps=256), got {shown(stepper)}.")


def named_stepper(text: str) -> Stepper:
    """Read a stepper from its name and its number: ``rk4:512``, ``rk8:32``, ``order8:1e-10``, ``free-flight``.

    Raises StepperError for an unknown name, and for a number that the stepper does not take.
    """
    name, colon, number = text.partition(":")
    if name not in _KINDS:
        raise StepperError(f"there is no stepper {name!r}{nearest(name, _KINDS)}")
    kind, read = _KINDS[name]
    try:
        value = read(number) if colon else None
    except ValueError:
        form = "a whole number, as in rk4:512" if read is int else "a number, as in order8:1e-10"
        raise StepperError(f"stepper {text!r}: {name} takes {form}, got {number!r}.") from None
    try:
        return kind() if value is None else kind(value)
    except ValueError as error:
        raise StepperError(f"stepper {text!r}: {error}") from error
