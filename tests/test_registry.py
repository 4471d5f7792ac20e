"""Entry points: broken, doubled, unknown and misplaced ones."""

import tomllib
import warnings
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace

import pytest

from vibrokit import registry
from vibrokit.errors import UnknownNameError
from vibrokit.registry import Group, Registered

LAWS = Group.CONTACT_LAWS


class Law:
    """Stands for the abstract contact law."""


class Soft(Law):
    pass


class Stiff(Law):
    pass


NOT_A_CLASS = Soft()


def entry(name, value, distribution):
    """Make a contact law's entry point as an installed one looks; a bare name means one in this file."""
    point = EntryPoint(name, value if ":" in value else f"{__name__}:{value}", LAWS.value)
    vars(point)["dist"] = SimpleNamespace(name=distribution)  # frozen; importlib.metadata does it so too
    return point


@pytest.fixture
def install(monkeypatch):
    """Replace what is installed by the entries given."""

    def install(*entries):
        monkeypatch.setattr(registry, "_entry_points", lambda group: entries)

    return install


@pytest.fixture(autouse=True)
def unexpected_warnings_fail():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


BROKEN = [
    pytest.param("no_such_package:Law", "ModuleNotFoundError: No module named 'no_such_package'", id="missing module"),
    pytest.param("NoSuchClass", "AttributeError", id="missing class"),
    pytest.param("NOT_A_CLASS", "must be a subclass of Law, got <", id="instance"),
    pytest.param("pathlib:Path", "must be a subclass of Law, got <class 'pathlib", id="another kind"),
]


def test_listing_names_origins_and_imports_nothing(install):
    install(entry("soft", "Soft", "soft-laws"), entry("broken", "no_such_package:Law", "broken-laws"))
    assert registry.names(LAWS) == (Registered("broken", "broken-laws"), Registered("soft", "soft-laws"))


@pytest.mark.parametrize(("value", "flaw"), BROKEN)
def test_broken_plugin_warns_by_name_and_stops_nothing(install, value, flaw):
    install(entry("bad", value, "bad-laws"), entry("soft", "Soft", "soft-laws"))
    assert registry.load(LAWS, "soft", Law) is Soft  # nothing said: the broken one was not asked for
    with pytest.warns(UserWarning, match=f"contact law 'bad' of the distribution bad-laws.*{flaw}"):
        assert registry.load_all(LAWS, Law) == {"soft": Soft}
    with (
        pytest.warns(UserWarning, match=flaw),
        pytest.raises(UnknownNameError, match=r"'bad'.*bad-laws.*cannot be loaded"),
    ):
        registry.load(LAWS, "bad", Law)


def test_plugin_that_exits_at_import_stops_nothing(install, tmp_path, monkeypatch):
    (tmp_path / "plugin_that_exits.py").write_text("raise SystemExit(3)\n")
    monkeypatch.syspath_prepend(tmp_path)
    install(entry("exit", "plugin_that_exits:Law", "exiting-laws"), entry("soft", "Soft", "soft-laws"))
    with pytest.warns(UserWarning, match="exiting-laws.*SystemExit: 3"):
        assert registry.load_all(LAWS, Law) == {"soft": Soft}


@pytest.mark.parametrize(
    ("soft_from", "stiff_from", "winner"),
    [
        ("vibrokit", "another-kit", Soft),
        ("another-kit", "vibrokit", Stiff),
        ("a-laws", "B-laws", Soft),
        ("b-laws", "A-laws", Stiff),
    ],
)
def test_two_of_one_name_warn_and_say_which_wins(install, soft_from, stiff_from, winner):
    install(
        entry("same", "Soft", soft_from),
        entry("same", "Stiff", stiff_from),
        entry("other", "Soft", "other-laws"),
    )
    first, second = (soft_from, stiff_from) if winner is Soft else (stiff_from, soft_from)
    message = f"'same' is registered by {first} and also by {second}; {first} is used"
    with pytest.warns(UserWarning, match=message):
        assert registry.load(LAWS, "same", Law) is winner
    with pytest.warns(UserWarning, match=message):
        assert Registered("same", first) in registry.names(LAWS)
    assert registry.load(LAWS, "other", Law) is Soft  # not concerned, so nothing said


def test_a_broken_winner_gives_way(install):
    install(entry("same", "no_such_package:Law", "a-laws"), entry("same", "Stiff", "b-laws"))
    with (
        pytest.warns(UserWarning, match="a-laws is used"),
        pytest.warns(UserWarning, match="skipped"),
    ):
        assert registry.load(LAWS, "same", Law) is Stiff


def ask_names():
    registry.names(LAWS)


def ask_for_all():
    registry.load_all(LAWS, Law)


def ask_for_one():
    with pytest.raises(UnknownNameError):
        registry.load(LAWS, "bad", Law)


@pytest.mark.parametrize("ask", [ask_names, ask_for_all, ask_for_one])
def test_warnings_point_at_the_caller(install, ask):
    install(entry("bad", "no_such_package:Law", "bad-laws"), entry("bad", "NoSuchClass", "worse-laws"))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        ask()
    assert {Path(warning.filename) for warning in said} == {Path(__file__)}


def test_unknown_name_suggests_the_nearest(install):
    install(entry("soft", "Soft", "soft-laws"), entry("stiff", "Stiff", "stiff-laws"))
    with pytest.raises(UnknownNameError, match=r"no contact law 'stif'; the nearest is 'stiff'\."):
        registry.load(LAWS, "stif")
    with pytest.raises(UnknownNameError, match=r"no contact law 'qqq'; allowed: soft, stiff\."):
        registry.load(LAWS, "qqq")


def test_nothing_registered_says_to_install(install):
    install()
    assert registry.names(LAWS) == ()
    with pytest.raises(UnknownNameError, match="install vibrokit"):
        registry.load(LAWS, "hertz")


@pytest.mark.parametrize("group", list(Group))
def test_built_ins_are_registered_like_plugins(group):
    project = tomllib.loads(Path(__file__).parents[1].joinpath("pyproject.toml").read_text())["project"]
    declared = project["entry-points"][group.value]
    registered = dict(registry.names(group))
    assert {name: registered.get(name) for name in declared} == dict.fromkeys(declared, "vibrokit")
    assert set(registry.load_all(group, object)) >= set(declared)
