"""sweep: which steady states exist along a parameter, and how long each lasts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from vibrokit.analyzers.energy_continuation import energy_continuation
from vibrokit.analyzers.least_action import LeastAction
from vibrokit.analyzers.mean_exit_times import MFET
from vibrokit.construction import called
from vibrokit.errors import StructureError, VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, advance, stage, working
from vibrokit.results.codes import Code
from vibrokit.results.continuation import Continuation
from vibrokit.results.energy_continuation import EnergyContinuation
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.finding import Finding
from vibrokit.results.rated import RatedResult
from vibrokit.results.stoppable import Stoppable
from vibrokit.results.sweep import Prefactor, Sweep
from vibrokit.scene_file import scene_data
from vibrokit.structure.continuation import continuation
from vibrokit.structure.find import find_structure
from vibrokit.structure.parameter_values import ParameterLine, parameter_line
from vibrokit.structure.validation import seed_of

_DEPTH = 5.0  # ΔU/D at which exits are simulated for the prefactor: the lesser, the faster, and above 4 exits are rare
_ERROR = 0.2  # of a mean time: 25 exits


@called
def sweep(
    osc: Oscillator,
    parameter: str | Mapping[str, float],
    values: Sequence[float],
    *,
    source: int | str | None = None,
    energies: bool = True,
    search: Sequence[float] | None = None,
    region: Any = None,
    cells: tuple[int, int] = (100, 100),
    starts: tuple[int, int] = (24, 24),
    rng: int = 0,
    progress: Progress = None,
    time_limit: float | None = None,
) -> Sweep:
    """Follow steady states, activation energies and mean exit times of a scene along values of one parameter.

    The steady states are those of `continuation`, the energies those of `energy_continuation`. The mean time is
    τ₀ exp(ΔU/D). Its prefactor τ₀ is found by simulation at the values at which paths are searched for, at a noise that
    makes ΔU/D = 5 there, and interpolated between them.

    On Ctrl-C, or when the time limit is reached, what was found so far is returned, marked incomplete.

    Parameters
    ----------
    osc : Oscillator
    parameter : str or dict of str to float
        A parameter, or the factors of several that are tied, as of `continuation`.
    values : sequence of float
        In SI base units.
    source : int or str, optional
        The state to leave; by default each.
    energies : bool
        Whether to compute energies and mean times; a scene without noise has none.
    search : sequence of float, optional
        Those of the values at which exit paths are searched for, as of `energy_continuation`.
    region, cells, starts
        For the steady states, as of `continuation`.
    rng : int
    progress : bool or callable, optional
        As of `find_structure`.
    time_limit : float, optional
        In seconds.

    Returns
    -------
    Sweep

    Raises
    ------
    ParameterError
        An unknown or ambiguous parameter, one that shapes the equations, or values that are not numbers.
    """
    line, seed = parameter_line("sweep", osc, parameter), seed_of(rng)
    findings: list[Finding] = []
    paths: EnergyContinuation | None = None
    prefactors: list[Prefactor] = []
    with working(progress, time_limit) as work:
        states = continuation(osc, parameter, values, region=region, cells=cells, starts=starts, rng=seed)
        complete = states.complete
        if complete and energies and osc.noise is not None:
            try:
                paths = energy_continuation(
                    osc, parameter, values, analyzer=LeastAction(source=source), search=search, rng=seed
                )
                complete = paths.complete
            except StructureError as error:
                findings.append(Finding.of(Code.REMARK, text=str(error)))
        if complete and paths is not None:
            complete = _add_prefactors(osc, line, paths, prefactors, findings)
    declared = line.entry.declared
    return Sweep(
        parameter=line.path, symbol=declared.symbol, unit=declared.unit, states=states, energies=paths,
        prefactors=tuple(prefactors), scene=scene_data(osc), complete=complete, seed=seed, seconds=work.seconds,
        stats=work.stats, findings=(*_open(states, paths), *findings),
        settings={"parameter": line.argument, "values": states.values.tolist(), "source": source, "rng": seed},
    )  # fmt: skip


def _open(states: Continuation, paths: EnergyContinuation | None) -> tuple[Finding, ...]:
    """What the parts found."""
    return (*states.findings, *(() if paths is None else paths.findings))


def _add_prefactors(
    osc: Oscillator, line: ParameterLine, paths: EnergyContinuation, found: list[Prefactor], findings: list[Finding]
) -> bool:
    """Simulate exits at the searched values; return whether that came to its end."""
    places = [int(np.argmin(np.abs(paths.values - value))) for value in paths.settings["search"]]
    with Stoppable("mean times") as times, stage("mean times", unit="values", total=len(places)):
        for place in places:
            there = line.at(osc, float(paths.values[place]))
            for result in _simulated(there, paths, place, findings):
                if not result.complete:
                    return False
                found += _prefactor(result, float(paths.values[place]))
            advance()
    findings += times.findings
    return not times.stopped


def _simulated(
    there: Oscillator, paths: EnergyContinuation, place: int, findings: list[Finding]
) -> Iterator[RatedResult]:
    """Yield the exits from each state whose energy is known at a value, at a noise that is strong enough."""
    structure = find_structure(there, manifolds=False, saddles=False, rng=int(paths.settings["rng"]))
    for source in dict.fromkeys(branch.source for branch in paths.branches):
        energy = float(paths.energy(source)[place])
        if source not in structure.names or not energy > 0:
            continue
        analyzer = MFET(source=source, intensities=(energy / _DEPTH,), target_error=_ERROR)
        try:
            result = analyzer.run(there, structure)
        except VibrokitError as error:
            findings.append(Finding.of(Code.REMARK, text=str(error)))
            continue
        if isinstance(result, RatedResult):
            yield result


def _prefactor(result: RatedResult, value: float) -> list[Prefactor]:
    """The prefactor of leaving a state at all, if a rate was found."""
    if not result.rates:
        return []
    left = ExitRate.total(result.rates)
    # The noise was chosen so that the energy is this many times D.
    return [Prefactor(result.names[left.source], value, -left.log_value - _DEPTH, left.log_error)]
