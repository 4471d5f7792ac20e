"""Structure: what the noise-free system does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Self

import xarray

from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import Basins
from vibrokit.results.labels import label_of
from vibrokit.results.manifold import Manifold
from vibrokit.results.record import Record
from vibrokit.results.saddle import Saddle
from vibrokit.results.structure_table import read_structure, structure_dataset
from vibrokit.results.summary import Summary, counted
from vibrokit.results.survival import Survival

if TYPE_CHECKING:
    from vibrokit.plots.basins import SectionArtists
    from vibrokit.plots.portraits import MotionArtists


class Structure(Record):
    """Attractors, basins, saddles and manifolds of a scene.

    Attributes
    ----------
    attractors : tuple of Attractor
        Sorted by stop hits; those that run clear of the stops come first.
    basins : Basins
    saddles : tuple of Saddle
        Those on the boundaries of the basins.
    manifolds : tuple of Manifold
        Branches of the saddles' stable and unstable manifolds.
    survival : tuple of Survival
        How long starts went on without settling; empty if all settled soon.
    settling : float
        Distance at which an attractor counts as reached.
    budget : int
        Largest number of periods for which a trajectory was followed.
    stepper : str
        Stepper of the basin grid, as `vibrokit run --stepper` reads it: ``"rk4:256"``.
    """

    kind: ClassVar[str] = "structure"

    attractors: tuple[Attractor, ...]
    basins: Basins
    saddles: tuple[Saddle, ...] = ()
    manifolds: tuple[Manifold, ...] = ()
    survival: tuple[Survival, ...] = ()
    settling: float
    budget: int
    stepper: str

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the attractors, in the order of their labels."""
        return tuple(attractor.name for attractor in self.attractors)

    def attractor(self, which: int | str) -> Attractor:
        """Return the attractor of a label or a name; the beginning of a name is enough if it is unique.

        Raises
        ------
        StructureError
            There is no such attractor.
        """
        return self.attractors[label_of(which, self.names)]

    @property
    def summary(self) -> Summary:
        """The attractors."""
        cells = " × ".join(map(str, self.basins.labels.shape))
        parts = (counted(len(self.attractors), "attractor"), counted(len(self.saddles), "saddle"))
        return Summary(
            f"Structure: {', '.join(parts)}, basins on {cells} cells",
            tuple((attractor.name, *attractor.description) for attractor in self.attractors),
        )

    def plot(self, ax: Any = None) -> SectionArtists:
        """Draw attractors, saddles and manifolds over the basins; see `vibrokit.plots.basins.section_portrait`."""
        from vibrokit.plots.basins import section_portrait

        return section_portrait(
            self.basins.labels,
            self.basins.region.bounds,
            [attractor.points for attractor in self.attractors],
            names=self.names,
            kinds=[attractor.kind for attractor in self.attractors],
            saddles=[saddle.points for saddle in self.saddles],
            saddle_kinds=[saddle.kind for saddle in self.saddles],
            stable=[manifold.curve for manifold in self.manifolds if manifold.stable],
            unstable=[manifold.curve for manifold in self.manifolds if not manifold.stable],
            cycles={a.label: a.orbit for a in self.attractors if a.kind == "limit cycle"},
            ax=ax,
        )

    def plot_orbits(self, ax: Any = None) -> MotionArtists:
        """Draw the steady motions in the phase plane; see `vibrokit.plots.portraits.steady_motions`."""
        from vibrokit.plots.portraits import steady_motions

        return steady_motions(
            [attractor.orbit for attractor in self.attractors],
            [attractor.points for attractor in self.attractors],
            stops=[(barrier["position"], barrier["side"]) for barrier in self.scene.get("barriers", ())],
            names=[_described(attractor) for attractor in self.attractors],
            ax=ax,
        )

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays with dimensions, coordinates, units and long names."""
        return structure_dataset(self)

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a structure of its arrays; raises ResultFileError."""
        return cls(**read_structure(dataset), **provenance)


def _described(attractor: Attractor) -> str:
    """What the legend of a picture calls an attractor: name, kind or period, and stop hits."""
    kind = f"period {attractor.period}" if attractor.kind == "periodic" else attractor.kind
    hits = f"{attractor.impacts:.3g} hit{'s' if attractor.impacts != 1 else ''}" if attractor.impacts else "no hits"
    pressed = sorted(side for side, depth in attractor.peak_depth.items() if depth > 0)
    if pressed and not attractor.impacts:
        hits = f"pressed on the {pressed[0]} stop"
    per = "" if attractor.repeats or not attractor.impacts else " per period"
    return f"{attractor.name}: {kind}, {hits}{per}"
