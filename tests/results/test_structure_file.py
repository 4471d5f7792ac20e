import contextlib
import dataclasses
import json
import struct
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest
import xarray

import vibrokit as vk
from tests.builders import (
    REGION,
    SCENE,
    assert_same,
    attractor,
    drop,
    empty_structure,
    full_structure,
    put,
    replaced,
    rewritten,
    say,
)  # fmt: skip
from vibrokit.errors import ArgumentError, NoSuchFileError, ResultFileError
from vibrokit.results.basins import Basins
from vibrokit.results.structure import Structure


@pytest.mark.parametrize("make", [full_structure, empty_structure])
def test_everything_comes_back_bit_for_bit(make, tmp_path):
    make().save(tmp_path / "s.nc")
    assert_same(make(), vk.load_result(tmp_path / "s.nc"))


def test_extra_noise_states_come_back(tmp_path):
    wide = attractor(0, "periodic", 1, points=np.array([[0.1, 0.2, 0.0]]))
    labels = np.zeros((4, 4), dtype=np.int16)
    structure = dataclasses.replace(empty_structure(), attractors=(wide,), basins=Basins(REGION, labels))
    structure.save(tmp_path / "s.nc")
    assert_same(structure, vk.load_result(tmp_path / "s.nc"))


def test_points_of_different_widths_are_refused(tmp_path):
    two = (attractor(0, "periodic", 1), attractor(1, "periodic", 1, points=np.array([[0.1, 0.2, 0.0]])))
    structure = dataclasses.replace(full_structure(), attractors=two, saddles=(), manifolds=())
    with pytest.raises(ResultFileError, match=r"attractor_points have \[2, 3\] columns"):
        structure.save(tmp_path / "s.nc")
    assert not list(tmp_path.iterdir())


def test_xarray_alone_reads_a_structure(tmp_path):
    structure = full_structure()
    structure.save(tmp_path / "s.nc")
    with xarray.open_dataset(tmp_path / "s.nc", engine="scipy") as file:
        cells = REGION.cell_centres((40, 30)).reshape(40, 30, 2)
        np.testing.assert_allclose(file.x, cells[:, 0, 0], rtol=1e-15)
        np.testing.assert_allclose(file.v, cells[0, :, 1], rtol=1e-15)
        np.testing.assert_array_equal(file.basin.transpose("x", "v"), structure.basins.labels)
        hammering = file.sel(attractor=1)
        assert hammering.attractor_name == "«periodic»-1"
        points = np.stack([hammering.attractor_points_x, hammering.attractor_points_v], axis=1)
        np.testing.assert_array_equal(points[: int(hammering.attractor_visit_count)], structure.attractors[1].points)
        assert np.isnan(points[4:]).all()
        assert float(hammering.attractor_peak_depth.sel(side="right")) == 0.1 + 0.2
        meanings = dict(zip(file.basin.flag_values.tolist(), file.basin.flag_meanings.split(), strict=True))
        assert (meanings[-3], meanings[0]) == ("not_followed", "«periodic»-0")


def test_opens_and_plots_without_numba_or_sympy(tmp_path):
    full_structure().save(tmp_path / "s.nc")
    code = (
        "import sys, vibrokit as vk\n"
        "s = vk.load_result(sys.argv[1])\n"
        "repr(s), s._repr_html_(), s.status\n"
        "s.plot().figure.savefig(sys.argv[2]); s.plot_orbits()\n"
        "assert not {'numba', 'sympy', 'matplotlib.pyplot'} & set(sys.modules)\n"
    )
    arguments = [sys.executable, "-c", code, str(tmp_path / "s.nc"), str(tmp_path / "p.png")]
    subprocess.run(arguments, check=True, capture_output=True)
    assert (tmp_path / "p.png").stat().st_size > 5000


def test_a_failed_save_leaves_the_old_file(tmp_path, monkeypatch):
    target = tmp_path / "s.nc"
    full_structure().save(target)
    before = target.read_bytes()

    def fail(*arguments):
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(OSError, match="disk full"):
        empty_structure().save(target)
    assert target.read_bytes() == before
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_is_the_same_to_the_byte_each_time(tmp_path):
    for name in "ab":
        full_structure().save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


