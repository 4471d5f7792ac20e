"""The page of an assessment: its numbers, its parts, and that it needs nothing else."""

import dataclasses
import html
import json
import shutil
import subprocess
import xml.etree.ElementTree

import pytest

import vibrokit as vk
from tests.assessment.test_assessment import SCENE, STRUCTURE, rated
from tests.builders import full_structure
from tests.layers import long
from tests.report.page import Page
from vibrokit.assessment.durations import duration_text
from vibrokit.cli import main
from vibrokit.errors import ArgumentError, FileError, StructureError, VibrokitError
from vibrokit.report.answer import answer_sentences
from vibrokit.report.material import gathered
from vibrokit.results.finding import Finding
from vibrokit.results.section import Section
from vibrokit.scene_file import scene_data

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def test_the_page_is_well_formed_and_needs_nothing_else(report):
    page = Page(report.html)
    assert not page.open
    assert len(set(page.ids)) == len(page.ids)
    assert all(link.startswith(("#", "data:")) for link in page.links)
    assert "A <b>scene</b> & its noise" in "".join(page.words)
    for chapter in report.chapters:
        assert chapter.title in page.words


def test_units_of_the_inputs_and_numbers_of_the_answer(assessment, report):
    (inputs,) = [table for table in report.tables if table.name == "inputs"]
    units = {row[0]: row[2:4] for row in inputs.rows}
    assert units["noise.intensity"] == ("1.5e-05", "m² s⁻³")
    assert units["barriers.0.law.stiffness"][1] == "m⁻¹ᐟ² s⁻²"
    answer = report.chapters[0].blocks[0].lines
    times = sorted(map(assessment.mean_time, assessment.names), key=lambda time: -time.log_value)
    for sentence, time in zip(answer, times, strict=False):
        assert all(duration_text(log) in sentence for log in (time.log_value, time.log_lower, time.log_upper))


def test_the_answer_says_when_no_state_runs_clear(assessment):
    states = assessment.structure.attractors
    assert [bool(state.touched) for state in states] == [False, True]
    touching = dataclasses.replace(states[0], peak_depth=states[1].peak_depth)
    structure = dataclasses.replace(assessment.structure, attractors=(touching, *states[1:]))
    without = len(answer_sentences(assessment))
    assert len(answer_sentences(dataclasses.replace(assessment, structure=structure))) == without + 1


def test_equations_are_mathml(report):
    (formulas,) = [block for chapter in report.chapters for block in chapter.blocks if block.kind == "formulas"]
    roots = [xml.etree.ElementTree.fromstring(text.replace("&InvisibleTimes;", "")) for text in formulas.mathml]
    assert [root.tag for root in roots] == ["math"] * 5  # x, v, p₁, p₂ and H
    assert sum(1 for _ in roots[1].iter("mtable")) == len(SCENE["barriers"])


@pytest.mark.slow
def test_the_same_records_give_the_same_page(assessment, report):
    assert assessment.report(title=report.title).html == report.html


def test_a_structure_and_results_are_one_assessment():
    structure = dataclasses.replace(STRUCTURE, scene=SCENE)
    results = [dataclasses.replace(rated(), section=Section.of(structure)) for _ in range(2)]
    (one,) = gathered([*results, structure])
    assert one.structure is structure
    assert list(one.results) == ["mfet", "mfet 2"]


def test_what_cannot_be_reported(assessment):
    other = dataclasses.replace(STRUCTURE, scene={**SCENE, "damping_ratio": 0.7})
    with pytest.raises(StructureError, match="damping_ratio"):
        vk.Report.of(assessment, other)
    with pytest.raises(StructureError):
        vk.Report.of(rated(), dataclasses.replace(full_structure(), scene=SCENE))
    for wrong in ((), ("answer.nc",), (None,), (assessment, assessment), (STRUCTURE, STRUCTURE)):
        with pytest.raises(ArgumentError):
            vk.Report.of(*wrong)


@pytest.mark.parametrize(
    "name",
    [
        long("<img src=x onerror=alert(1)>&amp;--><b>"),
        "\"'><script>alert('&lt;')</script>",
        long(r"$x_1$ & ${x}$"),
        long(r"5 $ of \frac{1"),
        long(r"$\frac{1$ --> ]]>"),
    ],
)
def test_names_with_markup_are_escaped_and_what_is_incomplete_is_said(assessment, name):
    """In tables, pictures, settings and remarks."""
    renamed = dataclasses.replace(STRUCTURE.attractors[0], name=name)
    structure = dataclasses.replace(STRUCTURE, attractors=(renamed, STRUCTURE.attractors[1]), scene=SCENE)
    remarks = (Finding.of(vk.Code.REMARK, text=name),)
    stopped = dataclasses.replace(
        assessment, structure=structure, settings={name: name}, complete=False, findings=remarks
    )
    page = Page(stopped.report(title=name).html)
    assert not page.open
    assert not page.tags & {"img", "script", "b"}
    assert all(link.startswith(("#", "data:")) for link in page.links)
    assert name in page.words  # the title
    assert name in page.cells
    assert any("ncomplete" in word for word in page.words)
    assert any(f"info: {name}" in word for word in page.words)


