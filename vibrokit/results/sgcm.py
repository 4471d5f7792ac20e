"""Result of SGCM."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.errors import StructureError
from vibrokit.results.labels import source_among
from vibrokit.results.rated import RatedResult

if TYPE_CHECKING:
    from vibrokit.plots.quasi_potential import QuasiPotentialArtists


class SGCMResult(RatedResult):
    """Quasi-stationary densities, exit rates and activation energies.

    `data` has, along ``source``:

    - ``log_density`` over (``intensity_index``, ``density_node_x``, ``density_node_v``), ln ρ while probability leaves,
      of mass 1, NaN where it is not resolved; ``density_x`` and ``density_v`` are the nodes, which are closer in x
      where the oscillator is stiffer;
    - ``log_committor`` over (``intensity_index``, ``exit_index``, ``density_node_x``, ``density_node_v``), NaN where
      the density is too small to matter, and in the core of the attractor, where it is 0;
    - ``quasi_potential``, −D ln ρ at the least intensity, 0 at its minimum, on nodes at equal distances;
    - ``log_rate`` and ``log_rate_error`` over (``intensity_index``, ``exit_index``), with ``rate_target`` and
      ``rate_intensity``;
    - ``mass_drift`` over ``intensity_index``, the probability that truncation errors add in a section interval.
    """

    kind: ClassVar[str] = "sgcm"
    refined_by: ClassVar[str] = "raise nodes"

    def barrier(self, source: int | str) -> xarray.DataArray:
        """Return −D ln ρ at the lowest point of the saddles, above the minimum, over intensity (m² s⁻³).

        This is the activation energy as the WKB approximation has it at finite noise. It differs from the limit D → 0
        by the prefactors, of the order of D; `Result.energy` has the limit.

        Raises
        ------
        StructureError
            There is no density of this attractor, or no saddle.
        """
        one = self._of(source)
        points = [point[:2] for saddle in self.section.saddles for point in saddle]
        if not points:
            raise StructureError("the structure has no saddle.")
        places = xarray.DataArray(np.array(points), dims=("saddle_point", "component"))
        found = _over_nodes(one["log_density"].values, one, "barrier")
        depths = found.max(("x", "v")) - found.interp(x=places[:, 0], v=places[:, 1])
        barrier: xarray.DataArray = found["intensity"] * depths.min("saddle_point")
        return barrier.rename("barrier").assign_attrs(units="m2 s-3")

    def committor(self, source: int | str, target: int | str | None = None) -> xarray.DataArray:
        """Return the probability to reach a target before the core of the source, over (intensity, x, v).

        The start is on the section. NaN where the density of the source is too small to matter, and in its core, where
        the probability is 0.

        Parameters
        ----------
        source : int or str
        target : int or str, optional
            By default any exit.

        Raises
        ------
        StructureError
            There is no density of the source, or no rate to the target.
        """
        one = self._of(source)
        logs = one["log_committor"].assign_coords(exit_index=one["rate_target"].values)
        if target is not None:
            targets = [label for label in one["rate_target"].values.tolist() if label >= 0]
            logs = logs.sel(exit_index=[source_among(targets, target, self.names, "rate", "to")])
        probabilities = np.exp(logs.transpose("exit_index", ...).values)
        known = np.isfinite(probabilities).any(axis=0)
        return _over_nodes(np.where(known, np.nansum(probabilities, axis=0), np.nan), one, "committor")

    def mean_exit_time(self, source: int | str) -> xarray.DataArray:
        """Return the mean time until an exit from a start at each node on the section (s), over (intensity, x, v).

        It is the mean exit time of the attractor times the probability to return to its core first. The time that a
        state takes to relax within the basin is neglected. NaN where the committor is not known, and in the core.

        Raises
        ------
        StructureError
            There is no density of the source.
        """
        one = self._of(source)
        rates = np.nansum(np.exp(one["log_rate"].transpose("intensity_index", "exit_index").values), axis=1)
        returns = 1.0 - self.committor(source)
        with np.errstate(divide="ignore"):
            times = returns.copy(data=returns.values / rates[:, None, None])
        return times.rename("mean_exit_time").assign_attrs(units="s")

    def _of(self, source: int | str) -> xarray.Dataset:
        """The data of one attractor; raises StructureError."""
        labels = self.data["source"].values.tolist() if "log_density" in self.data else []
        return self.data.isel(source=labels.index(source_among(labels, source, self.names, "density", "of")))

    @called
    def plot(self, ax: Any = None, source: int | str | None = None) -> QuasiPotentialArtists:
        """Draw −D ln ρ at the least intensity; see `Result.plot_quasi_potential`."""
        return self.plot_quasi_potential(source, ax)


def _over_nodes(values: NDArray[np.float64], one: xarray.Dataset, name: str) -> xarray.DataArray:
    """Values over (intensity, x, v) with their coordinates, without what pads a smaller grid."""
    x, v = (one[f"density_{axis}"].values for axis in ("x", "v"))
    known = values[:, np.isfinite(x)][:, :, np.isfinite(v)]
    coordinates = {"intensity": one["rate_intensity"].values, "x": x[np.isfinite(x)], "v": v[np.isfinite(v)]}
    return xarray.DataArray(known, coordinates, ("intensity", "x", "v"), name)
