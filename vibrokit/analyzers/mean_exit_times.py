"""MFET: mean first exit times by simulation, and the activation energies that follow."""

from __future__ import annotations

import dataclasses
import math
from typing import ClassVar, Self

import numpy as np

from vibrokit.analyzers.analyzer import Analysis
from vibrokit.analyzers.checkpoint import Slot
from vibrokit.analyzers.metastability import covariances_of, with_states
from vibrokit.analyzers.mfet.dataset import dataset_of
from vibrokit.analyzers.mfet.direct import DirectRun
from vibrokit.analyzers.mfet.importance import Importance, from_distances
from vibrokit.analyzers.mfet.measurement import AtIntensity, from_direct, from_splitting
from vibrokit.analyzers.mfet.splitting import SplittingRun
from vibrokit.analyzers.mfet.walk import Walk
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.rate_analyzer import RateAnalyzer
from vibrokit.analyzers.sgcm.stages import committor_stages
from vibrokit.arguments import whole
from vibrokit.errors import SceneError, StructureError, shown
from vibrokit.oscillator import Oscillator
from vibrokit.progress import put_off, stage
from vibrokit.results.arrhenius import ArrheniusFit
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.finding import Finding
from vibrokit.results.mfet import MFETResult
from vibrokit.results.result import Result
from vibrokit.results.stoppable import Stoppable
from vibrokit.structure.validation import share
from vibrokit.symbolic.flow_kind import Flow

METHOD = "Arrhenius fit"
# Direct simulation costs e^Λ relaxations for each exit, splitting about 2 Λ² (Λ is ln of the mean exit time in
# relaxations), times what its importance function and its density cost: they break even near Λ = 7.
_DIRECT = math.exp(7.0)
_SMALLEST_ERROR = 1e-3  # a million exits
_FEWEST_REPLICAS, _MOST_REPLICAS = 16, 1_000_000


