"""Work and precision of each step of least action on one scene: the error of an energy against computing time."""

from __future__ import annotations

import dataclasses
import math
import time
import warnings
from collections.abc import Callable, Sequence

from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.graph.search import GraphSearch
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.polish import polish
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.shooting import Shooting
from vibrokit.errors import SceneError, StructureError, VibrokitError
from vibrokit.kernels.choice import CoarseStepsWarning, single_stepper
from vibrokit.kernels.order8 import LocatedStepper
from vibrokit.kernels.rk4 import RK4
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, advance, stage, working
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.labels import exit_between
from vibrokit.results.structure import Structure
from vibrokit.structure.find import find_structure
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.text_table import number_text, text_table

SHOOTINGS = (
    Shooting(radius=1e-6, points=10_000),
    Shooting(radius=1e-6, points=100_000),
    Shooting(points=1_500, rounds=0),
    Shooting(points=1_500),
    Shooting(points=6_000, rounds=0),
    Shooting(points=6_000),
    Shooting(rounds=0),
    Shooting(),
    Shooting(tolerance=1e-4),
)
GRAPHS = (
    *(GraphSearch(nodes=(80, 80), steps_per_period=steps) for steps in (4, 8, 16)),
    *(GraphSearch(nodes=(160, 160), steps_per_period=steps) for steps in (4, 8, 16)),
    *(GraphSearch(steps_per_period=steps) for steps in (4, 16)),
    GraphSearch(),
)
STEPS = (256, 1024)
TOLERANCES = tuple(10.0**-k for k in range(4, 13, 2))
_WARM_UP = (Shooting(points=64, rounds=0), GraphSearch(nodes=(32, 32)))  # compile what is timed afterwards
_FINEST = 1e-13
_CELLS = (100, 100)  # of the basins: an exit is confirmed by the basin that it leads to
_SAME = 1e-3  # relative difference below which two steppers found the same path


@dataclasses.dataclass(frozen=True)
class EnergyRow:
    """One setting of one step; numbers that are not known are NaN."""

    setting: str  # as it is typed
    value: float  # least action found
    error: float  # relative distance of the value from the reference
    estimated: float  # relative error that the step itself estimates
    seconds: float  # on all threads, without compilation
    default: bool  # whether this is the default of `LeastAction`
    failure: str = ""  # why there is no value


@dataclasses.dataclass(frozen=True)
class EnergyTrade:
    """Work and precision of each step of `LeastAction`, for the cheapest exit of one attractor."""

    exit: str  # from where to where it leads, by name
    reference: float  # the certified action that all are compared with; NaN where no path was polished
    reference_from: str  # the stepper that it was polished with
    residual: float  # of the reference's path
    steps: dict[str, tuple[EnergyRow, ...]]  # settings of "shooting", "graph" and "polishing", coarse to fine

    def __str__(self) -> str:
        if math.isfinite(self.reference):
            heading = (
                f"Exit {self.exit}. Error: relative distance from {self.reference:.10g}, the certified action of\n"
                f"{self.reference_from}, residual {self.residual:.1e}. Estimated: the error that the step estimates."
            )
        else:
            heading = f"Exit {self.exit}: no path was polished, so errors are not known."
        tables = ["\n".join(_table(title, rows)) for title, rows in self.steps.items() if rows]
        return "\n\n".join([heading, *tables])


def _table(title: str, rows: Sequence[EnergyRow]) -> list[str]:
    lines = [(title, "ΔU", "error", "estimated", "time (s)", "")]
    for row in rows:
        errors = number_text(row.error, ".1e"), number_text(row.estimated, ".1e")
        mark = "← default" if row.default else row.failure
        lines.append((row.setting, number_text(row.value, ".8g"), *errors, number_text(row.seconds), mark))
    return text_table(lines)


