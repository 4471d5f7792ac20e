"""Picture of the quasi-potential of a result: collects the arrays that it shows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrokit.errors import ResultFileError, StructureError
from vibrokit.results.arrays import Arrays
from vibrokit.results.labels import label_of
from vibrokit.results.path_pictures import with_paths

if TYPE_CHECKING:
    from vibrokit.plots.quasi_potential import QuasiPotentialArtists
    from vibrokit.results.result import Result

_SHOWN = 1.5  # times the largest energy: above it, all shades are the same


def plot_quasi_potential(result: Result, source: int | str | None = None, ax: Any = None) -> QuasiPotentialArtists:
    """Draw a quasi-potential on the section; see `vibrokit.plots.quasi_potential.quasi_potential_map`.

    Parameters
    ----------
    result : Result
        Its data is as `ActionGraphResult` describes. Exit paths of the attractor are drawn over it.
    source : int or str, optional
        Label or name of the attractor; by default the first that has one.
    ax : matplotlib Axes, optional

    Raises
    ------
    StructureError
        It was not computed for this attractor, or for any.
    ResultFileError
        The arrays are not those of a quasi-potential.
    """
    from vibrokit.plots.quasi_potential import quasi_potential_map

    known = _potentials(result)
    if not known:
        raise StructureError("the result has no quasi-potential.")
    label = min(known) if source is None else label_of(source, result.names)
    if label not in known:
        have = ", ".join(result.names[other] for other in known)
        raise StructureError(f"the result has no quasi-potential of {result.names[label]}; it has those of {have}.")
    values, bounds = known[label]
    own = [energy for energy in result.energies if energy.source == label]
    return quasi_potential_map(
        values,
        bounds,
        result.section.points[label],
        label=label,
        names=result.names,
        top=_SHOWN * max(energy.value for energy in own) if own else None,
        saddles=result.section.saddles,
        paths=[path.q[path.section] for _, path in with_paths(own)],
        ax=ax,
    )


def _potentials(result: Result) -> dict[int, tuple[Any, Any]]:
    """By label: the quasi-potential on the nodes, and the bounds of the cells around them."""
    arrays = Arrays(result.data)
    if "quasi_potential" not in arrays:
        return {}
    labels = arrays.wholes("source", (None,), 0, len(result.names) - 1)
    values = arrays.numbers("quasi_potential", (len(labels), None, None), finite=False)
    nodes = [arrays.numbers(f"quasi_potential_{axis}", (len(labels), None), finite=False) for axis in ("x", "v")]
    if values.shape[1:] != (nodes[0].shape[1], nodes[1].shape[1]):
        raise ResultFileError(f"its quasi_potential has shape {values.shape}, which its nodes contradict")
    known = {}
    for label, psi, *axes in zip(labels.tolist(), values, *nodes, strict=True):
        counts = [int(np.isfinite(axis).sum()) for axis in axes]  # shorter ones end in NaN
        if not np.isfinite(psi).any():
            continue
        bounds = [_bounds(axis[:count]) for axis, count in zip(axes, counts, strict=True)]
        known[label] = psi[: counts[0], : counts[1]], np.array(bounds)
    return known


def _bounds(nodes: Any) -> tuple[float, float]:
    """Bounds of the cells around the nodes of one axis."""
    if len(nodes) < 2 or not np.all(np.diff(nodes) > 0):
        raise ResultFileError("its quasi_potential needs at least two nodes along each side, in ascending order")
    half = (nodes[-1] - nodes[0]) / (len(nodes) - 1) / 2
    return float(nodes[0] - half), float(nodes[-1] + half)
