"""sweep: which steady states exist along a parameter, and how long each lasts."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.analyzer import not_weak
from vibrokit.analyzers.energy_continuation import search_places
from vibrokit.analyzers.energy_run import EnergyRun
from vibrokit.analyzers.graph.search import GraphSearch
from vibrokit.analyzers.least_action import LeastAction
from vibrokit.analyzers.mean_exit_times import MFET
from vibrokit.construction import called
from vibrokit.errors import StructureError, VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, Work, advance, stage, working
from vibrokit.results.attractor import Attractor
from vibrokit.results.codes import Code
from vibrokit.results.continuation import Continuation
from vibrokit.results.energy_continuation import EnergyContinuation
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.finding import Finding
from vibrokit.results.labels import goal_of, label_of
from vibrokit.results.rated import RatedResult
from vibrokit.results.stoppable import Stoppable
from vibrokit.results.structure import Structure
from vibrokit.results.sweep import Prefactor, Sweep
from vibrokit.scene_file import scene_data
from vibrokit.structure.continuation import continuation
from vibrokit.structure.find import find_structure
from vibrokit.structure.parameter_values import ParameterLine, ordered_values, parameter_line
from vibrokit.structure.validation import check_means, seed_of

_DEPTH = 5.0  # ΔU/D at which exits are simulated for the prefactor: the lesser, the faster, and above 4 exits are rare
_ALONG = (Code.BIFURCATION, Code.BRANCH_ENDS, Code.PATH_LOST, Code.LEAST_PATH_CHANGES, Code.NOTHING_AT)
_VALUES = ("value", "error", "low", "high", "next")  # of the parameter, in findings of these codes


@called
def sweep(
    osc: Oscillator,
    parameter: str | Mapping[str, float],
    values: Sequence[float],
    *,
    unit: str | None = None,
    source: int | str | None = None,
    energies: bool = True,
    search: Sequence[float] | None = None,
    region: Any = None,
    starts: tuple[int, int] = (24, 24),
    rng: int = 0,
    progress: Progress = None,
    time_limit: float | None = None,
) -> Sweep:
    """Follow steady states, activation energies and mean exit times of a scene along values of one parameter.

    The steady states are those of `continuation`, the energies those of `energy_continuation` with graphs of 120 × 120
    nodes: a sweep has no lower bounds. Where a state exists and has no energy, paths are searched for anew. The mean
    time is τ₀ exp(ΔU/D). Its prefactor τ₀ is found by simulation at the values at which paths are searched for, at a
    noise that makes ΔU/D = 5 there, and interpolated between them. States, paths and mean times have the names of the
    branches.

    A value at which the scene is refused is a gap. Along the noise intensity, states and energies are found once.

    On Ctrl-C, or when the time limit is reached, what was found so far is returned, marked incomplete.

    Parameters
    ----------
    osc : Oscillator
    parameter : str or dict of str to float
        A parameter, or the factors of several that are tied, as of `continuation`.
    values : sequence of float
        Finite and distinct, one or more; they are taken in ascending order.
    unit : str, optional
        Unit of the values, in which tables and pictures show them too: ``"Hz"`` for a frequency, ``"mm"`` or ``"µm"``
        for a length, ``"g_n"`` or, in a scene with a mass, ``"N"`` for a force, ``"g_n^2/Hz"`` for noise by its
        one-sided spectral density. By default the values are in SI base units, and are shown in the unit in which the
        scene has the parameter.
    source : int or str, optional
        Name or number of the branch to leave; by default each.
    energies : bool
        Whether to compute energies and mean times; a scene without noise has none.
    search : sequence of float, optional
        Those of the values at which exit paths are searched for, as of `energy_continuation`.
    region, starts
        For the steady states, as of `continuation`.
    rng : int
    progress : bool or callable, optional
        As of `find_structure`.
    time_limit : float, optional
        In seconds.

    Returns
    -------
    Sweep
        Without basin fractions, which `continuation` finds.

    Raises
    ------
    ParameterError
        An unknown or ambiguous parameter, one that shapes the equations, values that are not numbers, or a unit of
        another dimension.
    """
    check_means(osc, None, None)
    line, seed = parameter_line("sweep", osc, parameter), seed_of(rng)
    size = 1.0 if unit is None else line.entry.declared.size_of(unit, osc.mass)
    numbers = size * ordered_values("sweep", values)
    wanted = energies and osc.noise is not None
    listed = None if search is None else (size * ordered_values("sweep: search", search)).tolist()
    places = None if listed is None else search_places(line, numbers, listed)
    settings = {"parameter": line.argument, "values": numbers.tolist(), "unit": unit, "source": source, "rng": seed}
    with working(progress, time_limit) as work:
        states = continuation(
            osc, line.argument, numbers.tolist(), region=region, starts=starts, cells=None, rng=seed
        )  # fmt: skip
        run = _Run(osc, line, numbers, states)
        if wanted and states.complete:
            run.find_paths(source, places)
            run.find_prefactors()
        return run.record(work, settings)


@dataclasses.dataclass(eq=False)
class _Run:
    """Goes through the stages and keeps what each has found."""

    osc: Oscillator
    line: ParameterLine
    values: NDArray[np.float64]
    states: Continuation
    search: EnergyRun | None = None
    paths: EnergyContinuation | None = None
    prefactors: list[Prefactor] = dataclasses.field(default_factory=list)
    findings: list[Finding] = dataclasses.field(default_factory=list)

    def __post_init__(self) -> None:
        self.complete = self.states.complete

    def record(self, work: Work, settings: Mapping[str, Any]) -> Sweep:
        """Return the record of all that was found."""
        declared = self.line.entry.declared
        found = Sweep(
            parameter=self.line.path, symbol=declared.symbol, unit=declared.unit, states=self.states,
            energies=self.paths, prefactors=tuple(self.prefactors), complete=self.complete, seed=settings["rng"],
            scene=scene_data(self.osc), settings=dict(settings), seconds=work.seconds, stats=work.stats,
        )  # fmt: skip
        parts = self._of_parts(found.axis()[1])
        findings = (*parts, *among_others(found), *_strong(found), *self.findings)
        return dataclasses.replace(found, findings=findings)

    def _of_parts(self, size: float) -> Iterator[Finding]:
        """Yield what the parts found, in a unit; a path that was lost is named by the branch that it leaves."""
        yield from (_in_unit(one, size) for one in self.states.findings)
        paths, names = self.paths, self.states.names
        if paths is None:
            return
        for finding in paths.findings:
            if finding.code is Code.PATH_LOST:
                source = names.index(paths.branches[finding.source or 0].source)
                yield dataclasses.replace(_in_unit(finding, size), source=source)
            elif finding.source is None and finding not in self.states.findings:
                yield _in_unit(finding, size)
            elif finding.source is not None:
                yield Finding.of(Code.REMARK, text=_in_unit(finding, size).sentence(paths.names))

    def find_paths(self, source: int | str | None, places: list[int] | None) -> None:
        """Search for exit paths where the states exist that are left, and follow them."""
        names = self.states.names
        labels = range(len(names)) if source is None else [label_of(source, names, "branch")]
        existing = {
            names[label]: [number for number, at in enumerate(self.states.states) if label in at.branches]
            for label in labels
        }
        # Few nodes propose paths; their lower bounds are not asked for.
        graph = GraphSearch(nodes=(120, 120))
        analyzer = LeastAction(source=None if source is None else names[labels[0]], graph=graph)
        run = self.search = EnergyRun(
            self.osc, self.line, self.values, analyzer, places, self.states.seed or 0,
            structure_at=self._structure, existing=existing,
        )  # fmt: skip
        try:
            with working() as work:
                run.run()
                self.paths = run.record(work)
            self.complete = self.paths.complete
        except StructureError as error:
            self.findings.append(Finding.of(Code.REMARK, text=str(error)))

    def _structure(self, value: float) -> tuple[Structure, tuple[str, ...]]:
        """The structure at a value, and the names of the branches of its attractors."""
        states = self.states
        structure = find_structure(
            self.line.at(self.osc, value), region=states.settings["region"], starts=states.settings["starts"],
            manifolds=False, rng=states.seed or 0,
        )  # fmt: skip
        (known,) = (at for at in states.states if at.value == value)
        branches = dict(zip(known.attractors, known.branches, strict=True))
        return structure, tuple(
            f"{attractor.name} in no branch" if same is None else states.names[branches[same]]
            for attractor in structure.attractors
            for same in [_same(attractor, known.attractors, structure.basins.region.widths)]
        )

    def find_prefactors(self) -> None:
        """Simulate exits at the values at which paths were searched for."""
        if self.search is None or self.paths is None or not self.complete:
            return
        places = self.search.places
        with Stoppable("mean times") as times, stage("mean times", unit="values", total=len(places)):
            for place in places:
                for name, result in self._simulated(self.paths, place):
                    if result.rates:
                        # The noise was chosen so that the energy is this many times D.
                        left = ExitRate.total(result.rates)
                        logarithm = -left.log_value - _DEPTH
                        self.prefactors.append(Prefactor(name, float(self.values[place]), logarithm, left.log_error))
                    self.complete = self.complete and result.complete
                if not self.complete:
                    return
                advance()
        self.findings += times.findings
        self.complete = not times.stopped

    def _simulated(self, paths: EnergyContinuation, place: int) -> Iterator[tuple[str, RatedResult]]:
        """Yield the exits from each branch whose energy is known at a value, at a noise that is strong enough."""
        assert self.search is not None
        if place not in self.search.structures:  # the scene is refused there
            return
        structure, names = self.search.structures[place]
        left = {branch.source for branch in paths.branches}
        for label, name in enumerate(names):
            energy = float(paths.energy(name)[place]) if name in left else 0.0
            if not energy > 0:
                continue
            analyzer = MFET(source=label, intensities=(energy / _DEPTH,), target_error=0.2)  # 25 exits
            try:
                result = analyzer.run(self.line.at(self.osc, float(self.values[place])), structure)
            except VibrokitError as error:
                self.findings.append(Finding.of(Code.REMARK, text=str(error)))
                continue
            if isinstance(result, RatedResult):
                yield name, result


def _same(attractor: Attractor, known: Sequence[Attractor], widths: NDArray[np.float64]) -> Attractor | None:
    """Which of some attractors it is, in a region of these widths."""
    for one in known:
        away = np.abs(one.points[:, :2] - attractor.points[0, :2])
        if (one.kind, one.period) == (attractor.kind, attractor.period) and (away < 1e-5 * widths).all(axis=1).any():
            return one
    return None


def _in_unit(finding: Finding, size: float) -> Finding:
    """Return a finding with the values of the parameter in the unit of the user."""
    if finding.code not in _ALONG:
        return finding
    values = {
        name: value / size if name in _VALUES and isinstance(value, float) else value
        for name, value in finding.values.items()
    }
    return dataclasses.replace(finding, values=values)


def among_others(found: Sweep) -> Iterator[Finding]:
    """Yield a finding if exits were searched for only where other states coexist than at some value with an energy."""
    if found.energies is None or not found.energies.branches:
        return
    known = np.isfinite([branch.action for branch in found.energies.branches]).any(axis=0)
    states = {at.value: frozenset(at.branches) for at in found.states.states}
    among = {states[value] for value in found.searched.tolist()}
    others = [value for value in found.values[known].tolist() if states[value] not in among]
    if others:
        at = [value / found.axis()[1] for value in others]
        yield Finding.of(Code.OTHER_STATES, parameter=found.parameter, at=at)


def _strong(found: Sweep) -> Iterator[Finding]:
    """Yield a finding for each exit along which the noise is not weak, with the least ratio ΔU/D."""
    for branch in () if found.energies is None else found.energies.branches:
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = np.where(branch.action > 0, branch.action / found.intensity, np.inf)
        place = int(np.argmin(ratios))
        source, target = found.names.index(branch.source), goal_of(branch.target, found.names)
        yield from not_weak(source, target, float(branch.action[place]), float(found.intensity[place]))