def test_a_scene_file_with_markup_in_its_names(tmp_path, monkeypatch, capsys):
    """Names of parameters and parts are words, and others are refused; the name of the file may have any signs."""
    monkeypatch.chdir(tmp_path)
    text = "natural_frequency = 1.0\ndamping_ratio = 0.1\n[spring]\nname = {0}\nformula = {1}\n{2} = 2.0\n"
    good = ('"custom"', '"b_1*x + script*x**3"', "b_1 = 1.0\nscript")
    wrong = ("'<script>'", '"b_1*x & <b>"', "'$b_1$'", "'<b>'")
    for place, bad in ((0, wrong[0]), (1, wrong[1]), (2, wrong[2]), (2, wrong[3])):
        words = [*good[:place], bad, *good[place + 1 :]]
        (tmp_path / "scene.toml").write_text(text.format(*words), encoding="utf-8")
        with pytest.raises(VibrokitError):
            vk.load_scene("scene.toml")
    (tmp_path / "scene.toml").write_text(text.format(*good), encoding="utf-8")
    scene = scene_data(vk.load_scene("scene.toml"))
    name = """<script>alert("1")<!-- & '$x_1$' ]]>"""
    dataclasses.replace(full_structure(), scene=scene).save(f"{name}.nc")
    main(["report", f"{name}.nc", "-o", "page.html"])
    page = Page((tmp_path / "page.html").read_text(encoding="utf-8"))
    assert not page.open
    assert name in page.words
    assert {"spring.b_1", "spring.script"} <= set(page.cells)


def test_files(report, tmp_path):
    report.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == report.html
    files = report.save_tables(tmp_path / "tables")
    assert len(files) == len(set(files)) == len(report.tables)
    for file, table in zip(files, report.tables, strict=True):
        assert len(file.read_text(encoding="utf-8").splitlines()) == 1 + len(table.rows)
    for name, error in (("page.pdf", VibrokitError), ("nowhere/page.html", FileError)):
        with pytest.raises(error):
            report.save(tmp_path / name)
    with pytest.raises(VibrokitError):
        report.save_tables(tmp_path / "page.html")


def test_command_line(assessment, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assessment.save("answer.nc")
    assert main(["report", "answer.nc"]) == 0
    text = capsys.readouterr().out
    assert "noise.intensity" in text
    assert assessment.mean_time(0).number in text
    assert main(["report", "answer.nc", "-o", "answer.html", "--tables", "tables"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == "answer.html"
    assert "<h1>answer</h1>" in (tmp_path / "answer.html").read_text(encoding="utf-8")
    assert list((tmp_path / "tables").glob("*.csv"))
    assert main(["report", "answer.nc", "-o", "answer.doc"]) == 2
    assert main(["report", "missing.nc", "-o", "answer.html"]) == 2
    (tmp_path / "folder.html").mkdir()
    (tmp_path / "file").touch()
    for wrong in (["-o", "folder.html"], ["-o", "nowhere/a.html"], ["--tables", "file"], ["--tables", "nowhere/t"]):
        assert main(["report", "answer.nc", *wrong]) == 2
    assert main(["report", "answer.nc", "answer.nc", "-o", "answer.html"]) == 2


MEASURE = """
const found = [];
function apart(boxes, say) {
  for (let i = 0; i < boxes.length; i++) for (let j = 0; j < i; j++) {
    const [a, b] = [boxes[i], boxes[j]].map(e => e.getBoundingClientRect());
    const x = Math.min(a.right, b.right) - Math.max(a.left, b.left);
    const y = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
    if (x > 0.5 && y > 0.5) say("overlap: " + boxes[i].outerHTML.slice(0, 80) + boxes[j].outerHTML.slice(0, 80));
  }
}
function measure(frame) {
  const page = frame.contentDocument, width = frame.clientWidth;
  const say = what => found.push(width + ": " + what);
  if (page.documentElement.scrollWidth > width) say("scrolls to " + page.documentElement.scrollWidth);
  for (const e of page.querySelectorAll("body *:not(svg *):not(.wide *)"))
    if (e.getBoundingClientRect().right > width + 0.5) say("outside: " + e.outerHTML.slice(0, 80));
  for (const e of page.querySelectorAll("body, section, figure, ul, .wide, tbody")) apart([...e.children], say);
  for (const e of page.querySelectorAll("svg")) apart([...e.querySelectorAll("g[id*=text_]")], say);
  if (frame.contentWindow.performance.getEntriesByType("resource").length) say("requests");
  document.body.dataset.measured = 1 + Number(document.body.dataset.measured || 0);
}
onload = () => { document.body.dataset.found = JSON.stringify(found); };
"""


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="needs a browser")
def test_in_a_browser_nothing_overlaps_or_is_wider_than_the_page(report, tmp_path):
    """Another page has this one in frames of two widths and measures it; windows cannot be as narrow as a telephone."""
    inside = html.escape(report.html)
    frames = "".join(
        f'<iframe srcdoc="{inside}" onload="measure(this)" style="width:{width}px; border:0"></iframe>'
        for width in (400, 1200)
    )
    page = tmp_path / "frames.html"
    page.write_text(f"<!DOCTYPE html><meta charset=utf-8><body><script>{MEASURE}</script>{frames}", encoding="utf-8")
    words = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}/profile"]
    words += ["--window-size=1300,900", "--timeout=60000", "--dump-dom", page.as_uri()]
    found = subprocess.run(words, capture_output=True, text=True, timeout=180, check=True).stdout
    body = found.split("<body", 1)[1].split(">", 1)[0]
    assert 'data-measured="2"' in body
    assert json.loads(html.unescape(body.split('data-found="')[1].split('"')[0])) == []
