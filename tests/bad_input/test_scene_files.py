"""Bad scene files: refused with one sentence, at once, nothing executed."""

import os
from pathlib import Path

import pytest

import vibrokit as vk
from tests.refusals import quickest_refusal
from vibrokit.errors import SceneError, UnknownNameError, VibrokitError

GOOD = """natural_frequency = 1.0
damping_ratio = 0.01
[[barriers]]
law = { name = "hertz", stiffness = 50.0 }
position = 0.5
side = "right"
[[excitations]]
name = "harmonic"
amplitude = 0.18
frequency = 0.57
[noise]
name = "white"
intensity = 2e-5
"""


def refused(tmp_path, content, name="scene.toml", limit=0.5):
    """What loading says: one line that names the file and ends with a period, said at once."""
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    before = sorted(os.listdir(tmp_path))
    said, seconds = quickest_refusal(VibrokitError, lambda: vk.load_scene(path))
    assert "\n" not in said
    assert said.endswith(".")
    assert len(said) < 700 + len(str(path))
    assert name in said
    assert seconds < limit
    assert sorted(os.listdir(tmp_path)) == before
    return said


def changed(old, new):
    assert GOOD.count(old) == 1
    return GOOD.replace(old, new)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_the_good_one_is_good(tmp_path, encoding):
    (tmp_path / "scene.toml").write_text(GOOD, encoding)
    assert vk.load_scene(tmp_path / "scene.toml").parameters["barriers.0.law.stiffness"] == 50.0


