"""The parameter that a continuation follows, and its values, checked."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.arguments import members, real
from vibrokit.errors import ParameterError, VibrokitError, shown
from vibrokit.oscillator import Oscillator
from vibrokit.parts.parameter import Entry


@dataclasses.dataclass(frozen=True)
class ParameterLine:
    """One parameter, or several that one number sets: each is its factor times that number.

    Attributes
    ----------
    entry : Entry
        The first of them, which names the line.
    factors : tuple of (str, float)
        By path.
    """

    entry: Entry
    factors: tuple[tuple[str, float], ...]

    @property
    def path(self) -> str:
        """Path of the first parameter."""
        return self.entry.path

    @property
    def argument(self) -> str | dict[str, float]:
        """The line as plain data, from which `parameter_line` makes it again."""
        return self.path if self.factors == ((self.path, 1.0),) else dict(self.factors)

    @property
    def own(self) -> float:
        """The number that the first parameter has in its scene."""
        return float(self.entry.value) / self.factors[0][1]

    def at(self, osc: Oscillator, value: float) -> Oscillator:
        """Return the scene at a value."""
        return osc.replace({path: factor * value for path, factor in self.factors})

    def enters(self, osc: Oscillator, expression: Any) -> bool:
        """Whether an expression of the model of a scene depends on any of the parameters."""
        return any(osc.model.symbols[path] in expression.free_symbols for path, _ in self.factors)

    def refusal(self, osc: Oscillator, value: float) -> str:
        """Return why there is no scene at a value; empty if there is one."""
        try:
            self.at(osc, value)
        except VibrokitError as error:
            return str(error)
        return ""

    def begins(self, prefix: str) -> bool:
        """Whether the path of any of the parameters begins with a prefix."""
        return any(path.startswith(prefix) for path, _ in self.factors)

    def derivative(self, partial: Callable[[str], float]) -> float:
        """Return the derivative along the line from the derivatives in each parameter."""
        return math.fsum(factor * partial(path) for path, factor in self.factors)


def parameter_line(caller: str, osc: Oscillator, parameter: str | Mapping[str, float]) -> ParameterLine:
    """Return a parameter that motion can be followed in, or several that are tied to one number.

    Raises
    ------
    ParameterError
        A parameter is unknown, shapes the equations or is tied by a factor that is no number; or parameters of
        different units are tied.
    """
    if not isinstance(parameter, Mapping):
        entry = _followed(caller, osc, parameter)
        return ParameterLine(entry, ((entry.path, 1.0),))
    tied = dict(parameter)
    if not tied:
        raise ParameterError(f"{caller}: parameter must be a name, or factors by name, got {shown(parameter)}.")
    entries = [_followed(caller, osc, name) for name in tied]
    for name, factor in tied.items():
        if not math.isfinite(real(factor)) or factor == 0:
            raise ParameterError(f"{caller}: the factor of {name} must be a finite number, not 0, got {shown(factor)}.")
    for entry in entries[1:]:
        if entry.declared.unit != entries[0].declared.unit:
            raise ParameterError(
                f"{caller}: {entry.path} ({entry.declared.unit or 'no unit'}) cannot be tied to {entries[0].path} "
                f"({entries[0].declared.unit or 'no unit'}); tie parameters of one unit."
            )
    paths = [entry.path for entry in entries]
    if len(set(paths)) < len(paths):
        raise ParameterError(f"{caller}: {', '.join(paths)} names a parameter twice; name each once.")
    return ParameterLine(entries[0], tuple(zip(paths, map(real, tied.values()), strict=True)))


def _followed(caller: str, osc: Oscillator, name: str) -> Entry:
    entry = osc.entry(name)
    if entry.declared.structural:
        raise ParameterError(
            f"{caller}: {entry.path} shapes the equations, so motion cannot be followed from value to value; "
            "find the structure at each value."
        )
    return entry


def ordered_values(caller: str, values: Any) -> NDArray[np.float64]:
    """Return values in ascending order; raises ParameterError unless they are finite and distinct."""
    listed = members(values)
    if not listed:
        raise ParameterError(f"{caller}: values must be a sequence of numbers, one or more, got {shown(values)}.")
    for value in listed:
        if not math.isfinite(real(value)):
            raise ParameterError(
                f"{caller}: values must be finite numbers, got {shown(value)}; give their unit by unit=, such as "
                "unit='Hz'."
            )
    numbers = np.sort([real(value) for value in listed])
    twice = numbers[:-1][np.diff(numbers) == 0]
    if twice.size:
        raise ParameterError(f"{caller}: values must be distinct, got {twice[0]:g} more than once.")
    return numbers
