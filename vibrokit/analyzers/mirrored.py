"""Mirrored: the analysis of an attractor whose mirror image was analyzed before, without a search of its own."""

from __future__ import annotations

import dataclasses

from vibrokit.analyzers.analyzer import Analysis
from vibrokit.analyzers.graph.solution import GraphSolution
from vibrokit.analyzers.paths.candidate import same_action
from vibrokit.analyzers.paths.mirror import Mirror
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.road import ExitRoad
from vibrokit.analyzers.sources import MirrorImages
from vibrokit.results.codes import Code
from vibrokit.results.energy import Bound
from vibrokit.results.finding import Finding


def mirrored(problem: ExitProblem, known: Analysis, graph: GraphSolution | None) -> Analysis | None:
    """Polish the mirror images of known paths, and give each energy the bounds of the one that it is the image of.

    `known` and `graph` are of the attractor's mirror image. Returns None where the image of an exit is no path, or not
    one of the same action: then the attractor has to be searched as any other one. Exits with exact energies without a
    polished path are such.
    """
    mirror = Mirror(problem)
    originals = {mirror.target(one): one for one in known.estimates if one.bound is not Bound.EXACT}
    if not originals or None in originals or len(originals) < len(known.estimates):
        return None
    found = ExitRoad(problem, [MirrorImages(known.branches)]).run()
    same = {
        one.target: originals[one.target]
        for one in found.estimates
        if one.target in originals and same_action(one.value, originals[one.target].value)
    }
    if found.complete and (len(same) < len(originals) or len(same) < len(found.estimates)):
        return None
    estimates = tuple(
        dataclasses.replace(one, lower=min(same[one.target].lower, one.value), bound=same[one.target].bound)
        if one.target in same
        else one
        for one in found.estimates
    )
    findings = [
        Finding.of(Code.MIRROR_IMAGE, problem.source, each.target, path=same[each.target].value)
        if each.code is Code.NOT_SEARCHED and each.target in same
        else each
        for each in found.findings
    ]
    data = found.data if graph is None else graph.dataset(mirrored_after=mirror.later)
    return dataclasses.replace(found, estimates=estimates, data=data, findings=tuple(findings))