# Files from strangers


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> bytes:
    """Content of a sound file."""
    target = tmp_path_factory.mktemp("sound") / "s.nc"
    full_structure().save(target)
    return target.read_bytes()


def stop(**changes):
    return say("scene", SCENE | {"barriers": [SCENE["barriers"][0] | changes]})


LIES = {
    "a label above the attractors": (put("basin", (3, 4), 6), "'basin' goes from -3 to 6; -4 to 5"),
    "a label below all": (put("basin", (0, 0), -5), "'basin' goes from -5"),
    "labels that are fractions": (lambda d, h: d.assign(basin=d["basin"] + 0.5), "'basin' holds numbers .* not whole"),
    "labels that are NaN": (lambda d, h: d.assign(basin=d["basin"] * np.nan), "'basin' holds numbers .* not whole"),
    "labels in one row": (lambda d, h: d.assign(basin=("n", d["basin"].values.ravel())), "shape .* any × any"),
    "labels that are letters": (lambda d, h: d.assign(basin=d["basin"].astype("S1")), "'basin' is of type"),
    "no basins": (drop("basin"), "no array 'basin'"),
    "no points": (drop("attractor_points_x"), "no array 'attractor_points_x'"),
    "points without velocity": (drop("attractor_points_v"), "no array 'attractor_points_v'"),
    "no names": (drop("attractor_name"), "no array 'attractor_name'"),
    "no residuals": (drop("saddle_residual"), "no array 'saddle_residual'"),
    "an unknown end of a branch": (put("manifold_end", 0, "bored"), "'manifold_end' holds 'bored'"),
    "no counts": (drop("manifold_vertex_count"), "no array 'manifold_vertex_count'"),
    "half of the numbers complex": (drop("attractor_multipliers_imag"), "no array 'attractor_multipliers_imag'"),
    "NaN for a point": (put("attractor_points_x", (0, 0), np.nan), "'attractor_points_x' holds NaN"),
    "infinity on a curve": (put("manifold_v", 5, np.inf), "'manifold_v' holds NaN or infinity"),
    "NaN for a multiplier": (put("saddle_multipliers_real", (0, 0), np.nan), "'saddle_multipliers_real' holds NaN"),
    "NaN for a bound": (put("region_x", 0, np.nan), "'region_x' holds NaN"),
    "a region inside out": (put("region_x", 0, 9.0), "region: x goes from 9"),
    "a share above 1": (put("attractor_basin_fraction", 0, 1.5), "'attractor_basin_fraction' goes from .* to 1.5"),
    "negative hits": (put("attractor_hits", (1, 0), -1.0), "'attractor_hits' goes from -1"),
    "counts that claim more": (put("attractor_visit_count", 2, 10**9), "'attractor_visit_count' goes from"),
    "vertices that claim more": (put("manifold_vertex_count", 0, 0), "'manifold_x' has shape"),
    "counts below zero": (put("attractor_visit_count", 2, -1), "'attractor_visit_count' goes from -1"),
    "an orbit without points": (put("attractor_visit_count", 0, 0), "period 1 has 0 points"),
    "a saddle without points": (put("saddle_visit_count", 3, 0), "a chaotic orbit has no points"),
    "a saddle without nodes": (put("saddle_node_count", 1, 0), "an orbit of period 2 has 0 nodes"),
    "nodes that are no multiple of the period": (put("saddle_period", 0, 3), "an orbit of period 3 has 4 nodes"),
    "a period that is not its points": (put("attractor_period", 1, 3), "period 3 has 4 points"),
    "labels out of order": (put("attractor", [0, 1], [1, 0]), "attractor 0 has label 1"),
    "two labels alike": (put("attractor", 1, 0), "attractor 1 has label 0"),
    "one column too short": (lambda d, h: d.assign(saddle_period=("few", [1, 2])), "'saddle_period' has shape"),
    "points of a number": (lambda d, h: d.assign(attractor_points_x=1.0), "'attractor_points_x' has shape"),
    "a saddle to an unknown place": (put("saddle_leads_to", (0, 0), 6), "leads to .6, 1., and there are 6"),
    "a saddle that leads to a half": (put("saddle_leads_to", (0, 0), 0.5), "'saddle_leads_to' holds .* not whole"),
    "a manifold of no saddle": (put("manifold_saddle", 0, 5), "saddle 5, which is missing"),
    "a manifold from no point": (put("manifold_point", 0, 1), "point 1 of saddle 0"),
    "a manifold without a side": (put("manifold_side", 0, 0), "on side 0"),
    "a flag that is 2": (replaced("manifold_stable", [2, 0, 1]), "'manifold_stable' goes from 0 to 2"),
    "more survivors than starts": (put("survival_survivors", 0, 6), "5 starts, 6 survivors"),
    "a survival of nobody": (put("survival_attractor", 0, 6), "belongs to attractor 6, and there are 6"),
    "an unknown kind of state": (put("attractor_kind", 5, "rare"), "'attractor_kind' holds 'rare'"),
    "an unknown kind of saddle": (put("saddle_kind", 1, "node"), "'saddle_kind' holds 'node'"),
    "kinds that are numbers": (replaced("attractor_kind", [1] * 6, "attractor"), "'attractor_kind' is of type"),
    "a distance of NaN": (replaced("settling", np.nan), "'settling' holds NaN"),
    "a distance in a row": (replaced("settling", [1.0, 2.0], "two"), "'settling' has shape"),
    "a budget in words": (replaced("budget", np.array("500", dtype="S")), "'budget' is of type"),
    "no budget": (drop("budget"), "no array 'budget'"),
    "complete in a number": (say("complete", 1), "complete = 1"),
    "a seed in letters": (say("seed", "abc"), "seed = 'abc'"),
    "a seed without end": (say("seed", "9" * 5000), "a whole number is needed"),
    "no seed": (say("seed", ...), "no entry 'seed'"),
    "versions in a list": (say("versions", []), "versions = "),
    "a version in a number": (say("versions", {"python": 3}), "python = 3"),
    "a scene in a text": (say("scene", "hertz-0.570"), "scene = 'hertz-0.570'"),
    "stops in a number": (say("scene", {"barriers": 2}), "barriers = 2"),
    "a stop in a number": (say("scene", {"barriers": [2]}), "no entry 'position'"),
    "a stop at infinity": (stop(position={"float": "inf"}), "position = inf"),
    "a stop in a text": (stop(position="0.5"), "position = '0.5'"),
    "a stop on top": (stop(side="top"), "side 'top'"),
    "a kind in a list": (say("kind", ["structure"]), "kind = "),
    "another kind of result": (say("kind", "action_plot"), "no dimension 'chaotic_saddle'"),
    "a newer format": (say("format", 4), r"format 4, and format 3 is read\. It was written by vibrokit 0"),
    "no list of empty arrays": (say("empty", ...), "no entry 'empty'"),
    "an empty array that is not": (say("empty", {"x": {"dims": ["x"], "shape": [0], "dtype": "f"}}), "contradict"),
    "an empty array of no type": (say("empty", {"q": {"dims": ["q"], "shape": [0], "dtype": "V"}}), "contradict"),
    "statistics in a text": (say("stats", "many"), "stats = 'many'"),
}  # fmt: skip


