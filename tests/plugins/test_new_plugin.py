"""``vibrokit new-plugin``: what it writes works as it is, and it writes nothing where it should not."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import vibrokit as vk
from tests.plugins.metadata import write_metadata
from vibrokit.cli import main, new_plugin
from vibrokit.cli.new_plugin import KINDS, plugin_files, plugin_names

NAMES = {kind: f"vibrokit-my-{kind}" for kind in KINDS}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder, the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def installed(folder, monkeypatch):
    """Put the plug-in of a folder on the path, with the metadata that its pyproject.toml leads to."""
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    write_metadata(folder, project)
    monkeypatch.syspath_prepend(folder)
    return {name: value for entries in project["entry-points"].values() for name, value in entries.items()}


def run(*words, folder):
    """Run a module of Python in the folder of a plug-in, which is on the path."""
    environment = os.environ | {"PYTHONPATH": str(folder)}
    return subprocess.run(
        [sys.executable, "-m", *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_passes_its_tests_and_the_checks(kind, folder, monkeypatch, capsys):
    assert main(["new-plugin", NAMES[kind], "--kind", kind]) == 0
    assert f"vibrokit_my_{kind.replace('-', '_')}" in capsys.readouterr().out
    entries = installed(folder / NAMES[kind], monkeypatch)
    tests = run("pytest", "-q", "-p", "no:cacheprovider", folder=folder / NAMES[kind])
    assert tests.returncode == 0, tests.stdout
    assert list(entries) == [f"my-{kind}"]
    if KINDS[kind].checks:
        assert main(["check", f"my-{kind}"]) == 0
        assert "FAILED" not in capsys.readouterr().out
    assert main(["list"]) == 0
    assert f"my-{kind} " in capsys.readouterr().out


@pytest.mark.parametrize("kind", KINDS)
def test_what_it_writes_is_in_good_style(kind, folder):
    assert main(["new-plugin", NAMES[kind], "--kind", kind]) == 0
    rules = ["--isolated", "--line-length=120", "."]
    for words in (["check", "--select=E,W,F,I,B,UP,SIM,RUF,PT", "--ignore=RUF001,RUF002"], ["format", "--check"]):
        judged = run("ruff", *words, *rules, folder=folder / NAMES[kind])
        assert judged.returncode == 0, judged.stdout


@pytest.mark.parametrize("kind", KINDS)
def test_the_readme_names_what_there_is(kind, folder):
    assert main(["new-plugin", NAMES[kind], "--kind", kind]) == 0
    text = (folder / NAMES[kind] / "README.md").read_text()
    assert ("vibrokit check" in text) == bool(KINDS[kind].checks)  # an analyzer has no checks
    (named,) = {line.split("`")[1] for line in text.splitlines() if line.startswith("The class is in `")}
    assert (folder / NAMES[kind] / named).is_file()
    project = tomllib.loads((folder / NAMES[kind] / "pyproject.toml").read_text())
    ((name, place),) = next(iter(project["project"]["entry-points"].values())).items()
    assert (folder / NAMES[kind] / f"{place.partition(':')[0].replace('.', '/')}.py").is_file()
    assert f"vibrokit check {name}" in text or f"--analyzer {name}" in text
    assert project["project"]["dependencies"] == [f"vibrokit>={vk.__version__}"]


def test_names():
    assert plugin_names("vibrokit-Tsuji.law", KINDS["contact-law"].group) == (
        "vibrokit-Tsuji.law", "vibrokit_tsuji_law", "tsuji-law", "TsujiLaw",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["2fast"], "'2fast'; give at most 60 ASCII letters"),
        (["-o"], None),
        ([""], "''; give at most 60"),
        (["my law"], "'my law'; give"),
        (["../mine"], "'../mine'; give"),
        (["my-"], "'my-'; give"),
        (["größe"], "'größe'; give"),
        (["a" * 61], "'aaa"),
        (["class"], "'class', which is no name"),
        (["none"], "'none', which is no name"),
        (["vibrokit"], "'vibrokit', which is no name"),
        (["vibrokit-2d"], "'vibrokit-2d', which is no name"),
        (["json"], "there is already a package 'json'"),
        (["NumPy"], "there is already a package 'numpy'"),
        (["vibrokit-hertz"], "there is already the contact law 'hertz' of vibrokit"),
        (["my-law", "--kind", "springs"], "no kind 'springs'; the nearest is 'spring'."),
    ],
)
def test_bad_names_are_refused_and_leave_nothing(words, said, folder, capsys):
    if said is None:  # argparse's own sentence
        with pytest.raises(SystemExit):
            main(["new-plugin", *words])
    else:
        assert main(["new-plugin", *words]) == 2
        text = capsys.readouterr().err
        assert said in text
        assert text.endswith(".\n")
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("make", [Path.mkdir, Path.touch, lambda path: path.symlink_to("nowhere")])
def test_what_exists_is_left_alone(make, folder, capsys):
    make(folder / "my-law")
    assert main(["new-plugin", "my-law"]) == 2
    assert capsys.readouterr().err == "vibrokit: my-law exists; give another name, or work in another folder.\n"
    assert [path.name for path in folder.iterdir()] == ["my-law"]
    assert not (folder / "my-law").is_dir() or not list((folder / "my-law").iterdir())


@pytest.mark.parametrize(("error", "status"), [(OSError(28, "No space left on device"), 2), (KeyboardInterrupt, 130)])
@pytest.mark.parametrize("place", ["write_text", "rename"])
def test_nothing_is_left_half_written(error, status, place, folder, monkeypatch, capsys):
    calls, owner = [], Path if place == "write_text" else new_plugin.os
    whole = getattr(owner, place)

    def broken(*given, **more):
        calls.append(given)
        if len(calls) == 3 or place == "rename":
            raise error
        return whole(*given, **more)

    monkeypatch.setattr(owner, place, broken)
    assert main(["new-plugin", "my-law"]) == status
    assert capsys.readouterr().err.endswith(".\n")
    assert list(folder.iterdir()) == []
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    assert main(["new-plugin", "my-law"]) == 0  # and then it can be written


def test_every_template_is_used():
    templates = set(new_plugin._TEMPLATES.list_templates())
    used = {"pyproject.toml.jinja", "README.md.jinja", "__init__.py.jinja", "part_test.py.jinja"}
    for kind, about in KINDS.items():
        used |= {f"{kind}/{name}.jinja" for name in ("class.py", "test.py", *(["scene.toml"] if about.checks else []))}
        files = plugin_files(kind, plugin_names(NAMES[kind], about.group))
        assert all("{{" not in text and "{%" not in text for text in files.values())
    assert templates == used
