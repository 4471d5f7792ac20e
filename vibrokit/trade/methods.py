"""Work and precision of the analyzers on one scene: the error of the number of one exit against time and memory."""

from __future__ import annotations

import dataclasses
import math
import time
import tracemalloc
from collections.abc import Sequence

from vibrokit.analyzers.action_graph import ActionGraph
from vibrokit.analyzers.action_plot import ActionPlot
from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.graph.search import GraphSearch
from vibrokit.analyzers.least_action import LeastAction
from vibrokit.analyzers.mean_exit_times import MFET
from vibrokit.analyzers.sgcm_wkb import SGCM
from vibrokit.analyzers.shooting.shooting import Shooting
from vibrokit.errors import SceneError, StructureError, VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, advance, stage, working
from vibrokit.results.codes import Code
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.labels import exit_between
from vibrokit.results.rated import RatedResult
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.structure.find import find_structure
from vibrokit.text_table import number_text, text_table

SEARCHES: tuple[Analyzer, ...] = (
    *(ActionPlot(points=points) for points in (1_500, 6_000)),
    ActionPlot(),
    *(ActionGraph(nodes=nodes) for nodes in ((80, 80), (160, 160))),
    ActionGraph(),
)
"""Compared with `LeastAction`, whose energy is certified."""
NODES = (0.55, 0.75)
"""Of a density along each side, in those of the default."""
STEPS = (0.5, 2.0)
"""Of a density, in those of the default."""
ERRORS = (0.2, 0.1, 0.05)
"""Relative errors that are asked for of simulated exit times."""
_WARM_UP = LeastAction(shooting=Shooting(points=64, rounds=0), graph=GraphSearch(nodes=(32, 32)))  # compiles
_RATE = "ln of the rate (s⁻¹) at the intensity of the scene"


@dataclasses.dataclass(frozen=True)
class MethodRow:
    """One setting of an analyzer; numbers that are not known are NaN."""

    setting: str  # as it is typed
    value: float  # energy (m² s⁻³), or ln of a rate (s⁻¹)
    error: float  # distance from the reference; relative for energies
    estimated: float  # the error that the analyzer estimates
    seconds: float  # on all threads, without compilation
    memory: float  # largest that Python's arrays took (MiB)
    default: bool
    failure: str = ""  # why there is no value


@dataclasses.dataclass(frozen=True)
class MethodTrade:
    """Work and precision of analyzers for the likeliest exit of one attractor."""

    exit: str  # from where to where it leads, by name
    quantity: str
    reference: MethodRow  # that all are compared with
    rows: tuple[MethodRow, ...]

    def __str__(self) -> str:
        best = self.reference
        heading = (
            f"{self.quantity}, {self.exit}. Error: distance from {best.value:.10g}, by {best.setting}, whose own error "
            f"is about {best.estimated:.1e}.\nEstimated: the error that the analyzer estimates."
        )
        lines = [("setting", "value", "error", "estimated", "time (s)", "memory (MiB)", "")]
        for row in (*self.rows, best):
            errors = number_text(row.error, ".1e"), number_text(row.estimated, ".1e")
            costs = number_text(row.seconds), number_text(row.memory, ".0f")
            mark = "← default" if row.default else row.failure
            lines.append((row.setting, number_text(row.value, ".8g"), *errors, *costs, mark))
        return "\n".join([heading, "", *text_table(lines)])


@dataclasses.dataclass(frozen=True, eq=False)
class _Bench:
    """A scene, and the attractor whose exits are measured."""

    osc: Oscillator
    structure: Structure
    source: int

    @classmethod
    def of(cls, osc: Oscillator, structure: Structure | None, source: int | str | None, what: str) -> _Bench:
        if osc.noise is None:
            raise SceneError(f"the scene has no noise, so nothing leaves an attractor; {what} were not measured.")
        found = structure or find_structure(osc, manifolds=False)
        LeaveBasin().check(osc, found)
        return cls(osc, found, 0 if source is None else found.attractor(source).label)

    def compared(self, quantity: str, analyzers: Sequence[Analyzer], reference: Analyzer) -> MethodTrade:
        """Run all, the reference first, which names the exit; raises StructureError if that finds none."""
        with stage(quantity, subject=self.structure.names[self.source], unit="settings", total=len(analyzers) + 1):
            best, found = self._run(reference)
            if not found:
                raise StructureError(f"{best.setting} found no exit to compare others with. {best.failure}")
            target, (value, estimated) = next(iter(found.items()))
            best = dataclasses.replace(best, value=value, estimated=estimated)
            rows = [self._row(analyzer, target, value) for analyzer in analyzers]
        return MethodTrade(exit_between(self.structure.names, self.source, target), quantity, best, tuple(rows))

    def _row(self, analyzer: Analyzer, target: int, reference: float) -> MethodRow:
        """Run an analyzer, and compare its number of the exit."""
        row, found = self._run(analyzer)
        if target not in found:
            return dataclasses.replace(row, failure=row.failure or "This exit was not found.")
        value, estimated = found[target]
        error = abs(value - reference) / (1.0 if analyzer.takes_intensities else reference)
        return dataclasses.replace(row, value=value, error=error, estimated=estimated)

    def _run(self, analyzer: Analyzer) -> tuple[MethodRow, dict[int, tuple[float, float]]]:
        """Run an analyzer: a row without its number, and the numbers of all exits.

        Memory is measured where arrays are large; it slows down what is done in Python.
        """
        setting, found, failure, memory = _typed(analyzer), dict[int, tuple[float, float]](), "", math.nan
        if analyzer.takes_intensities:
            tracemalloc.start()
        began = time.perf_counter()
        try:
            result = analyzer.run(self.osc, self.structure)
            found = _numbers(result)
            failure = next((str(one.values["reason"]) for one in result.found(Code.SOURCE_FAILED)), "")
        except VibrokitError as error:
            failure = str(error)
        seconds = time.perf_counter() - began
        if analyzer.takes_intensities:
            memory = tracemalloc.get_traced_memory()[1] / 2.0**20
            tracemalloc.stop()
        advance()
        default = setting == f"{type(analyzer).__name__}()"
        return MethodRow(setting, math.nan, math.nan, math.nan, seconds, memory, default, failure), found


