"""Result of SGCM."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

from vibrokit.results.arrays import Arrays
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.result import Result

if TYPE_CHECKING:
    from vibrokit.plots.quasi_potential import QuasiPotentialArtists


class SGCMResult(Result):
    """Quasi-stationary densities, exit rates and activation energies.

    `data` has, along ``source``:

    - ``log_density`` over (``intensity_index``, ``density_node_x``, ``density_node_v``), ln p while probability leaves,
      of mass 1, NaN where it is not resolved; ``density_x`` and ``density_v`` are the nodes, which are closer in x
      where the oscillator is stiffer;
    - ``quasi_potential``, −D ln p at the least intensity, 0 at its minimum, on nodes at equal distances;
    - ``log_rate`` and ``log_rate_error`` over (``intensity_index``, ``exit_index``), with ``rate_target`` and
      ``rate_intensity``;
    - ``mass_drift`` over ``intensity_index``, the probability that truncation errors add in a section interval.
    """

    kind: ClassVar[str] = "sgcm"

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
                    if math.isnan(log_rate):
                        continue
                    found.append(
                        ExitRate(
                            source,
                            target,
                            intensity,
                            value=math.exp(log_rate),
                            lower=math.exp(log_rate - error),
                            upper=math.exp(log_rate + error),
                            event=str(one["rate_event"].values),
                            method="SGCM",
                        )
                    )
        return tuple(found)

    def plot(self, ax: Any = None, source: int | str | None = None) -> QuasiPotentialArtists:
        """Draw −D ln p at the least intensity; see `Result.plot_quasi_potential`."""
        return self.plot_quasi_potential(source, ax)
