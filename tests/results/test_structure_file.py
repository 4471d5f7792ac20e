import contextlib
import dataclasses
import io
import json
import struct
import subprocess
import sys
import tracemalloc
from collections.abc import Mapping

import numpy as np
import pytest
import xarray

import vibrokit as vk
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import LEFT, NOT_FOLLOWED, UNSETTLED, Basins
from vibrokit.results.files import ResultFileError
from vibrokit.results.manifold import Manifold
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.results.structure import Structure
from vibrokit.results.survival import Survival

REGION = Region((-0.75, 0.8), (-1 / 3, 0.1 + 0.2))
SCENE = {
    "natural_frequency": 1.0,
    "damping_ratio": 0.01,
    "barriers": [
        {"law": {"name": "hertz", "stiffness": 50.0}, "position": 0.5, "side": "right"},
        {"law": {"name": "hertz", "stiffness": 50.0}, "position": -0.5, "side": "left"},
    ],
}


def circle(radius: float, samples: int = 64) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, samples + 1)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def attractor(label: int, kind: str, period: int, **changes) -> Attractor:
    common = {
        "duration": period * 11.0,
        "points": circle(0.1 * (label + 1))[: max(1, period)],
        "orbit": circle(0.1 * (label + 1)),
        "multipliers": np.array([0.3 - 0.4j, 0.3 + 0.4j]),
        "exponents": np.array([-0.01 + 0.5j, complex(-np.inf, np.pi)]),  # a multiplier of 0 has the rate −∞
        "exponent_error": 0.0,
        "hits": {"right": 8.0, "left": 0.0},
        "peak_depth": {"right": 0.1 + 0.2, "left": 0.0},
        "peak_force": {"right": 1 / 3, "left": 0.0},
        "basin_fraction": 0.1,
        "basin_fraction_error": 0.003,
        "residual": 1e-15,
        "error": 3e-11,
    }
    return Attractor(label=label, kind=kind, period=period, **(common | changes))


def survival(stepper: str) -> Survival:
    lives = np.array([17, -1, 2**40, -1, 450])  # longer than 32 bits
    return Survival(stepper, 5, 20000, 2, np.inf, np.nan, lives)


def chaotic(label: int) -> Attractor:
    never = {"duration": np.nan, "multipliers": np.empty(0, complex), "residual": np.nan, "error": np.nan}
    proof = (survival("RK4(steps=512)"), survival("FreeFlight(tolerance=1e-10)"))
    rate = {"exponents": np.array([0.0375 + 0j]), "exponent_error": 0.0003}
    sample = np.random.default_rng(0).normal(size=(200, 2))
    return attractor(label, "chaotic", 0, points=sample, survival=proof, **never, **rate)


def every_kind() -> Structure:
    attractors = (
        attractor(0, "periodic", 1, hits={}, peak_depth={}, peak_force={}),
        attractor(1, "periodic", 4),
        chaotic(2),
        attractor(3, "equilibrium", 1, duration=0.0, hits={"left": 0.0}),
        attractor(4, "limit cycle", 1),
        attractor(5, "quasiperiodic", 0, multipliers=np.empty(0, complex), survival=(survival("RK4(steps=256)"),)),
    )
    two = np.array([5.0 + 0j, -0.2 + 0j])
    rates = np.log(two)
    saddles = (
        Saddle("saddle", 1, 11.0, circle(0.2)[:1], two, rates, (0, 1), 1e-13, 1e-12),
        Saddle("flip saddle", 2, 22.0, circle(0.3)[:2], -two, rates, (1, 1), 1e-13, 1e-12),
        Saddle("repeller", 1, 11.0, circle(0.4)[:1], two, rates, (UNSETTLED, LEFT), 1e-13, 1e-12),
        Saddle("chaotic", 0, np.nan, circle(0.35), np.empty(0, complex), np.array([0.1 + 0j]), (0, 2), np.nan, np.nan),
    )
    manifolds = (
        Manifold(0, 0, True, 1, circle(0.5, 300), "It left the region."),
        Manifold(0, 0, False, -1, circle(0.25, 30), "It reached attractor 0 – «the clear one»."),
        Manifold(1, 1, False, 1, np.empty((0, 2)), "Nothing was grown."),
    )
    labels = np.arange(-3, 6, dtype=np.int16)[np.random.default_rng(1).integers(0, 9, (40, 30))]
    return Structure(
        attractors=attractors,
        saddles=saddles,
        manifolds=manifolds,
        basins=Basins(REGION, labels),
        survival=(survival("RK4(steps=256)"),),
        settling=1e-3,
        budget=500,
        stepper="RK4(steps=256)",
        complete=False,
        status="6 steady states found. It was stopped before its end.",
        scene=SCENE,
        seed=2**63 + 12345,
        seconds=12.25,
        versions={"python": "3.11.2", "vibrokit": "0.1"},
    )


