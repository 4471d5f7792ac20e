"""Order8 and FreeFlight: motion from contact to contact, each of which is located."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Self

from vibrokit.errors import StepperError
from vibrokit.kernels.attempts import AttemptWriter
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.time_scales import changes_of
from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText

FINEST, COARSEST = 1e-15, 1e-2
MOST_STEPS = 200_000.0
"""In one interval; motion that needs more is given up."""
_IN_PULSE = 3.0  # a step of so many pulses has a stage in each: no two of its nodes are farther apart than 0.27
_SMALL = 1e-12  # of the displacement by a force, to be at rest
# What jumps when a stop is touched or left, or where its law changes its sign: nothing, the derivatives M and the
# covariance, momenta, momenta and their derivatives; or derivatives of momenta diverge at a touch, and motion ends.
NOTHING, LINEARIZED, MOMENTA, EXTREMALS, DIVERGING = 0.0, 1.0, 2.0, 3.0, 4.0
_JUMPING: Mapping[Flow, float] = {
    Flow.STATE_VARIATIONAL: LINEARIZED,
    Flow.LINEARISED: LINEARIZED,
    Flow.COVARIANCE_REVERSED: LINEARIZED,
    Flow.HAMILTONIAN: MOMENTA,
    Flow.HAMILTONIAN_VARIATIONAL: EXTREMALS,
}
_CONTACT = ("crossing", "landing", "contact")


@dataclasses.dataclass(frozen=True)
class LocatedStepper(Stepper):
    """A stepper that locates every contact. Abstract.

    Parameters
    ----------
    tolerance : float
        Largest error of one step, relative to the size of what is integrated.
    """

    tolerance: float = 1e-10

    def __post_init__(self) -> None:
        number = self.tolerance
        if isinstance(number, bool) or not isinstance(number, int | float) or not FINEST <= number <= COARSEST:
            raise StepperError(
                f"{type(self).__name__}: tolerance must be a number from {FINEST:g} to {COARSEST:g}, got {number!r}."
            )

    def settings(self, scene: Scene, interval: float, samples: int = 0) -> tuple[float, ...]:
        """Tolerance, most steps in an interval, intervals until the forcing repeats (0: never), 1/ω_n.

        Then the time over which motion goes on, 0 where each interval begins anew, the longest step (s), and the least
        size by which the error of x is measured (m).
        """
        cycle, changes = 0 if samples else scene.intervals_in_period(interval), changes_of(scene)
        lapse, unit = interval * samples, 1.0 / scene.reference_frequency
        longest, floor = _IN_PULSE * changes.pulse, _SMALL * changes.size * unit**2
        return float(self.tolerance), MOST_STEPS, float(cycle), unit, lapse, longest, floor

    def scene_part(self, text: SceneText) -> list[str]:
        """The right-hand side with switched stops, the stops, and the slopes of all lanes.

        Where the slope of a force is infinite, derivatives of the momenta need its second derivative, whose integral
        over time diverges. They end at the touch of such a stop; at such a spring a StepperError is raised.
        """
        if text.flow is Flow.HAMILTONIAN_VARIATIONAL and text.rough:
            raise StepperError(
                f"{type(self).__name__} cannot follow extremal paths and their derivatives across a place where the "
                "slope of the force of a spring is infinite, as that of sqrt(abs(x)) at 0; use SGCM or MFET, which "
                "need no such paths, or a force that is smooth there, as (x**2 + w**2)**(1/4) with a small w."
            )
        writer = AttemptWriter(text)
        jumping = DIVERGING if text.diverges else _JUMPING[text.flow] if text.breaks else NOTHING
        crossing = f"CROSSING = {(jumping, *text.places)!r}\n"
        constants = [text.constants, text.walls, writer.facts(), crossing]
        return [*constants, text.forcing, text.rhs, text.stops, *writer.slopes()]

    def driver_part(self, text: SceneText) -> list[str]:
        """Where the numbers of the lanes are."""
        sizes = f"STATES = {text.states}\nSTOPS = {text.barriers > 0}\n"
        return [sizes, AttemptWriter(text).offsets(), self.series(text)]

    def series(self, text: SceneText) -> str:
        """Constants of the series of the flight, which has no terms where the flight is stepped."""
        return "TERMS = 0\n"

    def refined(self) -> Self:
        """A hundredth of the tolerance."""
        return dataclasses.replace(self, tolerance=max(FINEST, self.tolerance / 100))

    def coarsened(self) -> Self:
        """A hundred times the tolerance."""
        return dataclasses.replace(self, tolerance=min(COARSEST, self.tolerance * 100))


@dataclasses.dataclass(frozen=True)
class Order8(LocatedStepper):
    """Dormand–Prince 8(5,3) with adaptive steps, trajectories packed in vector lanes; contacts are located.

    Order 8 for linear and Hertz stops and every law that is smooth in the depth or in its second or fourth root, whose
    contact is stepped in that root of time and depth; other laws lose order at first touch, and the error control takes
    shorter steps. The lanes of a block attempt their steps together, each of its own length and along its own course.
    Choose it for orbits, certificates and accurate ensembles of any scene, and for stiff stops; choose `FreeFlight` for
    the same with a linear spring at tolerances below 1e-11, `RK4` for large ensembles at moderate accuracy.

    Parameters
    ----------
    tolerance : float
        Largest error of one step, relative to the size of what is integrated.
    """

    name: ClassVar[str] = "order8"
    templates: ClassVar[tuple[str, ...]] = ("steps", *_CONTACT, "order8", "attempts", "sections")


@dataclasses.dataclass(frozen=True)
class FreeFlight(LocatedStepper):
    """Exact flight between the stops, for linear springs and sinusoidal forces.

    The flight is its Taylor series to rounding error, at any damping and at resonance; the first touch is found by
    bounds that cannot miss one. Contacts are stepped as `Order8` does, to the same order. Choose it for orbits,
    certificates, grazing, stiff stops and long flights; a scene with a nonlinear spring is refused.

    Parameters
    ----------
    tolerance : float
        Largest error of one step in contact, relative to the size of what is integrated.
    """

    name: ClassVar[str] = "free_flight"
    templates: ClassVar[tuple[str, ...]] = ("steps", *_CONTACT, "free_flight", "attempts", "sections")

    def scene_part(self, text: SceneText) -> list[str]:
        """That of a located stepper, and the series of the flight."""
        return [text.flight_sizes, *super().scene_part(text), text.flight]

    def series(self, text: SceneText) -> str:
        """The order of the series, and its number of terms."""
        return text.flight_sizes
