"""Shooting: the search for exit paths among many extremal paths."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.boxes import Boxes
from vibrokit.analyzers.shooting.domain import fitted_domain
from vibrokit.analyzers.shooting.outcomes import Shooter, default_budget, growing_time
from vibrokit.analyzers.shooting.search import FINDER, Search
from vibrokit.analyzers.shooting.shots import Shots
from vibrokit.analyzers.shooting.starts import Ring, Starts
from vibrokit.arguments import real, whole
from vibrokit.construction import Constructed
from vibrokit.errors import StructureError, shown
from vibrokit.kernels.stepper import Stepper
from vibrokit.progress import TRAJECTORIES, stage
from vibrokit.results.stoppable import Stoppable
from vibrokit.symbolic.flow_kind import Flow

_MOST_PERIODS = 10**8
_MOST_POINTS = 10**7  # some GiB of starts and outcomes
_MOST_ROUNDS = 1000
# On weakly damped scenes a quarter of the starts led to the same paths without stops, and between stops to paths that
# cost up to a tenth more. All intervals take about 2.5 s on two processors.
_STARTS, _FEWEST_STARTS, _ALL_INTERVALS = 24_000, 1000, 5e6


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
            whole("points", self.points, 4, _MOST_POINTS)
        whole("rounds", self.rounds, 0, _MOST_ROUNDS)
        if self.budget is not None:
            whole("budget", self.budget, 1, _MOST_PERIODS)

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
            starts = self._starts(problem, stepper)
        slowest = float(np.abs(problem.attractor.multipliers).max())
        intervals = growing_time(slowest, problem.attractor.period, starts.growth)
        budget, points = self.budget or default_budget(intervals), self.points or _affordable(intervals)
        rounds = 0 if self.radius is not None else self.rounds
        with stage(FINDER, unit=TRAJECTORIES, total=None if rounds else points):
            shots = Shots.over(starts, Shooter(problem, stepper, budget), Boxes.grid(starts.grid(points)))
            with Stoppable(FINDER, problem.source) as refining:
                for refined in shots.refinements(rounds, self.tolerance):
                    shots = refined
            return Search.of(shots, refining)

    def _starts(self, problem: ExitProblem, stepper: Stepper) -> Starts:
        if self.radius is None:
            return fitted_domain(problem, stepper)
        return Ring.around(problem, stepper, self.radius)


def _affordable(intervals: float) -> int:
    """The default number of starts, of paths that take so many section intervals to grow."""
    return int(max(_FEWEST_STARTS, min(_STARTS, _ALL_INTERVALS / max(intervals, 1.0))))


def _check_positive(name: str, value: Any, alternative: str = "") -> None:
    if not 0 < real(value) < math.inf:
        raise StructureError(f"{name} must be a positive number{alternative}, got {shown(value)}.")