def nothing_found() -> Structure:
    nothing = {"attractors": (), "saddles": (), "manifolds": (), "survival": (), "seed": None, "scene": {}}
    labels = np.full((2, 3), NOT_FOLLOWED, dtype=np.int16)
    return dataclasses.replace(every_kind(), basins=Basins(REGION, labels), **nothing)


def assert_same(old, new, where=""):
    """Both are of one type and equal in every attribute; arrays to the last bit."""
    assert type(old) is type(new), where
    if dataclasses.is_dataclass(old):
        for field in dataclasses.fields(old):
            assert_same(getattr(old, field.name), getattr(new, field.name), f"{where}.{field.name}")
    elif isinstance(old, np.ndarray):
        assert (old.dtype, old.shape) == (new.dtype, new.shape), where
        assert old.tobytes() == new.tobytes(), where
    elif isinstance(old, Mapping):
        assert list(old) == list(new), where
        for key in old:
            assert_same(old[key], new[key], f"{where}.{key}")
    elif isinstance(old, tuple | list):
        assert len(old) == len(new), where
        for index, pair in enumerate(zip(old, new, strict=True)):
            assert_same(*pair, f"{where}[{index}]")
    else:
        assert repr(old) == repr(new), where  # NaN too


@pytest.mark.parametrize("structure", [every_kind(), nothing_found()], ids=["every kind", "nothing found"])
def test_everything_comes_back_bit_for_bit(structure, tmp_path):
    structure.save(tmp_path / "s.nc")
    assert_same(structure, vk.load_result(tmp_path / "s.nc"))


def test_extra_noise_states_come_back(tmp_path):
    wide = attractor(0, "periodic", 1, points=np.array([[0.1, 0.2, 0.0]]))
    labels = np.zeros((4, 4), dtype=np.int16)
    structure = dataclasses.replace(nothing_found(), attractors=(wide,), basins=Basins(REGION, labels))
    structure.save(tmp_path / "s.nc")
    assert_same(structure, vk.load_result(tmp_path / "s.nc"))


def test_other_tools_read_the_arrays(tmp_path):
    structure = every_kind()
    structure.save(tmp_path / "s.nc")
    with xarray.open_dataset(tmp_path / "s.nc", engine="scipy") as file:
        np.testing.assert_array_equal(file["basin"], structure.basins.labels)
        np.testing.assert_array_equal(file["attractor_points_count"], [1, 4, 200, 1, 1, 1])
        np.testing.assert_array_equal(file["attractor_points"][1:5], structure.attractors[1].points)


def test_opens_and_plots_without_numba_or_sympy(tmp_path):
    every_kind().save(tmp_path / "s.nc")
    code = (
        "import sys, vibrokit as vk\n"
        "s = vk.load_result(sys.argv[1])\n"
        "s.plot()[0].get_figure().savefig(sys.argv[2]); s.plot_orbits()\n"
        "assert not {'numba', 'sympy', 'matplotlib.pyplot'} & set(sys.modules)\n"
    )
    arguments = [sys.executable, "-c", code, str(tmp_path / "s.nc"), str(tmp_path / "p.png")]
    subprocess.run(arguments, check=True, capture_output=True)
    assert (tmp_path / "p.png").stat().st_size > 5000


def test_a_failed_save_leaves_the_old_file(tmp_path, monkeypatch):
    target = tmp_path / "s.nc"
    every_kind().save(target)
    before = target.read_bytes()

    def fail(*arguments):
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(OSError, match="disk full"):
        nothing_found().save(target)
    assert target.read_bytes() == before
    assert list(tmp_path.iterdir()) == [target]


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> bytes:
    """Content of a sound file."""
    target = tmp_path_factory.mktemp("sound") / "s.nc"
    every_kind().save(target)
    return target.read_bytes()


def drop(name):
    return lambda data, header: data.drop_vars(name)


def put(name, place, value):
    """Overwrite one entry of an array."""

    def change(data, header):
        values = data[name].values.copy()
        values[place] = value
        return data.assign({name: (data[name].dims, values)})

    return change


def replaced(name, values, *dimensions):
    return lambda data, header: data.assign({name: (dimensions or data[name].dims, np.array(values))})


def say(key, value):
    """Put another value into the header; `...` takes the entry out."""

    def change(data, header):
        header.pop(key) if value is ... else header.update({key: value})
        return data

    return change


