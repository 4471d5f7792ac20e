"""Structure: what the noise-free system does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import xarray

from vibrokit.construction import called
from vibrokit.errors import ResultFileError, counted
from vibrokit.results.arrays import Arrays
from vibrokit.results.attractor import Attractor, Survival, attractor_variables, read_attractors
from vibrokit.results.basins import Basins, grid_variables, read_grid
from vibrokit.results.fields import LARGEST, Number
from vibrokit.results.labels import label_of
from vibrokit.results.record import Record, Summary
from vibrokit.results.region import Region
from vibrokit.results.saddle import Manifold, Saddle
from vibrokit.results.table import Table, fields_of

if TYPE_CHECKING:
    from vibrokit.plots.basins import SectionArtists
    from vibrokit.plots.portraits import MotionArtists

_ATTRACTORS = Table("attractor", fields_of(Attractor), index="label")
_SADDLES = Table("saddle", fields_of(Saddle))
_MANIFOLDS = Table("manifold", fields_of(Manifold))

_REACHED = "distance at which an attractor counts as reached, as a fraction of the region's widths"
_SETTLING = Number(_REACHED, low=0.0, high=LARGEST)
_SHIFT = Number("distance along x that changes no motion: one turn; 0 for none", "m", 0.0, LARGEST)


class Structure(Record):
    """Attractors, basins, saddles and manifolds of a scene."""

    kind: ClassVar[str] = "structure"

    attractors: Annotated[tuple[Attractor, ...], "sorted by stop hits; those that run clear of the stops come first"]
    basins: Annotated[Basins, "the basins on a grid"]
    saddles: Annotated[tuple[Saddle, ...], "those on the boundaries of the basins"] = ()
    manifolds: Annotated[tuple[Manifold, ...], "branches of the saddles' stable and unstable manifolds"] = ()
    survival: Annotated[tuple[Survival, ...], "how long starts went on without settling; none if all settled soon"] = ()
    settling: Annotated[float, _SETTLING]
    budget: Annotated[int, "largest number of periods for which a trajectory was followed"]
    stepper: Annotated[str, 'stepper of the basin grid, as `vibrokit run --stepper` reads it: "rk4:256"']
    shift: Annotated[float, _SHIFT] = 0.0
    circle: Annotated[bool, "whether states a turn apart count as one; if not, motion to a copy has escaped"] = False

    @property
    def region(self) -> Region:
        """The region of (x, v) that the basins cover."""
        return self.basins.region

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the attractors, in the order of their labels."""
        return tuple(attractor.name for attractor in self.attractors)

    @called
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

    @called
    def plot(self, ax: Any = None) -> SectionArtists:
        """Draw attractors, saddles and manifolds over the basins; see `vibrokit.plots.basins.section_portrait`.

        Orbits inside a chaotic set are left out; the set itself is drawn.
        """
        from vibrokit.plots.basins import section_portrait

        saddles = [saddle for saddle in self.saddles if not saddle.embedded]
        return section_portrait(
            self.basins.labels,
            self.basins.region.bounds,
            [attractor.points for attractor in self.attractors],
            names=self.names,
            kinds=[attractor.kind for attractor in self.attractors],
            saddles=[saddle.points for saddle in saddles],
            saddle_kinds=[saddle.kind for saddle in saddles],
            stable=[manifold.curve for manifold in self.manifolds if manifold.stable],
            unstable=[manifold.curve for manifold in self.manifolds if not manifold.stable],
            cycles={a.label: a.orbit for a in self.attractors if a.kind == "limit cycle"},
            ax=ax,
        )

    @called
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
        return xarray.Dataset(
            {
                **grid_variables(self.basins.labels, self.basins.region, self.names),
                **attractor_variables(_ATTRACTORS, self.attractors, self.survival),
                **_SADDLES.variables(self.saddles),
                **_MANIFOLDS.variables(self.manifolds),
                **_SCALARS.variables([self]),
            }
        ).set_coords("attractor_name")

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a structure of its arrays; raises ResultFileError."""
        arrays = Arrays(dataset)
        attractors, survival = read_attractors(arrays, _ATTRACTORS)
        for place, attractor in enumerate(attractors):
            if attractor.label != place:
                raise ResultFileError(f"attractor {place} has label {attractor.label}; the two must be the same")
        saddles = _saddles(arrays, len(attractors))
        return cls(
            attractors=attractors,
            saddles=saddles,
            manifolds=_manifolds(arrays, saddles),
            basins=Basins(*read_grid(arrays, len(attractors))),
            survival=survival,
            **_SCALARS.read(arrays)[0],
            **provenance,
        )


_SCALARS = Table(
    "", {name: fields_of(Structure)[name] for name in ("settling", "budget", "stepper", "shift", "circle")}
)


def _described(attractor: Attractor) -> str:
    """What the legend of a picture calls an attractor: name, kind or period, and stop hits."""
    kind = f"period {attractor.period}" if attractor.kind == "periodic" else attractor.kind
    hits = f"{attractor.impacts:.3g} hit{'s' if attractor.impacts != 1 else ''}" if attractor.impacts else "no hits"
    if attractor.touched and not attractor.impacts:
        hits = f"pressed on the {attractor.touched[0]} stop"
    per = "" if attractor.repeats or not attractor.impacts else " per period"
    return f"{attractor.name}: {kind}, {hits}{per}"


def _saddles(arrays: Arrays, attractors: int) -> tuple[Saddle, ...]:
    saddles = tuple(Saddle(**values) for values in _SADDLES.read(arrays))
    for one in saddles:
        if any(label >= attractors for label in one.leads_to):
            raise ResultFileError(f"a saddle leads to {one.leads_to}, and there are {attractors} attractors")
        if len(one.points) == 0:
            raise ResultFileError(f"a {one.kind} orbit has no points")
        nodes, period = len(one.nodes), max(1, one.period)
        if one.kind != "chaotic" and nodes != 1 and (not nodes or nodes % period):
            raise ResultFileError(
                f"an orbit of period {period} has {nodes} nodes; 1 or a multiple of the period is valid"
            )
    return saddles


def _manifolds(arrays: Arrays, saddles: tuple[Saddle, ...]) -> tuple[Manifold, ...]:
    manifolds = tuple(Manifold(**values) for values in _MANIFOLDS.read(arrays))
    for one in manifolds:
        known = one.saddle < len(saddles) and one.point < len(saddles[one.saddle].points)
        if not known or one.side == 0:
            raise ResultFileError(
                f"a manifold starts on side {one.side} of point {one.point} of saddle {one.saddle}, which is missing"
            )
    return manifolds
