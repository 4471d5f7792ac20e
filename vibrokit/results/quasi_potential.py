"""The quasi-potential of an attractor on the section, as arrays that results carry along and pictures show."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.results.content import Content, ResultFileError
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.path_pictures import with_paths
from vibrokit.results.region import Region
from vibrokit.results.section import Section

_NAME = re.compile(r"quasi_potential_(\d+)")
_SHOWN = 1.5  # times the largest energy: what lies beyond the exits needs no shades

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class QuasiPotential:
    """Least action from an attractor to the nodes of a grid.

    Attributes
    ----------
    label : int
        Of the attractor.
    values : array (nx, nv)
        Ψ (m² s⁻³); NaN where it is not known.
    box : array (2, 2)
        Bounds of x and of v, on which the outermost nodes lie.
    """

    label: int
    values: Array
    box: Array

    @property
    def data(self) -> xarray.Dataset:
        """The arrays ``quasi_potential_k`` and ``quasi_potential_box_k``."""
        k = self.label
        return xarray.Dataset(
            {
                f"quasi_potential_{k}": ((f"node_x_{k}", f"node_v_{k}"), self.values),
                f"quasi_potential_box_{k}": (("axis", "bound"), self.box),
            }
        )

    @classmethod
    def all_in(cls, data: xarray.Dataset) -> dict[int, QuasiPotential]:
        """Take all there are out of a result's data, by label.

        Raises
        ------
        ResultFileError
            One is of another shape or kind, or its box is none.
        """
        content = Content(data, {})
        labels = sorted(int(match[1]) for name in data.variables if (match := _NAME.fullmatch(str(name))))
        return {label: cls._read(content, label) for label in labels}

    @classmethod
    def _read(cls, content: Content, label: int) -> QuasiPotential:
        values = content.numbers(f"quasi_potential_{label}", (None, None), finite=False)
        box = content.numbers(f"quasi_potential_box_{label}", (2, 2))
        if min(values.shape) < 2:
            raise ResultFileError(f"its quasi_potential_{label} has fewer than two nodes along a side")
        try:
            return cls(label, values, Region(tuple(box[0].tolist()), tuple(box[1].tolist())).bounds)
        except StructureError as error:
            raise ResultFileError(f"its quasi_potential_box_{label}: {str(error).rstrip('.')}") from error


def plot_quasi_potential(
    data: xarray.Dataset, energies: Iterable[ActivationEnergy], source: int | None = None, ax: Any = None
) -> Any:
    """Draw a quasi-potential on the section; see `vibrokit.plots.quasi_potential.quasi_potential_map`.

    Parameters
    ----------
    data : xarray.Dataset
        With the section and the quasi-potentials.
    energies : iterable of ActivationEnergy
        Exit paths of the attractor are drawn over it.
    source : int, optional
        Label of the attractor; by default the first that has one.
    ax : matplotlib Axes, optional

    Raises
    ------
    StructureError
        It was not computed for this attractor, or for none.
    """
    from vibrokit.plots.quasi_potential import quasi_potential_map

    known = QuasiPotential.all_in(data)
    label = source if source is not None else min(known, default=None)
    if label not in known:
        there_are = f"; there are those of {', '.join(map(str, known))}" if known else ""
        raise StructureError(f"the result has no quasi-potential of attractor {label}{there_are}.")
    section, shown = Section.in_data(data), known[label]
    own = [energy for energy in energies if energy.source == label]
    half = np.diff(shown.box, axis=1) / (np.array(shown.values.shape)[:, None] - 1) / 2
    return quasi_potential_map(
        shown.values,
        shown.box + half * np.array([-1.0, 1.0]),
        section.points[label],
        label=label,
        top=_SHOWN * max(energy.value for energy in own) if own else None,
        saddles=section.saddles,
        paths=[path.q[path.section] for _, path in with_paths(own)],
        ax=ax,
    )
