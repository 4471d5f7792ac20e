"""LeastAction: certified exit paths, from two searches and a polish."""

from __future__ import annotations

import dataclasses
import time
from typing import Any

import xarray

from vibrokit.analyzers.action_graph import ActionGraph, arrays_of
from vibrokit.analyzers.action_plot import ActionPlot
from vibrokit.analyzers.agreement import agreed, energies_of, least_of
from vibrokit.analyzers.analyzer import Analyzer, checked_sources, each_searched, part_of, plain_settings
from vibrokit.analyzers.exits import Exit, LeaveBasin
from vibrokit.analyzers.polishing.branches import polish_all
from vibrokit.analyzers.screening.screen import Screen
from vibrokit.errors import SceneError, StructureError, shown
from vibrokit.kernels.choice import single_stepper
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.section import Section
from vibrokit.results.structure import Structure
from vibrokit.results.transitions import Transitions
from vibrokit.results.versions import versions
from vibrokit.scene_file import scene_data
from vibrokit.structure.attractors.orbits_inside import orbits_inside
from vibrokit.structure.orbits import Orbit
from vibrokit.structure.request import whole
from vibrokit.symbolic.flow_kind import Flow

_STAGES = 3
_MOST_ORBITS = 1000
_ALIKE = 1e-5  # relative difference of the actions of paths that differ by where in a set they begin


@dataclasses.dataclass(frozen=True)
class LeastAction(Analyzer):
    """Activation energies with a certificate: two searches for ways out, then Newton's method on each.

    A graph over the whole section and an action plot over the whole fundamental domain of each attractor propose ways
    out. Each is polished to the extremal that leaves the attractor and ends on a saddle of its boundary, by multiple
    shooting on Hamilton's equations and their variational equations. The least action is the energy, and all others are
    listed. The certificate says how well a path solves its equations; that no cheaper one exists is what the graph,
    which has an error of its own, speaks for.

    From an attractor that is no orbit, the graph bounds the energy from below, and paths from unstable orbits inside it
    bound it from above.

    Parameters
    ----------
    plot : ActionPlot, optional
        A search; its own `exit` and `source` are not looked at. None to do without.
    graph : ActionGraph, optional
        The other, likewise.
    orbits : int
        Unstable orbits inside a chaotic attractor that paths are polished from.
    source : int, optional
        Label of the attractor to leave; by default each in turn.
    exit : Exit
        What counts as leaving.
    stepper : Stepper, optional
        For the polish; by default one that locates contacts.
    """

    plot: ActionPlot | None = dataclasses.field(default_factory=ActionPlot)
    graph: ActionGraph | None = dataclasses.field(default_factory=ActionGraph)
    orbits: int = 4
    source: int | None = None
    exit: Exit = dataclasses.field(default_factory=LeaveBasin)
    stepper: Stepper | None = None

    def __post_init__(self) -> None:
        _one_of("plot", self.plot, ActionPlot)
        _one_of("graph", self.graph, ActionGraph)
        if self.plot is None and self.graph is None:
            raise StructureError(
                "LeastAction: plot and graph are both None, and one at least has to look for ways out."
            )
        whole("LeastAction: orbits", self.orbits, 0, _MOST_ORBITS)

    def run(self, osc: Oscillator, structure: Structure, *, progress: Progress | None = None) -> LeastActionResult:
        """Find and certify the exits of each attractor.

        Returns
        -------
        LeastActionResult

        Raises
        ------
        SceneError
            The scene has no noise.
        StructureError
            The exit cannot be asked for in this scene, or the source is unknown.
        """
        sources = checked_sources(osc, structure, self.exit, self.source, self.stepper, progress)
        began = time.perf_counter()
        data = Section.of(structure).data
        energies: list[ActivationEnergy] = []
        branches: list[ActivationEnergy] = []
        words: list[str] = []

        def leave(attractor: Attractor, part: Progress | None) -> _Left:
            return self._leave(osc, structure, attractor, part)

        for attractor, left in each_searched(sources, leave, words, progress):
            agreement, said = agreed(attractor, least_of(left.branches), left.screened)
            energies += agreement
            branches += left.branches
            data = data if left.data is None else data.merge(left.data)
            words += [*left.words, *_summary(attractor, left), *said]
        labels = [attractor.label for attractor in structure.attractors]
        all_left = self.source is None and all(energy.target >= 0 for energy in energies)
        return LeastActionResult(
            energies=tuple(energies),
            data=data,
            scene=scene_data(osc),
            settings=plain_settings(self),
            status="\n".join(words),
            seconds=time.perf_counter() - began,
            versions=versions(),
            branches=tuple(branches),
            transitions=Transitions.of(labels, energies) if all_left else None,
        )

    def _leave(self, osc: Oscillator, structure: Structure, attractor: Attractor, progress: Progress | None) -> _Left:
        label = attractor.label
        if attractor.is_fixed and self.exit.beyond(osc, attractor.orbit).any():
            polished = polish_all(osc, structure, label, (), self.exit, self.stepper)
            return _Left(polished.branches, polished.words)
        words: list[str] = []
        screened = self._screened(osc, structure, label, words, part_of(progress, 0, _STAGES))
        candidates = [] if screened is None else list(screened.candidates)
        if self.plot is not None and attractor.is_fixed:
            plot = dataclasses.replace(self.plot, exit=self.exit, source=None)
            try:
                candidates += plot.search(osc, structure, label, part_of(progress, 1, _STAGES)).candidates
            except StructureError as error:
                if screened is None:
                    raise
                words.append(f"Attractor {label}, without an action plot: {error}")
        orbits = (None,) if attractor.is_fixed else self._orbits_inside(osc, attractor, words)
        last = part_of(progress, 2, _STAGES)
        branches: list[ActivationEnergy] = []
        for number, orbit in enumerate(orbits):
            part = part_of(last, number, len(orbits))
            polished = polish_all(osc, structure, label, candidates, self.exit, self.stepper, part, orbit=orbit)
            branches += polished.branches
            words += polished.words
        branches = branches if attractor.is_fixed else _once(branches)
        if screened is None:
            return _Left(tuple(branches), tuple(dict.fromkeys(words)))
        return _Left(tuple(branches), tuple(dict.fromkeys(words)), energies_of(screened), arrays_of(screened))

    def _screened(
        self, osc: Oscillator, structure: Structure, label: int, words: list[str], progress: Progress | None
    ) -> Screen | None:
        """What the graph finds; None, and why, where it cannot be used."""
        if self.graph is None:
            return None
        graph = dataclasses.replace(self.graph, exit=self.exit, source=None)
        try:
            found = graph.search(osc, structure, label, progress)
        except (SceneError, StructureError) as error:
            if self.plot is None:
                raise
            words.append(f"Attractor {label}, without a graph: {error}")
            return None
        words += found.words
        return found

    def _orbits_inside(self, osc: Oscillator, attractor: Attractor, words: list[str]) -> tuple[Orbit, ...]:
        if attractor.kind != "chaotic":
            words.append(f"Attractor {attractor.label} is {attractor.kind}: its energies are the graph's alone.")
            return ()
        stepper = self.stepper or single_stepper(osc, Flow.STATE_VARIATIONAL)
        found = orbits_inside(osc, attractor, stepper, self.orbits)
        periods = ", ".join(str(orbit.period) for orbit in found)
        words.append(
            f"Attractor {attractor.label} is chaotic: paths were polished from {len(found)} unstable orbits inside it"
            + (f", of periods {periods}." if found else ".")
        )
        return found