def _numbers(result: Result) -> dict[int, tuple[float, float]]:
    """By target, the likeliest exit first: ln of its rate or its energy, and the error that is estimated of it."""
    if isinstance(result, RatedResult):
        rates = sorted(result.rates, key=lambda rate: -rate.log_value)
        return {one.target: (one.log_value, one.log_error) for one in rates}
    energies = sorted((one for one in result.energies if one.value > 0), key=lambda energy: energy.value)
    return {one.target: (one.value, one.numerical_error / one.value) for one in energies}


def measure_energies(
    osc: Oscillator,
    structure: Structure | None = None,
    *,
    source: int | str | None = None,
    analyzers: Sequence[Analyzer] = SEARCHES,
    progress: Progress = None,
) -> MethodTrade:
    """Measure error and time of the searches for exit paths, against `LeastAction`, for the cheapest exit.

    The attractor is `source`, by default the first one. SceneError is raised if the scene has no noise, StructureError
    if there is nothing to leave or no exit was found.
    """
    with working(progress):
        bench = _Bench.of(osc, structure, source, "energies")
        every = [dataclasses.replace(one, source=bench.source) for one in (_WARM_UP, *analyzers, LeastAction())]
        every[0].run(bench.osc, bench.structure)
        return bench.compared("ΔU", every[1:-1], every[-1])


def measure_densities(
    osc: Oscillator,
    structure: Structure | None = None,
    *,
    source: int | str | None = None,
    nodes: Sequence[float] = NODES,
    steps: Sequence[float] = STEPS,
    progress: Progress = None,
) -> MethodTrade:
    """Measure error, time and memory of `SGCM` on other nodes and steps, against more nodes, for the likeliest exit.

    `nodes` and `steps` are in units of the defaults, the noise intensity is that of the scene, and source and errors
    are as of `measure_energies`.
    """
    with working(progress):
        bench = _Bench.of(osc, structure, source, "densities")
        plain = SGCM(source=bench.source, intensities=_intensities(osc))
        first = plain.run(osc, bench.structure)  # compiles, and tells what the defaults are
        _check_found(first)
        data = first.data.isel(source=0)
        shape, own_steps = (data.sizes["density_node_x"], data.sizes["density_node_v"]), int(data["rate_steps"])

        def on(factor: float) -> SGCM:
            return dataclasses.replace(plain, nodes=(round(factor * shape[0]), round(factor * shape[1])))

        others = [dataclasses.replace(on(1), steps=2 * round(0.5 * factor * own_steps)) for factor in steps]
        return bench.compared(_RATE, [*map(on, nodes), *others, plain], on(1.4))


def measure_exit_times(
    osc: Oscillator,
    structure: Structure | None = None,
    *,
    source: int | str | None = None,
    errors: Sequence[float] = ERRORS,
    progress: Progress = None,
) -> MethodTrade:
    """Measure error and time of `MFET`, directly and by splitting, for the likeliest exit.

    Direct simulation is left out where the method itself does not choose it. The noise intensity is that of the scene,
    and source and errors raised are as of `measure_energies`.
    """
    with working(progress):
        bench = _Bench.of(osc, structure, source, "exit times")
        plain = MFET(source=bench.source, intensities=_intensities(osc), escapes=0)
        first = dataclasses.replace(plain, target_error=max(errors)).run(osc, bench.structure)
        ways = (True,) if _check_found(first).method == "splitting" else (False, True)
        settings = [
            dataclasses.replace(plain, splitting=way, target_error=error)
            for way in ways
            for error in sorted(errors, reverse=True)
        ]
        finest = dataclasses.replace(
            plain, splitting=ways[0], target_error=0.5 * min(errors), replicas=8 * plain.replicas, seed=1
        )
        return bench.compared(_RATE, settings, finest)


def _intensities(osc: Oscillator) -> tuple[float, ...]:
    return () if osc.noise is None else (osc.noise.intensity,)


def _check_found(result: Result) -> ExitRate:
    """Return the largest exit rate; raises StructureError if there is none."""
    if not isinstance(result, RatedResult) or not result.rates:
        raise StructureError(" ".join(["no exit was found.", *(str(finding) for finding in result.findings)]))
    return max(result.rates, key=lambda rate: rate.log_value)


def _typed(analyzer: Analyzer) -> str:
    """Return a setting as it is typed, without defaults and what all share."""
    plain, shared = vars(type(analyzer)()), ("source", "intensities", "escapes")
    given = (
        f"{name}={value!r}" for name, value in vars(analyzer).items() if name not in shared and value != plain[name]
    )
    return f"{type(analyzer).__name__}({', '.join(given)})"
