"""The tables of the manual: their length, their commands, their scene files, and some rows that are computed again."""

import importlib.util
import re
import runpy
import shlex
import shutil
import sys
from pathlib import Path

import pytest

import vibrokit as vk
from tests.benchmarks import baseline, gallery, public_cases
from tests.klein_kramers import double_well_rate

REPOSITORY = Path(__file__).parents[1]
DOCS = REPOSITORY / "docs"
FILES = sorted((DOCS / "data").glob("*.csv"))
MOST_LINES = {"validation": 200, "performance": 120}
ENERGIES = ("gallery", "extremes")
CHEAP = {
    "gallery": ("double well, overdamped", "cubic well, unforced"),
    "public_cases": ("restitution 0.5",),
}


def loaded(path):
    """A module of the manual, which is no package."""
    spec = importlib.util.spec_from_file_location(f"docs_{path.stem}", path)
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


tables = loaded(DOCS / "tables.py")


def table(name):
    return tables.read(DOCS / "data" / f"{name}.csv")


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The pages by name, made in another folder."""
    docs = tmp_path_factory.mktemp("docs")
    shutil.copytree(DOCS / "data", docs / "data")
    tables.write(docs)
    return {path.stem: path.read_text(encoding="utf-8") for path in docs.glob("*.rst")}


def test_pages_are_short_and_use_every_table(pages):
    assert set(pages) == {"validation", "performance", "barriers"}
    for name, most in MOST_LINES.items():
        assert len(pages[name].splitlines()) <= most, name
    linked = set(re.findall(r"<(data/[^>]+)>`", "".join(pages.values())))
    assert all((DOCS / name).exists() for name in linked)
    assert {f"data/{path.name}" for path in FILES} <= linked


@pytest.mark.parametrize("name", ENERGIES)
def test_closed_forms_lie_within_bounds(name):
    rows = [row for row in table(name).rows if row["exact"] and row["energy"]]
    assert rows
    assert [row["scene"] for row in rows if tables.wrong(row)] == []


def test_public_cases_are_met_or_say_why():
    rows = table("public_cases").rows
    assert {row["case"] for row in rows} == set(public_cases.read_cases())
    assert [row["case"] for row in rows if row["met"] != "yes" and not row["remark"]] == []


def test_rates_are_those_of_the_spectrum():
    for row in table("klein_kramers").rows:
        spectrum = float(row["spectrum"])
        assert abs(float(row["sgcm"]) - spectrum) <= float(row["sgcm_error"])
        assert abs(float(row["mfet"]) - spectrum) <= 3 * float(row["mfet_error"])


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_commands_exist(path, monkeypatch, capsys):
    python, option, module, *words = shlex.split(tables.read(path).comments["command"])
    assert (python, option) == ("python", "-m")
    assert f"docs/data/{path.name}" in words
    monkeypatch.setattr(sys, "argv", [module, "--help"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(REPOSITORY / f"{module.replace('.', '/')}.py"), run_name="__main__")
    assert not ended.value.code
    usage = capsys.readouterr().out
    assert [word for word in words if word.startswith("--") and word not in usage] == []


def test_scene_files_are_the_scenes():
    files = {path.name: path for path in (DOCS / "data" / "scenes").iterdir()}
    names = {tables.file_name(name): name for name in gallery.SCENES}
    assert {gallery.file_name(name) for name in gallery.SCENES} == set(names) == set(files)
    for file, name in names.items():
        assert vk.load_scene(files[file]) == gallery.SCENES[name]


@pytest.mark.parametrize("name", CHEAP["gallery"])
def test_energies_are_computed_again(name):
    committed = table("gallery")
    known = {row["exit"]: row for row in committed.rows if row["scene"] == f"gallery: {name}"}
    found = list(baseline.of_gallery(gallery.SCENES[name], limit=60.0))
    assert {row["exit"] for row in found} == set(known)
    for row in found:
        tolerance = float(committed.comments["relative tolerance"])
        assert row["energy"] == pytest.approx(float(known[row["exit"]]["energy"]), rel=tolerance)
        assert row["energy"] == pytest.approx(row["exact"], rel=tolerance)


@pytest.mark.parametrize("word", CHEAP["public_cases"])
def test_public_cases_are_computed_again(word):
    known = {}
    for row in table("public_cases").rows:
        known.setdefault(row["case"], []).append(row)
    cases = public_cases.read_cases()
    sources = public_cases.sources(cases)
    for name, case in cases.items():
        if word in name:
            rows = public_cases.csv_rows(name, sources[name], public_cases.answers(public_cases.made(case, 60.0)))
            assert [row["met"] for row in rows] == [row["met"] for row in known[name]]
            assert [row["right"] for row in rows] == [row["right"] for row in known[name]]


def test_a_rate_of_the_spectrum_is_computed_again():
    row = table("klein_kramers").rows[0]
    damping = float(row["damping"])
    found = double_well_rate(damping, damping / float(row["ratio"]))
    assert found == pytest.approx(float(row["spectrum"]), abs=1e-7)
