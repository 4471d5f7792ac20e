"""vibrokit new-plugin: a distribution with one small part or analyzer, which works and is to be changed."""

from __future__ import annotations

import argparse
import importlib.util
import keyword
import os
import re
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import jinja2

from vibrokit import __version__
from vibrokit.errors import ArgumentError, FileError, UnknownNameError, nearest, reason, shown
from vibrokit.registry import BUILT_IN, Group, names

_LONGEST = 60
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*([._-]+[A-Za-z0-9]+)*")  # what PEP 503 allows and Python can import

_TEMPLATES = jinja2.Environment(
    loader=jinja2.PackageLoader("vibrokit.cli", "plugin_templates"),
    undefined=jinja2.StrictUndefined,
    keep_trailing_newline=True,
    trim_blocks=True,
    lstrip_blocks=True,
)


class Kind(NamedTuple):
    """What a new plug-in may have: its group, the module of its class, and its checks in `vibrokit.testing`."""

    group: Group
    file: str
    checks: str = ""


KINDS = {
    "contact-law": Kind(Group.CONTACT_LAWS, "law", "contact_law_checks"),
    "spring": Kind(Group.SPRINGS, "spring", "spring_checks"),
    "friction": Kind(Group.FRICTIONS, "friction", "friction_checks"),
    "excitation": Kind(Group.EXCITATIONS, "excitation", "excitation_checks"),
    "noise": Kind(Group.NOISE_MODELS, "noise", "noise_model_checks"),
    "analyzer": Kind(Group.ANALYZERS, "analyzer"),
}


class PluginNames(NamedTuple):
    """The names of a plug-in: of distribution and folder, of its package, in scene files, and of its class."""

    distribution: str
    module: str
    name: str
    cls: str


def new_plugin(options: argparse.Namespace) -> None:
    """Write a distribution into a folder of its name; the folder appears when all is written."""
    if options.kind not in KINDS:
        raise UnknownNameError(f"a plug-in has no kind {shown(options.kind)}{nearest(options.kind, KINDS)}")
    kind = KINDS[options.kind]
    found = plugin_names(options.name, kind.group)
    folder = Path(found.distribution)
    _write(folder, plugin_files(options.kind, found))
    check = f", 'vibrokit check {found.name}'" if kind.checks else ""
    print(f"{folder}: {kind.group.noun} {found.name!r}, class {found.cls} in {found.module}/{kind.file}.py")
    print(f"next: 'pip install --editable ./{folder}'{check}, 'pytest {folder}'")


def plugin_names(given: str, group: Group) -> PluginNames:
    """Return the names of a plug-in; raises ArgumentError if one of them cannot be."""
    module = re.sub(r"[._-]+", "_", given).lower()
    name = module.removeprefix(f"{BUILT_IN}_").replace("_", "-")
    cls = "".join(word.capitalize() for word in name.split("-"))
    if len(given) > _LONGEST or not _NAME.fullmatch(given):
        raise ArgumentError(
            f"a plug-in cannot have the name {shown(given)}; give at most {_LONGEST} ASCII letters, digits and single "
            "hyphens that begin with a letter, such as my-law."
        )
    if keyword.iskeyword(module) or keyword.iskeyword(cls) or not cls.isidentifier() or module == BUILT_IN:
        raise ArgumentError(f"a plug-in cannot have the name {given!r}, which is no name for a package and a class.")
    if module in sys.stdlib_module_names or importlib.util.find_spec(module) is not None:
        raise ArgumentError(f"there is already a package {module!r}; give the plug-in another name than {given!r}.")
    if name in (known := dict(names(group))):
        raise ArgumentError(
            f"there is already the {group.noun} {name!r} of {known[name]}; give the plug-in another name than "
            f"{given!r}."
        )
    return PluginNames(given, module, name, cls)


def plugin_files(kind: str, found: PluginNames) -> dict[str, str]:
    """Return the text of each file of a plug-in by its path."""
    group, file, checks = KINDS[kind]
    known = {
        **found._asdict(), "group": group.value, "noun": group.noun, "file": file, "checks": checks,
        "title": group.noun.capitalize(), "version": __version__,
        "where": "in scene files" if checks else "on the command line",
    }  # fmt: skip
    known["scene"] = _TEMPLATES.get_template(f"{kind}/scene.toml.jinja").render(known) if checks else ""
    templates = {
        "pyproject.toml": "pyproject.toml",
        "README.md": "README.md",
        f"{found.module}/__init__.py": "__init__.py",
        f"{found.module}/{file}.py": f"{kind}/class.py",
        f"tests/test_{found.module}.py": f"{kind}/test.py",
    }
    written = {path: _TEMPLATES.get_template(f"{name}.jinja").render(known) for path, name in templates.items()}
    return {**written, f"{found.module}/py.typed": ""}


def _write(folder: Path, files: dict[str, str]) -> None:
    if os.path.lexists(folder):
        raise FileError(f"{folder} exists; give another name, or work in another folder.")
    try:
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}-") as place:
            whole = Path(place) / folder.name
            for path, text in files.items():
                (whole / path).parent.mkdir(parents=True, exist_ok=True)
                (whole / path).write_text(text, encoding="utf-8")
            os.rename(whole, folder)
    except OSError as error:
        raise FileError(
            f"{folder} cannot be written ({reason(error)}); work in a folder that you may write to, on a disk that has "
            "room."
        ) from error
