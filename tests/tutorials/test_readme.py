"""Every snippet of the README and the manual does what it says."""

import ast
import importlib.util
import math
import os
import re
import runpy
import shlex
import tomllib
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest

import vibrokit as vk
from vibrokit import cli
from vibrokit.analyzers.settings import configured, setting
from vibrokit.registry import Group, load
from vibrokit.results.codes import Code

REPOSITORY = Path(__file__).parents[2]
README = REPOSITORY / "README.md"
DOCS = REPOSITORY / "docs"
IGNORED = (REPOSITORY / ".gitignore").read_text(encoding="utf-8").splitlines()


def made_by_the_build(page):
    """Whether `make docs` writes a page; git ignores these."""
    name = page.relative_to(REPOSITORY).as_posix()
    return any(line in (name, page.name) or (line.endswith("/") and name.startswith(line)) for line in IGNORED)


def from_scripts():
    """The folders of pages that Sphinx-Gallery makes, and those of their scripts."""
    for line in ast.parse((DOCS / "conf.py").read_text(encoding="utf-8")).body:
        if isinstance(line, ast.Assign) and ast.unparse(line.targets[0]) == "sphinx_gallery_conf":
            conf = ast.literal_eval(line.value)
    return {DOCS / pages: DOCS / own for pages, own in zip(conf["gallery_dirs"], conf["examples_dirs"], strict=True)}


WRITTEN = [page for page in sorted(DOCS.glob("**/*.rst")) if not made_by_the_build(page)]
PAGES = [README, *(page for page in WRITTEN if page.parent != DOCS / "scenes")]
QUICK = ("list", "equations", "plausibility", "check")  # of the other commands the words are checked
# Their Python takes the longest.
LONG = ("assess", "conformance-kit", "density", "exit-times", "least-action", "reconcile", "structure")


def snippets(page, language):
    """Snippets of one language in a page, Markdown or reStructuredText, in order."""
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".md":
        return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    blocks = re.findall(rf"^\.\. code-block:: {language}\n((?:\n|   .*\n)+)", text, re.MULTILINE)
    return [re.sub(r"^   ", "", block, flags=re.MULTILINE) for block in blocks]


def commands(page):
    """Command lines of a page, split into words."""
    lines = "".join(snippets(page, "console")).splitlines()
    return [shlex.split(line[2:], comments=True) for line in lines if line.startswith("$ ")]


def pages_with(language):
    """Pages that have snippets of a language."""
    pages = [page for page in PAGES if snippets(page, language)]
    return [
        pytest.param(
            page,
            id=page.relative_to(REPOSITORY).as_posix(),
            marks=[pytest.mark.long] * (page.parent.name == "theory" or page.stem in LONG),
        )
        for page in pages
    ]


def run_python(page, folder):
    """Run the Python snippets of a page as one script, and return its names."""
    script = folder / f"{page.stem.lower()}.py"
    script.write_text("\n".join(snippets(page, "python")), encoding="utf-8")
    return runpy.run_path(str(script), run_name="__main__")


