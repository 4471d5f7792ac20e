"""Shooting: the search for exit paths among many extremal paths."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.boxes import Boxes
from vibrokit.analyzers.shooting.outcomes import Shooter
from vibrokit.analyzers.shooting.search import FINDER, Search
from vibrokit.analyzers.shooting.shots import Shots
from vibrokit.analyzers.shooting.starts import Ring, Starts, fitted_domain
from vibrokit.arguments import real, whole
from vibrokit.construction import Constructed
from vibrokit.errors import StructureError, shown
from vibrokit.progress import TRAJECTORIES, stage
from vibrokit.results.attractor import Attractor
from vibrokit.results.stoppable import Stoppable
from vibrokit.symbolic.flow_kind import Flow


@dataclasses.dataclass(frozen=True, kw_only=True)
class Shooting(metaclass=Constructed):
    """Extremal paths from the whole unstable manifold of an attractor, and their actions at the exit.

    Extremals of least action leave an attractor along its unstable manifold in (q, p), which near the attractor is
    p = Σ⁻¹ δq. Each of them passes once between an ellipse Ψ = ½ δqᵀ Σ⁻¹ δq = const and its image after a period of the
    orbit, the fundamental domain. By default starts cover this domain in angle and radius. Hamilton's equations carry
    them until they leave. Rounds of refinement add starts where the action is small or jumps. The paths found bound the
    least action from above; a narrower exit path may be missed.

    With a `radius` the starts lie on the ring of Beri, Mannella, Luchinsky, Silchenko and McClintock (Phys. Rev. E 72,
    036131, 2005): a small circle at one phase, which meets the unstable manifold in a curve only.

    Parameters
    ----------
    radius : float, optional
        Radius of the ring (in m and m s⁻¹ alike); by default the whole fundamental domain is covered.
    points : int, optional
        Number of starts on the ring, or in the first grid over the domain; each round adds about a quarter of it. By
        default 24 000, or fewer, down to 1000, where damping is so weak that the paths would take more than 5 million
        periods in all.
    budget : int, optional
        Maximum number of periods that a path is followed; by default from the growth rate of deviations.
    rounds : int
        Maximum number of refinement rounds; the ring is not refined.
    tolerance : float
        Relative change of the least actions over three rounds (eight without forcing) that ends the refinement. The
        default is for paths that are polished afterwards. On the scenes of ``tests/benchmarks/gallery.py``,
        1e-4 leads to the same polished paths, and takes up to five times as long.
    """

    radius: float | None = None
    points: int | None = None
    budget: int | None = None
    rounds: int = 24
    tolerance: float = 0.01

    def __post_init__(self) -> None:
        if self.radius is not None:
            _check_positive("radius", self.radius, " or None (the whole domain)")
        _check_positive("tolerance", self.tolerance)
        if self.points is not None:
            whole("points", self.points, 4, 10**7)  # some GiB of starts and outcomes
        whole("rounds", self.rounds, 0, 1000)
        if self.budget is not None:
            whole("budget", self.budget, 1, 10**8)

    def search(self, problem: ExitProblem) -> Search:
        """Search the exit paths from one attractor.

        If the work is stopped during the refinement, the result holds what the finished rounds found.

        Raises
        ------
        StructureError
            The attractor is neither a periodic orbit nor an equilibrium, or is not hyperbolic.
        """
        if not problem.attractor.is_fixed:
            raise StructureError(
                f"it is {problem.attractor.kind}; the action plot needs a periodic orbit or an equilibrium. A graph "
                "search does not."
            )
        with stage("starts of exit paths", subject=problem.attractor.name):
            stepper = problem.ensemble_stepper(Flow.HAMILTONIAN)
            ring = None if self.radius is None else Ring.around(problem, stepper, self.radius)
            starts: Starts = ring or fitted_domain(problem, stepper)
        default_budget, default_points = default_effort(problem.attractor, starts.growth)
        budget, points = self.budget or default_budget, self.points or default_points
        rounds = 0 if ring else self.rounds
        with stage(FINDER, unit=TRAJECTORIES, total=None if rounds else points):
            shots = Shots.over(starts, Shooter(problem, stepper, budget), Boxes.grid(starts.grid(points)))
            with Stoppable(FINDER, problem.source) as refining:
                for refined in shots.refinements(rounds, self.tolerance):
                    shots = refined
            return Search.of(shots, refining)


def default_effort(attractor: Attractor, growth: float) -> tuple[int, int]:
    """Return the default budget and the default number of starts of paths that must grow by a factor to leave.

    Linear growth in the slowest direction takes a number of section intervals; the budget leaves ample time for more.
    5 million intervals in all take about 2.5 s on two processors. On weakly damped scenes a quarter of the starts led
    to the same paths without stops, and between stops to paths that cost up to a tenth more.
    """
    slowest = max(float(np.abs(attractor.multipliers).max()), 1e-12)
    intervals = -max(0.0, math.log(growth)) * attractor.period / math.log(slowest)
    return 100 + math.ceil(4.0 * intervals), int(max(1000, min(24_000, 5e6 / max(intervals, 1.0))))


def _check_positive(name: str, value: Any, alternative: str = "") -> None:
    if not 0 < real(value) < math.inf:
        raise StructureError(f"{name} must be a positive number{alternative}, got {shown(value)}.")
