"""Trajectory: states at equally spaced times."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.documented import documented

if TYPE_CHECKING:
    import xarray

    from vibrokit.plots.portraits import PortraitArtists


@documented
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """A trajectory at equally spaced times."""

    t: Annotated[NDArray[np.float64], "times (s)"]
    states: Annotated[NDArray[np.float64], "displacement (m), velocity (m s⁻¹), extra noise states, shape (count, n)"]
    stops: Annotated[tuple[float, ...], "positions of the stops (m), for pictures"] = ()

    @property
    def x(self) -> NDArray[np.float64]:
        """Displacement (m)."""
        return self.states[:, 0]

    @property
    def v(self) -> NDArray[np.float64]:
        """Velocity (m s⁻¹)."""
        return self.states[:, 1]

    def to_dataset(self) -> xarray.Dataset:
        """Return the states with the coordinate t, units and long names."""
        import xarray

        from vibrokit.results.fields import STATE

        columns = zip(STATE.of(self.states.shape[1]), self.states.T, strict=True)
        return xarray.Dataset(
            {column.name: ("t", values, column.about) for column, values in columns},
            coords={"t": ("t", self.t, {"long_name": "time", "units": "s"})},
        )

    def __repr__(self) -> str:
        return (
            f"Trajectory: {len(self.t)} samples from t = {self.t[0]:g} to {self.t[-1]:g} s\n"
            f"  {self.x.min():g} ≤ x ≤ {self.x.max():g} m, {self.v.min():g} ≤ v ≤ {self.v.max():g} m/s"
        )

    def _repr_html_(self) -> str:
        return f"<pre>{self!r}</pre>"

    @called
    def plot(self, ax: Any = None) -> PortraitArtists:
        """Draw the phase portrait; see `vibrokit.plots.portraits.phase_portrait`."""
        from vibrokit.plots.portraits import phase_portrait

        return phase_portrait(self.x, self.v, stops=self.stops, ax=ax)
