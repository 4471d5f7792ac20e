"""Nodes: candidates on the nodes of paths, the conditions of each end there, and which ends can be used."""

from __future__ import annotations

import functools
from collections.abc import Callable
from functools import cached_property

from vibrokit.analyzers.path_ends import AtFace, AtSaddle, PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ending import Ending, ResampledCandidate, resampled
from vibrokit.analyzers.polishing.endings import FaceEnding, SaddleEnding
from vibrokit.analyzers.polishing.linearize import linearized_orbit
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.time_scales import fastest_of_noise
from vibrokit.oscillator import Oscillator
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.structure.scales import doublings_of
from vibrokit.symbolic.flow_kind import Flow

_CHAOTIC = "chaotic"


class Nodes:
    """Candidates at the nodes of paths, and the conditions of ends there, each made once.

    Both may raise StructureError: a candidate as `ending.resampled` does, an end if it is a saddle that is not
    hyperbolic.
    """

    def __init__(self, problem: ExitProblem, *, fine: bool = False) -> None:
        self.problem, pieces = problem, pieces_of(problem.scene)[fine]
        stepper = problem.single_stepper(Flow.HAMILTONIAN_VARIATIONAL)
        self.propagator = SegmentPropagator(problem.scene, stepper, pieces)
        self.resampled: Callable[[Candidate], ResampledCandidate] = functools.cache(
            lambda candidate: resampled(self.propagator, candidate)
        )
        self.ending: Callable[[PathEnd], Ending] = functools.cache(lambda end: ending_at(end, problem, self.propagator))

    def distance(self, end: PathEnd, candidate: Candidate) -> float:
        """Return how near a candidate comes to an end."""
        return self.ending(end).distance(self.resampled(candidate))

    @cached_property
    def finer(self) -> Nodes:
        """Nodes half as far apart."""
        return Nodes(self.problem, fine=True)

    def usable(self) -> tuple[list[PathEnd], list[Finding]]:
        """Return the ends that paths are polished to: the usable ones on the own basin boundary.

        Where there are none, or all of them lie inside chaotic sets, saddles between other basins are added.
        """
        problem, obstacles, usable = self.problem, dict[int, str](), list[PathEnd]()
        for end in problem.path_ends:
            if not end.last_resort:
                found = obstacle(end, problem) or self._not_linear(end)
                usable += [] if found else [end]
                obstacles |= {end.saddle: found} if found and end.saddle >= 0 else {}
        inside = [end.saddle for end in usable if end.one_of_many]
        findings = [
            Finding.of(Code.SADDLE_NOT_USABLE, problem.source, saddle=saddle, kind=kind)
            for saddle, kind in obstacles.items()
            if not (kind == _CHAOTIC and inside)
        ]
        if inside:
            findings.append(Finding.of(Code.CHAOTIC_BOUNDARY, problem.source, saddles=inside))
        if all(end.one_of_many for end in usable):
            ends = [end for end in problem.path_ends if end.last_resort and not end.one_of_many]
            others = [end for end in ends if not (obstacle(end, problem) or self._not_linear(end))]
            findings += [Finding.of(Code.SADDLES_OF_OTHERS, problem.source)] if others else []
            usable += others
        return usable, findings

    def _not_linear(self, end: PathEnd) -> str:
        try:
            self.ending(end)
        except StructureError:
            return "an orbit along which the motion cannot be linearized"
        return ""


def obstacle(end: PathEnd, problem: ExitProblem) -> str:
    """Return why no path can be polished to an end of its kind, in words; empty if one can."""
    if isinstance(end, AtFace):
        return ""
    if not isinstance(end, AtSaddle):
        return "of a kind without conditions"
    return _CHAOTIC if problem.structure.saddles[end.number].kind == _CHAOTIC else ""


def ending_at(end: PathEnd, problem: ExitProblem, propagator: SegmentPropagator) -> Ending:
    """Prepare the conditions of an end; raises StructureError if it is a saddle that is not hyperbolic."""
    if isinstance(end, AtFace):
        return FaceEnding(propagator, end)
    saddle = problem.structure.saddles[end.saddle]
    orbit = linearized_orbit(propagator, saddle.nodes, saddle.period, saddle.duration)
    return SaddleEnding(propagator, orbit)


def pieces_of(scene: Oscillator) -> tuple[int, int]:
    """Return the numbers of pieces of a section interval that paths are solved with, in turn; more in a long one.

    The extra states of the noise decay by e⁸ in a piece at most, and momenta grow by as much.
    """
    coarse = 8 * 2 ** doublings_of(scene)
    while fastest_of_noise(scene) * scene.section_interval > 8.0 * coarse:
        coarse *= 2
    return coarse, 2 * coarse
