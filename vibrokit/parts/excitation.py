"""Excitations: forces that depend on time."""

from __future__ import annotations

import inspect
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

from vibrokit.errors import ArgumentError
from vibrokit.parts.functions import cos
from vibrokit.parts.parameter import parameter
from vibrokit.parts.part import Part

_TIME, _TIME_AND_STATE = ("t",), ("t", "x", "v")


class Excitation(Part):
    """Force per unit mass that depends on time, and may depend on the state. Abstract."""

    variables: ClassVar[tuple[str, ...]] = ("t",)
    """Names of the arguments of the force: those of the method of the class."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        given = tuple(inspect.signature(cls.force).parameters)[1:]
        if "force" in vars(cls) and given not in (_TIME, _TIME_AND_STATE):
            raise ArgumentError(
                f"{cls.__name__}.force has the arguments ({', '.join(given)}); an excitation has force(self, t), or "
                "force(self, t, x, v) if it depends on the state."
            )
        if "force" in vars(cls):
            cls.variables = given

    @property
    def depends_on_state(self) -> bool:
        """Whether the force depends on the displacement and the velocity of the mass, or moves the support."""
        return self.variables == _TIME_AND_STATE or self.moves_support

    @property
    def moves_support(self) -> bool:
        """Whether it moves the foot of spring and damper."""
        return type(self).support is not Excitation.support

    def support(self, t: Any) -> Any:
        """Displacement (m) of the foot of spring and damper at time `t` (s), as a SymPy expression; 0 if not given.

        Spring and damping of the scene act on x − y and v − y′, with the displacement y of all excitations together. It
        must be differentiable in time.
        """
        return 0

    def formulas(self, argument: Callable[[str], Any]) -> tuple[Any, ...]:
        """Return the force, and the displacement of the support if it moves."""
        moved = (self.support(argument("t")),) if self.moves_support else ()
        return *super().formulas(argument), *moved

    @abstractmethod
    def force(self, t: Any, *args: Any, **kwargs: Any) -> Any:
        """Force (m s⁻²) at time `t` (s), as a SymPy expression.

        Write ``force(self, t)``, or ``force(self, t, x, v)`` for a force that depends on the displacement `x` (m) and
        the velocity `v` (m s⁻¹) too, as under a stiffness that varies. In the state it must be smooth, and have values
        everywhere.

        In time it may jump, and have pulses as short as 1/30 000 of its period; one that never repeats is searched for
        pulses from t = 0 to 128 free oscillations.
        """

    @property
    @abstractmethod
    def period(self) -> float | None:
        """Period (s); None if the force is constant, `math.inf` if it varies without period."""

    @property
    def frequencies(self) -> tuple[float, ...] | None:
        """Angular frequencies (s⁻¹) of a force that is, at any state, sinusoids and a constant; None for any other."""
        return None


class Tone(Excitation, ABC):
    """Excitation of one frequency ω, which a subclass declares as `frequency`. Abstract."""

    if TYPE_CHECKING:
        frequency: float

    @property
    def period(self) -> float:
        """Period 2π/ω (s)."""
        return 2 * math.pi / self.frequency

    @property
    def frequencies(self) -> tuple[float, ...]:
        """The frequency ω (s⁻¹) alone."""
        return (self.frequency,)


class Harmonic(Tone):
    """Harmonic force: f cos(ω t + φ).

    Parameters
    ----------
    amplitude : float
        f, in m s⁻².
    frequency : float
        ω, in rad s⁻¹, positive.
    phase : float
        φ, in rad.
    """

    amplitude: float = parameter("f", "m s^-2")
    frequency: float = parameter("omega", "rad s^-1", above=0)
    phase: float = parameter("phi", "rad", default=0.0)

    def force(self, t: Any) -> Any:
        """Force at time t: f cos(ω t + φ)."""
        return self.amplitude * cos(self.frequency * t + self.phase)


class Constant(Excitation):
    """Constant force f.

    Parameters
    ----------
    force : float
        f, in m s⁻².
    """

    magnitude: float = parameter("f", "m s^-2", name="force")

    def __init__(self, force: float) -> None:
        object.__setattr__(self, "magnitude", force)
        self.__post_init__()

    def force(self, t: Any) -> Any:
        """Force at any time: f."""
        return self.magnitude

    @property
    def period(self) -> None:
        """None: a constant force has no period."""
        return None

    @property
    def frequencies(self) -> tuple[float, ...]:
        """No frequency."""
        return ()
