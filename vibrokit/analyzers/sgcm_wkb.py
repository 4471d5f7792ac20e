"""SGCM: densities on the section, exit rates, and the activation energies that follow."""

from __future__ import annotations

import dataclasses
import math
from typing import ClassVar, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.analyzers.analyzer import Analysis
from vibrokit.analyzers.metastability import with_states
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.rate_analyzer import RateAnalyzer, rate_variables
from vibrokit.analyzers.sgcm.at_intensity import AtIntensity, limit_of
from vibrokit.analyzers.sgcm.density_flow import check_steps
from vibrokit.analyzers.sgcm.density_grid import DensityGrid, checked_nodes, resolved
from vibrokit.analyzers.sgcm.propagator import checked_noise
from vibrokit.analyzers.sgcm.solution import ACCURACY, EDGE, DensitySolver
from vibrokit.errors import StructureError
from vibrokit.oscillator import Oscillator
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding
from vibrokit.results.result import Result
from vibrokit.results.sgcm import SGCMResult
from vibrokit.results.stoppable import Stoppable
from vibrokit.structure.validation import gibibytes, share

METHOD = "SGCM-WKB"
_ACCEPTED = 0.1  # error of ln rate, above which a finding reports it


class SGCM(RateAnalyzer):
    """Quasi-stationary densities and exit rates at finite noise, and activation energies as D → 0.

    The density ρ on the section is carried from section to section as φ = ln ρ: along the exact flow, and by diffusion
    of the velocity in closed form. Tails are as exact as the maximum, at any depth. States that have left are put back
    into the core of their attractor, so that the density is stationary. The exit rate follows from this density and the
    committor, see the notes.

    With `LeaveBasin`, a state has left when it is in the core of another attractor on the section: an ellipse with the
    shape and the standard deviations of the density there, or 2.5 node spacings where that is more; when it is in
    its basin, 10 standard deviations from the edge; or when it has escaped from the region for good. With
    `LeaveBasin(for_good=False)` it has left when it is in another basin on the section, and with an exit by position at
    the first time that satisfies the condition.

    Parameters
    ----------
    intensities : tuple of float, optional
        Noise intensities D (m² s⁻³); by default 1.5, 1.2 and 1 times the scene's.
    nodes : (int, int), optional
        Nodes in x and in v; by default so many that the narrowest density around the attractor is 5 node spacings
        wide, from 120 to 400, or 2 spacings with up to 640 nodes; see `accuracy`.
    steps : int, optional
        How often noise acts in a section interval; even. By default 2 per radian of the fastest oscillation or decay.
    max_memory_gib : float
        Memory that the tables may take (GiB).
    accuracy : float
        Relative error of rates that is wanted, as two error estimates. The number of node spacings follows from it: 5
        at 0.1, and in proportion to its inverse root. Each rate has the error that was reached.

    Raises
    ------
    StructureError
        A setting has a value that is not allowed.

    Notes
    -----
    A rate is the probability in the attractor's own core times the committor: the probability to reach an exit before
    that core, which the backward equation gives. The loss of the density in a section interval is the same rate, but
    less accurate where the density leaves in thin arms. The error estimate of ln of the rate is the whole change by a
    grid whose nodes are √2 times as far apart, plus the whole change by steps 1.5 times as long, plus the iteration
    error, plus the change by states that count as left √2 times nearer to the edge of a basin, plus the change by basin
    cells twice as large if basins decide about exits. A rate depends on the cores if
    the attractors are not metastable. This is no error, because cores are defined; a finding reports it.

    An activation energy is the limit of D ln τ as D → 0, extrapolated from the mean times τ at two intensities or more.
    It has bounds if there are three: two do not show how the prefactor depends on D. Its interval allows for a
    prefactor that is proportional to D or 1/D, for the power of D that the intensities show, and for the change by
    cores 1.5 times as large. Intensities that the nodes cannot resolve are left out, with a
    finding.

    The transition over one period is that of stochastic generalized cell mapping (Sun & Hsu, J. Appl. Mech. 57, 1018,
    1990), without its matrix of sampled transitions, which cannot contain a probability of 1e-9.
    """

    result: ClassVar[type[Result]] = SGCMResult

    nodes: tuple[int, int] | None = None
    steps: int | None = None
    max_memory_gib: float = 2.0
    accuracy: float = ACCURACY

    def __post_init__(self) -> None:
        if self.nodes is not None:
            object.__setattr__(self, "nodes", checked_nodes("SGCM", self.nodes))
        if self.steps is not None:
            check_steps("SGCM", self.steps)
        share("SGCM: accuracy", self.accuracy)
        gibibytes("SGCM: max_memory_gib", self.max_memory_gib)
        super().__post_init__()

    def for_accuracy(self, accuracy: float) -> Self:
        """Return it with this accuracy."""
        return dataclasses.replace(self, accuracy=accuracy)

    def check(self, osc: Oscillator) -> None:
        """Refuse also noise of intensity 0, and noise with states of its own."""
        super().check(osc)
        checked_noise(osc, needs_intensity=self.intensities is None)

    def analyze(self, problem: ExitProblem) -> Analysis:
        """Solve at each intensity; if the work is stopped, those that are solved are kept, marked incomplete."""
        problem.check_turns("SGCM")
        if problem.at_exit:
            return Analysis(findings=(Finding.of(Code.AT_EXIT, problem.source),))
        wanted, limits = with_states(problem, self.wanted_intensities(problem.osc))
        if not wanted:
            return Analysis(findings=limits)
        solver = DensitySolver(problem, self.nodes, self.steps, self.max_memory_gib, self.accuracy)
        solved, refused = list[AtIntensity](), dict[float, str]()
        with Stoppable("density", problem.source) as work:
            for one in solver.solve(wanted, refused):
                solved.append(one)
        if work.stopped and not solved:
            return Analysis(findings=(*limits, *work.findings), complete=False)
        if not solved:
            raise StructureError(list(refused.values())[-1])
        energies, more = _energies(problem, solved)
        return Analysis(
            energies,
            _data(problem, solver, solved),
            (*limits, *_findings(problem, solved, refused), *more, *work.findings),
            complete=not work.stopped,
        )


