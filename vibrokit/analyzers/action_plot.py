"""ActionPlot: the cheapest of many extremal paths that leave an attractor."""

from __future__ import annotations

import dataclasses
import math
import time
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.analyzer import Analyzer, checked_sources, each_searched, plain_settings, stepper_for
from vibrokit.analyzers.exits import Exit, LeaveBasin
from vibrokit.analyzers.quasi_potential import local_potential, potential_along
from vibrokit.analyzers.shooting.branches import Branch, sampled
from vibrokit.analyzers.shooting.domain import FundamentalDomain, shells_of
from vibrokit.analyzers.shooting.level import fitted_domain
from vibrokit.analyzers.shooting.outcomes import Shooter, default_budget
from vibrokit.analyzers.shooting.search import Search, least_near, search
from vibrokit.analyzers.shooting.starts import Ring, Starts
from vibrokit.errors import StructureError, shown
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import LEFT_REGION
from vibrokit.oscillator import Oscillator
from vibrokit.results.action_plot import ActionPlotResult
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy, ExitPath
from vibrokit.results.section import Section
from vibrokit.results.structure import Structure
from vibrokit.results.versions import versions
from vibrokit.scene_file import scene_data
from vibrokit.structure.orbits import refine_orbit
from vibrokit.structure.request import whole
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 128  # of a path, in a section interval
_SHARES = 4
_MOST_PERIODS = 10**8
_MOST_POINTS = 10**7  # some GiB of starts and outcomes
_MOST_ROUNDS = 1000

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class ActionPlot(Analyzer):
    """Extremal paths from all over the unstable manifold of an attractor, and what they pay until they leave.

    Extremals of least action leave an attractor along its unstable manifold in (q, p), which near by is p = Σ⁻¹ δq.
    Each of them passes once between an ellipse Ψ = ½ δqᵀ Σ⁻¹ δq = const and its image after a period of the orbit, the
    fundamental domain. By default starts cover it, in angle and in radius, are carried by Hamilton's equations until
    they leave, and are then refined, round by round, where the action is small or jumps. It is a search: it finds
    paths, whose actions bound the least one from above, and may miss a narrower way out.

    With a `radius` it is the ring of Beri, Mannella, Luchinsky, Silchenko and McClintock (Phys. Rev. E 72, 036131,
    2005): points on one small circle at one phase, which meets the unstable manifold in a curve only.

    Parameters
    ----------
    radius : float, optional
        Of the ring (in m and m s⁻¹ alike); by default the whole fundamental domain is taken.
    points : int
        On the ring; in the first grid over the domain, each round adding about a quarter as many.
    source : int, optional
        Label of the attractor to leave; by default each in turn.
    exit : Exit
        What counts as leaving.
    stepper : Stepper, optional
    budget : int, optional
        Most periods to wait for an exit; by default by the growth of deviations from the attractor.
    rounds : int
        Of refinement, at most; not for the ring.
    tolerance : float
        Relative change of the least actions over three rounds (eight without forcing) that ends the refinement.
    """

    radius: float | None = None
    points: int = 24_000
    source: int | None = None
    exit: Exit = dataclasses.field(default_factory=LeaveBasin)
    stepper: Stepper | None = None
    budget: int | None = None
    rounds: int = 24
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        if self.radius is not None:
            _positive("radius", self.radius, "a positive, finite one, or None for the whole domain")
        _positive("tolerance", self.tolerance, "a positive, finite one")
        whole("ActionPlot: points", self.points, 4, _MOST_POINTS)
        whole("ActionPlot: rounds", self.rounds, 0, _MOST_ROUNDS)
        if self.budget is not None:
            whole("ActionPlot: budget", self.budget, 1, _MOST_PERIODS)

    def run(self, osc: Oscillator, structure: Structure, *, progress: Progress | None = None) -> ActionPlotResult:
        """Search the ways out of each attractor.

        Returns
        -------
        ActionPlotResult
            The cheapest way to each target, of each attractor. Bounds of an energy are estimates: above, what the last
            rounds of refinement (for the ring, a quarter of its points) and a finer integration change; below, the same
            from the look before the exit, for where between two looks the path left is not known. A cheaper way that
            was missed is beyond them.

        Raises
        ------
        SceneError
            The scene has no noise.
        StructureError
            The exit cannot be asked for, such as another basin where there is one attractor only; or the source is
            unknown.
        """
        sources = checked_sources(osc, structure, self.exit, self.source, self.stepper, progress)
        began = time.perf_counter()
        data = Section.of(structure).data
        energies: list[ActivationEnergy] = []
        words: list[str] = []

        def search_one(attractor: Attractor, part: Progress | None) -> Search:
            return self.search(osc, structure, attractor.label, part)

        for attractor, found in each_searched(sources, search_one, words, progress):
            data = data.assign(_start_data(attractor.label, found))
            words.append(f"Attractor {attractor.label}, by {found.shooter.stepper!r}: {found.summary()}")
            energies += [self._energy(attractor, found, branch) for branch in found.cheapest]
        return ActionPlotResult(
            energies=tuple(energies),
            data=data,
            scene=scene_data(osc),
            settings=plain_settings(self),
            status="\n".join(words),
            seconds=time.perf_counter() - began,
            versions=versions(),
        )

    def search(self, osc: Oscillator, structure: Structure, label: int, progress: Progress | None = None) -> Search:
        """Search the ways out of one attractor; its `candidates` are what a polisher starts from.

        Parameters
        ----------
        osc : Oscillator
        structure : Structure
        label : int
            Of the attractor.
        progress : callable, optional
            Called with (work done, work in all).

        Returns
        -------
        Search

        Raises
        ------
        StructureError
            The attractor is no periodic orbit or equilibrium, is not hyperbolic, or counts as out by itself.
        """
        attractor = structure.attractor(label)
        if not attractor.is_fixed:
            raise StructureError(
                f"it is {attractor.kind}; an action plot starts round a point of an orbit or an equilibrium."
            )
        if self.exit.beyond(osc, attractor.orbit).any():
            raise StructureError("it counts as out by itself, without noise: its energy is 0.")
        stepper = stepper_for(osc, attractor, Flow.HAMILTONIAN, self.stepper)
        starts, growth = self._starts(osc, structure, attractor, stepper)
        slowest = float(np.abs(attractor.multipliers).max())
        budget = self.budget or default_budget(slowest, attractor.period, growth)
        shooter = Shooter(osc, structure, label, self.exit, stepper, budget)
        rounds = self.rounds if self.radius is None else 0
        return search(starts, shooter, self.points, rounds, self.tolerance, progress)

    def _starts(
        self, osc: Oscillator, structure: Structure, attractor: Attractor, stepper: Stepper
    ) -> tuple[Starts, float]:
        """The family of starts, and by how much deviations grow from there to the exit."""
        orbit = refine_orbit(osc, attractor.points[0], attractor.period, stepper)
        if self.radius is not None:
            return Ring(orbit.point, local_potential(osc, orbit, stepper), self.radius), 1 / self.radius
        shells = shells_of(potential_along(osc, orbit, stepper))
        duration = osc.section_interval * orbit.period / len(shells)
        domain = fitted_domain(osc, structure, self.exit, attractor, shells, duration, stepper)
        return domain, 1 / domain.share

    def _energy(self, attractor: Attractor, found: Search, branch: Branch) -> ActivationEnergy:
        """Energy of one way out, its error from fewer points, finer steps, and one look less."""
        shooter, outcomes = found.shooter, found.outcomes
        value = branch.candidate.action
        path = _path(found, branch)
        per_look = _SAMPLES // shooter.exit.looks(shooter.osc)
        before = float(path.action[max(0, len(path.action) - 1 - per_look)])
        if shooter.exit.leaving == LEFT_REGION:
            before -= _short_of_a_touch(path, shooter.interval)
        finer = dataclasses.replace(shooter, stepper=shooter.stepper.refined())
        again = least_near(found, branch, self._same_starts(attractor, found, finer), finer)
        by_steps = value if math.isnan(again) else abs(value - again)
        error = by_steps + (
            value * min(1.0, found.change) if self.radius is None else _by_points(outcomes.actions, value)
        )
        return ActivationEnergy(
            source=attractor.label,
            target=branch.candidate.target,
            value=value,
            lower=max(0.0, min(before, value) - error),
            upper=value + error,
            method="action plot" if self.radius is None else "action plot (ring)",
            residual=float(np.linalg.norm(path.p[-1])),
            path=path,
        )

    def _same_starts(self, attractor: Attractor, found: Search, shooter: Shooter) -> Starts:
        """The same family about the orbit as a finer integration has it."""
        osc, stepper = shooter.osc, shooter.stepper
        orbit = refine_orbit(osc, attractor.points[0], attractor.period, stepper)
        if isinstance(found.starts, FundamentalDomain):
            return dataclasses.replace(found.starts, shells=shells_of(potential_along(osc, orbit, stepper)))
        return Ring(orbit.point, local_potential(osc, orbit, stepper), self.radius or 1.0)


