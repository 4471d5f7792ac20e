"""DensityHistory: how a distribution of states changes in time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.errors import ResultFileError, StructureError, counted, shown
from vibrokit.results.arrays import Arrays
from vibrokit.results.record import Record, Summary

if TYPE_CHECKING:
    from vibrokit.plots.densities import MarginalArtists

Array = NDArray[np.float64]

_UNITS = {"x": "m", "v": "m s-1"}


class DensityHistory(Record):
    """The probability density of the state at some times."""

    kind: ClassVar[str] = "density_history"

    times: Annotated[Array, "since the start, which is on a section (s)"]
    x: Annotated[Array, "nodes (m), closer where the oscillator is stiffer"]
    v: Annotated[Array, "nodes (m s⁻¹)"]
    log_density: Annotated[Array, "ln ρ (ρ in s m⁻²), NaN where it is not resolved, shape (times, nx, nv)"]
    mass: Annotated[Array, "probability on the nodes: 1, less what has left the region, and truncation errors"]

    @property
    def names(self) -> tuple[str, ...]:
        """No attractors."""
        return ()

    @property
    def density(self) -> xarray.DataArray:
        """The density over (time, x, v); 0 where it is not resolved."""
        values = np.exp(np.nan_to_num(self.log_density, nan=-np.inf))
        coordinates = {"time": self.times, "x": self.x, "v": self.v}
        found = xarray.DataArray(values, coordinates, ("time", "x", "v"), name="density", attrs={"units": "s m-2"})
        for axis, unit in (*_UNITS.items(), ("time", "s")):
            found[axis].attrs["units"] = unit
        return found

    def marginal(self, axis: str = "x") -> xarray.DataArray:
        """Return the density of x or of v alone, over (time, axis).

        Raises
        ------
        StructureError
            The axis is neither ``"x"`` nor ``"v"``.
        """
        if axis not in _UNITS:
            raise StructureError(f"axis must be 'x' or 'v', got {shown(axis)}.")
        other = "v" if axis == "x" else "x"
        widths = xarray.DataArray(np.gradient(getattr(self, other)), dims=other)
        found: xarray.DataArray = (self.density * widths).sum(other)
        return found.assign_attrs(units="m-1" if axis == "x" else "s m-1")

    @property
    def summary(self) -> Summary:
        """The times, and the probability on the nodes at each."""
        rows = ((f"t = {t:.6g} s", f"probability {mass:.6g}") for t, mass in zip(self.times, self.mass, strict=True))
        times = counted(len(self.times), "time")
        return Summary(f"Density on {len(self.x)} × {len(self.v)} nodes at {times}", tuple(rows))

    @called
    def plot(self, ax: Any = None, axis: str = "x") -> MarginalArtists:
        """Draw the marginal densities of x, or of v, at all times."""
        from vibrokit.plots.densities import marginal_lines

        found = self.marginal(axis)
        return marginal_lines(getattr(self, axis), found.values, self.times, axis=axis, ax=ax)

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays with dimensions, coordinates, units and long names."""
        return xarray.Dataset(
            {
                "log_density": (("time", "x", "v"), self.log_density, {"long_name": "ln ρ", "units": "1"}),
                "mass": (("time",), self.mass, {"long_name": "probability on the nodes", "units": "1"}),
            },
            {
                "time": (("time",), self.times, {"long_name": "time since the start", "units": "s"}),
                "x": (("x",), self.x, {"long_name": "displacement", "units": "m"}),
                "v": (("v",), self.v, {"long_name": "velocity", "units": "m s-1"}),
            },
        )

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a record of its arrays; raises ResultFileError."""
        arrays = Arrays(dataset)
        times, x, v = (arrays.numbers(name, (None,)) for name in ("time", "x", "v"))
        if min(len(x), len(v)) < 2 or not all(np.all(np.diff(nodes) > 0) for nodes in (x, v)):
            raise ResultFileError("its nodes must be two or more in ascending order, along x and along v")
        log_density = arrays.numbers("log_density", (len(times), len(x), len(v)), finite=False)
        mass = arrays.numbers("mass", (len(times),))
        return cls(times=times, x=x, v=v, log_density=log_density, mass=mass, **provenance)
