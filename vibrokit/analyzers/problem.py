"""ExitProblem: one attractor to leave, what counts as leaving it, and what everything is integrated with."""

from __future__ import annotations

import dataclasses
from concurrent.futures import Executor
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.checkpoint import Checkpoint
from vibrokit.analyzers.escape import escapes
from vibrokit.analyzers.exits import Exit, beyond_faces
from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.construction import Constructed
from vibrokit.errors import StructureError
from vibrokit.kernels import choice
from vibrokit.kernels.ensemble import Stop
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import LEFT_BASIN, LEFT_REGION
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import ESCAPED
from vibrokit.results.structure import Structure
from vibrokit.structure.along_x import apart, wrapped
from vibrokit.structure.orbits import Orbit, refine_orbit
from vibrokit.symbolic.flow_kind import Flow

_REFINEMENTS = 5  # of an ensemble stepper, until it reproduces the attractor's orbit


@dataclasses.dataclass(frozen=True, eq=False)
class ExitProblem(metaclass=Constructed):
    """The question that an analyzer answers: how is this attractor left?

    Attributes
    ----------
    osc : Oscillator
    structure : Structure
    attractor : Attractor
        The one that is left.
    exit : Exit
    stepper : Stepper or None
        The one that the user asked for; None for the defaults.
    executor : Executor or None
        Where a method may do parts of its work; None for threads of this process.
    checkpoint : Checkpoint
        Where a method may keep what long work has reached.
    """

    osc: Oscillator
    structure: Structure
    attractor: Attractor
    exit: Exit
    stepper: Stepper | None = None
    executor: Executor | None = None
    checkpoint: Checkpoint = dataclasses.field(default_factory=lambda: Checkpoint(None, {}))

    @property
    def source(self) -> int:
        """Label of the attractor."""
        return self.attractor.label

    @cached_property
    def targets(self) -> tuple[Attractor, ...]:
        """The attractors that may be reached: none beyond a pole."""
        start, targets = float(self.attractor.points[0, 0]), self.exit.targets(self.structure, self.source)
        return tuple(target for target in targets if not apart(self.osc, start, float(target.points[0, 0])))

    @property
    def has_bystanders(self) -> bool:
        """Whether there are attractors that are neither left nor may be reached."""
        return len(self.targets) + 1 < len(self.structure.attractors)

    def check_basin(self) -> None:
        """Refuse an attractor that the grid puts into another basin; raises StructureError."""
        basins = self.structure.basins
        if not self.exit.by_position and basins.lost(self.attractor, self.source):
            cells = " × ".join(map(str, basins.labels.shape))
            raise StructureError(
                f"{self.attractor.name} lies in a cell of another basin on the grid of {cells} cells, so that leaving "
                "its basin cannot be told from staying; find the structure with more cells or on a smaller region."
            )

    def check_path_begins(self) -> None:
        """Refuse an attractor from which no path of least action is computed; raises StructureError."""
        if self.attractor.turns:
            raise StructureError(
                f"{self.attractor.name} turns over and over, and the least action to leave such motion is not "
                "computed; use MFET or SGCM, or choose another source."
            )

    def check_turns(self, method: str) -> None:
        """Refuse motion that turns over where copies of states are told apart; raises StructureError."""
        running = [one.name for one in (self.attractor, *self.targets) if one.turns]
        if running and not self.structure.circle and not self.exit.by_position:
            raise StructureError(
                f"{method}: {running[0]} turns over and over, and in a region wider than one turn x is a line, on "
                "which such motion is nowhere for long; find the structure without region=, or on one turn along x."
            )

    @cached_property
    def faces(self) -> NDArray[np.float64]:
        """Bounds of x and of v beyond which a state has left at any time, shape (2, 2); infinite if there are none."""
        return self.exit.faces(self.osc, self.structure, self.source)

    @cached_property
    def outlet(self) -> int | None:
        """The target of what leaves by position, −1 or −2 for escape; None if nothing does."""
        if self.exit.by_position:
            return -1
        return ESCAPED if escapes(self.structure) else None

    @property
    def turn(self) -> float:
        """Distance along x (m) after which states are the same, as on a circle; 0 if they are not."""
        return self.structure.shift if self.structure.circle and not self.exit.by_position else 0.0

    def on_turn(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return states (…, n), moved along x to the turn around the middle of the region where x is on a circle."""
        return wrapped(self.osc, states, float(np.mean(self.structure.region.x))) if self.turn else states

    @cached_property
    def scene(self) -> Oscillator:
        """The scene that paths move in until they leave."""
        return self.exit.scene(self.osc)

    @cached_property
    def stop(self) -> Stop:
        """The kernel's test."""
        return self.exit.stop(self.osc, self.structure, self.source)

    @property
    def exit_status(self) -> int:
        """Status, of `vibrokit.kernels.stopping`, of trajectories that have left."""
        return LEFT_REGION if self.exit.by_position else LEFT_BASIN

    @cached_property
    def path_ends(self) -> tuple[PathEnd, ...]:
        """Where a path of least action may end."""
        return self.exit.path_ends(self.osc, self.structure, self.source)

    @cached_property
    def ends_by_escape(self) -> bool:
        """Whether motion that leaves the region for good has made the exit."""
        return any(ESCAPED in end.targets for end in self.path_ends)

    @cached_property
    def checks(self) -> int:
        """Exit tests in a section interval."""
        return self.exit.checks_per_period(self.osc)

    @cached_property
    def at_exit(self) -> bool:
        """Whether the attractor already satisfies the exit condition, without noise."""
        return self.exit.holds_at(self.osc, self.attractor)

    def is_out(self, states: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which states have left, by position alone."""
        return self.exit.is_out(self.osc, states)

    def beyond(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far states have left, by position alone; see `Exit.beyond`."""
        return self.exit.beyond(self.osc, states) if self.exit.by_position else beyond_faces(self.faces, states)

    def orbit(self, stepper: Stepper) -> Orbit:
        """Return the attractor's orbit as a stepper gives it; raises StructureError if it gives none."""
        return refine_orbit(self.scene, self.attractor.points[0], self.attractor.period, stepper)

    def ensemble_stepper(self, flow: Flow) -> Stepper:
        """Return the stepper for many trajectories: the user's, or the default one, refined until it has the orbit.

        Steps across a contact that is short or nearly grazes can be too coarse for the orbit or for its stability.
        """
        if self.stepper is not None:
            return self.stepper
        chosen = tried = choice.ensemble_stepper(self.scene, flow)
        if not self.attractor.is_fixed:
            return chosen
        for _ in range(_REFINEMENTS):
            if self._has_orbit(tried):
                return tried
            tried = tried.refined()
        return chosen

    def single_stepper(self, flow: Flow) -> Stepper:
        """Return the stepper for single paths: the user's, or the default one."""
        return self.stepper or choice.single_stepper(self.scene, flow)

    def _has_orbit(self, stepper: Stepper) -> bool:
        try:
            orbit = self.orbit(stepper)
        except StructureError:
            return False
        return bool(np.abs(orbit.multipliers).max() < 1)