LOW, POSITIVE = "must be a finite number at least 0, got ", "must be a finite number greater than 0, got "
CHANGES = [
    ("stiffness = 50.0", "stiffness = -50.0", f"barriers.0.law: Hertz: stiffness {LOW}-50."),
    ("stiffness = 50.0", "stiffness = nan", f"stiffness {LOW}nan."),
    ("damping_ratio = 0.01", "damping_ratio = -1", f"damping_ratio {LOW}-1."),
    ("damping_ratio = 0.01", "damping_ratio = nan", f"damping_ratio {LOW}nan."),
    ("intensity = 2e-5", "intensity = -2e-5", f"noise: WhiteNoise: intensity {LOW}-2e-05."),
    ("\nfrequency = 0.57", "\nfrequency = 0", f"excitations.0: Harmonic: frequency {POSITIVE}0."),
    ("natural_frequency = 1.0", "natural_frequency = 0", "damping_ratio is 0.01, but that is relative to a natural"),
    ("stiffness = 50.0", 'stiffness = "50"', f"stiffness {LOW}'50'."),
    ("stiffness = 50.0", 'stiffness = "50 kN/m"', "barriers.0.law: Hertz: stiffness must be in m^(-1/2) s^-2, or kg "
     "m^-0.5 s^-2 with the mass of the scene, got '50 kN/m', which is in kg s^-2; allowed"),
    ("stiffness = 50.0", 'stiffness = "50 kN/m^1.5"', "scene: barriers.0.law.stiffness is 50 kN/m^1.5, which needs the "
     "mass; give the scene a mass, such as mass='0.35 kg', or the value per unit mass."),
    ("position = 0.5", 'position = "0.5 mmm"', "barriers.0: Barrier: position has the unknown unit 'mmm'; allowed are "
     "units of m, such as mm."),
    ("position = 0.5", 'position = "half a mm"', "position must be a finite number, got 'half a mm'."),
    ("\nfrequency = 0.57", '\nfrequency = "0 Hz"', f"frequency {POSITIVE}0."),
    ("\nfrequency = 0.57", '\nfrequency = "1e400 Hz"', f"frequency {POSITIVE}one above 1.8e308."),
    ("\nfrequency = 0.57", '\nfrequency = "57 Hz^9^9^9"', "frequency has the unknown unit 'Hz^9^9^9'"),
    ("intensity = 2e-5", 'intensity = "-1 g_n^2/Hz"', f"noise: WhiteNoise: intensity {LOW}-48.0852."),
    ("damping_ratio", "mass = 0\ndamping_ratio", f"scene: mass {POSITIVE}0."),
    ("damping_ratio", 'mass = "-1 kg"\ndamping_ratio', f"scene: mass {POSITIVE}-1."),
    ("damping_ratio", 'mass = "1 N"\ndamping_ratio', "scene: mass must be in kg, got '1 N', which is in kg m s^-2; "
     "allowed are units of kg, such as kg or g."),
    ("damping_ratio", "mass = [1]\ndamping_ratio", f"scene: mass {POSITIVE}[1]."),
    ("stiffness = 50.0", "stiffness = [50.0]", f"stiffness {LOW}[50.0]."),
    ("stiffness = 50.0", "stiffness = {k = 1}", f"stiffness {LOW}{{'k': 1}}."),
    ("stiffness = 50.0", "stiffness = true", f"stiffness {LOW}True."),
    ("stiffness = 50.0", "stiffness = 2020-01-01", f"stiffness {LOW}datetime.date(2020, 1, 1)."),
    ("stiffness = 50.0", "stiffness = 1e400", f"stiffness {LOW}inf."),
    ("stiffness = 50.0", "stiffness = 1" + "0" * 400, f"stiffness {LOW}one above 1.8e308."),
    ("stiffness = 50.0", "stiffness = 1" + "0" * 5000, "is not valid TOML: "),
    ('side = "right"', 'side = "rigth"', "barriers.0: Barrier: side must be 'right' or 'left', got 'rigth'."),
    ('side = "right"', "side = 1", "side must be 'right' or 'left', got 1."),
    ('side = "right"', 'side = "right"\nadhesive = 1', "adhesive must be True or False, got 1."),
    ("position = 0.5", 'position = "0.5"', "position must be a finite number, got '0.5'."),
    ("damping_ratio", "noize = 1\ndamping_ratio", "unknown entry 'noize'; the nearest is 'noise'."),
    ("damping_ratio", "damping_ration", "unknown entry 'damping_ration'; the nearest is 'damping_ratio'."),
    ("position = 0.5", "positoin = 0.5", "barriers.0 has an unknown entry 'positoin'; the nearest is 'position'."),
    ("stiffness = 50.0", "stifness = 50.0", "(hertz) has an unknown entry 'stifness'; the nearest is 'stiffness'."),
    ("amplitude", "ampltude", "(harmonic) has an unknown entry 'ampltude'; the nearest is 'amplitude'."),
    ("intensity", "strength", "noise (white) has an unknown entry 'strength'; allowed: intensity."),
    ('name = "hertz"', 'name = "herz"', "There is no contact law 'herz'; the nearest is 'hertz'."),
    ('name = "harmonic"', 'name = "harmonics"', "the nearest is 'harmonic'."),
    ('name = "white"', 'name = "wite"', "the nearest is 'white'."),
    ('name = "hertz"', 'name = "white"', "There is no contact law 'white'"),
    ('name = "hertz"', f'name = "{"h" * 5000}"', "barriers.0.law: name may have at most 100 characters, got 'hhh"),
    ("intensity", "i" * 5000, "unknown entry 'iii"),
    ('name = "hertz"', 'name = ""', "There is no contact law ''"),
    ('name = "hertz"', 'name = "os:system"', "There is no contact law 'os:system'"),
    ("stiffness = 50.0", "stiffness = 50.0, __class__ = 1", "unknown entry '__class__'"),
    ("stiffness = 50.0", "stiffness = 50.0, self = 1", "unknown entry 'self'"),
    (
        "natural_frequency = 1.0\n",
        "",
        "scene: it has neither natural_frequency nor stiffness nor a spring; give one of them, or natural_frequency =",
    ),
    ("damping_ratio = 0.01\n", "", "scene: it has neither damping_ratio nor damping; give one of them, 0 for no"),
    ("damping_ratio", "damping = 0.1\ndamping_ratio", "damping_ratio = 0.01 and damping = 0.1 are both given, and"),
    ("damping_ratio", "stiffness = 4\ndamping_ratio", "natural_frequency = 1 and stiffness = 4 are both given, and"),
    ("natural_frequency = 1.0", "stiffness = -4", f"stiffness {LOW}-4."),
    ("damping_ratio = 0.01", "damping = inf", f"damping {LOW}inf."),
    ("natural_frequency = 1.0", "natural_frequency = -1", f"natural_frequency {LOW}-1."),
    ('law = { name = "hertz", stiffness = 50.0 }\n', "", "barriers.0 has no entry law; it needs law, position, side."),
    ("position = 0.5\n", "", "barriers.0 has no entry position"),
    ('side = "right"\n', "", "barriers.0 has no entry side"),
    (", stiffness = 50.0", "", "barriers.0.law (hertz) has no entry stiffness; it needs stiffness."),
    (
        'name = "hertz", ',
        "",
        "barriers.0.law must be a table with the name of the part and its parameters, got {'stiffness': 50.0}.",
    ),
    ('name = "white"\n', "", "got {'intensity': 2e-05}."),
    ('name = "harmonic"\n', "", "excitations.0 must be a table"),
    ("intensity = 2e-5\n", "", "noise (white) has no entry intensity"),
    (GOOD, "", "scene: it has neither natural_frequency nor stiffness nor a spring"),
    ("[[barriers]]", "[barriers]", "scene: barriers must be a list of tables [[barriers]], got {'law': {", "}."),
    ("[[excitations]]", "[excitations]", "scene: excitations must be a list of tables [[excitations]], got {", "}."),
    ("[noise]", "[[noise]]", "noise must be a table", "}]."),
    ('{ name = "hertz", stiffness = 50.0 }', '"hertz"', "barriers.0.law must be a table", "got 'hertz'."),
    ('name = "white"', 'name = ["white"]', "noise must be a table", "}."),
    ('name = "white"', "name = 1", "noise must be a table", "'name': 1}."),
    ('[noise]\nname = "white"\nintensity = 2e-5\n', "[noise.white]\n", "noise must be a table", "got {'white': {}}."),
    (
        GOOD,
        "natural_frequency=1\ndamping_ratio=0\nbarriers=[1, 2]\n",
        "barriers.0 must be a table with law, ",
        "got 1.",
    ),
    (GOOD, "natural_frequency=1\ndamping_ratio=0\nexcitations=['a']\n", "excitations.0 must be a table", "got 'a'."),
    (GOOD, "natural_frequency=1\ndamping_ratio=0\nbarriers='two'\n", "barriers must be a list", "got 'two'."),
]  # fmt: skip


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: f"{change[0][:20]} → {change[1][:20]}")
def test_changes(tmp_path, change):
    old, new, *said = change
    message = refused(tmp_path, changed(old, new))
    assert all(part in message for part in said)
    assert message.endswith(said[-1]) or len(said) == 1