@pytest.mark.parametrize(("lie", "words"), LIES.values(), ids=LIES)
def test_lies_are_refused_in_a_sentence(lie, words, sound, tmp_path):
    (tmp_path / "lie.nc").write_bytes(rewritten(sound, lie))
    with pytest.raises(ResultFileError, match=rf"lie\.nc is no result that this vibrokit can open: .*{words}"):
        vk.load_result(tmp_path / "lie.nc")


@pytest.mark.parametrize(
    "header",
    ["", "[", "[]", "3", "null", '"text"', "[" * 100_000, '{"format": 1' + "0" * 9999 + "}", '{"format": NaN}'],
)
def test_headers_that_are_none_are_refused(header, tmp_path):
    xarray.Dataset({"a": ("n", [1.0])}, attrs={"vibrokit": header}).to_netcdf(tmp_path / "h.nc", engine="scipy")
    with pytest.raises(ResultFileError, match="no result that this vibrokit can open"):
        vk.load_result(tmp_path / "h.nc")


def test_a_file_of_another_program_is_refused(tmp_path):
    xarray.Dataset({"a": ("n", [1.0])}).to_netcdf(tmp_path / "h.nc", engine="scipy")
    with pytest.raises(ResultFileError, match="no attribute 'vibrokit'"):
        vk.load_result(tmp_path / "h.nc")


