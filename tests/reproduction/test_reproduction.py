"""The reproduction of the paper: its data, its verdicts, and that stopped work goes on with the same bits."""

import math
from dataclasses import replace

import pytest

import vibrokit as vk
from vibrokit.analyzers.sgcm_wkb import SGCM
from vibrokit.errors import FileError
from vibrokit.progress import working
from vibrokit.reproduction.published import STATES, Method, Published, published_energies, scenes
from vibrokit.reproduction.reproduce import PAGE, PUBLISHED, reproduce
from vibrokit.reproduction.steps import Step, do, steps
from vibrokit.reproduction.verdicts import Match, of_action_plot, of_density, of_exit_times, unknown

ONE = Published("hertz-0.570", "N", Method.ACTION_PLOT, 8.2e-5, 0.05e-5)
STEPS = (
    Step("double-well", "structure"),
    Step("double-well", "density", SGCM(source=0, intensities=(2e-2,), nodes=(60, 60))),
)


def test_every_published_number_has_its_digits():
    found = published_energies()
    assert len(found) == len(scenes()) * len(STATES) * len(Method)
    printed = {(one.scene, one.state, one.method): (one.value, one.half_digit) for one in found}
    assert printed["hertz-0.570", "N", Method.ACTION_PLOT] == pytest.approx((8.2e-5, 5e-7))
    assert printed["hertz-0.525", "I", Method.DENSITY] == pytest.approx((9.65e-5, 5e-8))


def test_scenes_are_those_of_the_data():
    for scene in scenes():
        osc = vk.load_scene(scene)
        assert osc.parameters["excitations.0.frequency"] == float(scene.removeprefix("hertz-"))


@pytest.mark.parametrize(
    ("verdict", "match"),
    [
        (of_action_plot(ONE, 8.1e-5, 8.17e-5, 8.8e-5), Match.MET),  # within half a digit
        (of_action_plot(ONE, 7.7e-5, 7.9e-5, 8.8e-5), Match.RING),
        (of_action_plot(ONE, 7.7e-5, 7.9e-5, 7.9e-5), Match.NOT_MET),  # the ring finds the cheapest path, too
        (of_action_plot(ONE, 8.5e-5, 8.9e-5, 9.9e-5), Match.NOT_MET),  # below what is proven
        (of_density(ONE, 8.0e-5, 0.2e-5, 7.9e-5, 2e-5), Match.MET),
        (of_density(ONE, 7.0e-5, 0.2e-5, 7.9e-5, 2e-5), Match.NOT_MET),
        (of_density(ONE, 7.0e-5, 0.2e-5, 7.9e-5, 2e-6), Match.TAILS),  # e⁻³⁹ of the maximum
        (of_exit_times(ONE, 8.1e-5, 0.1e-5, 7.9e-5), Match.MET),
        (of_exit_times(ONE, 8.6e-5, 0.1e-5, 7.9e-5), Match.REGIME),
        (of_exit_times(ONE, 7.9e-5, 0.1e-5, 7.9e-5), Match.NOT_MET),
        (of_exit_times(ONE, 7.0e-5, 0.1e-5, 7.9e-5), Match.NOT_MET),
        (of_density(ONE, 8.0e-5, 9.0e-5, 7.9e-5, 2e-5), Match.UNKNOWN),  # an interval that holds any number
        (unknown(ONE, "it is not metastable."), Match.UNKNOWN),
    ],
)
def test_verdicts(verdict, match):
    assert verdict.match is match
    assert verdict.sentence.endswith(".")


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    with working():
        return do(STEPS, tmp_path_factory.mktemp("whole"))["double-well"]


@pytest.mark.long
def test_work_that_was_stopped_goes_on_with_the_same_bits(found, tmp_path):
    assert list(found) == ["structure", "density"]
    with working():
        do(STEPS[:1], tmp_path)
    first = (tmp_path / STEPS[0].file).read_bytes()
    (tmp_path / STEPS[1].file).write_bytes(b"half of a file")
    with working():
        resumed = do(STEPS, tmp_path)["double-well"]
    assert (tmp_path / STEPS[0].file).read_bytes() == first
    assert found["density"].data.drop_attrs().equals(resumed["density"].data.drop_attrs())
    changed = (STEPS[0], Step("double-well", "density", SGCM(source=0, intensities=(3e-2,), nodes=(60, 60))))
    with working():
        redone = do(changed, tmp_path)["double-well"]["density"]
    assert redone.intensities == [3e-2]


def test_records_of_another_kind_scene_or_version_are_done_again(found, tmp_path):
    good = found["structure"]
    louder = {**good.scene, "noise": {**good.scene["noise"], "intensity": 1.0}}
    older = {**good.versions, "vibrokit": "0.0.1"}
    for wrong in (found["density"], replace(good, scene=louder), replace(good, versions=older)):
        wrong.save(tmp_path / STEPS[0].file)
        with working():
            again = do(STEPS[:1], tmp_path)["double-well"]["structure"]
        assert (again.kind, again.scene, again.versions) == (good.kind, good.scene, good.versions)


def test_a_limit_leaves_a_page(tmp_path):
    report = reproduce(tmp_path / "folder", quick=True, time_limit=1e-3)
    assert not report.complete
    (table,) = [table for table in report.tables if table.name == PUBLISHED]
    assert [row[6] for row in table.rows] == ["unknown"] * len(published_energies())
    assert "ncomplete" in (tmp_path / "folder" / PAGE).read_text(encoding="utf-8")


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    for wrong in (tmp_path / "file", tmp_path / "file" / "inside", "/proc", "/proc/inside"):
        with pytest.raises(FileError):
            reproduce(wrong)


def test_a_file_that_cannot_be_written_is_found_before_any_work(tmp_path):
    (tmp_path / STEPS[1].file).mkdir()
    with working(), pytest.raises(FileError, match="is a folder"):
        do(STEPS, tmp_path)
    assert not (tmp_path / STEPS[0].file).exists()


@pytest.mark.long
def test_the_paper_in_short(tmp_path):
    report = reproduce(tmp_path, quick=True)
    assert report.complete
    (table,) = [table for table in report.tables if table.name == PUBLISHED]
    assert len(table.rows) == len(published_energies())
    energies = {row[:3]: float(row[5]) for row in table.rows}
    assert math.isclose(energies["hertz-0.570", "N", "action-plot"], 7.905215598e-05, rel_tol=1e-5)
    assert math.isclose(energies["hertz-0.525", "N", "action-plot"], 9.432543e-05, rel_tol=1e-5)
    assert len(list(tmp_path.glob("figure-*.png"))) == 2 * 8 + 1  # Figures 2 to 9 of both scenes, and 10
    verdicts = {row[:3]: row[6] for row in table.rows}
    assert verdicts["hertz-0.525", "I", "action-plot"] == verdicts["hertz-0.570", "I", "action-plot"] == "ring"
    assert list(verdicts.values()).count("unknown") <= 1  # few nodes do not resolve the density of 0.570, N
    assert all(step.file in {file.name for file in tmp_path.iterdir()} for step in steps(quick=True))
