"""The gallery's scripts run: each compares a number with its right value by itself, and draws a picture."""

import ast
import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

SCENES = Path(__file__).parents[2] / "docs/scenes"
SCRIPTS = sorted(SCENES.glob("*.py"))
LONG = ("grazing_chaos", "heat_exchanger_tube", "paper_scene")  # the manual runs them, too
LIBRARIES = {"math", "matplotlib", "numpy", "vibrokit"}


def layered(path):
    """A script in the layer that it belongs to."""
    mark = pytest.mark.long if path.stem in LONG else pytest.mark.slow
    return pytest.param(path, id=path.stem, marks=mark)


@pytest.mark.parametrize("path", [layered(path) for path in SCRIPTS])
def test_a_script_runs_and_draws(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")  # closes all figures
    try:
        runpy.run_path(str(path), run_name="__main__")
        figures = [plt.figure(number) for number in plt.get_fignums()]
        assert figures
        for figure in figures:
            figure.savefig(tmp_path / "picture.png")
            for axes in figure.axes:
                assert axes.get_ylabel()
    finally:
        plt.close("all")
    assert capsys.readouterr().out


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_page_has_a_title_parts_of_a_scene_and_a_check(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    title, line, *_ = ast.get_docstring(tree).splitlines()
    assert line == "=" * len(title)
    nodes = list(ast.walk(tree))
    assert any(isinstance(node, ast.Assert) for node in nodes)
    assert any(isinstance(node, ast.Attribute) and node.attr == "Oscillator" for node in nodes)
    imported = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    assert {name.split(".")[0] for name in imported} <= LIBRARIES


def test_the_gallery_has_a_header_and_scenes():
    assert (SCENES / "GALLERY_HEADER.rst").read_text(encoding="utf-8").startswith("Gallery of scenes\n===")
    assert len(SCRIPTS) >= 12
