"""Scene: checked parts that fit together."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from fractions import Fraction
from numbers import Real
from typing import Any, NamedTuple, Self

from vibrokit.errors import NoSectionError, ParameterError, SceneError, nearest, shown
from vibrokit.parts.barrier import Barrier
from vibrokit.parts.excitation.excitation import Excitation
from vibrokit.parts.noise.noise_model import NoiseModel
from vibrokit.parts.parameter import Parameter
from vibrokit.parts.spring.spring import Spring

_OWN = (
    Parameter("natural_frequency", "natural_frequency", "omega_n", "s^-1", above=0),
    Parameter("damping_ratio", "damping_ratio", "zeta", "", minimum=0),
)
_LONGEST_RATIO = 1000  # common periods are looked for among frequency ratios of whole numbers up to this


class Entry(NamedTuple):
    """One parameter of a scene: where it is, what was declared, its value."""

    path: str
    declared: Parameter
    value: Any


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scene:
    """The parts of one oscillator, x″ + 2ζω_n x′ + spring = stops + Σ excitations + noise.

    Parameters
    ----------
    natural_frequency : float
        ω_n (s⁻¹), positive. Sets the spring ω_n² x unless another is given, and with ζ the damping 2ζω_n.
    damping_ratio : float
        ζ, not negative.
    barriers : sequence of Barrier
        At most one on each side, the left one not to the right of the right one.
    excitations : sequence of Excitation
    noise : NoiseModel, optional
    spring : Spring, optional

    Raises
    ------
    ParameterError, SceneError
        A number out of range; parts that do not fit together.
    """

    natural_frequency: float
    damping_ratio: float
    barriers: tuple[Barrier, ...] = ()
    excitations: tuple[Excitation, ...] = ()
    noise: NoiseModel | None = None
    spring: Spring | None = None

    def __post_init__(self) -> None:
        for declared in _OWN:
            value = declared.checked("scene", getattr(self, declared.name))
            object.__setattr__(self, declared.name, value)
        object.__setattr__(self, "barriers", _checked_parts("barriers", self.barriers, Barrier))
        object.__setattr__(self, "excitations", _checked_parts("excitations", self.excitations, Excitation))
        if self.noise is not None:
            _checked_parts("noise", (self.noise,), NoiseModel)
        if self.spring is not None:
            _checked_parts("spring", (self.spring,), Spring)
        self._check_stops()
        self._check_periods()

    def _check_stops(self) -> None:
        for side in ("left", "right"):
            places = [barrier.position for barrier in self.barriers if barrier.side == side]
            if len(places) > 1:
                raise SceneError(
                    f"scene: {len(places)} stops on the {side} side, at {', '.join(f'{p:g}' for p in places)}; "
                    "give at most one on each side."
                )
        stops = {barrier.side: barrier.position for barrier in self.barriers}
        if len(stops) == 2 and stops["left"] > stops["right"]:
            raise SceneError(
                f"scene: the left stop, at {stops['left']:g}, is to the right of the right stop, at "
                f"{stops['right']:g}; the left one must not be beyond the right one (equal places are allowed)."
            )

    def _check_periods(self) -> None:
        for index, part in enumerate(self.excitations):
            period = part.period
            if period is not None and (isinstance(period, bool) or not isinstance(period, Real) or not period > 0):
                raise SceneError(
                    f"scene: excitations.{index}, a {type(part).__name__}, has the period {shown(period)}; give a "
                    "positive number, None for a constant force, or math.inf for one that never repeats."
                )

    def entries(self) -> tuple[Entry, ...]:
        """Every parameter with its path, in the order in which they travel to compiled code."""
        found = [Entry(declared.name, declared, getattr(self, declared.name)) for declared in _OWN]
        for prefix, part in self._placed_parts():
            values = part.parameters
            found += [Entry(f"{prefix}.{d.name}", d, values[d.name]) for d in part.declared()]
        return tuple(found)

    def _placed_parts(self) -> list[tuple[str, Any]]:
        placed: list[tuple[str, Any]] = [] if self.spring is None else [("spring", self.spring)]
        for index, barrier in enumerate(self.barriers):
            placed += [(f"barriers.{index}", barrier), (f"barriers.{index}.law", barrier.law)]
        placed += [(f"excitations.{index}", part) for index, part in enumerate(self.excitations)]
        return placed if self.noise is None else [*placed, ("noise", self.noise)]

    @property
    def parameters(self) -> dict[str, Any]:
        """Every parameter by its path, such as ``"excitations.0.frequency"``."""
        return {entry.path: entry.value for entry in self.entries()}

    def replace(self, changes: Mapping[str, Any]) -> Self:
        """Return a copy with the parameters at some paths changed.

        Raises
        ------
        ParameterError
            An unknown path, or a value out of its range.
        """
        known = self.parameters
        fields: dict[str, Any] = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        for path, value in changes.items():
            if path not in known:
                raise ParameterError(f"scene has no parameter {shown(path)}{nearest(path, known)}")
            head, *rest = path.split(".")
            fields[head] = _replaced(fields[head], rest, value)
        return type(self)(**fields)

    @property
    def period(self) -> float | None:
        """Common period of the excitations (s); None if none is periodic.

        Raises
        ------
        NoSectionError
            The periods have no common multiple.
        """
        periods = [part.period for part in self.excitations if part.period is not None]
        if not periods:
            return None
        longest = max(periods)
        if math.isinf(longest):
            raise NoSectionError(
                "scene: an excitation never repeats, so there is no section; give every excitation a finite period."
            )
        multiple = 1
        for period in periods:
            ratio = Fraction(longest / period).limit_denominator(_LONGEST_RATIO)
            if ratio > _LONGEST_RATIO or not math.isclose(float(ratio), longest / period, rel_tol=1e-12):
                raise NoSectionError(
                    f"scene: excitations of periods {longest:.10g} and {period:.10g} have no common period, so there "
                    f"is no section; make the ratio of their frequencies one of whole numbers up to {_LONGEST_RATIO}."
                )
            multiple = math.lcm(multiple, ratio.denominator)
        return longest * multiple

    @property
    def autonomous(self) -> bool:
        """True if no excitation depends on time."""
        return all(part.period is None for part in self.excitations)

    @property
    def section_interval(self) -> float:
        """Time from section to section (s): the common period, or 2π/ω_n for an autonomous scene."""
        return self.period or 2 * math.pi / self.natural_frequency

    @property
    def time_unit(self) -> float:
        """Time that steps and samples are counted in (s): the section interval, or 2π/ω_n without a section."""
        try:
            return self.section_interval
        except NoSectionError:
            return 2 * math.pi / self.natural_frequency

    def repeats_after(self, interval: float) -> bool:
        """Whether the excitations are the same again after `interval` (s), so that trajectories share the phase."""
        if self.autonomous:
            return True
        try:
            multiple = interval / self.section_interval
        except NoSectionError:
            return False
        return round(multiple) >= 1 and abs(multiple - round(multiple)) < 1e-12 * multiple


def _checked_parts(name: str, parts: Any, kind: type) -> tuple[Any, ...]:
    if isinstance(parts, kind):
        raise SceneError(f"scene: {name} is a single {type(parts).__name__}; give a sequence of them, even of one.")
    if not isinstance(parts, Iterable):
        raise SceneError(f"scene: {name} is {shown(parts)}; give a sequence of {kind.__name__}s, empty for none.")
    found = tuple(parts)
    for part in found:
        if not isinstance(part, kind):
            raise SceneError(f"scene: {name} has {shown(part)}, which is no {kind.__name__}; give one.")
    return found


def _replaced(owner: Any, path: list[str], value: Any) -> Any:
    if not path:
        return value
    head, *rest = path
    if isinstance(owner, tuple):
        index = int(head)
        return (*owner[:index], _replaced(owner[index], rest, value), *owner[index + 1 :])
    if rest:
        return owner.replace(**{head: _replaced(getattr(owner, head), rest, value)})
    return owner.replace(**{head: value})
