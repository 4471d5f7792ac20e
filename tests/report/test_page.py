"""The page of an assessment: its numbers, its parts, and that it needs nothing else."""

import dataclasses
import html.parser
import math
import shutil
import subprocess
import xml.etree.ElementTree

import pytest

import vibrokit as vk
from tests.assessment.test_assessment import SCENE, STRUCTURE, assessment, rated  # noqa: F401 - a fixture
from tests.builders import full_structure
from vibrokit.cli import main
from vibrokit.errors import ArgumentError, FileError, StructureError, VibrokitError
from vibrokit.report.material import gathered
from vibrokit.results.finding import Finding
from vibrokit.results.section import Section

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
_VOID = {"meta", "br", "img", "link"}


class Page(html.parser.HTMLParser):
    """The elements of a page and the text of its table cells; counts what is not closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.ids, self.cells, self.words = [], [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.ids += [value for name, value in attrs if name == "id"]
        self.links += [value for name, value in attrs if name in ("src", "href", "xlink:href", "action", "data")]
        assert tag != "script"
        if tag not in _VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in _VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)
        if "td" in self.open:
            self.cells.append(data)


@pytest.fixture(scope="module")
def report(assessment):  # noqa: F811
    return assessment.report(title="A <b>scene</b> & its noise")


def test_the_page_is_well_formed_and_needs_nothing_else(report):
    page = Page(report.html)
    assert not page.open
    assert len(set(page.ids)) == len(page.ids)
    assert all(link.startswith(("#", "data:")) for link in page.links)
    assert "A <b>scene</b> & its noise" in "".join(page.words)
    for chapter in report.chapters:
        assert chapter.title in page.words


def test_its_numbers_are_those_of_the_assessment(assessment, report):  # noqa: F811
    cells = Page(report.html).cells
    for name in assessment.names:
        assert assessment.mean_time(name).number in cells
        assert f"{assessment.energy(name).value:.6g}" in cells
    (inputs,) = [table for table in report.tables if table.name == "inputs"]
    units = {row[0]: row[2:] for row in inputs.rows}
    assert units["noise.intensity"] == ("1.5e-05", "m² s⁻³")
    assert units["barriers.0.law.stiffness"][1] == "m⁻¹ᐟ² s⁻²"
    answer = report.chapters[0].blocks[0].lines
    longest = max(assessment.names, key=lambda name: assessment.mean_time(name).log_value)
    assert longest in answer[0]
    assert assessment.mean_time(longest).number in answer[0]


def test_equations_are_mathml(report):
    (formulas,) = [block for chapter in report.chapters for block in chapter.blocks if block.kind == "formulas"]
    roots = [xml.etree.ElementTree.fromstring(text.replace("&InvisibleTimes;", "")) for text in formulas.mathml]
    assert [root.tag for root in roots] == ["math"] * 5  # x, v, p₁, p₂ and H
    assert sum(1 for _ in roots[1].iter("mtable")) == len(SCENE["barriers"])


def test_the_same_records_give_the_same_page(assessment, report):  # noqa: F811
    assert assessment.report(title=report.title).html == report.html


def test_a_structure_and_results_are_one_assessment():
    structure = dataclasses.replace(STRUCTURE, scene=SCENE)
    results = [dataclasses.replace(rated(), section=Section.of(structure)) for _ in range(2)]
    (one,) = gathered([*results, structure])
    assert one.structure is structure
    assert list(one.results) == ["mfet", "mfet-2"]
    assert "Answer" in [chapter.title for chapter in vk.Report.of(*results, structure).chapters]


def test_what_is_incomplete_is_said(assessment):  # noqa: F811
    stopped = dataclasses.replace(
        assessment, complete=False, findings=(Finding.of(vk.Code.REMARK, text="a <script> & more"),)
    )
    page = Page(stopped.report().html)
    assert any("ncomplete" in word for word in page.words)
    assert any("A <script> & more" in word for word in page.words)


def test_what_cannot_be_reported(assessment):  # noqa: F811
    other = dataclasses.replace(STRUCTURE, scene={**SCENE, "damping_ratio": 0.7})
    with pytest.raises(StructureError, match="damping_ratio"):
        vk.Report.of(assessment, other)
    with pytest.raises(StructureError):
        vk.Report.of(rated(), dataclasses.replace(full_structure(), scene=SCENE))
    for wrong in ((), ("answer.nc",), (None,)):
        with pytest.raises(ArgumentError):
            vk.Report.of(*wrong)


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


def test_command_line(assessment, tmp_path, monkeypatch, capsys):  # noqa: F811
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


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="needs a browser")
@pytest.mark.parametrize("width", [500, 1200])
def test_in_a_browser_nothing_is_wider_than_the_page(report, tmp_path, width):
    """Chromium runs a script that the test adds, which writes the widths into the page that it then prints."""
    script = (
        "<script>document.body.dataset.wide = document.documentElement.scrollWidth + ' ' + window.innerWidth</script>"
    )
    text = report.html.replace("default-src 'none'", "default-src 'none'; script-src 'unsafe-inline'")
    page = tmp_path / "page.html"
    page.write_text(text.replace("</body>", f"{script}</body>"), encoding="utf-8")
    words = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}/profile"]
    words += [f"--window-size={width},900", "--dump-dom", page.as_uri()]
    found = subprocess.run(words, capture_output=True, text=True, timeout=120, check=True).stdout
    scrolled, inner = map(int, found.split('data-wide="')[1].split('"')[0].split())
    assert scrolled <= inner <= width
    assert math.isfinite(scrolled)
