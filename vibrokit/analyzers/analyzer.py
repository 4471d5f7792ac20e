"""Analyzer: a method that answers how attractors are left."""

from __future__ import annotations

import dataclasses
import hashlib
import math
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from typing import Any, ClassVar, Self, dataclass_transform

import xarray

from vibrokit.analyzers.checkpoint import Checkpoint
from vibrokit.analyzers.exits import Exit, LeaveBasin
from vibrokit.analyzers.metastability import metastability
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.settings import settings_of
from vibrokit.construction import Constructed, called
from vibrokit.errors import SceneError, StepperError, StructureError, shown
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, put_off, stage, working
from vibrokit.results.atomic import checked_target
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding, check_findings
from vibrokit.results.record import versions
from vibrokit.results.result import Result
from vibrokit.results.stoppable import Stoppable
from vibrokit.results.structure import Structure
from vibrokit.scene_file import scene_data
from vibrokit.structure.validation import check_belongs, check_means

WEAK = 3.0  # ΔU/D: below, exp(ΔU/D) varies no faster than the prefactor, and escape is no rare event


@dataclasses.dataclass(frozen=True, eq=False)
class Analysis(metaclass=Constructed):
    """What a method found about one attractor.

    Attributes
    ----------
    estimates : tuple of ActivationEnergy
        The best one of each exit.
    data : xarray.Dataset
        Arrays behind the numbers, without a dimension ``source``: those of all attractors are joined along one.
    findings : tuple of Finding
        A text of your own is ``Finding.of(Code.REMARK, source, text=...)``.
    branches : tuple of ActivationEnergy
        All exit paths that were found, also those that are not the best; the cheapest first.
    complete : bool
        False if the work was stopped before its end.
    """

    estimates: tuple[ActivationEnergy, ...] = ()
    data: xarray.Dataset = dataclasses.field(default_factory=xarray.Dataset)
    findings: tuple[Finding, ...] = ()
    branches: tuple[ActivationEnergy, ...] = ()
    complete: bool = True

    def __post_init__(self) -> None:
        check_findings(self.findings)


