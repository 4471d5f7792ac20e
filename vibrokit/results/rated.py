"""Results with exit rates at several noise intensities."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.errors import StructureError
from vibrokit.results.arrays import Arrays
from vibrokit.results.arrhenius import ArrheniusFit
from vibrokit.results.basins import ESCAPED
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.labels import exit_between, goal_of, source_among
from vibrokit.results.result import Result

if TYPE_CHECKING:
    from vibrokit.plots.exit_times import ExitTimeArtists, ExitTimes, SlopeArtists

METASTABLE = 10.0
"""Relaxations in a mean exit time: with fewer the state is left before it has formed."""
HELD = 0.5
"""Share of an attractor's core that lies in its own basin, at least: most of it."""

Array = NDArray[np.float64]


class RatedResult(Result):
    """Exit rates at finite noise, and activation energies.

    `data` has, along ``source``: ``log_rate`` and ``log_rate_error`` over (``intensity_index``, ``exit_index``),
    ``rate_target`` over ``exit_index``, ``rate_intensity`` and ``rate_method`` over ``intensity_index``, and
    ``rate_event``. A method may add ``log_rate_lower`` and ``log_rate_upper``, with the dimensions of ``log_rate``.
    Every analysis adds what decides which attractors are states of their own at that noise: ``relaxation_time`` (s)
    over ``core_source``, and ``core_share`` over (``intensity_index``, ``core_source``, ``core_label``), the share of
    the core of each attractor that lies in the basin of each; NaN where that is not known.
    """

    kind: ClassVar[str] = "rates"

    @property
    def intensities(self) -> list[float]:
        """Noise intensities D (m² s⁻³) of the analysis, descending."""
        if "rate_intensity" not in self.data:
            return []
        values = Arrays(self.data).numbers("rate_intensity", (None, None), finite=False)
        known: list[float] = np.unique(values[np.isfinite(values)])[::-1].tolist()
        return known

    @property
    def rates(self) -> tuple[ExitRate, ...]:
        """Exit rates of all attractors at all intensities."""
        return tuple(rate for rate in self._entries() if np.isfinite((rate.log_value, rate.log_error)).all())

    def _entries(self) -> list[ExitRate]:
        """The rate to each target at each intensity, also where it is not known."""
        arrays = Arrays(self.data)
        if "log_rate" not in arrays:
            return []
        labels = arrays.wholes("source", (None,), 0, len(self.names) - 1).tolist()
        values = arrays.numbers("log_rate", (len(labels), None, None), finite=False)
        errors = arrays.numbers("log_rate_error", values.shape, finite=False)
        intensities = arrays.numbers("rate_intensity", values.shape[:2], finite=False)
        methods = np.reshape(arrays.words("rate_method", values.shape[:2]), values.shape[:2])
        targets = arrays.wholes("rate_target", (values.shape[0], values.shape[2]), ESCAPED, len(self.names) - 1)
        events = arrays.words("rate_event", (len(labels),))
        lower, upper = (
            arrays.numbers(name, values.shape, finite=False) if name in arrays else np.full(values.shape, np.nan)
            for name in ("log_rate_lower", "log_rate_upper")
        )
        return [
            ExitRate(
                labels[s], int(targets[s, k]), float(intensities[s, i]), float(values[s, i, k]),
                float(errors[s, i, k]), events[s], str(methods[s, i]), float(lower[s, i, k]), float(upper[s, i, k]),
            )
            for s, i, k in np.ndindex(values.shape)
        ]  # fmt: skip

    @property
    def log_rates(self) -> xarray.DataArray:
        """ln of the rates (s⁻¹) over (intensity, source, target), by names; −∞ where no rate is known."""
        return self._between("log_rates", [(rate, rate.log_value) for rate in self.rates], -np.inf)

    @property
    def log_rate_bounds(self) -> tuple[xarray.DataArray, xarray.DataArray]:
        """Lower and upper bounds of `log_rates`; −∞ and ∞ where nothing is known.

        They are the method's 95 % interval if it has one, otherwise two error estimates on each side.
        """
        known = [rate for rate in self._entries() if not np.isnan((rate.log_lower, rate.log_upper)).any()]
        lower = self._between("lower", [(rate, rate.log_lower) for rate in known], -np.inf)
        return lower, self._between("upper", [(rate, rate.log_upper) for rate in known], np.inf)

    def _between(self, name: str, found: Iterable[tuple[ExitRate, float]], unknown: float) -> xarray.DataArray:
        """Numbers of rates between attractors over (intensity, source, target)."""
        known, names = self.intensities, list(self.names)
        values = np.full((len(known), len(names), len(names)), unknown)
        for rate, value in found:
            if rate.target >= 0:
                values[known.index(rate.intensity), rate.source, rate.target] = value
        coordinates = {"intensity": known, "source": names, "target": names}
        return xarray.DataArray(values, coordinates, ("intensity", "source", "target"), name)

    @property
    def relaxations(self) -> Array:
        """Relaxation times of all attractors (s), shape (attractors,); NaN where they are not known."""
        count, found = len(self.names), np.empty((0, len(self.names)))
        if "relaxation_time" in self.data:
            arrays = Arrays(self.data.transpose("source", "core_source", ...))
            found = arrays.numbers("relaxation_time", (None, count), finite=False)
        known = found[np.isfinite(found).all(axis=1)]  # the same for each source that has rates
        return known[0] if len(known) else np.full(count, np.nan)

    def core_shares(self, intensity: float) -> Array:
        """Return the share of each attractor's core in the basin of each, shape (attractors, attractors).

        It is that at the computed intensity nearest to the given one; NaN where it is not known.
        """
        count = len(self.names)
        if "core_share" not in self.data or not self.intensities:
            return np.full((count, count), np.nan)
        arrays = Arrays(self.data.transpose("source", "intensity_index", "core_source", "core_label", ...))
        places = arrays.numbers("rate_intensity", (None, None), finite=False)
        shares: Array = arrays.numbers("core_share", (*places.shape, count, count), finite=False)
        nearest = np.nanargmin(np.abs(np.log(places / intensity)))
        return shares.reshape(-1, count, count)[nearest]

    def arrhenius(self, source: int | str, target: int | str | None = None) -> ArrheniusFit:
        """Fit the Arrhenius law to the rates of one exit.

        Parameters
        ----------
        source : int or str
        target : int or str, optional
            By default the only one, or an exit that is no attractor.

        Raises
        ------
        StructureError
            There is no such exit, or there are not two intensities.
        """
        if not self.rates:
            raise StructureError("the result has no rates; see its findings.")
        label = source_among({rate.source for rate in self.rates}, source, self.names, "rate", "of")
        own = [rate for rate in self.rates if rate.source == label]
        reached = sorted({rate.target for rate in own})
        wanted = reached[0] if target is None else goal_of(target, self.names)
        if wanted not in reached:
            known = ", ".join(exit_between(self.names, label, one) for one in reached)
            raise StructureError(
                f"the result has no rate of {exit_between(self.names, label, wanted)}; it has {known}."
            )
        return ArrheniusFit.of([rate for rate in own if rate.target == wanted])

    @called
    def plot_rates(self, ax: Any = None, source: int | str | None = None) -> ExitTimeArtists:
        """Draw ln τ against 1/D, τ = 1/rate; see `vibrokit.plots.exit_times.exit_times`.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
        source : int or str, optional
            By default all attractors.
        """
        from vibrokit.plots.exit_times import exit_times

        return exit_times(self._exit_times(source), ax=ax)

    @called
    def plot_slopes(
        self, ax: Any = None, source: int | str | None = None, limits: Iterable[ActivationEnergy] = ()
    ) -> SlopeArtists:
        """Draw d ln τ/d(1/D) against D; see `vibrokit.plots.exit_times.exit_slopes`.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
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
