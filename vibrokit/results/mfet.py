"""Result of MFET."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray

from vibrokit.construction import called
from vibrokit.errors import StructureError
from vibrokit.results.labels import source_among
from vibrokit.results.rated import RatedResult

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from vibrokit.plots.escapes import EscapeArtists
    from vibrokit.plots.exit_times import ExitTimeArtists
    from vibrokit.plots.survival import SurvivalArtists


class MFETResult(RatedResult):
    """Exit times from simulation, exit rates and activation energies.

    `data` has, along ``source`` and ``intensity_index``, beside what `RatedResult` lists:

    - ``log_rate_lower`` and ``log_rate_upper`` over ``exit_index``, the 95 % interval of ``log_rate``;
    - ``exit_time`` and ``exit_target`` over ``exit_number``, of walkers simulated directly, in the order of the exits;
      ``walkers_left_over``, which had not left by the last of these times; ``time_at_risk`` of all walkers together;
    - ``exponential_p_value``, of the test that exit times follow an exponential law;
    - ``step_change`` and ``step_change_error``, what half the steps change in ``log_rate`` of all exits together;
    - ``escape_x`` and ``escape_v`` over (``escape``, ``escape_sample``) and ``escape_time`` over ``escape_sample``, the
      last parts of some walkers that left, aligned at the exit; ``escape_target`` over ``escape``.
    """

    kind: ClassVar[str] = "mfet"
    refined_by: ClassVar[str] = "lower target_error"

    def exit_times(self, source: int | str, intensity: float | None = None) -> xarray.DataArray:
        """Return the times of the exits that were simulated directly (s), with their targets as a coordinate.

        Parameters
        ----------
        source : int or str
        intensity : float, optional
            The nearest one that is known; by default the least that was simulated directly.

        Raises
        ------
        StructureError
            Nothing was simulated directly.
        """
        one = self._at(source, intensity, "exit_time")
        times = one["exit_time"].assign_coords(target=one["exit_target"].drop_vars("target", errors="ignore"))
        found: xarray.DataArray = times[np.isfinite(times.values)]
        return found

    def escapes(
        self, source: int | str, target: int | str | None = None, intensity: float | None = None
    ) -> xarray.DataArray:
        """Return realizations on their way out, over (escape, time, component); NaN before the start of one.

        Parameters
        ----------
        source, target : int or str
            By default all targets.
        intensity : float, optional
            The nearest one that is known; by default the least that was simulated directly.

        Raises
        ------
        StructureError
            No realization was kept.
        """
        one = self._at(source, intensity, "escape_x")
        known = np.isfinite(one["escape_time"].values)
        values = np.stack([one["escape_x"].values[:, known], one["escape_v"].values[:, known]], axis=-1)
        kept = np.isfinite(values[..., 0]).any(axis=1)
        if target is not None:
            goal = source_among(set(range(len(self.names))), target, self.names, "escape", "to")
            kept &= one["escape_target"].values == goal
        coordinates = {"time": one["escape_time"].values[known], "component": ["x", "v"]}
        return xarray.DataArray(values[kept], coordinates, ("escape", "time", "component"), "escapes")

    def _at(self, source: int | str, intensity: float | None, needed: str) -> xarray.Dataset:
        """The data of one attractor at one intensity that has something; raises StructureError."""
        absent = "no realization was kept" if needed.startswith("escape") else "nothing was simulated directly"
        labels = self.data["source"].values.tolist() if needed in self.data else []
        if not labels:
            raise StructureError(f"{absent}; see the result's settings and findings.")
        own = self.data.isel(source=labels.index(source_among(labels, source, self.names, "exit", "of")))
        finite = np.isfinite(own[needed].transpose("intensity_index", ...).values)
        known = np.flatnonzero(finite.reshape(len(finite), -1).any(axis=1))
        if not len(known):
            raise StructureError(f"{absent}; see the result's settings and findings.")
        intensities = own["rate_intensity"].values[known]
        wanted = intensities.min() if intensity is None else intensity
        return own.isel(intensity_index=known[np.argmin(np.abs(np.log(intensities / wanted)))])

    @called
    def plot(self, ax: Any = None) -> ExitTimeArtists:
        """Draw ln τ against 1/D; see `RatedResult.plot_rates`."""
        return self.plot_rates(ax)

    @called
    def plot_exit_times(self, ax: Any = None, source: int | str = 0, intensity: float | None = None) -> SurvivalArtists:
        """Draw the share of walkers that have not left, with the exponential law; see `vibrokit.plots.survival`."""
        from vibrokit.plots.survival import survival

        one = self._at(source, intensity, "exit_time")
        times = one["exit_time"].values
        times = times[np.isfinite(times)]
        rate = float(np.nansum(np.exp(one["log_rate"].values)))
        return survival(times, int(one["walkers_left_over"]), 1.0 / rate, label=int(one["source"]), ax=ax)

    @called
    def plot_escapes(
        self,
        ax: Any = None,
        source: int | str = 0,
        target: int | str | None = None,
        intensity: float | None = None,
        path: ArrayLike | None = None,
        last: float | None = None,
    ) -> EscapeArtists:
        """Draw realizations on their way out and the density of their paths; see `vibrokit.plots.escapes.escapes`.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
        source, target : int or str
        intensity : float, optional
        path : array_like (count, 2), optional
            A path that is drawn over them, such as ``energy.path.q``.
        last : float, optional
            How much of each is drawn: the last so many seconds. By default all that was kept.
        """
        from vibrokit.plots.escapes import escapes

        found = self.escapes(source, target, intensity)
        if last is not None:
            found = found.sel(time=slice(-last, None))
        return escapes(found.values, path=path, saddles=self.section.saddles, points=self.section.points, ax=ax)
