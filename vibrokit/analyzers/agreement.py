"""Agreement: polished paths and the graph's estimates combined into energies with bounds."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence

from vibrokit.results.attractor import Attractor
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding

VAGUE = 0.5
"""Of a path's action: with a larger error the graph cannot exclude a path of half the action."""
_TIGHT = 0.01  # of a path's action: an exact lower bound so near to it certifies it; most graphs leave more
_SAME = 1e-6  # relative difference of the actions of a path and of its mirror image


def combined(
    attractor: Attractor,
    branches: Sequence[ActivationEnergy],
    estimates: Iterable[ActivationEnergy],
    mirrored: Mapping[int, ActivationEnergy] | None = None,
    least: Iterable[ActivationEnergy] = (),
    shots: Iterable[ActivationEnergy] = (),
) -> tuple[tuple[ActivationEnergy, ...], tuple[Finding, ...]]:
    """Combine the polished paths of an attractor with the graph's estimates, target by target.

    The upper bound is the action of the best path and its numerical error. The lower bound rests on the graph, which
    searches everywhere: it is the smaller of path and graph, each less its error. Where the two differ by more than the
    graph's error, that error was estimated too small, and their difference takes its place. Without a graph nothing
    excludes a cheaper path, and the lower bound is 0. The energy of a mirror image has the bounds of the other one.
    Where it is known what no path can cost less than, the lower bound is at least that; where that is what the exit
    costs, no path is needed. An action plot's path that was not polished is an upper bound within its own error.

    Given are the polished paths, the cheapest first, the graph's estimates, by target the energies that those of the
    attractor are mirror images of, the least possible actions, and the action plot's energies. Returns an energy and a
    finding for each target.
    """
    paths: dict[int, ActivationEnergy] = {}
    for branch in branches:
        paths.setdefault(branch.target, branch)
    graph, lowest, shot = ({each.target: each for each in some} for some in (estimates, least, shots))
    known = [target for target, each in lowest.items() if each.bound is Bound.EXACT]
    pairs = [
        _of_target(
            attractor,
            paths.get(target),
            graph.get(target),
            (mirrored or {}).get(target),
            lowest.get(target),
            shot.get(target),
        )
        for target in sorted({*paths, *graph, *known, *shot}, key=lambda target: (target < 0, target))
    ]
    return tuple(energy for energy, _ in pairs), tuple(finding for _, finding in pairs)


def cost_the_same(one: ActivationEnergy, other: ActivationEnergy) -> bool:
    """Return whether two exits, one of which may be the mirror image of the other, cost the same."""
    return abs(one.value - other.value) <= _SAME * one.value


def _of_target(
    attractor: Attractor,
    path: ActivationEnergy | None,
    graph: ActivationEnergy | None,
    mirrored: ActivationEnergy | None,
    least: ActivationEnergy | None,
    shot: ActivationEnergy | None,
) -> tuple[ActivationEnergy, Finding]:
    if path is None and least is not None and least.bound is Bound.EXACT:
        code, energy = Code.BARRIER_ENERGY, least
    elif path is not None and least is not None and path.value - least.lower <= _TIGHT * path.value:
        code, energy = Code.DETAILED_BALANCE, path
        if path.certificate is not None:
            energy = dataclasses.replace(path, bound=Bound.CERTIFIED)
    elif path is not None and mirrored is not None and cost_the_same(path, mirrored):
        code, energy = Code.MIRROR_IMAGE, dataclasses.replace(path, lower=mirrored.lower, bound=mirrored.bound)
    elif path is None and shot is not None:
        code, energy = Code.NOT_POLISHED, shot if graph is None else _bracket(shot, graph, Bound.UPPER)
    elif path is None:
        assert graph is not None
        code, energy = Code.NO_POLISHED_PATH, graph
    elif graph is None:
        code, energy = Code.NOT_SEARCHED, path
    elif not attractor.repeats or path.bound is Bound.BRACKET:
        code, energy = Code.BRACKET, _bracket(path, graph, Bound.BRACKET)
    else:
        code, energy = _compared(path, graph)
    values = {} if graph is None else {"graph": graph.value, "error": graph.numerical_error}
    values |= {} if path is None else {"path": path.value}
    values |= {} if shot is None else {"shot": shot.value}
    if least is not None:
        values["least"] = least.value
        energy = _raised(energy, least)
    return energy, Finding(code, attractor.label, energy.target, values)


def _raised(energy: ActivationEnergy, least: ActivationEnergy) -> ActivationEnergy:
    """An energy that is at least what no path can cost less than."""
    if energy.path is not None:
        lower = max(energy.lower, min(least.lower, energy.value - energy.numerical_error))
        return dataclasses.replace(energy, lower=lower)
    value = max(energy.value, least.value)
    error = max(energy.numerical_error, value - energy.value)
    upper, lower = max(energy.upper, value), max(energy.lower, least.lower)
    return dataclasses.replace(energy, value=value, lower=lower, upper=upper, numerical_error=error)


def _compared(path: ActivationEnergy, graph: ActivationEnergy) -> tuple[Code, ActivationEnergy]:
    """The path's energy with the lower bound that the graph supports, and how the two compare."""
    difference = abs(graph.value - path.value)
    if difference > graph.numerical_error:
        code = Code.CHEAPER_PATH_EXPECTED if graph.value < path.value else Code.GRAPH_TOO_COARSE
        lower = min(path.value, graph.value) - difference
    else:
        code = Code.GRAPH_TOO_COARSE if graph.numerical_error > VAGUE * path.value else Code.AGREEMENT
        lower = min(path.value - path.numerical_error, graph.value - graph.numerical_error)
    bound = Bound.CERTIFIED if code is Code.AGREEMENT and path.certificate is not None else Bound.UPPER
    return code, dataclasses.replace(path, lower=max(0.0, lower), bound=bound)


def _bracket(path: ActivationEnergy, graph: ActivationEnergy, bound: Bound) -> ActivationEnergy:
    """Between the graph and a path that need not be the best: of a few orbits inside a set, or not polished.

    The value is the smaller one of both, and that of the path where the graph's error is as large.
    """
    vague = graph.numerical_error > VAGUE * path.value
    value = path.value if vague else min(path.value, graph.value)
    lower = min(2 * path.value - path.upper, graph.lower)
    return dataclasses.replace(path, value=value, lower=max(0.0, lower), bound=bound)
