"""Ends: which of a problem's path ends paths are polished to, and with which conditions."""

from __future__ import annotations

import numpy as np

from vibrokit.analyzers.path_ends import AtFace, AtSaddle, PathEnd
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.at_face import FaceEnding
from vibrokit.analyzers.polishing.at_saddle import SaddleEnding
from vibrokit.analyzers.polishing.ending import Ending
from vibrokit.analyzers.polishing.linearized_orbit import linearized_orbit
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.finding import Code, Finding

_NEUTRAL = 1e-6  # distance of a multiplier from 1: that of a shift along a limit cycle is 1


def usable_ends(problem: ExitProblem) -> tuple[list[PathEnd], list[Finding]]:
    """Return the ends that paths are polished to: those that are not a last resort, if any of them can be used."""
    own = [end for end in problem.path_ends if not end.last_resort]
    findings = [
        Finding.of(Code.SADDLE_NOT_USABLE, problem.source, saddle=end.saddle, kind=obstacle(end, problem))
        for end in own
        if end.saddle >= 0 and obstacle(end, problem)
    ]
    usable = [end for end in own if not obstacle(end, problem)]
    if not usable:
        usable = [end for end in problem.path_ends if end.last_resort and not obstacle(end, problem)]
        findings += [Finding.of(Code.SADDLES_OF_OTHERS, problem.source)] if usable else []
    return usable, findings


def obstacle(end: PathEnd, problem: ExitProblem) -> str:
    """Return what an end is if no path can be polished to it, as to a basin; empty if one can."""
    if isinstance(end, AtFace):
        return ""
    if not isinstance(end, AtSaddle):
        return "of a kind without conditions"
    saddle = problem.structure.saddles[end.number]
    if saddle.kind == "chaotic":
        return "chaotic"
    neutral = bool(np.any(np.abs(np.abs(saddle.multipliers) - 1) < _NEUTRAL))
    return "a limit cycle" if saddle.period == 1 and saddle.duration > 0 and neutral else ""


def ending_at(end: PathEnd, problem: ExitProblem, propagator: SegmentPropagator) -> Ending:
    """Prepare the conditions of an end; raises StructureError if it is a saddle that is not hyperbolic."""
    if isinstance(end, AtFace):
        return FaceEnding(propagator, end)
    saddle = problem.structure.saddles[end.saddle]
    return SaddleEnding(propagator, linearized_orbit(propagator, saddle.points[0], max(1, saddle.period)))
