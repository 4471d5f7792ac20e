"""Work and precision of densities on one scene: the error of an exit rate against time and memory."""

from __future__ import annotations

import dataclasses
import math
import time
import tracemalloc
from collections.abc import Sequence

from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.sgcm_wkb import SGCM
from vibrokit.errors import SceneError, StructureError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, advance, stage, working
from vibrokit.results.codes import Code
from vibrokit.results.labels import exit_between
from vibrokit.results.sgcm import SGCMResult
from vibrokit.results.structure import Structure
from vibrokit.structure.find import find_structure
from vibrokit.text_table import number_text, text_table

NODES = (0.55, 0.75, 1.0)
"""Nodes along each side, in those of the default."""
STEPS = (0.5, 2.0)
"""Steps in those of the default, on its nodes."""
SAMPLES = (20, 100)
"""Trajectories from each cell of the sampled matrix, on the coarsest nodes and on those of the default."""
_FINEST = 1.4  # nodes of the reference, in those of the default
_MIB = 2.0**20
_HEADINGS = ("setting", "ln rate", "error", "estimated", "time (s)", "memory (MiB)", "")


@dataclasses.dataclass(frozen=True)
class RateRow:
    """One setting of a method that gives rates; numbers that are not known are NaN."""

    setting: str  # as it is typed
    log_rate: float  # of the likeliest exit, per second
    error: float  # distance from the reference, in ln rate
    estimated: float  # the error that the method estimates
    seconds: float  # on all threads, without compilation
    memory: float  # largest, in MiB
    default: bool
    failure: str = ""  # why there is no rate


@dataclasses.dataclass(frozen=True)
class RateTrade:
    """Work and precision of rates of one attractor at the intensity of the scene."""

    exit: str  # from where to where it leads, by name
    intensity: float
    reference: RateRow  # that all are compared with
    rows: tuple[RateRow, ...]

    def __str__(self) -> str:
        heading = (
            f"Rate {self.exit} at D = {self.intensity:g}.\n"
            f"Error: distance of ln rate from {self.reference.log_rate:.5g}, by {self.reference.setting}, "
            f"whose own error is about {self.reference.estimated:.1e}.\nEstimated: the error that the method estimates."
        )
        lines = [_HEADINGS]
        for row in (*self.rows, self.reference):
            numbers = number_text(row.log_rate, ".5g"), number_text(row.error, ".1e"), number_text(row.estimated, ".1e")
            mark = "← default" if row.default else row.failure
            lines.append((row.setting, *numbers, number_text(row.seconds), number_text(row.memory, ".0f"), mark))
        return "\n".join([heading, "", *text_table(lines)])


def measure_densities(
    osc: Oscillator,
    structure: Structure | None = None,
    *,
    source: int | str | None = None,
    nodes: Sequence[float] = NODES,
    steps: Sequence[float] = STEPS,
    samples: Sequence[int] = SAMPLES,
    progress: Progress = None,
) -> RateTrade:
    """Measure error, time and memory of `SGCM` with finer and coarser settings, for the likeliest exit of an attractor.

    The attractor is `source`, by default the first one, and the noise intensity that of the scene. `nodes` and `steps`
    are in units of the defaults, `samples` those of the sampled matrix, on the least and the largest of the nodes.
    SceneError is raised if the scene has no noise, StructureError if there is nothing to leave or no rate was found.
    """
    if osc.noise is None:
        raise SceneError("the scene has no noise, so nothing leaves an attractor; densities were not measured.")
    intensities = (osc.noise.intensity,)
    with working(progress):
        found = structure or find_structure(osc, manifolds=False)
        LeaveBasin().check(osc, found)
        label = 0 if source is None else found.attractor(source).label
        plain = SGCM(source=label, intensities=intensities)
        first = plain.run(osc, found)  # compiles, and tells what the defaults are
        if not isinstance(first, SGCMResult) or not first.rates:
            reasons = [str(finding) for finding in first.found(Code.SOURCE_FAILED)]
            raise StructureError(" ".join(["no rate was found, so densities were not measured.", *reasons]))
        target = max(first.rates, key=lambda rate: rate.log_value).target
        one = first.data.isel(source=0)
        shape, own_steps = (one.sizes["density_node_x"], one.sizes["density_node_v"]), int(one["rate_steps"])

        def on(factor: float) -> tuple[int, int]:
            return round(factor * shape[0]), round(factor * shape[1])

        settings = [
            *(
                dataclasses.replace(plain, samples=count, nodes=on(size))
                for size in (nodes[0], nodes[-1])
                for count in samples
            ),
            *(dataclasses.replace(plain, nodes=on(size)) for size in nodes),
            *(dataclasses.replace(plain, nodes=shape, steps=2 * round(0.5 * factor * own_steps)) for factor in steps),
            dataclasses.replace(plain, nodes=on(_FINEST)),
        ]
        with stage("densities", subject=found.names[label], unit="settings", total=len(settings)):
            rows = [measured(osc, found, one, target, *_described(one, shape)) for one in settings]
    compared = tuple(dataclasses.replace(row, error=abs(row.log_rate - rows[-1].log_rate)) for row in rows)
    where = exit_between(found.names, label, target)
    return RateTrade(where, intensities[0], dataclasses.replace(rows[-1], error=math.nan), compared[:-1])


def _described(analyzer: SGCM, shape: tuple[int, int]) -> tuple[str, bool]:
    """The setting as it is typed, and whether it is the default."""
    given = {"nodes": analyzer.nodes, "steps": analyzer.steps, "samples": analyzer.samples}
    text = ", ".join(f"{name}={value}" for name, value in given.items() if value is not None)
    return f"SGCM({text})", analyzer.nodes == shape and analyzer.steps is None and analyzer.samples is None


def measured(
    osc: Oscillator, structure: Structure, analyzer: Analyzer, target: int, text: str, default: bool
) -> RateRow:
    """Run an analyzer, and return the rate of the exit to a target with what it took."""
    tracemalloc.start()
    began = time.perf_counter()
    found = analyzer.run(osc, structure)
    seconds = time.perf_counter() - began
    memory = tracemalloc.get_traced_memory()[1] / _MIB
    tracemalloc.stop()
    advance()
    rate = next((rate for rate in found.rates if rate.target == target), None)
    if rate is None:
        failure = next(
            (str(finding.values["reason"]) for finding in found.found(Code.SOURCE_FAILED)),
            "This exit was not resolved.",
        )
        return RateRow(text, math.nan, math.nan, math.nan, seconds, memory, default, failure)
    return RateRow(text, rate.log_value, math.nan, rate.log_error, seconds, memory, default)
