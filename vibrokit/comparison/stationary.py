"""StationaryDensity: the density over all attractors, from what SGCM finds for each."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.special import logsumexp

from vibrokit.arguments import pair
from vibrokit.comparison.occupancies import balances, occupancies, shares_text
from vibrokit.construction import Constructed, called
from vibrokit.documented import documented
from vibrokit.errors import StructureError, shown
from vibrokit.results.labels import label_of
from vibrokit.results.section import Section
from vibrokit.results.sgcm import SGCMResult

if TYPE_CHECKING:
    from vibrokit.plots.quasi_potential import QuasiPotentialArtists

Array = NDArray[np.float64]

_LOWEST = -1e6  # in place of −inf where ln ρ is interpolated


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class StationaryDensity(metaclass=Constructed):
    """Stationary probabilities of all attractors and the density on the section, at finite noise.

    The exit rates W between the attractors balance: for two attractors W_12 P_1 = W_21 P_2, where W_12 is the rate from
    1 to 2. The density is the sum of the quasi-stationary ones, each with the probability of its attractor. Nothing
    waits for relaxation between basins, so that it is right also where that takes 10³⁰ periods.
    """

    intensities: Annotated[Array, "noise intensities D (m² s⁻³), descending"]
    log_weights: Annotated[Array, "ln of the weight of the density of each attractor, shape (intensities, attractors)"]
    log_density: Annotated[Array, "ln ρ at the nodes; −inf where it is not resolved, shape (intensities, nx, nv)"]
    x: Annotated[Array, "nodes at equal distances (m)"]
    v: Annotated[Array, "nodes at equal distances (m s⁻¹)"]
    section: Annotated[Section, "attractors and saddles"]
    occupancies: Annotated[xarray.DataArray, "probability of each metastable state, as of `vibrokit.occupancies`"]

    @classmethod
    @called
    def of(cls, result: SGCMResult, nodes: tuple[int, int] = (240, 240)) -> StationaryDensity:
        """Combine what `SGCM` found for every attractor of a scene.

        Raises
        ------
        StructureError
            The result is not one of SGCM, an attractor was not analyzed, no exit from one was resolved, or the nodes
            are too few.
        """
        if not isinstance(result, SGCMResult):
            raise StructureError(f"StationaryDensity.of needs a result of SGCM, got {shown(result)}.")
        if "log_density" not in result.data:
            raise StructureError("SGCM has no density of any attractor; see the result's findings.")
        weights = np.array([balance.log_probabilities for balance in balances(result)])
        x, v, parts = _on_one_grid(result, pair("StationaryDensity.of: nodes", nodes, least=2))
        density = logsumexp(parts + weights[:, :, None, None], axis=1)
        return cls(np.array(result.intensities), weights, density, x, v, result.section, occupancies(result))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the attractors, in the order of their labels."""
        return self.section.names

    @property
    def density(self) -> xarray.DataArray:
        """The stationary density on the section (s m⁻²), over (intensity, x, v)."""
        return self._over_section(np.exp(self.log_density), "density")

    @property
    def quasi_potential(self) -> xarray.DataArray:
        """−D ln ρ (m² s⁻³), 0 at its minimum, over (intensity, x, v); infinite where ρ is not resolved."""
        potential = -self.intensities[:, None, None] * self.log_density
        potential -= potential.min(axis=(1, 2), keepdims=True)
        return self._over_section(potential, "quasi_potential")

    @called
    def barrier(self, source: int | str) -> xarray.DataArray:
        """Return −D ln ρ at the lowest point of the saddles, above that of an attractor, over intensity (m² s⁻³).

        Near a saddle the density is the sum of those of the states on both sides. `SGCMResult.barrier` has that of one
        state alone, which is higher.

        Raises
        ------
        StructureError
            The source is unknown, or there is no saddle.
        """
        if not self.section.saddles:
            raise StructureError("the structure has no saddle.")
        well, saddle = (
            self.quasi_potential.interp(x=("point", points[:, 0]), v=("point", points[:, 1])).min("point")
            for points in (self.section.points[label_of(source, self.names)], np.concatenate(self.section.saddles))
        )
        return (saddle - well).rename("barrier").assign_attrs(units="m2 s-3")

    def _over_section(self, values: Array, name: str) -> xarray.DataArray:
        coordinates = {"intensity": self.intensities, "x": self.x, "v": self.v}
        return xarray.DataArray(values, coordinates, ("intensity", "x", "v"), name)

    @called
    def plot(
        self, ax: Any = None, intensity: float | None = None, paths: Sequence[ArrayLike] = ()
    ) -> QuasiPotentialArtists:
        """Draw −D ln ρ with all attractors and saddles; see `vibrokit.plots.quasi_potential.quasi_potential_map`.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
        intensity : float, optional
            The nearest one that is known; by default the least.
        paths : sequence of array_like (count, 2)
            Points on the section that are drawn over it, such as ``path.q[path.section]`` of an exit path.
        """
        from vibrokit.plots.quasi_potential import quasi_potential_map

        chosen = self._place(intensity)
        found = self.quasi_potential.values[chosen]
        half = [0.5 * (axis[1] - axis[0]) for axis in (self.x, self.v)]
        bounds = [(self.x[0] - half[0], self.x[-1] + half[0]), (self.v[0] - half[1], self.v[-1] + half[1])]
        likeliest = int(np.argmax(self.log_weights[chosen]))
        return quasi_potential_map(
            found,
            bounds,
            self.section.points[likeliest],
            label=likeliest,
            names=self.names,
            top=self._shown(found),
            others={label: points for label, points in enumerate(self.section.points) if label != likeliest},
            saddles=self.section.saddles,
            paths=paths,
            ax=ax,
        )

    def _place(self, intensity: float | None) -> int:
        """Which intensity is the nearest one, the least by default."""
        return int(np.argmin(np.abs(self.intensities - (0.0 if intensity is None else intensity))))

    def _shown(self, potential: Array) -> float | None:
        """The value up to which a picture tells shades apart: somewhat above the highest saddle."""
        points = np.concatenate([saddle[:, :2] for saddle in self.section.saddles] or [np.empty((0, 2))])
        inside = (points >= [self.x[0], self.v[0]]) & (points <= [self.x[-1], self.v[-1]])
        points = points[inside.all(axis=1)]
        there = potential[np.searchsorted(self.x, points[:, 0]), np.searchsorted(self.v, points[:, 1])]
        there = there[np.isfinite(there)]
        return 1.3 * float(there.max()) if there.size else None

    def __str__(self) -> str:
        return shares_text(self.occupancies)


