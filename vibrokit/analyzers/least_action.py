"""LeastAction: certified exit paths, from a search and a polish."""

from __future__ import annotations

import dataclasses
import time

from vibrokit.analyzers.action_plot import ActionPlot
from vibrokit.analyzers.analyzer import Analyzer, checked_sources, part_of, plain_settings
from vibrokit.analyzers.exits import Exit, LeaveBasin
from vibrokit.analyzers.polishing.branches import Polished, polish_all
from vibrokit.errors import StructureError
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

_NONE = Polished((), ())


@dataclasses.dataclass(frozen=True)
class LeastAction(Analyzer):
    """Activation energies with a certificate: a search for ways out, then Newton's method on each.

    An action plot over the whole fundamental domain of each attractor proposes ways out. Each is polished to the
    extremal that leaves the attractor and ends on a saddle of its boundary, by multiple shooting on Hamilton's
    equations and their variational equations. The least action is the energy, and all others are listed. The
    certificate says how well a path solves its equations; that no cheaper one exists rests on the search.

    Parameters
    ----------
    plot : ActionPlot
        The search; its own `exit` and `source` are not looked at.
    source : int, optional
        Label of the attractor to leave; by default each in turn.
    exit : Exit
        What counts as leaving.
    stepper : Stepper, optional
        For the polish; by default one that locates contacts.
    """

    plot: ActionPlot = dataclasses.field(default_factory=ActionPlot)
    source: int | None = None
    exit: Exit = dataclasses.field(default_factory=LeaveBasin)
    stepper: Stepper | None = None

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
        found, words = [], []
        for number, attractor in enumerate(sources):
            try:
                polished = self._leave(osc, structure, attractor, part_of(progress, number, len(sources)))
            except StructureError as error:
                polished = _NONE
                words.append(f"Attractor {attractor.label} was left out: {error}")
            found.append(polished)
            words += [*polished.words, *_summary(attractor, polished)]
        energies = tuple(energy for polished in found for energy in _cheapest(polished))
        labels = [attractor.label for attractor in structure.attractors]
        all_left = self.source is None and all(energy.target >= 0 for energy in energies)
        return LeastActionResult(
            energies=energies,
            data=Section.of(structure).data,
            scene=scene_data(osc),
            settings=plain_settings(self),
            status=" ".join(words),
            seconds=time.perf_counter() - began,
            versions=versions(),
            branches=tuple(branch for polished in found for branch in polished.branches),
            transitions=Transitions.of(labels, energies) if all_left else None,
        )

    def _leave(
        self, osc: Oscillator, structure: Structure, attractor: Attractor, progress: Progress | None
    ) -> Polished:
        label = attractor.label
        if attractor.kind in ("periodic", "equilibrium") and self.exit.beyond(osc, attractor.orbit).any():
            return polish_all(osc, structure, label, (), self.exit, self.stepper)
        plot = dataclasses.replace(self.plot, exit=self.exit, source=None)
        search = plot.search(osc, structure, label, part_of(progress, 0, 2))
        polish = part_of(progress, 1, 2)
        return polish_all(osc, structure, label, search.candidates, self.exit, self.stepper, polish)


def _cheapest(polished: Polished) -> tuple[ActivationEnergy, ...]:
    """The least action to each target; branches come the cheapest first."""
    targets = dict.fromkeys(branch.target for branch in polished.branches)
    return tuple(next(b for b in polished.branches if b.target == target) for target in targets)


def _summary(attractor: Attractor, polished: Polished) -> list[str]:
    """How many ways out there are, and what the least costs."""
    if not polished.branches:
        return []
    best, count = polished.branches[0], len(polished.branches)
    ways = f"{count} ways out were polished, the least of" if count > 1 else "one way out was polished, of"
    return [f"Attractor {attractor.label}: {ways} action {best.value:.6g}, residual {best.residual:.1e}."]
