"""Files from strangers: lies, damage and claims are refused in a sentence."""

import contextlib
import json
import struct
import tracemalloc

import numpy as np
import pytest
import xarray

import vibrokit as vk
from tests.builders import (
    SCENE,
    drop,
    full_continuation,
    full_result,
    full_structure,
    put,
    replaced,
    rewritten,
    say,
)  # fmt: skip
from vibrokit.errors import ArgumentError, NoSuchFileError, ResultFileError, VibrokitError
from vibrokit.results.codes import Code

KINDS = {"structure": full_structure, "result": full_result, "continuation": full_continuation}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """Content of a sound file of each kind."""
    folder = tmp_path_factory.mktemp("sound")
    for name, make in KINDS.items():
        make().save(folder / name)
    return {name: (folder / name).read_bytes() for name in KINDS}


def opened(content, change, folder):
    (folder / "lie.nc").write_bytes(rewritten(content, change))
    return vk.load_result(folder / "lie.nc")


def stop(**changes):
    return say("scene", SCENE | {"barriers": [SCENE["barriers"][0] | changes]})


# Of each kind of field a few lies; then what contradicts other arrays
LIES = {
    "structure": [
        (put("basin", (3, 4), 6), "'basin' goes from -3 to 6; -4 to 5"),
        (put("basin", (0, 0), -5), "'basin' goes from -5"),
        (lambda d, h: d.assign(basin=d["basin"] + 0.5), "'basin' holds numbers .* not whole"),
        (lambda d, h: d.assign(basin=d["basin"] * np.nan), "'basin' holds numbers .* not whole"),
        (lambda d, h: d.assign(basin=("n", d["basin"].values.ravel())), "shape .* any × any"),
        (lambda d, h: d.assign(basin=d["basin"].astype("S1")), "'basin' is of type"),
        (drop("basin"), "no array 'basin'"),
        (drop("attractor_points_v"), "no array 'attractor_points_v'"),
        (drop("attractor_name"), "no array 'attractor_name'"),
        (put("attractor_points_x", (0, 0), np.nan), "'attractor_points_x' holds NaN"),
        (put("manifold_v", 5, np.inf), "'manifold_v' holds NaN or infinity"),
        (put("attractor_basin_fraction", 0, 1.5), "'attractor_basin_fraction' goes from .* to 1.5"),
        (put("attractor_hits", (1, 0), -1.0), "'attractor_hits' goes from -1"),
        (put("attractor_visit_count", 2, 10**9), "'attractor_visit_count' goes from"),
        (put("manifold_vertex_count", 0, 0), "'manifold_x' has shape"),
        (put("manifold_end", 0, "bored"), "'manifold_end' holds 'bored'"),
        (replaced("manifold_stable", [2, 0, 1]), "'manifold_stable' goes from 0 to 2"),
        (replaced("attractor_kind", [1] * 6, "attractor"), "'attractor_kind' is of type"),
        (lambda d, h: d.assign(saddle_period=("few", [1, 2])), "'saddle_period' has shape"),
        (put("saddle_leads_to", (0, 0), 0.5), "'saddle_leads_to' holds .* not whole"),
        (put("region_x", 0, np.nan), "'region_x' holds NaN"),
        (put("region_x", 0, 9.0), "region: x goes from 9"),
        (replaced("settling", np.nan), "'settling' holds NaN"),
        (replaced("settling", [1.0, 2.0], "two"), "'settling' has shape"),
        (replaced("budget", np.array("500", dtype="S")), "'budget' is of type"),
        (put("attractor_visit_count", 0, 0), "period 1 has 0 points"),
        (put("attractor_period", 1, 3), "period 3 has 4 points"),
        (put("attractor", [0, 1], [1, 0]), "attractor 0 has label 1"),
        (put("saddle_visit_count", 3, 0), "a chaotic orbit has no points"),
        (put("saddle_node_count", 1, 0), "an orbit of period 2 has 0 nodes"),
        (put("saddle_period", 0, 3), "an orbit of period 3 has 4 nodes"),
        (put("saddle_leads_to", (0, 0), 6), "leads to .6, 1., and there are 6"),
        (put("manifold_saddle", 0, 5), "saddle 5, which is missing"),
        (put("manifold_point", 0, 1), "point 1 of saddle 0"),
        (put("manifold_side", 0, 0), "on side 0"),
        (put("survival_survivors", 0, 6), "5 starts, 6 survivors"),
        (put("survival_attractor", 0, 6), "belongs to attractor 6, and there are 6"),
        (say("complete", 1), "complete = 1"),
        (say("seed", "abc"), "seed = 'abc'"),
        (say("seed", "9" * 5000), "a whole number is needed"),
        (say("seed", ...), "no entry 'seed'"),
        (say("versions", {"python": 3}), "python = 3"),
        (say("scene", "hertz-0.570"), "scene = 'hertz-0.570'"),
        (say("scene", {"barriers": 2}), "barriers = 2"),
        (say("scene", {"barriers": [2]}), "no entry 'position'"),
        (stop(position={"float": "inf"}), "position = inf"),
        (stop(position="0.5"), "position = '0.5'"),
        (stop(side="top"), "side 'top'"),
        (say("kind", ["structure"]), "kind = "),
        (say("kind", "action_plot"), "no dimension 'chaotic_saddle'"),
        (say("format", 4), r"format 4, and format 3 is read\. It was written by vibrokit 0"),
        (say("empty", ...), "no entry 'empty'"),
        (say("empty", {"x": {"dims": ["x"], "shape": [0], "dtype": "f"}}), "contradict"),
        (say("empty", {"q": {"dims": ["q"], "shape": [0], "dtype": "V"}}), "contradict"),
        (say("stats", "many"), "stats = 'many'"),
        (say("findings", 3), "findings = 3"),
        (say("findings", [3]), "no entry 'code'"),
    ],
    "result": [
        (replaced("branch_method", ["ring"] * 5, "five"), "'branch_method' has shape"),
        (put("energy_bound", 0, "certain"), "'energy_bound' holds 'certain'; it may hold exact"),
        (replaced("energy_value", ["a", "b", "c"]), "'energy_value' is of type"),
        (put("energy_saddle", 0, -2), "'energy_saddle' goes from -2"),
        (put("branch_source", 0, 3), "from attractor 3 to 1, and there are 3"),
        (put("energy_target", 0, 3), "from attractor 0 to 3, and there are 3"),
        (replaced("energy_certified", [2, 0, 1]), "'energy_certified' goes from"),
        (drop("energy_certificate_by_start"), "no array 'energy_certificate_by_start'"),
        (drop("path_p2"), "no array 'path_p2'"),
        (put("energy_path", 0, 3), "has path 3, and there are 3"),
        (put("branch_path", 0, -2), "'branch_path' goes from -2"),
        (put("path_sample_count", 0, 0), "has 0 samples"),
        (put("path_section", (0, 0), 10**6), "fewer than its points on the section"),
        (put("path_section", (0, 0), -1), "'path_section' holds"),
        (put("attractor_visit_count", 0, 0), "one of its attractors has no points"),
        (put("stable_manifold_x", 0, np.inf), "'stable_manifold_x' holds NaN"),
        (replaced("region_x", [0.0, 1.0, 2.0], "three"), "'region_x' has shape"),
    ],
    "continuation": [
        (put("value", 0, np.nan), "'value' holds NaN"),
        (put("attractor_at", 0, 3), "value or a branch that does not exist"),
        (put("attractor_branch", 0, 2), "value or a branch that does not exist"),
        (put("bifurcation_branch", 0, 2), "bifurcation is on branch 2"),
        (drop("branch_name"), "no dimension 'branch'"),
        (put("attractor_label", 0, -2), "'attractor_label' goes from -2"),
        (put("bifurcation_kind", 0, "crisis"), "'bifurcation_kind' holds 'crisis'"),
        (
            lambda d, h: d.isel(bifurcation_point=[0, 0]).assign(bifurcation_point_count=d.bifurcation_point_count * 2),
            "a bifurcation has 2 points",
        ),
        (put("bifurcation_error", 0, -1.0), "'bifurcation_error' goes from -1"),
        (put("bifurcation_period", 0, 0), "'bifurcation_period' goes from 0"),
        (put("bifurcation_side", 0, "top"), "'bifurcation_side' holds 'top'"),
        (put("survival_attractor", 0, -1), "survivals belong to no attractor"),
        (put("value_findings", 0, "well"), "holds no JSON"),
        (put("value_findings", 0, "{}"), "a list is needed"),
        (replaced("parameter", 3), "'parameter' is of type"),
        (drop("region_v"), "no array 'region_v'"),
    ],
}  # fmt: skip