def at_exit(problem: ExitProblem, method: str, bound: Bound) -> Analysis:
    """Return the analysis of an attractor that satisfies the exit condition without noise: its energy is 0."""
    end = problem.path_ends[0]
    zero = ActivationEnergy(
        problem.source, end.targets[0], 0.0, 0.0, 0.0, method, bound, numerical_error=0.0, saddle=end.saddle
    )
    return Analysis((zero,), findings=(Finding.of(Code.AT_EXIT, problem.source),))


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(dataclasses.field,))
@dataclasses.dataclass(frozen=True, kw_only=True)
class Analyzer(ABC, metaclass=Constructed):
    """A method with its configuration in its fields and no hidden state. Abstract.

    A subclass becomes a frozen dataclass by itself; no decorator is needed.

    Parameters
    ----------
    source : int or str, optional
        Label or name of the attractor to leave; by default each in turn.
    exit : Exit
        What counts as leaving.
    stepper : Stepper, optional
        By default each method chooses its own.

    For developers
    --------------
    Write `analyze`, and register the class under the entry-point group ``vibrokit.analyzers``: then ``vibrokit run
    SCENE --analyzer NAME`` runs it, and its results are saved, opened and drawn. A method with its own picture names a
    subclass of `Result` as its `result`. A method that gives exit rates at finite noise has a parameter
    ``intensities``, a tuple of numbers or None, and says ``takes_intensities = True``: `assess` then chooses them.
    """

    result: ClassVar[type[Result]] = Result
    keeps_checkpoints: ClassVar[bool] = False
    takes_intensities: ClassVar[bool] = False
    """Whether its parameter `intensities` lists noise intensities D (m² s⁻³) at which its result has exit rates."""

    source: int | str | None = None
    exit: Exit = dataclasses.field(default_factory=LeaveBasin)
    stepper: Stepper | None = None

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        dataclasses.dataclass(frozen=True, kw_only=True)(cls)

    @abstractmethod
    def analyze(self, problem: ExitProblem) -> Analysis:
        """Analyze how one attractor is left.

        Raises
        ------
        StructureError
            The method cannot be used for this attractor; the others are analyzed all the same.
        """

    @called
    def run(
        self,
        osc: Oscillator,
        structure: Structure,
        *,
        executor: Executor | None = None,
        progress: Progress = None,
        time_limit: float | None = None,
        checkpoint: str | os.PathLike[str] | None = None,
    ) -> Result:
        """Analyze a scene whose structure is known.

        On Ctrl-C, or when the time limit is reached, what was found so far is returned, marked incomplete.

        Parameters
        ----------
        osc : Oscillator
        structure : Structure
            What `find_structure` returned for this oscillator.
        executor : concurrent.futures.Executor, optional
            Where `SGCM` works on parts of a grid and `MFET` on some of its walkers; threads of this process by default,
            which the other methods always use. The result is the same to the last bit.
        progress : bool or callable, optional
            True shows progress on standard error; a function is called with each `vibrokit.progress.Update`.
        time_limit : float, optional
            In seconds.
        checkpoint : path, optional
            A file in which `MFET` keeps what it has done, every few seconds. If it exists, the work goes on from there;
            the result is the same to the last bit as without a pause. Other methods keep none.

        Returns
        -------
        Result

        Raises
        ------
        SceneError
            The scene has no noise.
        StructureError
            The structure is that of another scene, the scene has no such exit, the source is unknown, or the method
            keeps no checkpoints.
        CheckpointError
            The checkpoint is damaged, or belongs to other work.
        """
        sources = self._checked(osc, structure, executor)
        kept = self._checkpoint(osc, structure, checkpoint)
        problems = [ExitProblem(osc, structure, one, self.exit, self.stepper, executor, kept) for one in sources]
        with working(progress, time_limit) as work:
            try:
                analyses, stops = self._analyze_all(problems)
            finally:
                kept.flush()
            some = analyses.values()
            findings = [finding for one in some for finding in one.findings]
            findings += _strength(self.least_intensity(osc), some)
            findings += stops
            if kept.failure:
                findings.append(Finding.of(Code.CHECKPOINT_NOT_WRITTEN, path=str(kept.path), reason=kept.failure))
            return self.result.assembled(
                structure,
                estimates={label: one.estimates for label, one in analyses.items()},
                branches={label: one.branches for label, one in analyses.items()},
                data={label: one.data for label, one in analyses.items()},
                findings=tuple(findings),
                scene=scene_data(osc),
                settings=settings_of(self),
                stats=work.stats,
                complete=not stops and all(one.complete for one in some),
                seconds=work.seconds,
            )

    def check(self, osc: Oscillator) -> None:
        """Refuse a scene that the method cannot analyze, whatever its structure: `run` and the command line begin so.

        Raises
        ------
        SceneError, StructureError, StepperError
            The scene has no noise or no such exit; a setting is not for this scene.
        """
        check_means(osc, self.stepper, None)
        if osc.noise is None:
            raise SceneError("the scene has no noise, so nothing leaves an attractor; give it a noise model.")
        if not isinstance(self.exit, Exit):
            raise StructureError(f"exit must be an Exit, such as LeaveBasin(), got {shown(self.exit)}.")
        self.exit.check_scene(osc)

    def for_accuracy(self, accuracy: float) -> Self:
        """Return the analyzer with settings for a relative error of energies and mean times, the half of an interval.

        By default as it is: the method chooses its own effort. `assess` asks each analyzer.
        """
        return self

    def least_intensity(self, osc: Oscillator) -> float:
        """Return the least noise intensity for which energies are meant, that of the scene by default (m² s⁻³)."""
        return osc.noise.intensity if osc.noise else 0.0

    def _checked(self, osc: Oscillator, structure: Structure, executor: Executor | None) -> tuple[Attractor, ...]:
        """Check what a run is given, before any work is done, and return the attractors to leave."""
        check_means(osc, self.stepper, executor)
        check_belongs(osc, structure)
        self.check(osc)
        if not structure.attractors:
            raise StructureError(
                "the structure has no attractors, because its search was stopped before; find it with more time."
            )
        self.exit.check(osc, structure)
        return structure.attractors if self.source is None else (structure.attractor(self.source),)

    def _checkpoint(self, osc: Oscillator, structure: Structure, path: str | os.PathLike[str] | None) -> Checkpoint:
        if path is None:
            return Checkpoint(None, {})
        if not self.keeps_checkpoints:
            raise StructureError(f"{type(self).__name__} does not write checkpoints; leave out checkpoint=.")
        where = checked_target(path)
        points = [attractor.points.tolist() for attractor in structure.attractors]
        labels = hashlib.sha256(structure.basins.labels.tobytes()).hexdigest()
        return Checkpoint(
            where,
            {
                "scene": scene_data(osc),
                "settings": settings_of(self),
                "structure": [points, structure.basins.region.bounds.tolist(), labels],
                "versions": versions(),
            },
        )

    def _analyze_all(self, problems: Sequence[ExitProblem]) -> tuple[dict[int, Analysis], tuple[Finding, ...]]:
        """Analyze attractors in turn until the work is stopped; findings tell of a stop that no analysis tells of."""
        analyses, analyze = dict[int, Analysis](), self._analyzing()
        with Stoppable(type(self).__name__) as work:
            for problem in problems:
                work.source = problem.source
                with stage(work.doing, subject=problem.attractor.name):
                    analyses[problem.source] = found = self._analyzed(problem, analyze)
                if not found.complete:
                    break
        return analyses, work.findings

    def _analyzing(self) -> Callable[[ExitProblem], Analysis]:
        """Return what analyzes the attractors of one run, in turn; by default each by itself."""
        return self.analyze

    def _analyzed(self, problem: ExitProblem, analyze: Callable[[ExitProblem], Analysis]) -> Analysis:
        """The analysis of one attractor; a failure is a finding, and the others are analyzed all the same."""
        try:
            problem.check_basin()
            found = analyze(problem)
        except (StructureError, StepperError) as error:
            failed = Finding.of(Code.SOURCE_FAILED, problem.source, reason=str(error))
            return Analysis(findings=(failed,))
        self._check_returned(found, problem)
        with put_off():  # an interrupt must not lose the results
            data, limits = metastability(problem, found.data)
        return dataclasses.replace(found, data=data, findings=(*found.findings, *limits))

    def _check_returned(self, found: Any, problem: ExitProblem) -> None:
        """Refuse what no method may return, here where the class that returned it is known."""
        method, attractors = f"{type(self).__name__}.analyze", problem.structure.attractors
        if not isinstance(found, Analysis):
            raise TypeError(f"{method} must return an Analysis, got {shown(found)}.")
        for energy in (*found.estimates, *found.branches):
            if not isinstance(energy, ActivationEnergy):
                raise TypeError(f"{method} must return an ActivationEnergy for each exit, got {shown(energy)}.")
            if energy.source != problem.source:
                raise ValueError(
                    f"{method} returned the source {shown(energy.source)}; it must be {problem.source}, the label of "
                    "the attractor that it was given."
                )
            if energy.target not in range(ESCAPED, len(attractors)):
                raise ValueError(
                    f"{method} returned the target {shown(energy.target)}; it must be the label of an attractor, 0 to "
                    f"{len(attractors) - 1}, or -1 for another exit, -2 for escape."
                )
            if not energy.value >= 0:
                raise ValueError(f"{method} returned the energy {shown(energy.value)}; it must be 0 or positive.")
            if not energy.lower <= energy.value <= energy.upper:
                raise ValueError(
                    f"{method} returned the bounds {shown(energy.lower)} to {shown(energy.upper)}, which do not "
                    f"contain the energy {shown(energy.value)}; where nothing is known they are 0 and inf."
                )


def _strength(intensity: float, analyses: Iterable[Analysis]) -> list[Finding]:
    """Findings where the noise is not weak against an energy that is known."""
    energies = [energy for one in analyses for energy in one.estimates if math.isfinite(energy.upper)]
    return [finding for one in energies for finding in not_weak(one.source, one.target, one.value, intensity)]


def not_weak(source: int, target: int, energy: float, intensity: float) -> list[Finding]:
    """Return a finding if the noise is not weak against an energy."""
    if not 0 < energy < WEAK * intensity:
        return []
    values = {"ratio": energy / intensity, "intensity": intensity, "least": WEAK}
    return [Finding.of(Code.NOISE_NOT_WEAK, source, target, **values)]