@pytest.mark.filterwarnings("ignore")  # of xarray, about names and units that damage made strange
def test_damaged_bytes_open_or_are_refused(sound, tmp_path):
    random = np.random.default_rng(3)
    opened = 0
    for _ in range(300):
        damaged = bytearray(sound)
        for place in random.integers(0, len(sound) if random.random() < 0.3 else 12_000, random.integers(1, 5)):
            damaged[place] = random.choice([0, 1, 127, 128, 255, random.integers(256)])
        del damaged[random.integers(len(sound) // 2, 2 * len(sound)) :]
        (tmp_path / "d.nc").write_bytes(damaged)
        with contextlib.suppress(ResultFileError):  # or a number was changed into another number
            opened += isinstance(vk.load_result(tmp_path / "d.nc"), vk.Structure)
    assert 0 < opened < 300


def netcdf(variables: int, lengths: tuple[int, ...], room: int) -> bytes:
    """A file whose variables all claim the same bytes, with `room` zeros after its header."""

    def name(text: str) -> bytes:
        return struct.pack(">i", len(text)) + text.encode().ljust(-len(text) % 4 + len(text), b"\0")

    content = b"CDF\x02" + struct.pack(">i", 0)
    content += struct.pack(">ii", 10, len(lengths))
    content += b"".join(name(f"d{index}") + struct.pack(">i", length) for index, length in enumerate(lengths))
    content += struct.pack(">ii", 0, 0)  # no attributes
    content += struct.pack(">ii", 11, variables)
    for index in range(variables):
        content += name(f"v{index}") + struct.pack(f">{1 + len(lengths)}i", len(lengths), *range(len(lengths)))
        content += struct.pack(">iiiiq", 0, 0, 6, 0, 4)  # no attributes, doubles, size, begin
    return content + bytes(room)


@pytest.mark.parametrize(
    ("variables", "lengths", "room", "words"),
    [
        (1, (2**31 - 1, 2**31 - 1), 100, "damaged"),
        (1, (2**31 - 1,) * 12, 100, "damaged"),
        (1, (-1,), 100, "damaged"),
        (2, (-8, 2**30), 100, "damaged"),
        (1, (0, 2**31 - 1), 100, "damaged"),
        (3, (0, 0), 100, "damaged"),
        (2000, (2000,), 16_000, "claim more bytes than it has"),  # each a copy of the same 16 kB
    ],
)
def test_huge_claims_cost_nothing_and_are_refused(variables, lengths, room, words, tmp_path):
    (tmp_path / "huge.nc").write_bytes(netcdf(variables, lengths, room))
    tracemalloc.start()
    try:
        with pytest.raises(ResultFileError, match=rf"no result that this vibrokit can open: .*{words}"):
            vk.load_result(tmp_path / "huge.nc")
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_what_is_no_file_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(ResultFileError, match="cannot be read"):
        vk.load_result(tmp_path)
    with pytest.raises(ArgumentError, match="got 3"):
        vk.load_result(3)
    with pytest.raises(NoSuchFileError, match="give a file written by save") as raised:
        vk.load_result(tmp_path / "none.nc")
    assert isinstance(raised.value, FileNotFoundError)
    (tmp_path / "nine.nc").write_bytes(b"")
    with pytest.raises(NoSuchFileError, match=r"nine\.nc"):
        vk.load_result(tmp_path / "none.nc")


def test_the_provenance_is_plain_json(sound, tmp_path):
    (tmp_path / "s.nc").write_bytes(sound)
    with xarray.open_dataset(tmp_path / "s.nc", engine="scipy") as file:
        header = json.loads(file.attrs["vibrokit"], parse_constant=pytest.fail)
    assert header["kind"] == Structure.kind
    assert header["settings"]["tolerance"] == {"float": "inf"}
    sentence = header["findings"][1]["sentence"]
    assert sentence.startswith("The edge state between «periodic»-0 and «chaotic»-2 is chaotic")
