import dataclasses

import numpy as np
import pytest
import xarray

import vibrokit as vk
from tests.builders import assert_same, drop, full_continuation, put, replaced, rewritten
from vibrokit.results.files import ResultFileError


def nothing_found():
    return dataclasses.replace(
        full_continuation(), states=(), branch_names=(), bifurcations=(), region=None, unit=None, symbol="", findings=()
    )


@pytest.mark.parametrize("make", [full_continuation, nothing_found])
def test_everything_comes_back_bit_for_bit(make, tmp_path):
    make().save(tmp_path / "c.nc")
    assert_same(make(), vk.load_result(tmp_path / "c.nc"))


def test_xarray_alone_reads_a_continuation(tmp_path):
    sweep = full_continuation()
    sweep.save(tmp_path / "c.nc")
    with xarray.open_dataset(tmp_path / "c.nc", engine="scipy") as file:
        np.testing.assert_array_equal(file.value, sweep.values)
        assert file.value.units == file.bifurcation_value.units == "s^-1"
        np.testing.assert_array_equal(file.value[file.attractor_at], [0.1 + 0.2, 0.1 + 0.2, 0.75])
        assert file.bifurcation_kind.values.tolist() == ["grazing", "Neimark–Sacker"]
        assert file.parameter == "excitations.0.frequency"


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> bytes:
    target = tmp_path_factory.mktemp("sound") / "c.nc"
    full_continuation().save(target)
    return target.read_bytes()


LIES = {
    "no values": (drop("value"), "no array 'value'"),
    "a value of NaN": (put("value", 0, np.nan), "'value' holds NaN"),
    "an attractor at no value": (put("attractor_at", 0, 3), "value or a branch that does not exist"),
    "an attractor of no branch": (put("attractor_branch", 0, 2), "value or a branch that does not exist"),
    "a bifurcation of no branch": (put("bifurcation_branch", 0, 2), "bifurcation is on branch 2"),
    "no names of branches": (drop("branch_name"), "no dimension 'branch'"),
    "a branch below zero": (put("attractor_branch", 0, -1), "'attractor_branch' goes from -1"),
    "a label below all": (put("attractor_label", 0, -2), "'attractor_label' goes from -2"),
    "an unknown kind of bifurcation": (put("bifurcation_kind", 0, "crisis"), "'bifurcation_kind' holds 'crisis'"),
    "a bifurcation of two points": (
        lambda d, h: d.isel(bifurcation_point=[0, 0]).assign(bifurcation_point_count=d.bifurcation_point_count * 2),
        "a bifurcation has 2 points",
    ),
    "a negative error": (put("bifurcation_error", 0, -1.0), "'bifurcation_error' goes from -1"),
    "a period of 0": (put("bifurcation_period", 0, 0), "'bifurcation_period' goes from 0"),
    "a stop on top": (put("bifurcation_side", 0, "top"), "'bifurcation_side' holds 'top'"),
    "a survival of the whole": (put("survival_attractor", 0, -1), "survivals belong to no attractor"),
    "findings that are no JSON": (put("value_findings", 0, "well"), "holds no JSON"),
    "findings in a table": (put("value_findings", 0, "{}"), "a list is needed"),
    "a parameter in a number": (replaced("parameter", 3), "'parameter' is of type"),
    "half a region": (drop("region_v"), "no array 'region_v'"),
}


@pytest.mark.parametrize(("lie", "words"), LIES.values(), ids=LIES)
def test_lies_are_refused_in_a_sentence(lie, words, sound, tmp_path):
    (tmp_path / "lie.nc").write_bytes(rewritten(sound, lie))
    with pytest.raises(ResultFileError, match=rf"lie\.nc is no result that this vibrokit can open: .*{words}"):
        vk.load_result(tmp_path / "lie.nc")
