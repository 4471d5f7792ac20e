"""Agreement: what polished paths and the graph say of the same exits, put together."""

from __future__ import annotations

import dataclasses

from vibrokit.analyzers.screening.screen import Screen
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy

_GRAPH = "graph"
_BRACKET = "least action (bracket)"
_VAGUE = 0.5  # of a path's action: a greater error of the graph says nothing of it


def least_of(branches: tuple[ActivationEnergy, ...]) -> dict[int, ActivationEnergy]:
    """Return the least action to each target; branches come the cheapest first."""
    found: dict[int, ActivationEnergy] = {}
    for branch in branches:
        found.setdefault(branch.target, branch)
    return found


def energies_of(found: Screen) -> dict[int, ActivationEnergy]:
    """Return what the graph has for each target."""
    return {
        target: ActivationEnergy(
            source=found.source,
            target=target,
            value=value,
            lower=max(0.0, value - error),
            upper=value + error,
            method=_GRAPH,
            residual=float("nan"),
            saddle=found.saddles[target],
        )
        for target, (value, error) in found.targets.items()
    }


def agreed(
    attractor: Attractor, polished: dict[int, ActivationEnergy], screened: dict[int, ActivationEnergy]
) -> tuple[list[ActivationEnergy], list[str]]:
    """Put polished paths and the graph together, target by target.

    A polished path bounds the least action from above; the graph, which no shot can miss, says whether a cheaper one is
    to be expected. Where the graph is cheaper by more than its error, the energy's lower bound is the graph's.

    Returns
    -------
    energies : list of ActivationEnergy
    words : list of str
        One sentence for each target.
    """
    energies, words = [], []
    for target in sorted({*polished, *screened}, key=lambda key: (key < 0, key)):
        path, graph = polished.get(target), screened.get(target)
        if path is None and graph is not None:
            energies.append(graph)
            words.append(
                f"{_from(attractor, target)} no path was polished; the graph's {_priced(graph)} is all there is."
            )
        elif path is not None and graph is not None:
            energies.append(_bounded(path, graph) if attractor.is_fixed else _bracket(path, graph))
            words.append(f"{_from(attractor, target)} {_compared(attractor, path, graph)}")
        elif path is not None:
            energies.append(path)
    return energies, words


def _bounded(path: ActivationEnergy, graph: ActivationEnergy) -> ActivationEnergy:
    return dataclasses.replace(path, lower=min(path.lower, graph.lower)) if graph.upper < path.value else path


def _bracket(path: ActivationEnergy, graph: ActivationEnergy) -> ActivationEnergy:
    """From a set, of whose orbits a few only were tried: the path above, the graph below."""
    return dataclasses.replace(
        path,
        value=min(path.value, graph.value),
        lower=min(path.lower, graph.lower),
        upper=path.upper,
        method=_BRACKET,
    )


def _compared(attractor: Attractor, path: ActivationEnergy, graph: ActivationEnergy) -> str:
    if not attractor.is_fixed:
        return f"a path from an orbit inside costs {path.value:.6g}, and the graph has {_priced(graph)}: a bracket."
    if graph.upper < path.value:
        return (
            f"the graph has {_priced(graph)}, less than the {path.value:.6g} of the best path polished: there is a "
            "cheaper way out that was not polished; take more cells, or more points of the action plot."
        )
    if graph.lower > path.value:
        return (
            f"the graph has {_priced(graph)}, more than the {path.value:.6g} of the path: its grid is too coarse here."
        )
    if graph.upper - graph.value > _VAGUE * path.value:
        return (
            f"the graph has {_priced(graph)}, and its grid is too coarse here to say more of the {path.value:.6g} of "
            "the path polished."
        )
    return f"the graph has {_priced(graph)}, and the path polished {path.value:.6g}: they agree."


def _from(attractor: Attractor, target: int) -> str:
    return f"From {attractor.label} to {target if target >= 0 else 'the exit'}:"


def _priced(graph: ActivationEnergy) -> str:
    return f"{graph.value:.4g} ± {graph.upper - graph.value:.1g}"