def _by_points(actions: Array, value: float) -> float:
    """How much dearer the best is that some quarter of the ring's points find."""
    quarters = [actions[k::_SHARES] for k in range(_SHARES)]
    return max(float(np.nanmin(some)) - value if np.isfinite(some).any() else value for some in quarters)


def _short_of_a_touch(path: ExitPath, interval: float) -> float:
    """What a path saves that turns back at the stop between two looks, by as much as none of them sees: p₁ ½ a (τ/2)²."""  # noqa: E501
    spacing = float(path.t[1] - path.t[0])
    acceleration = float(np.abs(np.diff(path.q[-3:, 1])).max()) / spacing
    return float(abs(path.p[-1, 0])) * acceleration * interval**2 / 8


def _path(found: Search, branch: Branch) -> ExitPath:
    osc = found.shooter.osc
    z = sampled(found.shooter, found.outcomes, branch.index, _SAMPLES)
    size = (z.shape[1] - 1) // 2
    unit = osc.section_interval
    times: Array = unit * (int(found.outcomes.section[branch.index]) + np.arange(len(z), dtype=float) / _SAMPLES)
    step = _SAMPLES // found.shooter.exit.looks(osc) if osc.autonomous else _SAMPLES
    return ExitPath(times, z[:, :size], z[:, size : 2 * size], z[:, -1], np.arange(0, len(z), step))


def _start_data(label: int, found: Search) -> dict[str, tuple[object, ...]]:
    start = f"start_{label}"
    places, outcomes = found.boxes.centres, found.outcomes
    columns = {
        "angle": 2 * np.pi * (places[:, 0] % 1.0),
        "radius": found.starts.fractions(places),
        "action": outcomes.actions,
        "status": outcomes.status.astype(np.int32),
        "target": outcomes.targets.astype(np.int32),
        "exit_x": outcomes.states[:, 0],
        "exit_v": outcomes.states[:, 1],
    }
    data: dict[str, tuple[object, ...]] = {f"{name}_{label}": (start, column) for name, column in columns.items()}
    if found.starts.polars:
        polar = np.pi * places[:, 1 : 1 + found.starts.polars]
        data[f"polar_{label}"] = ((start, f"polar_number_{label}"), polar)
    return data


def _positive(name: str, value: Any, wanted: str) -> None:
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 < float(value) < math.inf:
        raise StructureError(f"ActionPlot: {name} is {shown(value)}; give {wanted}.")