STOP = '[[barriers]]\nlaw = { name = "linear", stiffness = 1.0 }\n'


NO_TOML = {
    "duplicated key": GOOD.replace("damping_ratio = 0.01", "damping_ratio = 0.01\ndamping_ratio = 0.02").encode(),
    "duplicated table": (GOOD + '[noise]\nname = "white"\nintensity = 1\n').encode(),
    "broken": b"natural_frequency = = 1\n",
    "unfinished": GOOD[:-3].encode() + b"\n[",
    "json": b'{"natural_frequency": 1.0}',
    "nested arrays": b"x = " + b"[" * 40_000 + b"]" * 40_000,
    "nested tables": b"x = " + b"{a = " * 10_000 + b"1" + b"}" * 10_000,
    "control characters": b"natural_frequency = 1\x00\n",
}


@pytest.mark.parametrize("content", NO_TOML.values(), ids=NO_TOML)
def test_what_is_no_toml(tmp_path, content):
    said = refused(tmp_path, content)
    assert "is not valid TOML: " in said or "is nested too deeply" in said


CONTENTS = {
    "two stops on one side": (
        f'{GOOD}{STOP}position = 0.7\nside = "right"\n',
        "2 on the right side, at 0.5, 0.7.",
        0.5,
    ),
    "crossed stops": (
        f'{GOOD}{STOP}position = 0.7\nside = "left"\n',
        "the left stop, at 0.7, is to the right of the right stop, at 0.5",
        0.5,
    ),
    "many stops": (
        GOOD + "".join(f"{STOP}position = {i}\nside = 'left'\n" for i in range(1000)),
        "scene: at most 100 entries of barriers are allowed, got 1001.",
        0.5,
    ),
    "binary": (b"\x89PNG\r\n\x1a\n" + bytes(99), "is not UTF-8 text (byte 0)", 0.5),
    "utf-16": (GOOD.encode("utf-16"), "is not UTF-8 text", 0.5),
    "deep dotted keys": (GOOD.replace("stiffness =", f"stiffness{'.a' * 3000} ="), "stiffness must be ", 2.0),
    "huge": (GOOD + "#" * 100_000, "is too large for a scene; at most 100000 bytes", 0.5),
    "a megabyte of formula": (
        GOOD.replace('"hertz"', f'"custom", formula = "{"1+" * 500_000}1"'),
        "is too large for a scene",
        0.1,
    ),
}


