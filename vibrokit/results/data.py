"""The data of a result: datasets of single attractors joined along ``source``, beside the arrays of the result."""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.errors import ResultFileError

_OWN = ("basin", "bound", "region_x", "region_v")  # names of arrays and dimensions that results use themselves
_PREFIXES = "attractor, saddle, chaotic_saddle, stable_manifold, energy, branch, path"
_RESERVED = re.compile(rf"{'|'.join(_OWN)}|({_PREFIXES.replace(', ', '|')})(_.*)?")
_SOURCE = ("source", "source_name")  # made when the data of all attractors is joined
_GRID = ("x", "v")  # coordinates of the basins, which data may share
_FILLS: Mapping[str, Any] = {"i": -1, "u": 0, "b": False, "U": "", "O": ""}


def joined(data: Mapping[int, xarray.Dataset], names: Sequence[str]) -> xarray.Dataset:
    """Join the datasets of single attractors along ``source``, which gets their labels and names.

    Where lengths differ, the shorter ones end in fill values: −1 for whole numbers, NaN for others. Dimensions with
    coordinates are aligned by them.

    Raises
    ------
    ResultFileError
        An array has other dimensions for one attractor than for another, or a name that is taken.
    """
    for one in data.values():
        _refuse([name for name in (*one.variables, *one.dims) if name in _SOURCE])
    filled = {label: _indexed(one) for label, one in data.items() if one.variables}
    if not filled:
        return xarray.Dataset()
    counted = {dim for one in data.values() for dim in one.dims if dim not in one.indexes}
    about = {"long_name": "label of the attractor"}
    sources = xarray.DataArray(list(filled), dims="source", name="source", attrs=about)
    fills: dict[Hashable, Any] = {
        name: _FILLS.get(array.dtype.kind, np.nan) for one in filled.values() for name, array in one.variables.items()
    }
    for name in fills:
        shapes = {one[name].dims for one in filled.values() if name in one.variables}
        if len(shapes) > 1:
            raise ResultFileError(f"the arrays {name!r} of the attractors have the dimensions {sorted(shapes)}")
    try:
        whole = xarray.concat(
            list(filled.values()), sources, data_vars="all", coords="all", compat="override", join="outer",
            fill_value=fills, combine_attrs="override",
        )  # fmt: skip
    except (TypeError, ValueError) as error:
        raise ResultFileError(f"the arrays of the attractors cannot be joined along 'source': {error}") from error
    named = [names[label] for label in filled]
    return whole.drop_vars(counted).assign_coords(source_name=("source", named, {"long_name": "name of the attractor"}))


def _indexed(one: xarray.Dataset) -> xarray.Dataset:
    """A dataset whose dimensions all have coordinates, so that different lengths can be aligned."""
    return one.assign_coords({dim: np.arange(size) for dim, size in one.sizes.items() if dim not in one.indexes})


def check_names(data: xarray.Dataset, grid: Mapping[str, NDArray[np.float64]]) -> None:
    """Raise ResultFileError if data uses a name that is taken; `grid` has the coordinates of the basins, x and v."""
    names = (*data.variables, *data.dims)
    shared = {axis for axis in _GRID if axis in data.indexes and np.array_equal(data[axis].values, grid[axis])}
    _refuse([name for name in names if _RESERVED.fullmatch(str(name)) or (name in _GRID and name not in shared)])


def _refuse(names: Sequence[Hashable]) -> None:
    if names:
        raise ResultFileError(
            f"its data uses the name {str(names[0])!r}, which results use for an array or a dimension of another "
            f"meaning; give it another name. Names that are taken: {', '.join((*_OWN, *_SOURCE))}; {_PREFIXES}, also "
            "with an underscore and more after them; x and v, unless they are the coordinates of the basins."
        )


def data_in(dataset: xarray.Dataset) -> xarray.Dataset:
    """Return the part of a result's arrays that is its data."""
    data = dataset.drop_vars([name for name in dataset.variables if _RESERVED.fullmatch(str(name))])
    used = {dim for array in data.data_vars.values() for dim in array.dims}
    return data.drop_vars([name for name in _GRID if name in data.coords and name not in used])