@pytest.mark.parametrize(("kind", "lie", "words"), [(kind, *one) for kind, some in LIES.items() for one in some])
def test_lies_are_refused_in_a_sentence(kind, lie, words, sound, tmp_path):
    with pytest.raises(ResultFileError, match=rf"lie\.nc is no result that this vibrokit can open: .*{words}"):
        opened(sound[kind], lie, tmp_path)


@pytest.mark.parametrize(
    ("lie", "words"),
    [
        (drop("quasi_potential_x"), "no array 'quasi_potential_x'"),
        (put("quasi_potential_v", (0, 0), 9.0), "in ascending order"),
        (lambda d, h: d.isel(node_x=[0]), "at least two nodes"),
        (replaced("quasi_potential", [1.0], "source"), "'quasi_potential' has shape"),
        (lambda d, h: d.assign(quasi_potential=d["quasi_potential"].astype("S1")), "is of type"),
        (put("source", 0, 3), "'source' goes from 3"),
    ],
)
def test_data_that_is_not_a_quasi_potential_is_not_drawn(lie, words, sound, tmp_path):
    with pytest.raises(ResultFileError, match=words):
        opened(sound["result"], lie, tmp_path).plot_quasi_potential()


# Findings


def test_a_code_of_a_newer_version_becomes_a_remark(sound, tmp_path):
    entry = {"code": "tea-is-ready", "source": 1, "target": None, "values": {"cups": 3}, "sentence": "Tea {is} ready."}
    (finding,) = opened(sound["structure"], say("findings", [entry]), tmp_path).findings
    assert (finding.code, finding.source, str(finding)) == (Code.REMARK, 1, "Tea {is} ready.")


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"values": {"count": 6}}, "'steady-states' has values that do not fit its sentence .KeyError: 'starts'"),
        ({"code": "smooth"}, "no entry 'sentence'"),
        ({"code": 3}, "code = 3"),
        ({"source": "clear"}, "source = 'clear'"),
        ({"source": 1.5}, "source = 1.5"),
        ({"values": []}, "values = "),
        ({"values": {"count": {"a": 1}, "starts": 3}}, "'steady-states' has count = {'a': 1}"),
        ({"values": {"count": [[1]], "starts": 3}}, "'steady-states' has count = "),
        ({"code": "cells-unsettled", "values": {"fraction": "half"}}, "'cells-unsettled' .*ValueError"),
        ({"code": "cells-unsettled", "values": {"fraction": None}}, "'cells-unsettled' .*TypeError"),
        ({"code": "cells-unsettled", "values": {"fraction": 10**400}}, "'cells-unsettled' .*OverflowError"),
    ],
)
def test_findings_that_do_not_make_a_sentence_are_refused(entry, words, sound, tmp_path):
    whole = {"code": "steady-states", "source": None, "target": None, "values": {"count": 6, "starts": 9}} | entry
    with pytest.raises(ResultFileError, match=words):
        opened(sound["structure"], say("findings", [whole]), tmp_path)


