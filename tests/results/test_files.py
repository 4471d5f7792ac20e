"""What all saved records have in common: kinds, provenance, findings, and who may read them."""

import dataclasses
import subprocess
import sys
import tomllib
import warnings
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
import xarray

import vibrokit as vk
from tests.builders import (
    PROVENANCE,
    CountRecord,
    ShadeResult,
    Toy,
    assert_same,
    empty_structure,
    full_continuation,
    full_result,
    full_structure,
    plug_in,
    rewritten,
    say,
)  # fmt: skip
from vibrokit import registry
from vibrokit.errors import UnknownNameError, VibrokitError
from vibrokit.registry import Group, names
from vibrokit.results.codes import Code, Severity
from vibrokit.results.files import ResultFileError
from vibrokit.results.finding import Finding
from vibrokit.results.pictures import save_figure
from vibrokit.results.plain import PlainRecord
from vibrokit.results.record import Record
from vibrokit.results.result import Result


@pytest.fixture(scope="module")
def toy():
    """The result of a plug-in's analyzer."""
    osc = vk.load_scene("hertz-0.570")
    structure = vk.find_structure(osc, cells=(40, 40), starts=(6, 6), rng=0)
    with plug_in():
        return Toy(points=6, pair=(8, 9)).run(osc, structure)


# Kinds


def test_every_kind_of_the_toolkit_is_registered():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert set(project["entry-points"][Group.RECORDS]) == {one.name for one in names(Group.RECORDS)}


def test_a_result_of_a_plug_in_is_saved_opened_and_drawn(toy, tmp_path):
    toy.save(tmp_path / "toy.nc")
    with plug_in():
        again = vk.load_result(tmp_path / "toy.nc")
        assert_same(toy, again)
        save_figure(again.plot(), tmp_path / "toy.png")
    assert (tmp_path / "toy.png").stat().st_size > 1000
    again.plot_paths(), again.plot_history()


def test_a_record_of_a_plug_in_is_saved_and_opened(tmp_path):
    with plug_in():
        for counts in ((1, 2, 3), ()):
            CountRecord(counts=counts, **PROVENANCE).save(tmp_path / "c.nc")
            assert_same(CountRecord(counts=counts, **PROVENANCE), vk.load_result(tmp_path / "c.nc"))


def test_a_file_of_an_unknown_kind_opens_as_plain_data(toy, tmp_path):
    toy.save(tmp_path / "toy.nc")
    plain = vk.load_result(tmp_path / "toy.nc")
    assert type(plain) is PlainRecord
    assert plain.names == toy.names
    assert (plain.scene, plain.settings, plain.stats) == (toy.scene, toy.settings, toy.stats)
    (finding,) = plain.found(Code.UNKNOWN_KIND)
    assert (finding.severity, finding.values["kind"]) == (Severity.WARNING, "shade")
    assert "'shade'" in repr(plain)
    assert "shade" in plain.status
    np.testing.assert_array_equal(plain.dataset["angle"], toy.data["angle"])
    with pytest.raises(UnknownNameError, match="no picture of kind 'shade': no installed package registers it"):
        plain.plot()


def test_plain_data_saved_again_is_what_it_was(toy, tmp_path):
    toy.save(tmp_path / "toy.nc")
    vk.load_result(tmp_path / "toy.nc").save(tmp_path / "again.nc")
    assert (tmp_path / "again.nc").read_bytes() == (tmp_path / "toy.nc").read_bytes()
    assert len(vk.load_result(tmp_path / "again.nc").found(Code.UNKNOWN_KIND)) == 1
    with plug_in():
        again = vk.load_result(tmp_path / "again.nc")
    assert type(again) is ShadeResult
    assert_same(toy.energies, again.energies)
    assert_same(toy.data, again.data)


def test_plain_data_has_its_energies(toy, tmp_path):
    toy.save(tmp_path / "toy.nc")
    full_structure().save(tmp_path / "s.nc")
    (tmp_path / "s.nc").write_bytes(rewritten((tmp_path / "s.nc").read_bytes(), say("kind", "other")))
    assert_same(toy.energies, vk.load_result(tmp_path / "toy.nc").energies)
    assert vk.load_result(tmp_path / "s.nc").energies == ()


def test_a_misspelt_kind_opens_as_plain_data(tmp_path):
    full_structure().save(tmp_path / "s.nc")
    (tmp_path / "s.nc").write_bytes(rewritten((tmp_path / "s.nc").read_bytes(), say("kind", "strucure")))
    assert vk.load_result(tmp_path / "s.nc").unknown_kind == "strucure"


