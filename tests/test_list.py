"""``vibrokit list``: every name, its distribution, and the parameters of parts, in columns."""

import re
from importlib.metadata import EntryPoint

import pytest

from vibrokit import registry
from vibrokit.cli import main
from vibrokit.registry import Group
from vibrokit.scene_file import bundled_scenes


def listed(capsys):
    """What `vibrokit list` prints: columns by name, for each kind."""
    assert main(["list"]) == 0
    _, *lines = capsys.readouterr().out.splitlines()
    kinds = {}
    for line in lines:
        if line.endswith("s:"):
            rows = kinds[line[:-1]] = {}
        else:
            name, *columns = re.split(r" {2,}", line.strip())
            rows[name] = columns
    return kinds


def test_list_has_every_name(capsys):
    kinds = listed(capsys)
    assert set(kinds) == {f"{group.noun}s" for group in Group}
    for group in Group:
        assert {name: row[0] for name, row in kinds[f"{group.noun}s"].items()} == dict(registry.names(group))
    assert main(["list"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == f"scenes: {', '.join(bundled_scenes())}"


def test_list_has_the_parameters_of_parts_and_the_fields_of_exits_alone(capsys):
    kinds = listed(capsys)
    assert kinds["contact laws"]["hertz"] == ["vibrokit", "stiffness k [m^(-1/2) s^-2]"]
    assert kinds["contact laws"]["custom"] == ["vibrokit", "formula in depth and rate as text, and its constants"]
    assert kinds["contact laws"]["hunt-crossley"][0] == "vibrokit-hunt-crossley"
    assert kinds["contact laws"]["hunt-crossley"][1].endswith("dissipation c [s m^-1], exponent n [1]")
    assert kinds["excitations"]["constant"] == ["vibrokit", "force f [m s^-2]"]
    assert kinds["noise models"]["state-dependent"][1].startswith(
        "intensity D [m^2 s^-3], amplitude in x and v as text"
    )
    assert kinds["exits"]["leave-bounds"] == ["vibrokit", "x, v"]
    assert kinds["analyzers"]["mfet"] == kinds["records"]["mfet"] == ["vibrokit"]


def test_list_keeps_its_columns_whatever_the_length_of_a_name(capsys, monkeypatch):
    long_name = "a-law-with-a-name-of-many-words"
    entry = EntryPoint(long_name, "vibrokit.parts.contact:Hertz", Group.CONTACT_LAWS)
    broken = EntryPoint("broken", "vibrokit.parts.contact:Missing", Group.CONTACT_LAWS)
    installed = registry._entry_points
    added = {Group.CONTACT_LAWS: [entry, broken]}
    monkeypatch.setattr(registry, "_entry_points", lambda group: [*installed(group), *added.get(group, [])])
    with pytest.warns(UserWarning, match="broken"):
        kinds = listed(capsys)
    assert kinds["contact laws"][long_name] == ["an unnamed distribution", "stiffness k [m^(-1/2) s^-2]"]
    assert kinds["contact laws"]["broken"] == ["an unnamed distribution", "cannot be loaded"]
    with pytest.warns(UserWarning, match="broken"):
        main(["list"])
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("    ")]
    starts = {row.index(row.split()[1], len(row.split()[0]) + 4) for row in rows}
    assert starts == {4 + len(long_name) + 2}
