"""Structure: what the noise-free system does."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from typing import Any

from vibrokit.errors import StructureError
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import Basins
from vibrokit.results.manifold import Manifold
from vibrokit.results.saddle import Saddle
from vibrokit.results.survival import Survival


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Structure:
    """Attractors, basins, saddles and manifolds of a scene.

    Attributes
    ----------
    attractors : tuple of Attractor
        Those that run clear of the stops first, then by stop hits.
    saddles : tuple of Saddle
        Those on the boundaries of the basins.
    manifolds : tuple of Manifold
        Branches of the saddles' stable and unstable manifolds.
    basins : Basins
    survival : tuple of Survival
        What became of starts that were long in settling; empty if there were none.
    settling : float
        Distance at which an attractor counts as reached.
    budget : int
        Most periods that a trajectory was given to settle.
    stepper : str
        What carried the cells of the basin grid, as `vibrokit run --stepper` has it: ``"rk4:256"``.
    complete : bool
        False if the work was stopped before its end; `status` says what is missing.
    status : str
        What was found and what was not, as sentences.
    scene : dict
        The scene as plain data, with every parameter.
    seed : int or None
    seconds : float
        Time that it took.
    versions : dict
        Versions of the toolkit and of what it stands on.
    """

    attractors: tuple[Attractor, ...]
    saddles: tuple[Saddle, ...]
    manifolds: tuple[Manifold, ...]
    basins: Basins
    survival: tuple[Survival, ...]
    settling: float
    budget: int
    stepper: str
    complete: bool
    status: str
    scene: Mapping[str, Any]
    seed: int | None
    seconds: float
    versions: Mapping[str, str]

    def __repr__(self) -> str:
        return f"<Structure: {self.status}>"

    def attractor(self, label: int) -> Attractor:
        """Return the attractor of a label.

        Raises
        ------
        StructureError
            There is none of that label.
        """
        for attractor in self.attractors:
            if attractor.label == label:
                return attractor
        known = ", ".join(str(attractor.label) for attractor in self.attractors)
        raise StructureError(f"there is no attractor of label {label!r}; there are {known}.")

    def plot(self, ax: Any = None) -> Any:
        """Draw attractors, saddles and manifolds over the basins; see `vibrokit.plots.basins.section_portrait`."""
        from vibrokit.plots.basins import section_portrait

        return section_portrait(
            self.basins.labels,
            self.basins.region.bounds,
            [attractor.points for attractor in self.attractors],
            kinds=[attractor.kind for attractor in self.attractors],
            saddles=[saddle.points for saddle in self.saddles],
            saddle_kinds=[saddle.kind for saddle in self.saddles],
            stable=[manifold.curve for manifold in self.manifolds if manifold.stable],
            unstable=[manifold.curve for manifold in self.manifolds if not manifold.stable],
            cycles={a.label: a.orbit for a in self.attractors if a.kind == "limit cycle"},
            ax=ax,
        )

    def plot_orbits(self, ax: Any = None) -> Any:
        """Draw the steady motions in the phase plane; see `vibrokit.plots.portraits.steady_motions`."""
        from vibrokit.plots.portraits import steady_motions

        return steady_motions(
            [attractor.orbit for attractor in self.attractors],
            [attractor.points for attractor in self.attractors],
            stops=[(barrier["position"], barrier["side"]) for barrier in self.scene.get("barriers", ())],
            names=[_described(attractor) for attractor in self.attractors],
            ax=ax,
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to a netCDF file, whole or not at all; `vibrokit.load_result` opens it."""
        from vibrokit.results.structure_file import save_structure

        save_structure(self, path)


def _described(attractor: Attractor) -> str:
    """An attractor as the legend of a picture names it: label, kind or period, and stop hits."""
    kind = f"period {attractor.period}" if attractor.kind == "periodic" else attractor.kind
    hits = (
        "no hits" if attractor.impacts == 0 else f"{attractor.impacts:.3g} hit{'s' if attractor.impacts != 1 else ''}"
    )
    pressed = [side for side, depth in attractor.peak_depth.items() if depth > 0 and not attractor.hits.get(side)]
    if pressed and attractor.impacts == 0:
        hits = f"pressed on the {pressed[0]} stop"
    return f"{attractor.label}: {kind}, {hits}" + ("" if attractor.repeats or attractor.impacts == 0 else " a period")