def test_a_plug_in_that_does_not_load_is_warned_about(tmp_path, monkeypatch):
    broken = EntryPoint("structure", "no_such_package:Structure", Group.RECORDS)
    full_structure().save(tmp_path / "s.nc")
    monkeypatch.setattr(registry, "_entry_points", lambda group: [broken])
    with pytest.warns(UserWarning, match="no_such_package"):
        assert isinstance(vk.load_result(tmp_path / "s.nc"), PlainRecord)


def test_a_record_without_a_kind_is_refused_at_once():
    with pytest.raises(TypeError, match=r'Nameless names no kind; write kind: ClassVar.str. = "..."'):

        class Nameless(Result):
            def plot(self, ax=None):
                """Draw."""

    with pytest.raises(TypeError, match="Heir names no kind"):

        class Heir(CountRecord):
            pass


def test_an_abstract_record_needs_no_kind():
    class Halfway(Record):
        """Without a picture it is abstract still."""

    class Whole(Halfway):
        kind: ClassVar[str] = "whole"

    with pytest.raises(TypeError, match="abstract"):
        Whole(scene={})


# Provenance


@pytest.mark.parametrize("make", [full_structure, full_result, full_continuation])
def test_arrays_and_provenance_make_the_record_again(make):
    record = make()
    provenance = {field.name: getattr(record, field.name) for field in dataclasses.fields(Record)}
    assert_same(record, type(record).from_dataset(record.to_dataset(), **provenance))


def test_the_analyzer_is_built_again_from_a_file(toy, tmp_path):
    toy.save(tmp_path / "toy.nc")
    with plug_in():
        again = vk.load_result(tmp_path / "toy.nc")
        assert again.settings == toy.settings
        assert again.analyzer == Toy(points=6, pair=(8, 9))


def test_the_oscillator_is_built_again_from_a_file(toy, tmp_path):
    toy.save(tmp_path / "toy.nc")
    assert vk.load_result(tmp_path / "toy.nc").oscillator == vk.load_scene("hertz-0.570")


def test_settings_that_are_not_plain_data_are_refused(tmp_path):
    record = dataclasses.replace(full_result(), settings={"stepper": vk.RK4(steps=64)})
    with pytest.raises(ResultFileError, match=r"LeastActionResult cannot be saved: .* not plain data .*RK4"):
        record.save(tmp_path / "r.nc")
    assert not list(tmp_path.iterdir())


def test_settings_come_back_as_they_were(tmp_path):
    settings = {"a": (1, 2.5, None), "b": {"c": True, "d": -np.inf}, "e": np.float64(0.1), "f": np.int64(3), "g": 2**70}
    dataclasses.replace(full_result(), settings=settings).save(tmp_path / "r.nc")
    assert vk.load_result(tmp_path / "r.nc").settings == {
        "a": [1, 2.5, None], "b": {"c": True, "d": -np.inf}, "e": 0.1, "f": 3, "g": 2**70,
    }  # fmt: skip


# Findings


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> bytes:
    target = tmp_path_factory.mktemp("sound") / "s.nc"
    full_structure().save(target)
    return target.read_bytes()


def opened(content: bytes, change, folder):
    (folder / "s.nc").write_bytes(rewritten(content, change))
    return vk.load_result(folder / "s.nc")


def test_a_code_of_a_newer_version_becomes_a_remark(sound, tmp_path):
    entry = {"code": "tea-is-ready", "source": 1, "target": None, "values": {"cups": 3}, "sentence": "Tea {is} ready."}
    (finding,) = opened(sound, say("findings", [entry]), tmp_path).findings
    assert (finding.code, finding.source, str(finding)) == (Code.REMARK, 1, "Tea {is} ready.")


