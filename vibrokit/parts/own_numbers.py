"""The scene's own numbers: its frequency or stiffness, and its damping ratio or damping."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from typing import Any

from vibrokit.construction import Constructed
from vibrokit.errors import ParameterError, SceneError
from vibrokit.parts.parameter import Entry, Parameter

NUMBERS = (
    Parameter("natural_frequency", "natural_frequency", "omega_n", "rad s^-1", minimum=0),
    Parameter("stiffness", "stiffness", "kappa", "s^-2", minimum=0),
    Parameter("damping_ratio", "damping_ratio", "zeta", "", minimum=0),
    Parameter("damping", "damping", "c", "s^-1", minimum=0, mass_power=1),
)
"""In the order of the parameters of a scene, which has those that are given."""

_PAIRS = {
    ("natural_frequency", "stiffness"): "stiffness is the square of natural_frequency",
    ("damping_ratio", "damping"): "damping is 2 damping_ratio natural_frequency",
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class OwnNumbers(metaclass=Constructed):
    """Frequency or stiffness, and damping ratio or damping. Fields hold what is given, and None otherwise."""

    natural_frequency: float | None = None
    damping_ratio: float | None = None
    stiffness: float | None = None
    damping: float | None = None

    @property
    def given_numbers(self) -> list[Entry]:
        """The numbers that are given. A natural frequency of 0 shapes the equations: they have no spring."""
        found = []
        for declared in NUMBERS:
            value = getattr(self, declared.name)
            if value is not None and declared.name == "natural_frequency":
                declared = dataclasses.replace(declared, minimum=None, above=0) if value > 0 else _NO_SPRING
            if value is not None:
                found.append(Entry(declared.name, declared, value))
        return found

    @property
    def own_frequency(self) -> float:
        """ω_n (s⁻¹), as given or √κ; 0 where there is none."""
        return self.natural_frequency or math.sqrt(self.stiffness or 0.0)

    @property
    def linear_damping(self) -> float:
        """c (s⁻¹), as given or 2ζω_n."""
        return 2 * (self.damping_ratio or 0.0) * self.own_frequency if self.damping is None else self.damping

    def _check_numbers(self, spring: object | None) -> None:
        """Check each number by itself, and all with each other; `spring` is the part that replaces κ x."""
        for declared in NUMBERS:
            value = getattr(self, declared.name)
            if value is not None:
                object.__setattr__(self, declared.name, declared.checked("scene", value))
        for pair, relation in _PAIRS.items():
            _refuse_both(pair, [getattr(self, name) for name in pair], relation)
        if spring is None and self.natural_frequency is None and self.stiffness is None:
            raise SceneError(
                "scene: it has neither natural_frequency nor stiffness nor a spring; give one of them, or "
                "natural_frequency = 0 for a mass without a spring."
            )
        if spring is not None and self.stiffness is not None:
            raise SceneError(
                f"scene: stiffness = {self.stiffness:g} is given and a spring besides, {type(spring).__name__}, which "
                "takes the place of the linear one; give one of them."
            )
        if self.damping_ratio is None and self.damping is None:
            raise SceneError("scene: it has neither damping_ratio nor damping; give one of them, 0 for no damping.")
        if self.damping_ratio and not self.own_frequency:
            raise ParameterError(
                f"scene: damping_ratio is {self.damping_ratio:g}, but that is relative to a natural frequency, and "
                "the scene has none; give damping (s^-1) in its place."
            )


_NO_SPRING = dataclasses.replace(NUMBERS[0], structural=True)


def _refuse_both(pair: tuple[str, str], values: list[float | None], relation: str) -> None:
    if None not in values:
        given = " and ".join(f"{name} = {value:g}" for name, value in zip(pair, values, strict=True))
        raise SceneError(f"scene: {given} are both given, and {relation}; give one of them.")


def displaced(changes: Mapping[str, Any]) -> dict[str, str]:
    """Return by the name of each number that is changed the other one of its pair, unless that is changed too."""
    others = {name: other for pair in _PAIRS for name, other in (pair, pair[::-1])}
    return {name: other for name, other in others.items() if name in changes and other not in changes}


def refuse_two_meanings(scene: OwnNumbers, changes: Mapping[str, Any], paths: Iterable[str]) -> None:
    """Refuse a name that may be a number of the scene, not given so far, or be short for a parameter of a part."""
    for name, other in displaced(changes).items():
        parts = [path for path in paths if path.endswith(f".{name}")]
        if parts and getattr(scene, name) is None:
            raise ParameterError(
                f"scene: {name!r} may be that of the scene, in place of {other}, or {' or '.join(parts)}; give the "
                f"full path of the latter, or {other}=None besides for the former."
            )