def _on_one_grid(result: SGCMResult, nodes: tuple[int, int]) -> tuple[Array, Array, Array]:
    """Nodes at equal distances over all regions, and ln ρ there, shape (intensities, attractors, nx, nv)."""
    data = result.data
    axes = {axis: data[f"density_{axis}"].values for axis in ("x", "v")}
    x, v = (
        np.linspace(np.nanmin(axis), np.nanmax(axis), count) for axis, count in zip(axes.values(), nodes, strict=True)
    )
    points = np.stack(np.meshgrid(x, v, indexing="ij"), axis=-1)
    known = np.nan_to_num(data["log_density"].values, nan=-np.inf)
    area = math.log((x[1] - x[0]) * (v[1] - v[0]))
    parts = np.full((known.shape[1], len(result.names), *nodes), -np.inf)
    for place, label in enumerate(data["source"].values.tolist()):
        own = tuple(axes[axis][place][np.isfinite(axes[axis][place])] for axis in ("x", "v"))
        for number, phi in enumerate(known[place]):
            resolved = np.maximum(phi[: len(own[0]), : len(own[1])], _LOWEST)
            found = RegularGridInterpolator(own, resolved, bounds_error=False, fill_value=-np.inf)(points)
            least = np.min(resolved, where=resolved > _LOWEST, initial=np.inf)
            found = np.where(found >= least, found, -np.inf)
            if np.isneginf(found).all():
                raise StructureError(
                    f"the density of {result.names[label]} at D = {result.intensities[number]:g} is narrower than the "
                    f"distance of {nodes[0]} × {nodes[1]} nodes; ask for more."
                )
            parts[number, label] = found - logsumexp(found) - area  # interpolation changes the mass a little
    return x, v, parts
