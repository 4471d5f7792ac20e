"""Scene: the checked parts of one oscillator."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Any, Self

from vibrokit.construction import called
from vibrokit.errors import NoSectionError, ParameterError, SceneError, nearest, shown
from vibrokit.parts.barrier import Barrier
from vibrokit.parts.common_period import common_period
from vibrokit.parts.excitation import Excitation
from vibrokit.parts.friction import Friction
from vibrokit.parts.noise import NoiseModel
from vibrokit.parts.own_numbers import NUMBERS, OwnNumbers, displaced, refuse_two_meanings
from vibrokit.parts.parameter import Entry, Parameter
from vibrokit.parts.scene_checks import check_names, check_periods, check_stops, checked_parts
from vibrokit.parts.single_parts import FORCES_OF_STATE, SINGLE_PARTS
from vibrokit.parts.spring import Spring
from vibrokit.parts.time_scale import reference_frequency
from vibrokit.quantity import Quantity

_MASS = Parameter("mass", "mass", "m", "kg", above=0)
_MOST_INTERVALS = 4096  # in a period, over which the forcing is tabulated


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scene(OwnNumbers):
    """The parts of one oscillator, x″ + c x′ + spring + friction = stops + Σ excitations + noise, per unit mass.

    Parameters
    ----------
    natural_frequency : float, optional
        ω_n (s⁻¹), not negative. The spring is ω_n² x if no spring is given; with 0 there is none.
    damping_ratio : float, optional
        ζ, not negative: c = 2ζω_n. It has no meaning without ω_n. Give either this or `damping`.
    stiffness : float, optional
        κ (s⁻²) of the spring κ x, not negative, in place of ω_n = √κ.
    damping : float, optional
        c (s⁻¹), not negative.
    barriers : sequence of Barrier
        At most one per side; the left one is not to the right of the right one.
    excitations : sequence of Excitation
    noise : NoiseModel, optional
    spring : Spring, optional
    friction : Friction, optional
        Besides the damping.
    mass : float or str, optional
        In kg, or with a unit: ``"0.35 kg"``. Forces, stiffnesses, dampings and spectral densities of force that are
        given with units, such as ``"6 N"``, are divided by it, and numbers without a unit are not. Scenes that differ
        in nothing else are equal.

    Raises
    ------
    ParameterError, SceneError
        A number is out of range, or parts do not fit together.
    """

    barriers: tuple[Barrier, ...] = ()
    excitations: tuple[Excitation, ...] = ()
    noise: NoiseModel | None = None
    spring: Spring | None = None
    friction: Friction | None = None
    mass: float | None = dataclasses.field(default=None, compare=False)

    def __post_init__(self) -> None:
        self._check_numbers(self.spring)
        object.__setattr__(self, "barriers", checked_parts("barriers", self.barriers, Barrier))
        object.__setattr__(self, "excitations", checked_parts("excitations", self.excitations, Excitation))
        for name, part in self.single_parts.items():
            checked_parts(name, (part,), SINGLE_PARTS[name])
        if self.noise is not None:
            check_names(self.noise)
        self._divide_by_mass()
        check_stops(self.barriers)
        check_periods(self.excitations)

    def _divide_by_mass(self) -> None:
        """Divide what was given as a force by the mass; this is done nowhere else."""
        mass = None if self.mass is None else _MASS.checked("scene", self.mass)
        object.__setattr__(self, "mass", mass)
        for declared in NUMBERS:
            value = getattr(self, declared.name)
            if isinstance(value, Quantity):
                object.__setattr__(self, declared.name, declared.checked("scene", value.of_mass(mass)))
        for name, part in self.single_parts.items():
            object.__setattr__(self, name, part.of_mass(mass))
        for name in ("barriers", "excitations"):
            object.__setattr__(self, name, tuple(part.of_mass(mass) for part in getattr(self, name)))
        for path, quantity in self.quantities.items():
            if quantity.pending:
                raise SceneError(
                    f"scene: {path} is {quantity.text}, which needs the mass; give the scene a mass, such as "
                    "mass='0.35 kg', or the value per unit mass."
                )

    @property
    def quantities(self) -> dict[str, Quantity]:
        """What was given with a unit, by path."""
        own = {name: getattr(self, name) for name in (_MASS.name, *(declared.name for declared in NUMBERS))}
        found = {name: value for name, value in own.items() if isinstance(value, Quantity)}
        for path, part in self.placed_parts():
            found |= {f"{path}.{name}": value for name, value in part.quantities.items()}
        return found

    @property
    def single_parts(self) -> dict[str, Any]:
        """The parts of `SINGLE_PARTS` that are given, by field."""
        return {name: part for name in SINGLE_PARTS if (part := getattr(self, name)) is not None}

    @property
    def forces_of_state(self) -> dict[str, Spring | Friction]:
        """The spring and the friction, those that are given, by field."""
        return {name: part for name, part in self.single_parts.items() if name in FORCES_OF_STATE}

    @functools.cached_property
    def entries(self) -> tuple[Entry, ...]:
        """Every parameter with its path, in the order of the parameter array of compiled code."""
        found = self.given_numbers
        for prefix, part in self.placed_parts():
            values = part.parameters
            found += [Entry(f"{prefix}.{d.name}", d, values[d.name]) for d in part.declared()]
        return tuple(found)

    def placed_parts(self) -> list[tuple[str, Any]]:
        """Return the stops and all parts with their paths, in the order of `entries`."""
        placed: list[tuple[str, Any]] = [*self.forces_of_state.items()]
        for index, barrier in enumerate(self.barriers):
            placed += [(f"barriers.{index}", barrier), (f"barriers.{index}.law", barrier.law)]
        placed += [(f"excitations.{index}", part) for index, part in enumerate(self.excitations)]
        return placed if self.noise is None else [*placed, ("noise", self.noise)]

    @property
    def parameters(self) -> dict[str, Any]:
        """Every parameter by its path, such as ``"excitations.0.frequency"``."""
        return {entry.path: entry.value for entry in self.entries}

    @called
    def entry(self, path: str) -> Entry:
        """Return the parameter at a path.

        Parameters
        ----------
        path : str
            A key of `parameters`, or the end of exactly one key after a dot: ``"frequency"`` is short for
            ``"excitations.0.frequency"`` where there is one harmonic, and never for ``"natural_frequency"``.

        Raises
        ------
        ParameterError
            The path matches no parameter, or several.
        """
        entries = {entry.path: entry for entry in self.entries}
        name = path if isinstance(path, str) else ""
        found = [full for full in entries if full == name] or [full for full in entries if full.endswith(f".{name}")]
        if not found:
            raise ParameterError(f"scene has no parameter {shown(path)}{nearest(name, entries)}")
        if len(found) > 1:
            raise ParameterError(
                f"scene: {shown(path)} matches {len(found)} parameters, {', '.join(found)}; give one full path."
            )
        return entries[found[0]]

    @called
    def replace(self, changes: Mapping[str, Any] | None = None, /, **more: Any) -> Self:
        """Return a copy with some parameters or parts changed, checked like a new scene.

        `stiffness` takes the place of `natural_frequency`, and `damping` that of `damping_ratio`, and the reverse.

        Parameters
        ----------
        changes : mapping of str to value, optional
            By name of a field of the scene, or by path of a parameter as in `entry`.
        **more : value
            Further changes, by name of a field or by short path.

        Raises
        ------
        ParameterError, SceneError
            An unknown or ambiguous path, one parameter given twice, a value out of range, or parts that do not
            fit together.

        Examples
        --------
        >>> osc.replace(damping_ratio=0.02, noise=vk.WhiteNoise(intensity=1e-4))  # doctest: +SKIP
        >>> osc.replace({"noise.intensity": 1e-4}, frequency=0.58)  # doctest: +SKIP
        """
        fields = {field.name for field in dataclasses.fields(self)}
        if not isinstance(changes, Mapping | None):
            raise ParameterError(f"scene: changes must be a mapping from paths to values, got {shown(changes)}.")
        given = [*(changes or {}).items(), *more.items()]
        whole: dict[str, Any] = {key: value for key, value in given if key in fields}
        refuse_two_meanings(self, whole, self.parameters)
        taken: dict[str, Any] = dict.fromkeys(displaced(whole).values())
        scene = dataclasses.replace(self, **taken, **whole)
        paths = [key if key in fields else scene.entry(key).path for key, _ in given]
        changed: dict[str, Any] = {}
        for path, (_, value) in zip(paths, given, strict=True):
            if paths.count(path) > 1:
                raise ParameterError(f"scene: {path} is given {paths.count(path)} times; give it once.")
            head, *rest = path.split(".")
            if rest:
                changed[head] = _replaced(changed.get(head, getattr(scene, head)), rest, value)
        return dataclasses.replace(scene, **changed)

    @functools.cached_property
    def period(self) -> float | None:
        """Common period of the excitations (s); None without periodic excitation.

        Raises
        ------
        NoSectionError
            The periods have no common multiple.
        """
        periods = [part.period for part in self.excitations if part.period is not None]
        return common_period(periods) if periods else None

    @property
    def autonomous(self) -> bool:
        """True if no excitation depends on time."""
        return all(part.period is None for part in self.excitations)

    @functools.cached_property
    def reference_frequency(self) -> float:
        """What makes times and speeds comparable (s⁻¹): ω_n, or without it a frequency that the parts have."""
        return reference_frequency(self)

    @property
    def depends_on_state(self) -> bool:
        """Whether the force of an excitation depends on the state."""
        return any(part.depends_on_state for part in self.excitations)

    @property
    def section_interval(self) -> float:
        """Time between sections (s): the common period, or 2π/ω_n for an autonomous scene."""
        return self.period or 2 * math.pi / self.reference_frequency

    @property
    def time_unit(self) -> float:
        """Unit of time for counts of steps and samples (s): the section interval, or 2π/ω_n without a section."""
        try:
            return self.section_interval
        except NoSectionError:
            return 2 * math.pi / self.reference_frequency

    def intervals_in_period(self, interval: float) -> int:
        """Return after how many intervals (s) the excitations repeat, so that trajectories share the phase; 0 if never.

        That is 1 for multiples of the section interval, and n for an n-th of it, up to 4096.
        """
        if self.autonomous:
            return 1
        try:
            multiple = interval / self.section_interval
        except NoSectionError:
            return 0
        for ratio, intervals in ((multiple, 1), (1.0 / multiple, round(1.0 / multiple))):
            if round(ratio) >= 1 and abs(ratio - round(ratio)) < 1e-12 * ratio and intervals <= _MOST_INTERVALS:
                return intervals
        return 0


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