def test_findings_are_saved_with_names(tmp_path):
    structure = empty_structure()
    found = Finding.of(Code.CHAOTIC_SOURCE, 7, count=3, periods=[1, 4])
    dataclasses.replace(structure, findings=(found,)).save(tmp_path / "s.nc")
    (again,) = vk.load_result(tmp_path / "s.nc").findings
    assert (again.code, again.source, again.target, dict(again.values)) == (
        Code.CHAOTIC_SOURCE, 7, None, {"count": 3, "periods": [1, 4]},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"values": {"count": 6}}, "'steady-states' has values that do not fit its sentence .KeyError: 'starts'"),
        ({"code": "smooth"}, "no entry 'sentence'"),
        ({"code": 3}, "code = 3"),
        ({"source": "clear"}, "source = 'clear'"),
        ({"source": 1.5}, "source = 1.5"),
        ({"values": []}, "values = "),
        ({"values": {"count": {"a": 1}, "starts": 3}}, "'steady-states' has count = {'a': 1}"),
        ({"values": {"count": [[1]], "starts": 3}}, "'steady-states' has count = "),
        ({"code": "cells-unsettled", "values": {"fraction": "half"}}, "'cells-unsettled' .*ValueError"),
        ({"code": "cells-unsettled", "values": {"fraction": None}}, "'cells-unsettled' .*TypeError"),
        ({"code": "cells-unsettled", "values": {"fraction": 10**400}}, "'cells-unsettled' .*OverflowError"),
    ],
)
def test_findings_that_do_not_make_a_sentence_are_refused(entry, words, sound, tmp_path):
    whole = {"code": "steady-states", "source": None, "target": None, "values": {"count": 6, "starts": 9}} | entry
    with pytest.raises(ResultFileError, match=words):
        opened(sound, say("findings", [whole]), tmp_path)


@pytest.mark.parametrize("findings", [3, [3], ["tea"], {}, None])
def test_findings_that_are_none_are_refused(findings, sound, tmp_path):
    with pytest.raises(ResultFileError):
        opened(sound, say("findings", findings), tmp_path)


@pytest.mark.parametrize(
    ("code", "values", "words"),
    [
        (Code.REMARK, {}, "'remark' has values that do not fit its sentence .KeyError: 'text'"),
        (Code.STEADY_STATES, {"count": 3}, "'steady-states' .*KeyError: 'starts'.*{count}, from {starts:start}"),
        (Code.CELLS_UNSETTLED, {"fraction": "half"}, "'cells-unsettled' .*ValueError"),
        (Code.CELLS_UNSETTLED, {"fraction": None}, "'cells-unsettled' .*TypeError"),
        ("steady-states", {"count": 3, "starts": 9}, "needs a Code, such as Code.REMARK, got 'steady-states'"),
    ],
)
def test_a_finding_whose_values_do_not_fit_is_not_made(code, values, words):
    with pytest.raises(TypeError, match=words):
        Finding.of(code, **values)


@pytest.mark.parametrize("findings", ["a text", ("a text",), ["a text"], (Finding.of(Code.SADDLES, count=3), None), 3])
def test_what_is_no_finding_is_refused(findings):
    for make in (vk.Analysis, lambda findings: dataclasses.replace(full_result(), findings=findings)):
        with pytest.raises(TypeError, match=r"findings must be a tuple of Finding, got .*Code\.REMARK"):
            make(findings=findings)


# Files


@pytest.mark.parametrize("content", [b"", b"not a result", b"CDF\x01" + bytes(200), b"\x80\x04\x95pickle"])
def test_strange_files_are_refused_in_a_sentence(content, tmp_path):
    (tmp_path / "bad.nc").write_bytes(content)
    with pytest.raises(ResultFileError, match="no result"):
        vk.load_result(tmp_path / "bad.nc")


def test_a_truncated_file_is_refused(sound, tmp_path):
    (tmp_path / "s.nc").write_bytes(sound[: len(sound) // 2])
    with pytest.raises(VibrokitError):
        vk.load_result(tmp_path / "s.nc")


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere"):
        full_structure().save(tmp_path / "nowhere" / "s.nc")


def test_opening_warns_of_nothing(sound, tmp_path):
    (tmp_path / "s.nc").write_bytes(sound)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        vk.load_result(tmp_path / "s.nc")


def test_saving_and_opening_need_no_numba(tmp_path):
    full_result().save(tmp_path / "r.nc")
    code = (
        "import sys, vibrokit as vk\n"
        "vk.load_result(sys.argv[1]).save(sys.argv[1])\n"
        "assert not {'numba', 'sympy', 'matplotlib'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "r.nc")], check=True, capture_output=True)


def test_the_dataset_of_a_trajectory():
    path = vk.load_scene("hertz-0.570").trajectory((0.1, 0.2), periods=1, samples=16)
    data = path.to_dataset()
    np.testing.assert_array_equal(data.v, path.v)
    np.testing.assert_array_equal(data.t, path.t)
    assert (data.x.units, data.v.units, data.t.units) == ("m", "m s-1", "s")
    assert isinstance(data, xarray.Dataset)
