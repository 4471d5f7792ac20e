"""The reference: one entry with an example for each public name, and links to other manuals without a network."""

import importlib.util
import pydoc
import re
import tomllib
import zlib
from collections import Counter
from pathlib import Path

import pytest

import vibrokit as vk

REPOSITORY = Path(__file__).parents[1]
DOCS = REPOSITORY / "docs"
PAGES = sorted(page for page in DOCS.glob("reference/*.rst") if page.stem != "index")
ENTRY = re.compile(r"^\.\. auto(?:class|function|exception|module):: ([\w.]+)$", re.MULTILINE)
EXAMPLE = re.compile(r"^ *(?:>>>|\.\.\.) (.*)$", re.MULTILINE)
OTHERS = tomllib.loads((DOCS / "inventories.toml").read_text(encoding="utf-8"))
KNOWN = {name for tables in OTHERS.values() for role, table in tables.items() if role != "url" for name in table}


def entries(page):
    """Full names of the objects that a page has entries of."""
    found = ENTRY.findall(page.read_text(encoding="utf-8"))
    return [name if name.startswith("vibrokit.") else f"vibrokit.{name}" for name in found]


def test_each_public_name_has_one_entry():
    counts = Counter(name for page in PAGES for name in entries(page))
    assert {name: counts[f"vibrokit.{name}"] for name in vk.__all__} == dict.fromkeys(vk.__all__, 1)


def test_no_object_has_two_entries():
    found = [(name, pydoc.locate(name)) for page in PAGES for name in entries(page)]
    assert [name for name, one in found if one is None] == []
    counts = Counter(id(one) for _, one in found)
    assert [name for name, one in found if counts[id(one)] > 1] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_each_public_name_has_an_example(page):
    examples = "\n".join(EXAMPLE.findall(page.read_text(encoding="utf-8")))
    own = [name.removeprefix("vibrokit.") for name in entries(page)]
    public = [name for name in own if name in vk.__all__]
    assert public or page.stem == "pictures"
    assert [name for name in public if not re.search(rf"\bvk\.{name}\b", examples)] == []


def test_the_index_lists_each_page():
    index = (DOCS / "reference/index.rst").read_text(encoding="utf-8")
    assert sorted(re.findall(r"^:doc:`([\w-]+)`$", index, re.MULTILINE)) == [page.stem for page in PAGES]
    assert sorted(re.findall(r"^   ([\w-]+)$", index, re.MULTILINE)) == [page.stem for page in PAGES]


def inventories():
    """The module that writes inventories."""
    spec = importlib.util.spec_from_file_location("inventories", DOCS / "inventories.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_inventories_have_the_format_of_sphinx(tmp_path):
    (tmp_path / "inventories.toml").write_bytes((DOCS / "inventories.toml").read_bytes())
    mapping = inventories().write_inventories(tmp_path)
    assert mapping.keys() == OTHERS.keys()
    for project, (url, file) in mapping.items():
        assert re.fullmatch(r"https://\S+/", url)
        *head, content = (tmp_path / file).read_bytes().split(b"\n", 4)
        assert head[0] == b"# Sphinx inventory version 2"
        assert head[1] == f"# Project: {project}".encode()
        assert [line[:3] for line in (head[2][2:], head[3][2:])] == [b"Ver", b"The"]
        lines = zlib.decompress(content).decode().splitlines()
        known = [re.fullmatch(r"(\S+) py:(\w+) 1 (\S+\.html#\S+) -", line) for line in lines]
        assert {match[1] for match in known} == {n for r, table in OTHERS[project].items() if r != "url" for n in table}


def test_sphinx_reads_the_inventories():
    inventory = pytest.importorskip("sphinx.util.inventory")
    for project, tables in OTHERS.items():
        read = inventory.InventoryFile.loads(inventories().inventory(project, tables), uri=tables["url"])
        found = {(kind, name): item.uri for kind, items in read.data.items() for name, item in items.items()}
        assert found == {
            (f"py:{role}", name): tables["url"] + place.replace("$", name)
            for role, table in tables.items()
            if role != "url"
            for name, place in table.items()
        }


def test_objects_of_other_manuals_exist():
    pytest.importorskip("matplotlib")
    assert [name for name in sorted(KNOWN) if pydoc.locate(name) is None] == []


def test_types_of_other_packages_in_docstrings_have_a_link():
    typed = re.compile(
        r"^ +[\w, *]+ : .*?\b((?:numpy|scipy|sympy|xarray|matplotlib|concurrent)(?:\.\w+)+)", re.MULTILINE
    )
    named = {name for path in REPOSITORY.glob("vibrokit/**/*.py") for name in typed.findall(path.read_text("utf-8"))}
    assert {"numpy.random.Generator", "matplotlib.axes.Axes"} <= named <= KNOWN