def stop(**changes):
    return say("scene", SCENE | {"barriers": [SCENE["barriers"][0] | changes]})


KINDS = ["periodic", "periodic", "chaotic", "equilibrium", "limit cycle"]
LIES = {
    "a label above the attractors": (put("basin", (3, 4), 6), "'basin' goes from -3 to 6; -3 to 5"),
    "a label below all": (put("basin", (0, 0), -4), "'basin' goes from -4"),
    "labels that are fractions": (lambda d, h: d.assign(basin=d["basin"] + 0.5), "'basin' holds numbers .* not whole"),
    "labels that are NaN": (lambda d, h: d.assign(basin=d["basin"] * np.nan), "'basin' holds numbers .* not whole"),
    "labels in one row": (lambda d, h: d.assign(basin=("n", d["basin"].values.ravel())), "shape .* any × any"),
    "labels that are letters": (lambda d, h: d.assign(basin=d["basin"].astype("S1")), "'basin' is of kind"),
    "no basins": (drop("basin"), "no array 'basin'"),
    "no points": (drop("attractor_points"), "no array 'attractor_points'"),
    "no residuals": (drop("saddle_residual"), "no array 'saddle_residual'"),
    "no counts": (drop("manifold_curve_count"), "no array 'manifold_curve_count'"),
    "half of the numbers complex": (drop("attractor_multipliers_imag"), "no array 'attractor_multipliers_imag'"),
    "NaN for a point": (put("attractor_points", (0, 0), np.nan), "'attractor_points' holds NaN"),
    "infinity on a curve": (put("manifold_curve", (5, 1), np.inf), "'manifold_curve' holds NaN or infinity"),
    "NaN for a multiplier": (put("saddle_multipliers_real", 0, np.nan), "'saddle_multipliers_real' holds NaN"),
    "NaN for a bound": (put("region", (0, 0), np.nan), "'region' holds NaN"),
    "a region inside out": (put("region", (0, 0), 9.0), "region: x goes from 9"),
    "a share above 1": (put("attractor_basin_fraction", 0, 1.5), "'attractor_basin_fraction' leaves the range 0 to 1"),
    "negative hits": (put("attractor_hits", 0, -1.0), "'attractor_hits' holds negative numbers"),
    "counts that claim more": (put("attractor_points_count", 2, 10**9), "shape .* is needed"),
    "counts below zero": (put("attractor_points_count", 2, -1), "'attractor_points_count' goes from -1"),
    "fewer imaginary parts": (put("attractor_multipliers_imag_count", [0, 1], [1, 3]), "2 real and 1 imaginary"),
    "an orbit without points": (put("attractor_points_count", [0, 1], [0, 5]), "points of shape"),
    "a period that is not its points": (put("attractor_period", 1, 3), "period 3 has 4 points"),
    "labels out of order": (put("attractor_label", [0, 1], [1, 0]), "attractor 0 has label 1"),
    "two labels alike": (put("attractor_label", 1, 0), "attractor 1 has label 0"),
    "one column too short": (lambda d, h: d.assign(saddle_period=("few", [1, 2])), "'saddle_period' has shape"),
    "points of one number": (
        lambda d, h: d.assign(attractor_points=d["attractor_points"][:, :1].rename(attractor_points_state="one")),
        "points of shape",
    ),
    "a saddle to an unknown place": (put("saddle_leads_to", 0, 6), "leads to .6, 1., and there are 6"),
    "a manifold of no saddle": (put("manifold_saddle", 0, 4), "saddle 4, which is not there"),
    "a manifold from no point": (put("manifold_point", 0, 1), "point 1 of saddle 0"),
    "a manifold without a side": (put("manifold_side", 0, 0), "on side 0"),
    "a flag that is 2": (put("manifold_stable", 0, 2), "'manifold_stable' goes from 0 to 2"),
    "more survivors than starts": (put("survival_survivors", 0, 6), "5 starts, 6 survivors"),
    "proofs that are not there": (put("attractor_survival_count", 0, 4), "claim 7 survivals; there are 4"),
    "an unknown kind of state": (say("attractor_kind", [*KINDS, "rare"]), "attractor of kind 'rare'"),
    "an unknown kind of saddle": (say("saddle_kind", ["saddle", "node"] * 2), "saddle of kind 'node'"),
    "too few kinds": (say("attractor_kind", KINDS), "5 entries in attractor_kind; 6"),
    "kinds that are no texts": (say("attractor_kind", [1] * 6), "no list of texts"),
    "an unknown side": (say("attractor_hits_sides", [["up"]] * 6), "not left and right"),
    "one side twice": (say("attractor_hits_sides", [["left", "left"]] * 6), "not left and right"),
    "sides that are a number": (say("attractor_hits_sides", 3), "attractor_hits_sides = 3, which is no list"),
    "a huge number of records": (say("attractors", 10**9), "shape"),
    "an endless number of records": (say("attractors", 10**30), "claims 10+ attractors"),
    "a negative number of records": (say("manifolds", -1), "claims -1 manifolds"),
    "a number of records that is true": (say("manifolds", True), "manifolds = True"),
    "no status": (say("status", ...), "lacks 'status'"),
    "a status that is a list": (say("status", ["all is well"]), "status = .* no str"),
    "NaN for the distance": (say("settling", float("nan")), "settling = nan, and a finite"),
    "a distance too large for a float": (say("settling", 10**400), "no float"),
    "a budget in words": (say("budget", "500"), "budget = '500'"),
    "complete in a number": (say("complete", 1), "complete = 1"),
    "a seed in letters": (say("seed", "abc"), "seed = 'abc'"),
    "a seed without end": (say("seed", "9" * 5000), "no whole number"),
    "no seed": (say("seed", ...), "lacks 'seed'"),
    "versions in a list": (say("versions", []), "versions = "),
    "a version in a number": (say("versions", {"python": 3}), "python = 3"),
    "a scene in a text": (say("scene", "hertz-0.570"), "scene = 'hertz-0.570'"),
    "stops in a number": (say("scene", {"barriers": 2}), "barriers = 2"),
    "a stop in a number": (say("scene", {"barriers": [2]}), "lacks 'position'"),
    "a stop nowhere": (stop(position=float("inf")), "position = inf"),
    "a stop in a text": (stop(position="0.5"), "position = '0.5'"),
    "a stop on top": (stop(side="top"), "side 'top'"),
    "an unknown kind of result": (say("kind", "strucure"), "unknown kind 'strucure'; the nearest is 'structure'"),
    "a kind in a list": (say("kind", ["structure"]), "kind = "),
    "another kind of result": (say("kind", "action_plot"), "lacks 'methods'"),
    "a newer format": (say("format", 2), "format 2, and this version reads format 1"),
}