class MFET(RateAnalyzer):
    """Mean first exit times by simulation, and activation energies from their dependence on D.

    Walkers start in the core of an attractor and go on until they leave. A core is an ellipse on the section with the
    shape and the standard deviations of the density around the attractor. With `LeaveBasin`, a walker has left when it
    is in the core of another attractor, or has escaped from the region for good. With `LeaveBasin(for_good=False)` it
    has left at the first section in another basin, and with an exit by position at the first time that satisfies the
    condition.

    Where direct simulation would take too long, adaptive multilevel splitting gives the rate, down to e⁻¹⁰⁰ and below.

    Parameters
    ----------
    intensities : tuple of float, optional
        Noise intensities D (m² s⁻³); by default 1.5, 1.2 and 1 times the scene's.
    target_error : float
        Relative standard error of each rate: 1/√n needs n exits.
    seed : int
        Chooses the random numbers; the same seed gives the same result to the last bit.
    splitting : bool, optional
        Whether to use splitting; by default where it is faster. It is not used with `LeaveBasin(to=…)` where there are
        other attractors: excursions that stay with these do not belong to the attractor that is left.
    replicas : int
        Independent estimates of splitting, at most; 16 at least.
    from_orbit : bool
        Whether walkers start on the attractor's orbit, in place of the density in its core. Splitting never does.
    escapes : int
        Realizations whose last part is kept at each intensity that is simulated directly.

    Raises
    ------
    StructureError
        A setting has a value that is not allowed.

    Notes
    -----
    A rate is the inverse of the mean time, times the share of the target. Simulation ends when enough walkers have
    left. Those that remain count with their time, and as if they went on to leave at the rate of the later exits. A
    quarter of the exits is simulated again with steps twice as long: ``data["step_change"]`` is the difference in ln of
    the rate.

    An activation energy is the slope of ln τ against 1/D. It is given only if the slope does not change with D by more
    than the errors of the rates allow. It has bounds if there are three intensities or more: two do not show how the
    prefactor depends on D.
    """

    result: ClassVar[type[Result]] = MFETResult
    keeps_checkpoints: ClassVar[bool] = True

    target_error: float = 0.05
    seed: int = 0
    splitting: bool | None = None
    replicas: int = 128
    from_orbit: bool = False
    escapes: int = 50

    def __post_init__(self) -> None:
        share("MFET: target_error", self.target_error, _SMALLEST_ERROR)
        whole("MFET: seed", self.seed, 0, 2**63 - 1)
        whole("MFET: escapes", self.escapes, 0, 100_000)
        whole("MFET: replicas", self.replicas, _FEWEST_REPLICAS, _MOST_REPLICAS)
        if not isinstance(self.from_orbit, bool):
            raise StructureError(f"MFET: from_orbit must be True or False, got {shown(self.from_orbit)}.")
        if not isinstance(self.splitting, bool | None):
            raise StructureError(f"MFET: splitting must be True, False or None, got {shown(self.splitting)}.")
        super().__post_init__()

    def for_accuracy(self, accuracy: float) -> Self:
        """Return it with a standard error of half the accuracy; splitting gets as many replicas as that needs."""
        error = min(max(accuracy / 2, _SMALLEST_ERROR), 0.25)  # 16 exits at least
        replicas = max(_FEWEST_REPLICAS, math.ceil(32 * (0.1 / error) ** 2))  # 128 reach 0.05
        return dataclasses.replace(self, target_error=error, replicas=min(replicas, _MOST_REPLICAS))

    def check(self, osc: Oscillator) -> None:
        """Refuse also noise of intensity 0, and a stepper that takes no noise."""
        super().check(osc)
        self.wanted_intensities(osc)
        if self.stepper is not None:
            self.stepper.check(Flow.NOISY)

    def analyze(self, problem: ExitProblem) -> Analysis:
        """Simulate at each intensity; if the work is stopped, what was seen until then is kept, marked incomplete."""
        problem.check_turns("MFET")
        if self.splitting and problem.has_bystanders:
            raise StructureError(
                "MFET: splitting=True follows excursions from one attractor, and the exit leaves others standing by; "
                "use splitting=None, or an exit that counts each of them (exit=LeaveBasin())."
            )
        if problem.at_exit:
            return Analysis(findings=(Finding.of(Code.AT_EXIT, problem.source),))
        wanted, limits = with_states(problem, self.wanted_intensities(problem.osc))
        findings, measured = list(limits), list[AtIntensity]()
        work = Stoppable("simulation of exit times", problem.source)
        covariances_of(problem, problem.attractor)  # refuses noise that does not spread the motion
        stepper = problem.ensemble_stepper(Flow.NOISY)
        for number, intensity in enumerate(wanted):
            walk, slot = Walk(problem, intensity, self.seed, stepper), problem.checkpoint.slot(problem.source, number)
            try:
                with stage("exit times", subject=f"{problem.attractor.name}, D = {intensity:g}"):
                    measured += self._measured(walk, slot, work)
            except StructureError as error:
                findings.append(
                    Finding.of(Code.INTENSITY_FAILED, problem.source, intensity=intensity, reason=str(error))
                )
            if work.stopped:
                break
        findings += (*work.findings, *(finding for one in measured for finding in one.findings))
        if not measured:
            return Analysis(findings=tuple(findings), complete=not work.stopped)
        energies, more = _energies(problem, measured)
        return Analysis(energies, dataset_of(problem, measured), (*findings, *more), complete=not work.stopped)

    def _measured(self, walk: Walk, slot: Slot, work: Stoppable) -> list[AtIntensity]:
        """Simulate exits; split if that is wanted, or if it would take too long. Empty if it was stopped at once.

        Exits that decide this do not count in the rate: if early exits choose a method and count, rates are too large.
        """
        wanted, run, coarser = math.ceil(self.target_error**-2), None, None
        splits, split = self.splitting is True, None
        with work:
            if self.splitting is None and not walk.problem.has_bystanders:
                pilots = 10
                run = DirectRun(walk, pilots, self.from_orbit, slot.inner("pilot"), 14)
                splits = not run.run(pilots * _DIRECT * walk.relaxation)
            if splits:
                importance = _importance(walk) or from_distances(walk)
                split = SplittingRun(walk, importance, self.target_error, self.replicas, slot.inner("splitting"))
                split.run()
            else:
                run = DirectRun(walk, wanted, self.from_orbit, slot.inner("direct"), 10)
                run.run()
                coarser = self._coarser(walk, max(25, wanted // 4), slot)
        with put_off():
            if split is not None and split.batches:
                return [from_splitting(split)]
            return [from_direct(run, coarser, self.escapes)] if run is not None and run.at_risk > 0 else []

    def _coarser(self, walk: Walk, wanted: int, slot: Slot) -> DirectRun | None:
        """A part of the exits with half the steps; None if there are no fewer steps."""
        stepper = walk.stepper.coarsened()
        if stepper == walk.stepper:
            return None
        try:
            run = DirectRun(
                dataclasses.replace(walk, stepper=stepper), wanted, self.from_orbit, slot.inner("coarser"), 11
            )
        except StructureError:
            return None
        run.run()
        return run


def _importance(walk: Walk) -> Importance | None:
    """The committor of a density; None if there is none for this scene."""
    problem = walk.problem
    try:
        found = committor_stages(problem, walk.intensity)
    except (SceneError, StructureError):
        return None
    points = found.grid.places(problem.on_turn(problem.attractor.points[:, :2]))
    (i, j) = np.clip(np.rint(points), 0, np.array(found.grid.shape) - 1).astype(int).T
    depth = max(1.0, -float(found.log_values[0, i, j].min()) * found.intensity / walk.intensity)
    count = min(walk.looks(depth), 64)  # a tenth of a radian, where it may be interpolated
    return Importance(np.arange(count) / count, found.grid.x, found.grid.v, found.at(count), depth)


def _energies(
    problem: ExitProblem, measured: list[AtIntensity]
) -> tuple[tuple[ActivationEnergy, ...], tuple[Finding, ...]]:
    """Slopes of ln τ against 1/D that do not change with D."""
    energies, findings = list[ActivationEnergy](), list[Finding]()
    for target in sorted({target for one in measured for target in one.rates}):
        rates = [
            ExitRate(
                problem.source, target, one.intensity, known.log_value, known.log_error, problem.exit.event, one.method
            )
            for one in measured
            if one.metastable and (known := one.rates.get(target)) is not None and math.isfinite(known.log_value)
        ]
        if len(rates) < 2:
            continue
        fit = ArrheniusFit.of(rates)
        if fit.drifts:
            slopes, _ = fit.local_slopes
            findings.append(
                Finding.of(
                    Code.ARRHENIUS_NOT_REACHED, problem.source, target, first=float(slopes[0]), last=float(slopes[-1])
                )
            )
            continue
        if not fit.slope > 0:
            continue
        lower, upper = fit.interval
        energies.append(
            ActivationEnergy(
                problem.source, target, fit.slope, max(lower, 0.0), upper, METHOD, Bound.ESTIMATE,
                numerical_error=fit.slope_error,
            )
        )  # fmt: skip
    return tuple(energies), tuple(findings)
