"""Work and precision of the stages of least action on one scene: what a digit of an energy costs."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Sequence

from vibrokit.analyzers.action_graph import ActionGraph
from vibrokit.analyzers.action_plot import ActionPlot
from vibrokit.analyzers.analyzer import checked_sources
from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.errors import SceneError, StructureError
from vibrokit.kernels.choice import CoarseStepsWarning, single_stepper
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.order8 import LocatedStepper
from vibrokit.kernels.rk4 import RK4
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.structure import Structure
from vibrokit.structure.find import find_structure
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.trade.energy_runs import Run, Work
from vibrokit.trade.energy_table import EnergyRow, EnergyTrade

PLOTS = (
    ActionPlot(radius=1e-6, points=10_000),
    ActionPlot(radius=1e-6, points=100_000),
    ActionPlot(points=1_500, rounds=0),
    ActionPlot(points=1_500),
    ActionPlot(points=6_000, rounds=0),
    ActionPlot(points=6_000),
    ActionPlot(rounds=0),
    ActionPlot(),
)
GRAPHS = (
    *(ActionGraph(cells=(80, 80), fraction=fraction) for fraction in (4, 8, 16)),
    *(ActionGraph(cells=(160, 160), fraction=fraction) for fraction in (4, 8, 16)),
    *(ActionGraph(cells=(360, 360), fraction=fraction) for fraction in (4, 16)),
    ActionGraph(),
)
STEPS = (256, 1024)
TOLERANCES = tuple(10.0**-k for k in range(4, 13, 2))
_FINEST = 1e-13
_CELLS = (100, 100)  # of the basins, as exits are confirmed by where they settle
_SAME = 1e-3  # relative difference of the actions of one path by different steppers


def measure_energies(
    osc: Oscillator,
    structure: Structure | None = None,
    *,
    source: int | None = None,
    plots: tuple[ActionPlot, ...] = PLOTS,
    graphs: tuple[ActionGraph, ...] = GRAPHS,
    steppers: tuple[Stepper, ...] | None = None,
    progress: Progress | None = None,
) -> EnergyTrade:
    """Measure error and time of both searches and of the polish, for the cheapest exit from one attractor.

    Candidates of one plot and one graph, those of the default settings if they are among them, are all polished. The
    least action found is what everything is compared with, polished once more at the finest tolerance from the
    candidate that the other steppers have to start from too.

    Parameters
    ----------
    osc : Oscillator
    structure : Structure, optional
    source : int, optional
        Label of the attractor to leave; by default the first that is an orbit or an equilibrium.
    plots : tuple of ActionPlot
    graphs : tuple of ActionGraph
        Coarse to fine; either may be empty.
    steppers : tuple of Stepper, optional
        That polish; by default fixed steps, then located contacts from coarse to fine.
    progress : callable, optional
        Called with (work done, work in all).

    Returns
    -------
    EnergyTrade

    Raises
    ------
    SceneError
        The scene has no noise.
    StructureError
        It has one attractor only, or none that is an orbit.
    """
    if osc.noise is None:
        raise SceneError("the scene has no noise, and nothing leaves an attractor without; energies were not measured.")
    if structure is None:
        structure = find_structure(osc, cells=_CELLS)
        if not structure.complete:
            raise KeyboardInterrupt
    label = _orbit_of(checked_sources(osc, structure, LeaveBasin(), source, None, progress)).label
    default = single_stepper(osc, Flow.HAMILTONIAN_VARIATIONAL)
    ladder = _ladder(default) if steppers is None else steppers
    work = Work(osc, structure, label, len(plots) + len(graphs) + 1 + len(ladder), progress)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseStepsWarning)  # too few steps are what is measured here
        work.load((*plots[:1], *graphs[:1]))
        shot = [work.search(plot) for plot in plots]
        screened = [work.search(graph) for graph in graphs]
        candidates = [c for runs in (shot, screened) for c in _chosen(runs).candidates] if shot or screened else []
        return _table(work, shot, screened, sorted(candidates, key=lambda each: each.action), default, ladder)


def _table(
    work: Work,
    shot: list[Run],
    screened: list[Run],
    candidates: list[Candidate],
    default: Stepper,
    ladder: tuple[Stepper, ...],
) -> EnergyTrade:
    for stepper in {type(each): each for each in (*ladder, default)}.values():
        work.polish(candidates[:1], stepper, default, counts=False)  # before the clock starts, for what is compiled
    run, polished = work.polish(candidates, default, default)
    if polished is None or not polished.branches:
        words = (run.failure,) if polished is None else polished.words
        target = next((target for each in (*shot, *screened) for target in each.costs), -1)
        plots, graphs = _rows(shot, target, math.nan), _rows(screened, target, math.nan)
        return EnergyTrade(work.label, target, math.nan, "", math.nan, plots, graphs, (), words)
    best = polished.branches[0]
    candidate, reference, stepper = _reference(work, candidates, best, (_finest(default), default))
    polishes = [work.polish([candidate], each, default)[0] for each in ladder]
    polishes.append(dataclasses.replace(run, setting=f"{run.setting}, all {len(candidates)} candidates"))
    return EnergyTrade(
        source=work.label,
        target=best.target,
        reference=reference.value,
        reference_from=repr(stepper),
        residual=reference.residual,
        plots=_rows(shot, best.target, reference.value),
        graphs=_rows(screened, best.target, reference.value),
        polishes=_rows(polishes, best.target, reference.value),
    )


def _rows(runs: Sequence[Run], target: int, reference: float) -> tuple[EnergyRow, ...]:
    return tuple(run.row(target, reference) for run in runs)


def _reference(
    work: Work, candidates: list[Candidate], best: ActivationEnergy, steppers: tuple[Stepper, ...]
) -> tuple[Candidate, ActivationEnergy, Stepper]:
    """The candidate that leads to the best path, that path polished from it alone, and by what."""
    for stepper in steppers:
        for candidate in candidates:
            found = work.polish([candidate], stepper, stepper, counts=False)[1]
            for branch in found.branches[:1] if found is not None else ():
                if branch.target == best.target and math.isclose(branch.value, best.value, rel_tol=_SAME):
                    return candidate, branch, stepper
    raise StructureError("the least action was found once and not again; energies were not measured.")


def _orbit_of(attractors: Sequence[Attractor]) -> Attractor:
    for attractor in attractors:
        if attractor.is_fixed:
            return attractor
    kinds = ", ".join(f"{attractor.label} is {attractor.kind}" for attractor in attractors)
    raise StructureError(f"the stages are measured on exits from an orbit or an equilibrium, and {kinds}.")


def _ladder(default: Stepper) -> tuple[Stepper, ...]:
    fixed = tuple(RK4(steps) for steps in STEPS)
    if not isinstance(default, LocatedStepper):
        return (*fixed, default)
    return (*fixed, *(dataclasses.replace(default, tolerance=tolerance) for tolerance in TOLERANCES))


def _finest(default: Stepper) -> Stepper:
    return dataclasses.replace(default, tolerance=_FINEST) if isinstance(default, LocatedStepper) else default


def _chosen(runs: list[Run]) -> Run:
    return next((run for run in runs if run.default), runs[-1])
