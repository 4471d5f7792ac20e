"""Result of SGCM."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.results.arrays import Arrays
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.labels import exit_between, source_among
from vibrokit.results.result import Result

if TYPE_CHECKING:
    from vibrokit.plots.exit_times import ExitTimeArtists, ExitTimes, SlopeArtists
    from vibrokit.plots.quasi_potential import QuasiPotentialArtists


class SGCMResult(Result):
    """Quasi-stationary densities, exit rates and activation energies.

    `data` has, along ``source``:

    - ``log_density`` over (``intensity_index``, ``density_node_x``, ``density_node_v``), ln p while probability leaves,
      of mass 1, NaN where it is not resolved; ``density_x`` and ``density_v`` are the nodes, which are closer in x
      where the oscillator is stiffer;
    - ``log_committor`` over (``intensity_index``, ``exit_index``, ``density_node_x``, ``density_node_v``), NaN where
      the density is too small to matter, and in the core of the attractor, where it is 0;
    - ``quasi_potential``, −D ln p at the least intensity, 0 at its minimum, on nodes at equal distances;
    - ``log_rate`` and ``log_rate_error`` over (``intensity_index``, ``exit_index``), with ``rate_target`` and
      ``rate_intensity``;
    - ``mass_drift`` over ``intensity_index``, the probability that truncation errors add in a section interval.
    """

    kind: ClassVar[str] = "sgcm"

    @property
    def intensities(self) -> list[float]:
        """Noise intensities D (m² s⁻³) at which there are densities, descending."""
        if "rate_intensity" not in self.data:
            return []
        values = Arrays(self.data).numbers("rate_intensity", (None, None), finite=False)
        found: list[float] = np.nanmax(values, axis=0).tolist()
        return found

    @property
    def rates(self) -> tuple[ExitRate, ...]:
        """Exit rates of all attractors at all intensities."""
        arrays = Arrays(self.data)
        if "log_rate" not in arrays:
            return ()
        found = []
        for place, source in enumerate(self.data["source"].values.tolist()):
            one = self.data.isel(source=place)
            for i, intensity in enumerate(one["rate_intensity"].values.tolist()):
                for k, target in enumerate(one["rate_target"].values.tolist()):
                    log_rate, error = float(one["log_rate"][i, k]), float(one["log_rate_error"][i, k])
                    if not (math.isfinite(log_rate) and math.isfinite(error)):
                        continue
                    found.append(
                        ExitRate(
                            source,
                            target,
                            intensity,
                            log_value=log_rate,
                            log_error=error,
                            event=str(one["rate_event"].values),
                            method="SGCM",
                        )
                    )
        return tuple(found)

    def barrier(self, source: int | str) -> xarray.DataArray:
        """Return −D ln p at the lowest point of the saddles, above the minimum, over intensity (m² s⁻³).

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

    def plot(self, ax: Any = None, source: int | str | None = None) -> QuasiPotentialArtists:
        """Draw −D ln p at the least intensity; see `Result.plot_quasi_potential`."""
        return self.plot_quasi_potential(source, ax)

    def plot_rates(self, ax: Any = None, source: int | str | None = None) -> ExitTimeArtists:
        """Draw ln τ against 1/D, τ = 1/rate; see `vibrokit.plots.exit_times.exit_times`.

        Parameters
        ----------
        ax : matplotlib Axes, optional
        source : int or str, optional
            By default all attractors.
        """
        from vibrokit.plots.exit_times import exit_times

        return exit_times(self._exit_times(source), ax=ax)

    def plot_slopes(
        self, ax: Any = None, source: int | str | None = None, limits: Iterable[ActivationEnergy] = ()
    ) -> SlopeArtists:
        """Draw d ln τ/d(1/D) against D; see `vibrokit.plots.exit_times.exit_slopes`.

        Parameters
        ----------
        ax : matplotlib Axes, optional
        source : int or str, optional
            By default all attractors.
        limits : iterable of ActivationEnergy
            Drawn with their bounds; the slopes tend to them as D → 0. Those of `LeastAction` do not depend on D.
        """
        from vibrokit.plots.exit_times import exit_slopes

        lines = [(e.source, f"{self.exit_of(e)}, {e.method}", e.value, e.lower, e.upper) for e in limits]
        return exit_slopes(self._exit_times(source), lines, ax=ax)

    def _exit_times(self, source: int | str | None) -> list[ExitTimes]:
        """The mean times of every exit of one attractor, or of all, over intensity."""
        from vibrokit.plots.exit_times import ExitTimes

        found, rates = [], self.rates
        if source is not None:
            label = source_among({rate.source for rate in rates}, source, self.names, "rate", "of")
            rates = tuple(rate for rate in rates if rate.source == label)
        for start, target in dict.fromkeys((rate.source, rate.target) for rate in rates):
            own = [rate for rate in rates if (rate.source, rate.target) == (start, target)]
            found.append(
                ExitTimes(
                    [rate.intensity for rate in own],
                    [-rate.log_value for rate in own],
                    [rate.log_error for rate in own],
                    start,
                    exit_between(self.names, start, target),
                )
            )
        return found


def _over_nodes(values: NDArray[np.float64], one: xarray.Dataset, name: str) -> xarray.DataArray:
    """Values over (intensity, x, v) with their coordinates, without what pads a smaller grid."""
    x, v = (one[f"density_{axis}"].values for axis in ("x", "v"))
    known = values[:, np.isfinite(x)][:, :, np.isfinite(v)]
    coordinates = {"intensity": one["rate_intensity"].values, "x": x[np.isfinite(x)], "v": v[np.isfinite(v)]}
    return xarray.DataArray(known, coordinates, ("intensity", "x", "v"), name)