@pytest.mark.parametrize(("content", "said", "limit"), CONTENTS.values(), ids=CONTENTS)
def test_contents(tmp_path, content, said, limit):
    """Each refused within some seconds."""
    assert said in refused(tmp_path, content, limit=limit)


def test_endless_files_are_not_read_to_their_end():
    if not os.path.exists("/dev/zero"):
        pytest.skip("this system has no /dev/zero")
    with pytest.raises(SceneError, match="is too large for a scene"):
        vk.load_scene("/dev/zero")


RUNS_CODE = {
    "import": "__import__('os').system('touch ran')",
    "attribute": "depth.__class__.__mro__",
    "comprehension": "[open('ran', 'w') for i in (1,)]",
    "power tower": "9**9**9**9",
    "much": "1+" * 40_000 + "1",
    "parentheses": "(" * 80_000,
}


@pytest.mark.parametrize("formula", RUNS_CODE.values(), ids=RUNS_CODE)
@pytest.mark.parametrize("place", ["law", "spring", "noise"])
def test_a_formula_that_would_run_code(tmp_path, monkeypatch, place, formula):
    monkeypatch.chdir(tmp_path)
    text = {
        "law": f'[[barriers]]\nposition = 1.0\nside = "left"\nlaw = {{ name = "custom", formula = "{formula}" }}\n',
        "spring": f'[spring]\nname = "custom"\nformula = "{formula}"\n',
        "noise": f'[noise]\nname = "state-dependent"\nintensity = 1e-3\namplitude = "{formula}"\n',
    }[place]
    said = refused(tmp_path, f"natural_frequency = 1\ndamping_ratio = 0\n{text}", limit=0.1)
    assert f"{'barriers.0.law' if place == 'law' else place}: The formula " in said
    assert not (tmp_path / "ran").exists()


def test_unknown_symbols_of_a_formula(tmp_path):
    said = refused(
        tmp_path, changed('name = "hertz", stiffness = 50.0', 'name = "custom", formula = "kk*depth", k = 1')
    )
    assert "'kk'" in said
    assert "'k'" in said


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("hertz-0.57", "the nearest is 'hertz-0.570'."),
        ("no-such-scene", "."),
        ("", "."),
        ("x" * 5000, "."),
        ("a\0b", "."),
        ("missing/scene.toml", "."),
    ],
)
def test_no_such_scene(source, said):
    with pytest.raises((UnknownNameError, SceneError)) as error:
        vk.load_scene(source)
    assert str(error.value).endswith(said)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 500


@pytest.mark.parametrize(
    ("wanted", "meant"), [("tub.toml", "tube.toml"), ("tube", "tube.toml"), ("valv.TOML", "valve.toml")]
)
def test_a_scene_file_beside_it_is_suggested(tmp_path, monkeypatch, wanted, meant):
    for name in ("tube", "valve", "gear-rattle"):
        (tmp_path / f"{name}.toml").touch()
    with pytest.raises(UnknownNameError) as error:
        vk.load_scene(tmp_path / wanted)
    assert str(error.value).endswith(f"the nearest is {str(tmp_path / meant)!r}.")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UnknownNameError, match=f"the nearest is '{meant}'"):
        vk.load_scene(wanted)


def test_a_folder(tmp_path):
    with pytest.raises(SceneError, match=r"is a folder; give a TOML file or one of .*hertz-0\.570.*\.$"):
        vk.load_scene(tmp_path)


@pytest.mark.parametrize("source", [None, 3, b"hertz-0.570", ["hertz-0.570"]])
def test_what_is_no_path(source):
    with pytest.raises(SceneError, match=r"^the scene must be the path of a TOML file or one of .*, got .*\.$"):
        vk.load_scene(source)


def test_a_file_that_may_not_be_read(tmp_path, monkeypatch):
    path = tmp_path / "scene.toml"
    path.write_text(GOOD)

    def denied(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", denied)
    with pytest.raises(SceneError, match=r"scene\.toml cannot be read \(Permission denied\); give .*\.$"):
        vk.load_scene(path)
