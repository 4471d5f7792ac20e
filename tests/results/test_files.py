import dataclasses
import io
import json
import subprocess
import sys

import numpy as np
import pytest
import xarray

import vibrokit as vk
from vibrokit.errors import VibrokitError
from vibrokit.results.certificate import Certificate
from vibrokit.results.files import ResultFileError


@pytest.fixture(scope="module")
def result():
    osc = vk.load_scene("double-well")
    return vk.ActionPlot(points=100).run(osc, vk.find_structure(osc, cells=(40, 40), starts=(6, 6)))


def test_round_trip(result, tmp_path):
    result.save(tmp_path / "r.nc")
    again = vk.load_result(tmp_path / "r.nc")
    assert type(again) is type(result)
    for name in ("scene", "settings", "status", "seconds", "versions", "seed"):
        assert getattr(again, name) == getattr(result, name)
    for old, new in zip(result.energies, again.energies, strict=True):
        for name in ("source", "target", "value", "lower", "upper", "method", "residual", "saddle", "certificate"):
            assert getattr(old, name) == getattr(new, name)
        for name in ("t", "q", "p", "action", "section"):
            np.testing.assert_array_equal(getattr(old.path, name), getattr(new.path, name))
    for name in result.data.data_vars:
        np.testing.assert_array_equal(result.data[name].values, again.data[name].values)


def test_opens_and_plots_without_numba_or_sympy(result, tmp_path):
    result.save(tmp_path / "r.nc")
    code = (
        "import sys, vibrokit as vk\n"
        f"r = vk.load_result({str(tmp_path / 'r.nc')!r})\n"
        "r.plot()[0].get_figure().savefig(sys.argv[1]); r.plot_paths()\n"
        "assert not {'numba', 'sympy'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "p.png")], check=True, capture_output=True)
    assert (tmp_path / "p.png").stat().st_size > 5000


@pytest.mark.parametrize("content", [b"", b"not a result", b"CDF\x01" + bytes(200), b"\x80\x04\x95pickle"])
def test_strange_files_are_refused_in_a_sentence(content, tmp_path):
    (tmp_path / "bad.nc").write_bytes(content)
    with pytest.raises(ResultFileError, match="no result"):
        vk.load_result(tmp_path / "bad.nc")


def test_a_truncated_file_is_refused(result, tmp_path):
    result.save(tmp_path / "r.nc")
    whole = (tmp_path / "r.nc").read_bytes()
    (tmp_path / "r.nc").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(VibrokitError):
        vk.load_result(tmp_path / "r.nc")


def test_a_failed_save_leaves_the_old_file(result, tmp_path, monkeypatch):
    target = tmp_path / "r.nc"
    result.save(target)
    before = target.read_bytes()

    def fail(*arguments):
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(OSError, match="disk full"):
        result.save(target)
    assert target.read_bytes() == before
    assert list(tmp_path.iterdir()) == [target]


def test_a_result_without_energies_comes_back(result, tmp_path):
    dataclasses.replace(result, energies=(), seed=2**70).save(tmp_path / "r.nc")
    again = vk.load_result(tmp_path / "r.nc")
    assert (again.energies, again.seed) == ((), 2**70)
    np.testing.assert_array_equal(again.data["action_0"], result.data["action_0"])


def test_certificates_and_saddles_come_back_with_every_kind_of_result(result, tmp_path):
    certificate = Certificate(1e-12, 1e-6, 2e-6, 40.0, 1e-13, -1e-14, 0.1 + 0.2, 0.5)
    first, *rest = result.energies
    first = dataclasses.replace(first, saddle=3, certificate=certificate)
    dataclasses.replace(result, energies=(first, *rest)).save(tmp_path / "r.nc")
    again, *others = vk.load_result(tmp_path / "r.nc").energies
    assert (again.saddle, again.certificate) == (3, certificate)
    assert {(energy.saddle, energy.certificate) for energy in others} == {(-1, None)}


def test_files_from_before_certificates_open(result, tmp_path):
    result.save(tmp_path / "r.nc")
    data = xarray.load_dataset(io.BytesIO((tmp_path / "r.nc").read_bytes()), engine="scipy", decode_cf=False)
    data.drop_vars(["energy_saddle", "energy_certified"]).to_netcdf(tmp_path / "old.nc", engine="scipy")
    for old, new in zip(result.energies, vk.load_result(tmp_path / "old.nc").energies, strict=True):
        assert (new.value, new.saddle, new.certificate) == (old.value, -1, None)


def without(name):
    return lambda data, header: data.drop_vars(name)


def with_array(name, dimensions, values):
    return lambda data, header: data.assign({name: (dimensions, np.array(values))})


def with_entry(key, value):
    return lambda data, header: header.update({key: value}) or data


@pytest.mark.parametrize(
    ("lie", "words"),
    [
        (without("energy_value"), "no array 'energy_value'"),
        (with_array("energy_value", "few", [1.0]), "'energy_value' has shape"),
        (with_array("energy_source", "energy", [np.nan, 0.0]), "'energy_source' holds numbers that are not whole"),
        (with_array("energy_value", "energy", ["a", "b"]), "'energy_value' is of kind"),
        (without("path0_p"), "no array 'path0_p'"),
        (with_array("path0_q", ("one", "path0_state"), [[0.0, 0.0]]), "'path0_q' has shape"),
        (with_array("path0_on_section", "path0_section_", [10**9]), "'path0_on_section' goes from"),
        (with_entry("methods", [1, 2]), "no list of texts"),
        (with_entry("methods", ["ring"] * 9), "'energy_source' has shape"),
        (with_entry("settings", 3), "settings = 3"),
        (with_entry("seconds", None), "seconds = None"),
        (with_entry("kind", "acton_plot"), "the nearest is 'action_plot'"),
    ],
)
def test_lies_are_refused_in_a_sentence(lie, words, result, tmp_path):
    result.save(tmp_path / "r.nc")
    data = xarray.load_dataset(io.BytesIO((tmp_path / "r.nc").read_bytes()), engine="scipy", decode_cf=False)
    header = json.loads(data.attrs["vibrokit"])
    data = lie(data, header)
    data.attrs["vibrokit"] = json.dumps(header)
    data.to_netcdf(tmp_path / "lie.nc", engine="scipy")
    with pytest.raises(ResultFileError, match=rf"no result that vibrokit saved: .*{words}"):
        vk.load_result(tmp_path / "lie.nc")