@dataclasses.dataclass(frozen=True, eq=False)
class _Left:
    """All that was found of the exits of one attractor."""

    branches: tuple[ActivationEnergy, ...]
    words: tuple[str, ...]
    screened: dict[int, ActivationEnergy] = dataclasses.field(default_factory=dict)
    data: xarray.Dataset | None = None


def _one_of(name: str, value: Any, kind: type) -> None:
    if value is not None and not isinstance(value, kind):
        raise StructureError(f"LeastAction: {name} is {shown(value)}; give {kind.__name__}(), or None to do without.")


def _once(branches: list[ActivationEnergy]) -> list[ActivationEnergy]:
    """The branches, cheapest first; of those that differ by the orbit they begin on only, the cheapest."""
    kept: list[ActivationEnergy] = []
    for branch in sorted(branches, key=lambda branch: branch.value):
        if not any(
            (branch.target, branch.saddle) == (other.target, other.saddle)
            and branch.value <= (1 + _ALIKE) * other.value
            for other in kept
        ):
            kept.append(branch)
    return kept


def _summary(attractor: Attractor, left: _Left) -> list[str]:
    """How many ways out there are, and what the least costs."""
    if not left.branches:
        return [] if left.screened else [f"Attractor {attractor.label}: no way out was found."]
    best, count = left.branches[0], len(left.branches)
    ways = f"{count} ways out were polished, the least of" if count > 1 else "one way out was polished, of"
    return [f"Attractor {attractor.label}: {ways} action {best.value:.6g}, residual {best.residual:.1e}."]