@pytest.mark.slow
@pytest.mark.parametrize("page", pages_with("python"))
def test_python_snippets_run(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    made = run_python(page, tmp_path)
    printed = capsys.readouterr().out
    how_to = page.stem if page.parent.name == "how-to" else None
    if page == README:
        assert made["osc"] == vk.load_scene("hertz-0.570")
        assert [state.impacts for state in made["states"].attractors] == [0, 2]
        assert made["result"].energies[0].value == pytest.approx(7.9052e-5, rel=1e-4)  # what the README says of it
        assert len(made["result"].found(Code.AGREEMENT)) == 1
    elif how_to == "contact-law":
        assert "False False 3/2" in printed
        assert "FAILED" not in printed
    elif how_to == "least-action":
        assert (made["r"].energies[0].source, made["r"].energies[0].target) == (0, 1)
        assert made["r"].energies[0].certificate.residual < 1e-9
        assert len(made["r"].found(Code.AGREEMENT)) == 1
        well = 4 * 0.05 * 0.25  # 4ζω_n times the barrier, either way
        assert made["t"].energies == pytest.approx(np.array([[0, well], [well, 0]]), rel=1e-6)
        touch = 2 * 0.01 * (0.5 - 0.2 - 0.18 / abs(1 - 0.57**2 + 0.02j * 0.57)) ** 2
        assert made["touch"].energies[0].value == pytest.approx(touch, rel=1e-8)
    elif how_to == "density":
        energy = made["r"].energy("left-rest", "right-rest")
        assert energy.lower <= 4 * 0.05 * 0.25 <= energy.upper
        np.testing.assert_allclose(made["d"].occupancies, 0.5, rtol=1e-6)
        assert made["h"].times == pytest.approx(np.array([0.5, 1, 4]) * made["osc"].section_interval)
    elif how_to == "exit-times":
        energy = made["r"].energy("left-rest", "right-rest")
        assert energy.lower <= 4 * 0.2 * 0.25 <= energy.upper
        np.testing.assert_allclose(vk.occupancies(made["r"]), 0.5, atol=0.08)  # 5 % of each rate, three errors
        assert made["rare"].rates[0].method == "splitting"
        assert made["rare"].rates[0].log_value == pytest.approx(-21.71, abs=3 * made["rare"].rates[0].log_error)
        assert "commitment" in printed
        assert "False True True" in printed
    elif how_to == "spring":
        assert "FAILED" not in printed
        errors = dict(re.findall(r"^(\d\.0 \d+) (\S+)$", printed, re.MULTILINE))
        order = {k: math.log(float(errors[f"{k} 64"]) / float(errors[f"{k} 4096"]), 64) for k in ("4.0", "3.0")}
        assert order["4.0"] > 3.5
        assert order["3.0"] == pytest.approx(2, abs=0.5)
        rows = [
            row.split() for row in page.read_text(encoding="utf-8").splitlines() if re.match(r"(64|256|\d{4}) ", row)
        ]
        for steps, *shown in rows:  # the table of the page
            for k, error in zip(("4.0", "3.0"), shown, strict=True):
                assert float(errors[f"{k} {steps}"]) == pytest.approx(float(error), rel=0.5)
    elif how_to == "friction":
        assert float(printed.split()[-1]) == pytest.approx(2.0, rel=1e-7)
        assert "FAILED" not in printed
    elif how_to == "conformance-kit":
        assert "Wave, an excitation, fails 1 of " in printed
        assert "but its force repeats after 1/2 of it" in printed
        assert "FAILED" not in printed
    elif how_to == "excitation":
        assert (made["found"].harmonics, made["found"].periods) == (3, 4)
        assert float(printed.split()[0]) == pytest.approx(3.0, abs=1e-6)
        assert "42/59 (off by 1.0e-04, a section of 0.6462 s)\n" in printed
        assert "never repeats, so there is no section" in printed
        assert "FAILED" not in printed
    elif how_to == "noise":
        assert printed.splitlines()[0].split() == [str(0.25 / (2 * 0.35**2)), str(0.25 / 0.35**2)]
        assert made["e"].value == pytest.approx(0.110753, abs=1e-6)
        assert made["e"].lower == pytest.approx(0.1, rel=1e-6)
        assert made["estimate"].noise.rate == pytest.approx(3.0, abs=4 * made["estimate"].standard_errors["rate"])
        assert made["osc"].noise == made["estimate"].noise
    elif how_to == "steppers":
        assert "RK4: steps must be a whole number from 1 to 10000000, got 0." in printed
        errors = np.array(re.findall(r"^\d+ \[(\S+) +(\S+)\]", printed, re.MULTILINE), dtype=float)
        assert errors.shape == (3, 2)
        orders = np.log(errors[:-1] / errors[1:]) / np.log(4)
        assert np.all(orders[:, 0] > 3.5)  # free of contact, until rounding is met
        assert np.all(orders[:, 1] > 1.0)


def test_readme_has_ten_lines():
    first = snippets(README, "python")[0]
    assert len(first.splitlines()) == 10


def layered(line):
    """A command in the layer that it belongs to."""
    return pytest.param(line, marks=[pytest.mark.slow] * line.startswith("vibrokit check "))


@pytest.mark.parametrize(
    "line", [layered(line) for line in sorted({shlex.join(words) for page in PAGES for words in commands(page)})]
)
def test_commands_do_what_they_say(line, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    program, *words = shlex.split(line)
    if program == "make":
        makefile = (REPOSITORY / "Makefile").read_text(encoding="utf-8")
        assert re.search(rf"^{words[0]}:", makefile, re.MULTILINE)
        return
    if program == "python":
        module = words[0] == "-m"
        assert importlib.util.find_spec(words[1]) if module else (REPOSITORY / words[0]).exists()
        return
    assert program == "vibrokit"
    if words[0] in QUICK:
        assert cli.main(words) == 0
        assert capsys.readouterr().out
    else:
        assert cli.parsed(words).function


def test_settings_in_the_manual_are_settings():
    lines = [line for page in PAGES for line in commands(page) if "--set" in line]
    assert lines
    for line in lines:
        options = cli.parsed(line[1:])
        given = dict(setting(text) for text in options.set)
        for name in options.analyzer:
            made = configured(load(Group.ANALYZERS, name, vk.Analyzer), given)
            for key, text in given.items():
                assert np.array_equal(np.array(text.split(","), float), np.atleast_1d(attrgetter(key)(made)))


@pytest.mark.parametrize("page", pages_with("toml"))
def test_toml_snippets_are_read(page, tmp_path):
    for number, snippet in enumerate(snippets(page, "toml")):
        data = tomllib.loads(snippet)
        if data.keys() & {"natural_frequency", "stiffness"}:
            path = tmp_path / f"{number}.toml"
            path.write_text(snippet, encoding="utf-8")
            osc = vk.load_scene(path)
            rest = [[0.0] * len(osc.model.state)]
            assert osc.section_map(rest).shape == (1, len(osc.model.state))
        else:
            assert set(data) <= {"project", "barriers", "excitations", "spring", "friction", "noise"}


@pytest.mark.slow
def test_the_scene_of_the_command_line_has_a_clear_and_a_hammering_state(tmp_path):
    (snippet,) = snippets(DOCS / "how-to/command-line.rst", "toml")
    (tmp_path / "one-stop.toml").write_text(snippet, encoding="utf-8")
    found = vk.find_structure(vk.load_scene(tmp_path / "one-stop.toml"), cells=(20, 20), rng=0)
    assert [state.impacts for state in found.attractors] == [0, 2]


def test_files_that_the_readme_names_exist():
    text = README.read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:docs|tutorials|plugins)/[\w./-]*|[A-Z]+\.(?:cff|md))`", text))
    links = {link for link in re.findall(r"\]\(([^)#\s]+)", text) if "://" not in link}
    assert {"docs/images/overview.png", "docs/how-to/units.rst"} <= links
    assert "CITATION.cff" in named
    files = {REPOSITORY / name for name in named | links}
    assert [str(file) for file in sorted(files) if not (file.exists() or made_by_the_build(file))] == []


def pages_named_in(page):
    """Paths of the pages that a page leads to, by links and by tables of contents, without the suffix."""
    text = page.read_text(encoding="utf-8")
    named = re.findall(r":doc:`(?:[^`<]*<)?([^`<>]+)>?`", text)
    for block in re.findall(r"^\.\. toctree::\n((?:\n|   .*\n)+)", text, re.MULTILINE):
        entries = [line.strip() for line in block.splitlines()]
        named += [re.sub(r".*<(.*)>", r"\1", line) for line in entries if line and not line.startswith(":")]
    return [Path(os.path.normpath(_from(page, name))) for name in named]


def files_named_in(page):
    """Paths of the pictures and files that a page shows or offers."""
    text = page.read_text(encoding="utf-8")
    named = re.findall(r"^ *\.\. (?:image|figure|include|literalinclude):: (\S+)$", text, re.MULTILINE)
    named += re.findall(r":download:`(?:[^`<]*<)?([^`<>]+)>?`", text)
    return [_from(page, name) for name in named if "://" not in name]


def _from(page, name):
    return DOCS / name[1:] if name.startswith("/") else page.parent / name


def source_of(target):
    """The file that a page is made from: itself, a script, or what the build writes."""
    page = target.with_name(f"{target.name}.rst")
    folder = from_scripts().get(target.parent)
    if folder is None:
        return DOCS / "conf.py" if made_by_the_build(page) else page
    return folder / ("GALLERY_HEADER.rst" if target.name == "index" else f"{target.name}.py")


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: page.relative_to(REPOSITORY).as_posix())
def test_links_and_pictures_exist(page):
    assert [str(target) for target in pages_named_in(page) if not source_of(target).exists()] == []
    assert [str(file) for file in files_named_in(page) if not file.exists()] == []


def test_links_are_read(tmp_path):
    """The test above sees links of each form."""
    page = tmp_path / "page.rst"
    page.write_text(
        "A\n=\n\n:doc:`one`, :doc:`the other <../two>` and :doc:`/three`\n\n.. toctree::\n   :maxdepth: 1\n\n"
        "   four\n   Five <five>\n\n.. image:: six.png\n   :alt: six\n\n:download:`it <seven.toml>`\n",
        encoding="utf-8",
    )
    two, here = tmp_path.parent / "two", tmp_path
    assert pages_named_in(page) == [here / "one", two, DOCS / "three", here / "four", here / "five"]
    assert files_named_in(page) == [here / "six.png", here / "seven.toml"]


def test_lines_that_register_are_those_of_the_project():
    lines = re.findall(r'``([\w-]+ = "[\w.]+:\w+")``', (DOCS / "contributing.rst").read_text(encoding="utf-8"))
    project = (REPOSITORY / "pyproject.toml").read_text(encoding="utf-8").splitlines()
    assert len(lines) >= 7
    assert [line for line in lines if line not in project] == []


def test_the_changelog_and_the_citation_have_the_version():
    changes = (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(r"^(\d\S*) \(.*\)\n-+$", changes, re.MULTILINE)[1] == vk.__version__
    assert f"\nversion: {vk.__version__}\n" in (REPOSITORY / "CITATION.cff").read_text(encoding="utf-8")


def test_the_readme_is_short():
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 120


def test_the_picture_is_small():
    assert (REPOSITORY / "docs/images/overview.png").stat().st_size < 200_000
