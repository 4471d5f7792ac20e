"""Data of a result: datasets of single attractors joined along source, beside the arrays of the result."""

import dataclasses

import numpy as np
import pytest
import xarray

import vibrokit as vk
from tests.builders import assert_same, full_result, full_structure
from vibrokit.results.data import joined
from vibrokit.results.files import ResultFileError
from vibrokit.results.result import Result

NAMES = ("clear", "hammering", "chaotic")


def test_datasets_of_different_lengths_are_padded():
    short = xarray.Dataset({"angle": ("start", [0.5, 1.5], {"units": "rad"}), "hit": ("start", [3, 4])})
    long = xarray.Dataset({"angle": ("start", [0.1, 0.2, 0.3]), "hit": ("start", [5, 6, 7])})
    data = joined({2: short, 0: long}, NAMES)
    assert data.source.values.tolist() == [2, 0]
    assert data.source_name.values.tolist() == ["chaotic", "clear"]
    np.testing.assert_array_equal(data.angle.sel(source=2), [0.5, 1.5, np.nan])
    np.testing.assert_array_equal(data.angle.sel(source=0), [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(data.hit, [[3, 4, -1], [5, 6, 7]])
    assert data.hit.dtype.kind == "i"
    assert data.angle.units == "rad"
    assert "start" not in data.variables


def test_several_dimensions_texts_and_flags_are_padded():
    one = xarray.Dataset({"psi": (("x_node", "v_node"), np.ones((2, 3))), "ok": ("x_node", [True, True])})
    two = xarray.Dataset({"psi": (("x_node", "v_node"), np.ones((3, 1))), "word": ("v_node", ["a"])})
    data = joined({0: one, 1: two}, NAMES)
    assert data.psi.shape == (2, 3, 3)
    assert int(np.isfinite(data.psi).sum()) == 9
    assert data.ok.values.tolist() == [[True, True, False], [False, False, False]]
    assert data.word.values.tolist() == [["", "", ""], ["a", "", ""]]


def test_dimensions_with_coordinates_are_aligned_by_them():
    one = xarray.Dataset({"rate": ("intensity", [1.0, 2.0])}, coords={"intensity": [1e-5, 2e-5]})
    two = xarray.Dataset({"rate": ("intensity", [3.0, 4.0])}, coords={"intensity": [2e-5, 4e-5]})
    data = joined({0: one, 1: two}, NAMES)
    np.testing.assert_array_equal(data.intensity, [1e-5, 2e-5, 4e-5])
    np.testing.assert_array_equal(data.rate, [[1, 2, np.nan], [np.nan, 3, 4]])


def test_coordinates_of_nodes_keep_their_source_and_attractors_without_arrays_are_left_out():
    nodes = {k: xarray.Dataset(coords={"place": ("node", np.arange(2.0 + k))}) for k in (0, 1)}
    data = joined({**nodes, 2: xarray.Dataset()}, NAMES)
    np.testing.assert_array_equal(data.place, [[0, 1, np.nan], [0, 1, 2]])
    assert data.source.values.tolist() == [0, 1]
    assert len(joined({0: xarray.Dataset()}, NAMES).variables) == 0


def with_data(data):
    return dataclasses.replace(full_result(), data=data)


TAKEN = {
    "array": xarray.Dataset({"basin": ("n", [1.0])}),
    "prefix": xarray.Dataset({"energy_of_mine": ("n", [1.0])}),
    "dimension": xarray.Dataset({"mine": ("path", [1.0])}),
    "axis": xarray.Dataset({"mine": ("x", [1.0])}),
    "axis as array": xarray.Dataset({"x": ("n", [1.0])}),
    "other grid": xarray.Dataset({"density": (("x", "v"), np.ones((20, 16)))}, coords={"x": np.arange(20.0)}),
    "coordinate": xarray.Dataset(coords={"region_x": ("n", [1.0])}),
}
OF_SOURCES = {
    "dimension": xarray.Dataset({"b": ("source", [1.0])}),
    "array": xarray.Dataset({"source": ("n", [1.0])}),
    "names": xarray.Dataset(coords={"source_name": ("n", ["a"])}),
}


@pytest.mark.parametrize("data", TAKEN.values(), ids=TAKEN)
def test_names_that_results_use_are_refused(data):
    with pytest.raises(ResultFileError, match=r"its data uses the name '.*'.*give it another name") as refused:
        with_data(data)
    assert all(name in str(refused.value) for name in ("basin", "region_x", "source_name", "chaotic_saddle", "path"))


@pytest.mark.parametrize("data", [*OF_SOURCES.values(), TAKEN["dimension"]], ids=[*OF_SOURCES, "path"])
def test_names_that_are_taken_are_refused_when_a_result_is_assembled(data):
    with pytest.raises(ResultFileError, match="Names that are taken: basin, "):
        Result.assembled(full_structure(), estimates={}, branches={}, data={0: data}, scene={})


UNFIT = {
    "complex": xarray.Dataset({"z": ("n", [1j])}),
    "objects": xarray.Dataset({"o": ("n", np.array([{}, 3], dtype=object))}),
    "long numbers": xarray.Dataset({"big": ("n", np.array([2**60]))}),
    "attribute": xarray.Dataset({"a": ("n", [1.0], {"meta": {"b": 1}})}),
    "number as name": xarray.Dataset({3: ("n", [1.0])}),
    **{name: xarray.Dataset(attrs={name: "mine"}) for name in ("title", "vibrokit", "history")},
}


@pytest.mark.parametrize("data", UNFIT.values(), ids=UNFIT)
def test_what_files_cannot_hold_is_refused_in_a_sentence(data, tmp_path):
    with pytest.raises(ResultFileError, match="LeastActionResult cannot be saved: "):
        with_data(data).save(tmp_path / "r.nc")
    assert not list(tmp_path.iterdir())


def test_data_over_the_cells_of_the_basins_shares_their_coordinates(tmp_path):
    cells = full_result().to_dataset()[["x", "v"]].coords
    density = xarray.Dataset({"density": (("x", "v"), np.random.default_rng(0).random((20, 16)))}, coords=cells)
    with_data(density).save(tmp_path / "r.nc")
    assert_same(vk.load_result(tmp_path / "r.nc").data.density.values, density.density.values)
    assert set(vk.load_result(tmp_path / "r.nc").data.coords) == {"x", "v"}


def test_all_kinds_of_data_come_back(tmp_path):
    data = xarray.Dataset(
        {
            "number": ("n", [0.1 + 0.2, np.nan, -np.inf], {"units": "days since 2000-01-01"}),
            "whole": ("n", [1, 2**40, -3]),
            "short": ("n", np.array([1, 2, 3], dtype=np.int16)),
            "flag": ("n", [True, False, True]),
            "word": ("n", ["", "ζω_n", "a b"]),
            "nothing": ("empty", np.empty(0)),
            "no_words": ("empty", np.empty(0, dtype="<U3")),
            "alone": ((), 7),
        },
        coords={"n": [10, 20, 30], "label": ("n", ["p", "q", "r"])},
        attrs={"note": "π – of a plug-in", "count": 3},
    )
    with_data(data).save(tmp_path / "r.nc")
    again = vk.load_result(tmp_path / "r.nc").data
    assert again.attrs == data.attrs
    assert set(again.variables) == set(data.variables)
    assert set(again.coords) == set(data.coords)
    for name in data.variables:
        np.testing.assert_array_equal(again[name].values.tolist(), data[name].values.tolist())
        assert again[name].dims == data[name].dims
    assert (again["number"].units, again["flag"].dtype) == ("days since 2000-01-01", bool)


def test_arrays_of_other_dimensions_cannot_be_joined():
    one, other = xarray.Dataset({"a": ("n", [1.0])}), xarray.Dataset({"a": (("n", "m"), [[1.0]])})
    with pytest.raises(ResultFileError, match="the arrays 'a' of the attractors have the dimensions"):
        joined({0: one, 1: other}, NAMES)
