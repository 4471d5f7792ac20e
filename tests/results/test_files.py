"""What all saved records have in common: kinds, provenance, findings, and who may read them."""

import dataclasses
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import vibrokit as vk
from tests.builders import (
    PROVENANCE,
    REGION,
    CountRecord,
    Toy,
    assert_same,
    attractor,
    empty_structure,
    full_result,
    full_structure,
    plug_in,
    rewritten,
    say,
)  # fmt: skip
from vibrokit import registry
from vibrokit.errors import UnknownNameError
from vibrokit.registry import Group, names
from vibrokit.results.atomic import save_figure
from vibrokit.results.basins import Basins
from vibrokit.results.codes import Code, Severity
from vibrokit.results.files import PlainRecord, ResultFileError, nested, records_in
from vibrokit.results.finding import Finding
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.trajectory import Trajectory
from vibrokit.scene_file import scene_data


@pytest.fixture(scope="module")
def toy():
    """The result of a plug-in's analyzer."""
    osc = vk.load_scene("hertz-0.570")
    labels = (REGION.cell_centres((40, 30))[:, 0] > 0.15).reshape(40, 30).astype(np.int16)
    structure = dataclasses.replace(
        empty_structure(), attractors=(attractor(0, "periodic", 1), attractor(1, "periodic", 1)),
        basins=Basins(REGION, labels), scene=scene_data(osc),
    )  # fmt: skip
    with plug_in():
        return Toy(points=6, pair=(8, 9)).run(osc, structure)


# Kinds


def test_every_kind_of_the_toolkit_is_registered():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert set(project["entry-points"][Group.RECORDS]) == {one.name for one in names(Group.RECORDS)}


def test_a_result_of_a_plug_in_is_saved_opened_and_drawn(toy, tmp_path):
    assert [energy.source for energy in toy.energies] == [0, 1]
    toy.save(tmp_path / "toy.nc")
    with plug_in():
        again = vk.load_result(tmp_path / "toy.nc")
        assert_same(toy, again)
        save_figure(again.plot(), tmp_path / "toy.png")
        assert again.settings == toy.settings
        assert again.analyzer == Toy(points=6, pair=(8, 9))
    again.plot_paths(), again.plot_history()


def test_a_record_of_a_plug_in_is_saved_and_opened(tmp_path):
    with plug_in():
        for counts in ((1, 2, 3), ()):
            CountRecord(counts=counts, **PROVENANCE).save(tmp_path / "c.nc")
            assert_same(CountRecord(counts=counts, **PROVENANCE), vk.load_result(tmp_path / "c.nc"))


def test_a_file_of_an_unknown_kind_opens_as_plain_data_and_is_saved_as_it_was(toy, tmp_path):
    toy.save(tmp_path / "toy.nc")
    plain = vk.load_result(tmp_path / "toy.nc")
    assert type(plain) is PlainRecord
    assert (plain.names, plain.unknown_kind) == (toy.names, "shade")
    assert (plain.scene, plain.settings, plain.stats) == (toy.scene, toy.settings, toy.stats)
    assert plain.oscillator == vk.load_scene("hertz-0.570")
    (finding,) = plain.found(Code.UNKNOWN_KIND)
    assert (finding.severity, finding.values["kind"]) == (Severity.WARNING, "shade")
    np.testing.assert_array_equal(plain.dataset["angle"], toy.data["angle"])
    assert_same(toy.energies, plain.energies)
    with pytest.raises(UnknownNameError, match="no picture of kind 'shade': no installed package registers it"):
        plain.plot()
    plain.save(tmp_path / "again.nc")
    assert (tmp_path / "again.nc").read_bytes() == (tmp_path / "toy.nc").read_bytes()


def test_a_part_of_unknown_kind_comes_back_as_plain_data_and_keeps_its_kind():
    record = CountRecord(counts=(1, 2), **PROVENANCE)
    (part,) = records_in(nested({"part": record})).values()
    assert (type(part), part.unknown_kind) == (PlainRecord, "count")
    with plug_in():
        (again,) = records_in(nested({"part": part})).values()
    assert (type(again), again.counts) == (CountRecord, (1, 2))


def test_a_file_of_another_kind_has_no_energies(tmp_path):
    full_structure().save(tmp_path / "s.nc")
    (tmp_path / "s.nc").write_bytes(rewritten((tmp_path / "s.nc").read_bytes(), say("kind", "strucure")))
    plain = vk.load_result(tmp_path / "s.nc")
    assert (plain.unknown_kind, plain.energies) == ("strucure", ())


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


def test_settings_that_are_not_plain_data_are_refused(tmp_path):
    with pytest.raises(ResultFileError, match=r"LeastActionResult cannot be saved: .* not plain data .*RK4"):
        dataclasses.replace(full_result(), settings={"stepper": vk.RK4(steps=64)}).save(tmp_path / "r.nc")
    assert not list(tmp_path.iterdir())


def test_settings_come_back_as_they_were(tmp_path):
    settings = {"a": (1, 2.5, None), "b": {"c": True, "d": -np.inf}, "e": np.float64(0.1), "f": np.int64(3), "g": 2**70}
    dataclasses.replace(full_result(), settings=settings).save(tmp_path / "r.nc")
    assert vk.load_result(tmp_path / "r.nc").settings == {
        "a": [1, 2.5, None], "b": {"c": True, "d": -np.inf}, "e": 0.1, "f": 3, "g": 2**70,
    }  # fmt: skip


# Findings


def test_findings_are_saved_with_names(tmp_path):
    found = Finding.of(Code.CHAOTIC_SOURCE, 7, count=3, periods=[1, 4])
    dataclasses.replace(empty_structure(), findings=(found,)).save(tmp_path / "s.nc")
    assert vk.load_result(tmp_path / "s.nc").findings == (found,)


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


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere"):
        full_structure().save(tmp_path / "nowhere" / "s.nc")


def test_the_dataset_of_a_trajectory():
    path = Trajectory(np.arange(3.0), np.random.default_rng(0).normal(size=(3, 3)))
    data = path.to_dataset()
    np.testing.assert_array_equal([data.t, data.x, data.v, data.state3], [path.t, *path.states.T])
    assert (data.x.units, data.v.units, data.t.units) == ("m", "m s-1", "s")