def _energies(
    problem: ExitProblem, solved: list[AtIntensity]
) -> tuple[tuple[ActivationEnergy, ...], tuple[Finding, ...]]:
    """The limits of the exits whose rates are known at two intensities at least."""
    found, findings = list[ActivationEnergy](), list[Finding]()
    for target in sorted({target for one in solved for target in one.errors}):
        known = [one for one in solved if target in one.errors and np.isfinite(one.changes(target)).all()]
        if len(known) < 2:
            findings.append(Finding.of(Code.ENERGY_NEEDS_RATES, problem.source, target, known=len(known)))
            continue
        value, error = limit_of(
            [one.intensity for one in known],
            [-one.log_rates[target] for one in known],
            [one.committors[target].change for one in known],
            np.transpose([one.changes(target) for one in known]).tolist(),
        )
        error += max(-value, 0.0)  # no energy is negative: a negative limit misses by that much at least
        lower, upper = max(value - error, 0.0), max(value, 0.0) + error
        found.append(
            ActivationEnergy(
                problem.source,
                target,
                value=max(value, 0.0),
                lower=lower,
                upper=upper,
                method=METHOD,
                bound=Bound.ESTIMATE,
                numerical_error=error if math.isfinite(error) else math.nan,
            )
        )
    return tuple(found), tuple(findings)


def _data(problem: ExitProblem, solver: DensitySolver, solved: list[AtIntensity]) -> xarray.Dataset:
    targets = sorted({target for one in solved for target in one.errors})
    last = solved[-1]
    uniform = DensityGrid(np.linspace(*last.grid.region.x, last.grid.shape[0]), last.grid.v)
    shown = uniform.resampled(last.log_density, last.grid)
    potential = -last.intensity * (shown - np.nanmax(shown))
    shift, dims = math.log(problem.osc.section_interval), ("density_node_x", "density_node_v")
    logs = np.array([[one.log_rates.get(target, np.nan) for target in targets] for one in solved])
    errors = np.array([[one.errors.get(target, np.nan) for target in targets] for one in solved])
    committors = np.array([[_committor(one, target) for target in targets] for one in solved])
    rates = rate_variables(
        problem, [one.intensity for one in solved], ["SGCM"] * len(solved), targets,
        {
            "log_rate": (logs - shift, "logarithm of the exit rate (s-1)"),
            "log_rate_error": (errors, "error of log_rate"),
        },
    )  # fmt: skip
    return xarray.Dataset(
        rates
        | {
            "log_density": (
                ("intensity_index", *dims), np.array([one.log_density for one in solved]),
                {"long_name": "logarithm of the quasi-stationary density (s m-2)", "units": "1"},
            ),
            "log_committor": (
                ("intensity_index", "exit_index", *dims),
                committors.reshape(len(solved), len(targets), *last.grid.shape),
                {"long_name": "logarithm of the probability to reach an exit before the own core", "units": "1"},
            ),
            "mass_drift": (
                ("intensity_index",), np.array([one.density.drift for one in solved]),
                {"long_name": "relative change of probability in a section interval by truncation", "units": "1"},
            ),
            "quasi_potential": (("node_x", "node_v"), potential, {"long_name": "-D ln ρ", "units": "m2 s-3"}),
            "rate_steps": ((), solver.steps, {"long_name": "how often noise acts in a section interval"}),
        },
        {
            "density_x": ("density_node_x", last.grid.x, {"long_name": "displacement", "units": "m"}),
            "density_v": ("density_node_v", last.grid.v, {"long_name": "velocity", "units": "m s-1"}),
            "quasi_potential_x": ("node_x", uniform.x, {"long_name": "displacement", "units": "m"}),
            "quasi_potential_v": ("node_v", uniform.v, {"long_name": "velocity", "units": "m s-1"}),
        },
    )  # fmt: skip


def _committor(one: AtIntensity, target: int) -> NDArray[np.float64]:
    """ln of the committor, NaN where it is not known."""
    known = one.committors.get(target)
    return np.full(one.grid.shape, np.nan) if known is None else resolved(known.log_values)


def _findings(problem: ExitProblem, solved: list[AtIntensity], refused: dict[float, str]) -> tuple[Finding, ...]:
    """What limits the rates."""
    found = [
        Finding.of(Code.INTENSITY_FAILED, problem.source, intensity=intensity, reason=reason)
        for intensity, reason in refused.items()
    ]
    for one in solved:
        if not one.converged:
            found.append(
                Finding.of(
                    Code.DENSITY_NOT_CONVERGED,
                    problem.source,
                    intensity=one.intensity,
                    intervals=one.density.intervals,
                    change=max([one.density.change, *(c.change for c in one.committors.values())]),
                )
            )
        if one.at_edge > max(one.density.log_rates.values(), default=0.0) + math.log(EDGE):
            found.append(
                Finding.of(Code.DENSITY_AT_EDGE, problem.source, intensity=one.intensity, share=math.exp(one.at_edge))
            )
        for target, error in one.errors.items():
            if not error <= _ACCEPTED:
                code = Code.RATE_UNCERTAIN if math.isfinite(error) else Code.RATE_UNKNOWN
                values = {"error": error, "accepted": _ACCEPTED} if math.isfinite(error) else {}
                found.append(Finding.of(code, problem.source, target, intensity=one.intensity, **values))
    return tuple(found)
