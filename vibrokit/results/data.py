"""The data of a result: datasets of single attractors joined along ``source``, beside the arrays of the result."""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray

from vibrokit.errors import ResultFileError

_RESERVED = re.compile(
    r"basin|bound|(attractor|saddle|chaotic_saddle|stable_manifold|energy|branch|path)(_.*)?|region_[xv]"
)
"""Names of arrays and dimensions that results use themselves."""
_GRID = ("x", "v")  # coordinates of the basins, which data may share
_FILLS: Mapping[str, Any] = {"i": -1, "u": 0, "b": False, "U": "", "O": ""}


def joined(data: Mapping[int, xarray.Dataset], names: Sequence[str]) -> xarray.Dataset:
    """Join the datasets of single attractors along ``source``, which gets their labels and names.

    Where lengths differ, the shorter ones end in fill values: −1 for whole numbers, NaN for others. Dimensions with
    coordinates are aligned by them.

    Raises
    ------
    ResultFileError
        An array has other dimensions for one attractor than for another, or is named ``source``.
    """
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


def joined_with(data: xarray.Dataset, own: xarray.Dataset) -> xarray.Dataset:
    """Return the data beside the arrays of the result itself.

    Raises
    ------
    ResultFileError
        They use the same name for different things.
    """
    for name in (*data.variables, *data.dims):
        if _RESERVED.fullmatch(str(name)) or (name in _GRID and not _same(data, own, str(name))):
            raise ResultFileError(
                f"its data uses the name {str(name)!r}, which results use for an array or a dimension of another "
                "meaning; give it another name"
            )
    return own.assign_coords(data.coords).assign(data.data_vars).assign_attrs(data.attrs)


def _same(data: xarray.Dataset, own: xarray.Dataset, name: str) -> bool:
    """Whether the data uses a coordinate of the basins as they do."""
    return name in data.indexes and np.array_equal(data[name].values, own[name].values)


def data_in(dataset: xarray.Dataset) -> xarray.Dataset:
    """Return the part of a result's arrays that is its data."""
    data = dataset.drop_vars([name for name in dataset.variables if _RESERVED.fullmatch(str(name))])
    used = {dim for array in data.data_vars.values() for dim in array.dims}
    return data.drop_vars([name for name in _GRID if name in data.coords and name not in used])
