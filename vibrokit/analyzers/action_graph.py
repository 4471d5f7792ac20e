"""ActionGraph: the quasi-potential on the whole section, as a shortest path in time and space."""

from __future__ import annotations

import dataclasses
import time
from numbers import Real

import numpy as np
import xarray

from vibrokit.analyzers.agreement import energies_of
from vibrokit.analyzers.analyzer import Analyzer, checked_sources, each_searched, plain_settings, stepper_for
from vibrokit.analyzers.exits import Exit, LeaveBasin
from vibrokit.analyzers.screening.screen import Screen, screen
from vibrokit.errors import SceneError, StructureError, shown
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.action_graph import ActionGraphResult
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.quasi_potential import QuasiPotential
from vibrokit.results.section import Section
from vibrokit.results.structure import Structure
from vibrokit.results.versions import versions
from vibrokit.scene_file import scene_data
from vibrokit.structure.request import pair, whole
from vibrokit.symbolic.flow_kind import Flow

_BYTES_KEPT = 116  # for each node of each phase: V, its bound, places come from and tried, b, Q, flags
_BYTES_PASSING = 700  # for each node of one phase, while its steps are integrated
_POORER = 1.9  # all grids together, in units of the finest
_MOST_FRACTION = 64
_FRACTIONS = (8, 16, 32, 64)


@dataclasses.dataclass(frozen=True)
class ActionGraph(Analyzer):
    """Least action from an attractor to everywhere, without a shot that could miss.

    The period is cut into steps, the section at each of these phases into nodes. To come to a node y from a state x one
    step before costs ½ eᵀ C⁻¹ e, where e is the miss of y by the motion from x and C the Gramian of the noise along it.
    The least sum of such costs from the attractor is the quasi-potential V. It is found as the shortest path over the
    phases by value iteration, in which x is any state, not a node: from node to node each step would pay for rounding,
    which at weak damping is dearer than the whole path. V between nodes is interpolated. Round the attractor V is the
    exact quadratic form.

    The error that is told is what halving the nodes along each side changed, and what the path of the graph costs less
    or more when it is brought down to a minimum of the action by Hamilton's equations: its steps are linearised, and a
    price over a whole period can be far off by that, over an eighth of it it is right to some 0.2 %.

    Parameters
    ----------
    cells : (int, int)
        Nodes in x and in v.
    fraction : int, optional
        Steps in a section interval; even. By default 8, doubled (to 64 at most) until linearising over a step
        changes no price by more than 1 %.
    source : int, optional
        Label of the attractor to leave; by default each in turn.
    exit : Exit
        What counts as leaving.
    stepper : Stepper, optional
    memory : float
        Most memory to take (GiB).
    """

    cells: tuple[int, int] = (360, 360)
    fraction: int | None = None
    source: int | None = None
    exit: Exit = dataclasses.field(default_factory=LeaveBasin)
    stepper: Stepper | None = None
    memory: float = 4.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", pair("ActionGraph: cells", self.cells))
        if min(self.cells) < 32:
            raise StructureError(f"ActionGraph: cells is {self.cells}; give 32 or more each way.")
        if self.fraction is not None:
            whole("ActionGraph: fraction", self.fraction, 2, _MOST_FRACTION)
        if self.fraction is not None and self.fraction % 2:
            raise StructureError(
                f"ActionGraph: fraction is {self.fraction}; give an even number, for the error is found by steps "
                "twice as long."
            )
        if isinstance(self.memory, bool) or not isinstance(self.memory, Real) or not self.memory > 0:
            raise StructureError(f"ActionGraph: memory is {shown(self.memory)}; give a positive number of GiB.")

    def run(self, osc: Oscillator, structure: Structure, *, progress: Progress | None = None) -> ActionGraphResult:
        """Find the potential of each attractor.

        Returns
        -------
        ActionGraphResult

        Raises
        ------
        SceneError
            The scene has no noise, or noise with states of its own.
        StructureError
            The exit cannot be asked for in this scene, the source is unknown, or the grid would take too much memory.
        """
        sources = checked_sources(osc, structure, self.exit, self.source, self.stepper, progress)
        began = time.perf_counter()
        data = Section.of(structure).data
        energies: list[ActivationEnergy] = []
        words: list[str] = []

        def search_one(attractor: Attractor, part: Progress | None) -> Screen:
            return self.search(osc, structure, attractor.label, part)

        for attractor, found in each_searched(sources, search_one, words, progress):
            energies += energies_of(found).values()
            data = data.merge(arrays_of(found))
            words += [f"Attractor {attractor.label}, by {found.stepper!r}: {_ways(found)}.", *found.words]
        return ActionGraphResult(
            energies=tuple(energies),
            data=data,
            scene=scene_data(osc),
            settings=plain_settings(self),
            status="\n".join(words),
            seconds=time.perf_counter() - began,
            versions=versions(),
        )

    def search(self, osc: Oscillator, structure: Structure, label: int, progress: Progress | None = None) -> Screen:
        """Search the ways out of one attractor; errors as of `run`."""
        if osc.noise is not None and osc.noise.extra_states:
            raise SceneError(
                f"the noise has {len(osc.noise.extra_states)} states of its own, and the graph covers x and v only; "
                "take ActionPlot."
            )
        attractor = structure.attractor(label)
        stepper = stepper_for(self.exit.scene(osc), attractor, Flow.GRAMIAN, self.stepper)
        return screen(
            osc, structure, attractor, self.exit, stepper, self.cells, self._fractions(osc), progress
        )  # fmt: skip

    def _fractions(self, osc: Oscillator) -> tuple[int, ...]:
        """Those to try, as many as there is memory for."""
        wanted = _FRACTIONS if self.fraction is None else (self.fraction,)
        allowed = tuple(fraction for fraction in wanted if self._memory(osc, fraction) <= self.memory)
        if not allowed:
            raise StructureError(
                f"a graph of {self.cells[0]} × {self.cells[1]} nodes at {wanted[0]} phases needs "
                f"{self._memory(osc, wanted[0]):.3g} GiB of memory, and {self.memory:.3g} GiB are allowed; take fewer "
                "cells, or allow more by memory."
            )
        return allowed

    def _memory(self, osc: Oscillator, fraction: int) -> float:
        """What a graph takes, in GiB."""
        phases = 1 if osc.autonomous else fraction
        return _POORER * self.cells[0] * self.cells[1] * (phases * _BYTES_KEPT + _BYTES_PASSING) / 2**30


def _ways(found: Screen) -> str:
    return ", ".join(f"{value:.4g} ± {error:.1g} to {target}" for target, (value, error) in found.targets.items())


def arrays_of(found: Screen) -> xarray.Dataset:
    """Return the potential on the section, the barriers and the cheapest path, by flat names."""
    label, potential = found.source, found.potential
    values = np.where(potential.values[0] < potential.unreached, potential.values[0], np.nan)
    data = QuasiPotential(label, values, potential.grids.boxes[0]).data
    barriers = [(index, *cost) for index, cost in found.barriers.items()]
    if barriers:
        data[f"barrier_{label}"] = ((f"barrier_saddle_{label}", "barrier_number"), np.array(barriers))
    if found.candidates:
        data[f"graph_path_{label}"] = ((f"graph_step_{label}", "state"), found.candidates[0].states)
    return data