@dataclasses.dataclass(frozen=True, eq=False)
class _Run:
    """What one setting found."""

    setting: str
    default: bool
    energies: tuple[ActivationEnergy, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    seconds: float = math.nan
    failure: str = ""

    def row(self, target: int, reference: float) -> EnergyRow:
        """Compare it with a reference."""
        energy = min((e for e in self.energies if e.target == target), key=lambda e: e.value, default=None)
        if energy is None:
            failure = self.failure or "This exit was not found."
            return EnergyRow(self.setting, math.nan, math.nan, math.nan, self.seconds, self.default, failure)
        error = abs(energy.value - reference) / reference
        estimated = energy.numerical_error / energy.value
        return EnergyRow(self.setting, energy.value, error, estimated, self.seconds, self.default)


def measure_energies(
    osc: Oscillator,
    structure: Structure | None = None,
    *,
    source: int | str | None = None,
    shootings: tuple[Shooting, ...] = SHOOTINGS,
    graphs: tuple[GraphSearch, ...] = GRAPHS,
    steppers: tuple[Stepper, ...] | None = None,
    progress: Progress = None,
) -> EnergyTrade:
    """Measure error and time of both searches and of polishing, for the cheapest exit of one attractor.

    The candidates of one shooting and of one graph search, those with the default settings if they are among the given
    ones, are all polished. The least action found is polished once more with the finest tolerance, from the candidate
    that the other steppers start from too. All others are compared with it.

    The exits are those from `source`, by default the first attractor that is an orbit or an equilibrium. `shootings`
    and `graphs` are coarse to fine, and either may be empty. `steppers` polish; by default they are fixed steps, then
    located contacts from coarse to fine. SceneError is raised if the scene has no noise, StructureError if it has only
    one attractor, or none that is an orbit, or no exit path was found again.
    """
    if osc.noise is None:
        raise SceneError("the scene has no noise, so nothing leaves an attractor; energies were not measured.")
    with working(progress):
        found = structure or find_structure(osc, cells=_CELLS)
        LeaveBasin().check(osc, found)
        attractors = found.attractors if source is None else (found.attractor(source),)
        problem = ExitProblem(osc, found, _first_orbit(attractors), LeaveBasin())
        default = single_stepper(osc, Flow.HAMILTONIAN_VARIATIONAL)
        ladder = _ladder(default) if steppers is None else steppers
        count = len(shootings) + len(graphs) + len(ladder) + 1
        with warnings.catch_warnings(), stage("energies", subject=problem.attractor.name, unit="settings", total=count):
            warnings.simplefilter("ignore", CoarseStepsWarning)  # too few steps are measured here on purpose
            for search in _WARM_UP:
                _searched(problem, search)
            shot, graphed = ([_counted(_searched, problem, one) for one in some] for some in (shootings, graphs))
            return _compared(problem, shot, graphed, default, ladder)


def _compared(
    problem: ExitProblem, shot: list[_Run], graphed: list[_Run], default: Stepper, ladder: tuple[Stepper, ...]
) -> EnergyTrade:
    """Polish the candidates, and compare all runs with the best path."""
    chosen = [next((run for run in runs if run.default), runs[-1]) for runs in (shot, graphed) if runs]
    candidates = sorted((c for run in chosen for c in run.candidates), key=lambda candidate: candidate.action)
    for stepper in {type(each): each for each in (*ladder, default)}.values():
        _polished(problem, candidates[:1], stepper, default)  # compiles
    whole = _counted(_polished, problem, candidates, default, default)
    whole = dataclasses.replace(whole, setting=f"{whole.setting}, all {len(candidates)} candidates")
    best = min(whole.energies, key=lambda energy: energy.value, default=None)
    polished = [whole]
    target, reference, stepper, residual = -1, math.nan, default, math.nan
    if best is None:
        target = next((energy.target for run in (*shot, *graphed) for energy in run.energies), -1)
    else:
        candidate, again, stepper = _reference(problem, candidates, best, (_finest(default), default))
        target, reference, residual = best.target, again.value, again.residual
        polished = [*(_counted(_polished, problem, [candidate], each, default) for each in ladder), whole]
    names = problem.structure.names
    runs = {"shooting": shot, "graph": graphed, "polishing": polished}
    return EnergyTrade(
        exit=exit_between(names, problem.source, target),
        reference=reference,
        reference_from=repr(stepper),
        residual=residual,
        steps={title: tuple(run.row(target, reference) for run in some) for title, some in runs.items()},
    )


def _reference(
    problem: ExitProblem, candidates: list[Candidate], best: ActivationEnergy, steppers: tuple[Stepper, ...]
) -> tuple[Candidate, ActivationEnergy, Stepper]:
    """Return the candidate that leads to the best path, that path polished from it alone, and the stepper."""
    for stepper in steppers:
        for candidate in candidates:
            for energy in _polished(problem, [candidate], stepper, stepper).energies[:1]:
                if energy.target == best.target and math.isclose(energy.value, best.value, rel_tol=_SAME):
                    return candidate, energy, stepper
    raise StructureError("the least action was found once and not again; energies were not measured.")


def _counted(run: Callable[..., _Run], *arguments: object) -> _Run:
    found = run(*arguments)
    advance()
    return found


def _searched(problem: ExitProblem, search: Shooting | GraphSearch) -> _Run:
    """Search the exits with one setting."""
    setting, default = _typed(search), search == type(search)()
    began = time.perf_counter()
    try:
        found = search.search(problem)
    except VibrokitError as error:
        return _Run(setting, default, failure=str(error))
    seconds = time.perf_counter() - began
    return _Run(setting, default, found.estimates, found.candidates, seconds)


def _polished(problem: ExitProblem, candidates: Sequence[Candidate], stepper: Stepper, default: Stepper) -> _Run:
    """Polish candidates with one stepper, the cheapest path first."""
    began = time.perf_counter()
    try:
        found = polish(dataclasses.replace(problem, stepper=stepper), candidates)
    except VibrokitError as error:
        return _Run(repr(stepper), stepper == default, failure=str(error))
    seconds = time.perf_counter() - began
    failure = str(found.findings[0]) if found.findings and not found.branches else ""
    return _Run(repr(stepper), stepper == default, tuple(found.branches), (), seconds, failure)


def _typed(search: Shooting | GraphSearch) -> str:
    """Return a setting as it is typed, without defaults."""
    plain = type(search)()
    given = {name: value for name, value in vars(search).items() if value != getattr(plain, name)}
    return f"{type(search).__name__}({', '.join(f'{name}={value!r}' for name, value in given.items())})"


def _first_orbit(attractors: Sequence[Attractor]) -> Attractor:
    for attractor in attractors:
        if attractor.is_fixed:
            return attractor
    kinds = ", ".join(f"{attractor.name} is {attractor.kind}" for attractor in attractors)
    raise StructureError(f"the steps are measured on exits from an orbit or an equilibrium, and {kinds}.")


def _ladder(default: Stepper) -> tuple[Stepper, ...]:
    fixed = tuple(RK4(steps) for steps in STEPS)
    if not isinstance(default, LocatedStepper):
        return (*fixed, default)
    return (*fixed, *(dataclasses.replace(default, tolerance=tolerance) for tolerance in TOLERANCES))


def _finest(default: Stepper) -> Stepper:
    return dataclasses.replace(default, tolerance=_FINEST) if isinstance(default, LocatedStepper) else default