@pytest.mark.parametrize(("lie", "words"), LIES.values(), ids=LIES)
def test_lies_are_refused_in_a_sentence(lie, words, sound, tmp_path):
    data = xarray.load_dataset(io.BytesIO(sound), engine="scipy", decode_cf=False)
    header = json.loads(data.attrs["vibrokit"])
    data = lie(data, header)
    data.attrs["vibrokit"] = json.dumps(header)
    data.to_netcdf(tmp_path / "lie.nc", engine="scipy")
    with pytest.raises(ResultFileError, match=rf"lie\.nc is no result that vibrokit saved: .*{words}"):
        vk.load_result(tmp_path / "lie.nc")


@pytest.mark.parametrize(
    "header", ["", "[", "[]", "3", "null", '"text"', "[" * 100_000, '{"format": 1' + "0" * 9999 + "}"]
)
def test_headers_that_are_none_are_refused(header, tmp_path):
    xarray.Dataset({"a": ("n", [1.0])}, attrs={"vibrokit": header}).to_netcdf(tmp_path / "h.nc", engine="scipy")
    with pytest.raises(ResultFileError, match="no result that vibrokit saved"):
        vk.load_result(tmp_path / "h.nc")


def test_damaged_bytes_open_or_are_refused(sound, tmp_path):
    random = np.random.default_rng(3)
    for _ in range(300):
        damaged = bytearray(sound)
        for place in random.integers(0, len(sound) if random.random() < 0.3 else 6000, random.integers(1, 5)):
            damaged[place] = random.choice([0, 1, 127, 128, 255, random.integers(256)])
        del damaged[random.integers(len(sound) // 2, 2 * len(sound)) :]
        (tmp_path / "d.nc").write_bytes(damaged)
        with contextlib.suppress(ResultFileError):  # or a number was changed into another number
            assert isinstance(vk.load_result(tmp_path / "d.nc"), Structure)


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
        with pytest.raises(ResultFileError, match=rf"no result that vibrokit saved: .*{words}"):
            vk.load_result(tmp_path / "huge.nc")
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_what_is_no_file_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(ResultFileError, match="cannot be read"):
        vk.load_result(tmp_path)
    with pytest.raises(ResultFileError, match="cannot be read"):
        vk.load_result(3)
    with pytest.raises(FileNotFoundError):
        vk.load_result(tmp_path / "none.nc")
