"""MFET: mean first exit times by simulation, and the activation energies that follow."""

from __future__ import annotations

import dataclasses
import math
from typing import ClassVar, Self

import numpy as np

from vibrokit.analyzers.analyzer import Analysis, Analyzer
from vibrokit.analyzers.metastability import with_states
from vibrokit.analyzers.mfet.dataset import dataset_of
from vibrokit.analyzers.mfet.importance import Importance
from vibrokit.analyzers.mfet.measurement import AtIntensity, Measurement
from vibrokit.analyzers.mfet.walk import Walk
from vibrokit.analyzers.neighbourhoods import covariances_of
from vibrokit.analyzers.problem import ExitProblem
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
from vibrokit.structure.validation import intensities, share
from vibrokit.symbolic.flow_kind import Flow

METHOD = "Arrhenius fit"
_INTENSITIES = (1.5, 1.2, 1.0)  # times the scene's, as SGCM has them
_SMALLEST_ERROR, _LARGEST_ERROR = 1e-3, 0.25  # a million and 16 exits
_REPLICAS = 32  # of splitting at a relative error of 0.1: its default of 128 reaches 0.05
_FEWEST_REPLICAS, _MOST_REPLICAS = 16, 1_000_000
_MOST_STAGES = 64  # of an importance function in a section interval: a tenth of a radian, where it may be interpolated


class MFET(Analyzer):
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
    takes_intensities: ClassVar[bool] = True

    intensities: tuple[float, ...] | None = None
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
        if self.intensities is not None:
            object.__setattr__(self, "intensities", intensities("MFET", self.intensities))

    def for_accuracy(self, accuracy: float) -> Self:
        """Return it with a standard error of half the accuracy; splitting gets as many replicas as that needs."""
        error = min(max(accuracy / 2, _SMALLEST_ERROR), _LARGEST_ERROR)
        replicas = max(_FEWEST_REPLICAS, math.ceil(_REPLICAS * (0.1 / error) ** 2))
        return dataclasses.replace(self, target_error=error, replicas=min(replicas, _MOST_REPLICAS))

    def least_intensity(self, osc: Oscillator) -> float:
        """The least of the intensities."""
        return min(self.intensities) if self.intensities else super().least_intensity(osc)

    def check(self, osc: Oscillator) -> None:
        """Refuse also noise of intensity 0, and a stepper that takes no noise."""
        super().check(osc)
        self._intensities(osc)
        if self.stepper is not None:
            self.stepper.check(osc, Flow.NOISY)

    def analyze(self, problem: ExitProblem) -> Analysis:
        """Simulate at each intensity; if the work is stopped, what was seen until then is kept, marked incomplete."""
        problem.check_turns("MFET")
        wanted = self._intensities(problem.osc)
        bystanders = problem.has_bystanders
        if self.splitting and bystanders:
            raise StructureError(
                "MFET: splitting=True follows excursions from one attractor, and the exit leaves others standing by; "
                "use splitting=None, or an exit that counts each of them (exit=LeaveBasin())."
            )
        if problem.at_exit:
            return Analysis(findings=(Finding.of(Code.AT_EXIT, problem.source),))
        attractors = problem.structure.attractors
        measured: list[AtIntensity] = []
        wanted, limits = with_states(problem, wanted)
        findings = list(limits)
        work = Stoppable("simulation of exit times", problem.source)
        covariances = {a.label: covariances_of(problem, a) for a in attractors}
        stepper = problem.ensemble_stepper(Flow.NOISY)
        for number, intensity in enumerate(wanted):
            measurement = Measurement(
                problem, intensity, self, stepper, covariances, _importance,
                problem.checkpoint.slot(problem.source, number),
            )  # fmt: skip
            try:
                with work, stage("exit times", subject=f"{problem.attractor.name}, D = {intensity:g}"):
                    measured.append(measurement.run())
            except StructureError as error:
                findings.append(
                    Finding.of(Code.INTENSITY_FAILED, problem.source, intensity=intensity, reason=str(error))
                )
            if work.stopped:
                with put_off():
                    so_far = measurement.so_far()
                measured += [] if so_far is None else [so_far]
                break
        findings += work.findings
        if not measured:
            return Analysis(findings=tuple(findings), complete=not work.stopped)
        for one in measured:
            findings += one.findings
        energies, more = _energies(problem, measured)
        return Analysis(energies, dataset_of(problem, measured), (*findings, *more), complete=not work.stopped)

    def _intensities(self, osc: Oscillator) -> tuple[float, ...]:
        assert osc.noise is not None  # every analyzer checks that
        if self.intensities is None and not osc.noise.intensity > 0:
            raise StructureError("the noise has the intensity 0, so nothing leaves; give intensities=(…,).")
        return self.intensities or tuple(factor * osc.noise.intensity for factor in _INTENSITIES)


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
    count = min(walk.looks(depth), _MOST_STAGES)
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
