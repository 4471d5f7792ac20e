"""LeastAction: certified exit paths, from two searches and polishing."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar, Self

from vibrokit.analyzers.analyzer import Analysis, Analyzer, at_exit
from vibrokit.analyzers.graph.search import GraphSearch
from vibrokit.analyzers.graph.solution import GraphSolution
from vibrokit.analyzers.mirrored import mirrored
from vibrokit.analyzers.paths.mirror import Mirror
from vibrokit.analyzers.polishing.certified import METHOD
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.road import ExitRoad
from vibrokit.analyzers.shooting.shooting import Shooting
from vibrokit.analyzers.sources import (
    ClosestApproach,
    Graph,
    MirrorImages,
    Relaxations,
    RelaxationsWithoutMemory,
    Shots,
    Source,
)
from vibrokit.arguments import whole
from vibrokit.errors import StructureError, shown
from vibrokit.results.energy import Bound
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.result import Result
from vibrokit.structure.validation import share

_MOST_ORBITS = 1000


class LeastAction(Analyzer):
    """Activation energies with a certificate: two searches for exit paths, then Newton's method on each candidate.

    A graph search over the whole section and shooting from the whole fundamental domain of each attractor propose exit
    paths. Each is polished to the extremal path that leaves the attractor and ends on a saddle of its basin boundary,
    or on a face of the region that is left, by multiple shooting on Hamilton's equations and their variational
    equations. The least action is the energy; all others are listed in the result's `branches`. The certificate shows
    how well a path solves its equations. The graph search tests, within its error estimate, whether a cheaper path
    exists, and the lower bound of the energy rests on it, or, exactly, on detailed balance.

    Without forcing, the motion from each end back to an equilibrium, run backwards, is the first candidate; where
    detailed balance holds, it is the path of least action, and nothing else is searched. Otherwise, the graph is solved
    on a quarter of its nodes along each side, and shooting follows. Then the graph is solved on twice as many, and on
    all, until it agrees with the paths within the `accuracy`. Last, it is solved around the beginning of the cheapest
    path, where paths compete that differ by about 0.1 %. Paths are certified after each search. If the work is stopped
    in between, they are returned with the bounds that are known.

    In a scene with odd forces, an attractor may be the mirror image of one that was analyzed before. Then the mirror
    images of its paths are polished, with the same bounds, and nothing is searched.

    A path that passes saddles and other attractors on its way is polished in legs, from each of these orbits to the
    next.

    For a chaotic attractor, and for a chaotic set on its basin boundary, the graph bounds the energy from below, and
    paths from or to unstable orbits inside it bound it from above. Where the graph gives no path from a chaotic
    attractor, candidates follow the attractor until it is closest to a saddle and then go to that saddle.

    Parameters
    ----------
    shooting : Shooting, optional
        One of the searches; None to do without.
    graph : GraphSearch, optional
        The other one; None to do without.
    accuracy : float
        The graph is refined, up to its `nodes`, until its error is at most this fraction of each energy, except
        energies of exits that pass through other basins or that even the finest grid cannot resolve. The energies are
        far more accurate; this limits the gap from an energy to its lower bound.
    orbits : int
        Number of unstable orbits inside a chaotic attractor that paths are polished from.
    source : int or str, optional
        Label or name of the attractor to leave; by default each in turn.
    exit : Exit
        What counts as leaving.
    stepper : Stepper, optional
        By default each search chooses its own, and polishing one that locates contacts.
    """

    result: ClassVar[type[Result]] = LeastActionResult

    shooting: Shooting | None = dataclasses.field(default_factory=Shooting)
    graph: GraphSearch | None = dataclasses.field(default_factory=GraphSearch)
    accuracy: float = 0.1
    orbits: int = 4

    def __post_init__(self) -> None:
        _check_part("shooting", self.shooting, Shooting)
        _check_part("graph", self.graph, GraphSearch)
        if self.shooting is None and self.graph is None:
            raise StructureError("LeastAction: shooting and graph are both None; at least one must search for paths.")
        share("LeastAction: accuracy", self.accuracy)
        whole("LeastAction: orbits", self.orbits, 0, _MOST_ORBITS)

    def for_accuracy(self, accuracy: float) -> Self:
        """Return it with this accuracy."""
        return dataclasses.replace(self, accuracy=accuracy)

    def analyze(self, problem: ExitProblem) -> Analysis:
        """Find and certify the exit paths of one attractor.

        If the work is stopped, what was found before is returned, marked incomplete.

        Raises
        ------
        SceneError, StructureError, StepperError
            The only search cannot be used for this attractor.
        """
        return self._analyzing()(problem)

    def road(self, problem: ExitProblem) -> ExitRoad:
        """Return the road that it takes, before anything is done."""
        return ExitRoad(problem, self.sources(problem), accuracy=self.accuracy, orbits=self.orbits)

    def sources(self, problem: ExitProblem) -> list[Source]:
        """Return the sources of its road, in their order; a subclass may put more among them."""
        shoots = self.shooting is not None and problem.attractor.is_fixed
        graph = None if self.graph is None else Graph(self.graph, shots_follow=shoots)
        shots = None if self.shooting is None else Shots(self.shooting)
        sources = (Relaxations(), RelaxationsWithoutMemory(), graph, shots, MirrorImages(), ClosestApproach(graph))
        return [source for source in sources if source is not None]

    def _analyzing(self) -> Callable[[ExitProblem], Analysis]:
        """Return what analyzes attractors in turn; it searches only one of two that are mirror images."""
        searched: dict[int | None, tuple[Analysis, GraphSolution | None]] = {}

        def analyze(problem: ExitProblem) -> Analysis:
            problem.check_path_begins()
            if problem.at_exit:
                return at_exit(problem, METHOD, Bound.CERTIFIED)
            original = searched.get(Mirror(problem).image) if searched else None
            found = None if original is None else mirrored(problem, *original)
            if found is None:
                road = self.road(problem)
                found = road.run()
                searched[problem.source] = found, road.solution
            return found

        return analyze


def _check_part(name: str, value: Any, kind: type) -> None:
    if value is not None and (not isinstance(value, kind) or isinstance(value, Analyzer)):
        raise StructureError(
            f"LeastAction: {name} must be a {kind.__name__}, such as {kind.__name__}(), or None to do without, got "
            f"{shown(value)}."
        )