# Headers and bytes


@pytest.mark.parametrize(
    "header",
    ["", "[", "[]", "3", "null", '"text"', "[" * 100_000, '{"format": 1' + "0" * 9999 + "}", '{"format": NaN}', None],
)
def test_headers_that_are_none_are_refused(header, tmp_path):
    about = {} if header is None else {"vibrokit": header}
    xarray.Dataset({"a": ("n", [1.0])}, attrs=about).to_netcdf(tmp_path / "h.nc", engine="scipy")
    with pytest.raises(ResultFileError, match="no result that this vibrokit can open"):
        vk.load_result(tmp_path / "h.nc")


@pytest.mark.parametrize("content", [b"", b"not a result", b"CDF\x01" + bytes(200), b"\x80\x04\x95pickle", None])
def test_strange_and_cut_files_are_refused_in_a_sentence(content, sound, tmp_path):
    half = sound["result"][: len(sound["result"]) // 2]
    (tmp_path / "bad.nc").write_bytes(half if content is None else content)
    with pytest.raises(VibrokitError, match="no result"):
        vk.load_result(tmp_path / "bad.nc")


@pytest.mark.filterwarnings("ignore")  # of xarray, about names and units that damage made strange
@pytest.mark.parametrize("kind", ["structure", "result"])
def test_damaged_bytes_open_or_are_refused(kind, sound, tmp_path):
    random, content, opened = np.random.default_rng(3), sound[kind], 0
    for _ in range(50):
        damaged = bytearray(content)
        for place in random.integers(0, len(content) if random.random() < 0.3 else 12_000, random.integers(1, 5)):
            damaged[place] = random.choice([0, 1, 127, 128, 255, random.integers(256)])
        del damaged[random.integers(len(content) // 2, 2 * len(content)) :]
        (tmp_path / "d.nc").write_bytes(damaged)
        with contextlib.suppress(ResultFileError):  # or a number was changed into another number
            opened += isinstance(vk.load_result(tmp_path / "d.nc"), vk.Record)
    assert 0 < opened < 50


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
    (tmp_path / "s.nc").write_bytes(sound["structure"])
    with xarray.open_dataset(tmp_path / "s.nc", engine="scipy") as file:
        header = json.loads(file.attrs["vibrokit"], parse_constant=pytest.fail)
    assert header["settings"]["tolerance"] == {"float": "inf"}
    sentence = header["findings"][1]["sentence"]
    assert sentence.startswith("The edge state between «periodic»-0 and «chaotic»-2 is chaotic")
