import contextlib
import dataclasses
import io
import json
import math
import subprocess
import sys

import numpy as np
import pytest
import xarray

import vibrokit as vk
from vibrokit import report
from vibrokit.errors import StructureError
from vibrokit.results.basins import LEFT
from vibrokit.results.certificate import Certificate
from vibrokit.results.energy import ActivationEnergy, ExitPath
from vibrokit.results.files import ResultFileError
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.quasi_potential import QuasiPotential
from vibrokit.results.section import Section
from vibrokit.results.transitions import Transitions

CERTIFICATE = Certificate(1e-12, 1e-5, 2e-5, 61.5, -1e-13, 3e-14, -2e-12, 0.25)
UNSURE = Certificate(1e-10, 1e-4, 0.0, 12.0, math.nan, 0.0, 1e-12, math.nan)


def spiral(turns: int = 12) -> ExitPath:
    t = np.linspace(0, 11.0 * turns, 16 * turns + 1)
    growth = np.exp(0.05 * (t - t[-1]))
    q = np.stack([0.3 + growth * np.cos(t), growth * np.sin(t)], axis=1)
    return ExitPath(t, q, 1e-3 * q, 1e-4 * growth**2, np.arange(0, len(t), 16))


def energy(source, target, value, **changes):
    common = {"lower": value - 1e-9, "upper": value + 1e-9, "method": "least action", "residual": 1e-11}
    return ActivationEnergy(source=source, target=target, value=value, **(common | changes))


def section() -> Section:
    labels = np.random.default_rng(0).integers(-3, 3, (20, 16)).astype(np.int16)
    angle = np.linspace(0, 6, 200)
    curve = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Section(
        labels=labels,
        bounds=np.array([[-1.0, 1.0], [-0.9, 0.1 + 0.2]]),
        points=(np.array([[0.3, 0.0]]), curve[:4], 0.4 * curve[:60]),
        saddles=(np.array([[0.9, 0.0]]), curve[7:9]),
        chaotic=(0.5 * curve[:50],),
        stable=(curve, curve[:30] - 0.1),
    )


def everything() -> LeastActionResult:
    energies = (
        energy(0, 1, 9e-5, path=spiral(), saddle=0, certificate=CERTIFICATE),
        energy(1, 0, 1e-3, lower=5e-4, upper=math.inf, certificate=UNSURE, saddle=1, method="«graph» and polish"),
        energy(2, LEFT, 3e-4, lower=math.nan, path=spiral(3)),
    )
    branches = (*energies, energy(0, 1, 1.1e-4, path=spiral(5), saddle=1, certificate=CERTIFICATE))
    lower = np.array([[0, 9e-5, np.inf], [5e-4, 0, 0.1], [0.2, 0.3, 0]])
    potential = np.random.default_rng(1).exponential(size=(20, 16))
    potential[potential > 2] = np.inf
    return LeastActionResult(
        energies=energies,
        data=section().data.merge(QuasiPotential(2, potential, section().bounds).data),
        scene={"natural_frequency": 1.0, "noise": {"name": "white", "intensity": 2e-5}},
        settings={"orbits": 3},
        status="All is well – nearly.",
        seconds=1.5,
        versions={"vibrokit": "0.1"},
        branches=branches,
        transitions=Transitions((0, 1, 2), 1.5 * lower, lower, 2 * lower),
    )


def nothing_found() -> LeastActionResult:
    bare = Section(np.full((2, 3), -1, dtype=np.int16), np.array([[0.0, 1.0], [0.0, 1.0]]), ())
    return dataclasses.replace(everything(), energies=(), branches=(), transitions=None, data=bare.data)


def assert_same(old, new, where=""):
    assert type(old) is type(new), where
    if dataclasses.is_dataclass(old):
        for field in dataclasses.fields(old):
            assert_same(getattr(old, field.name), getattr(new, field.name), f"{where}.{field.name}")
    elif isinstance(old, np.ndarray):
        assert (old.dtype, old.shape) == (new.dtype, new.shape), where
        assert old.tobytes() == new.tobytes(), where
    elif isinstance(old, tuple):
        assert len(old) == len(new), where
        for index, pair in enumerate(zip(old, new, strict=True)):
            assert_same(*pair, f"{where}[{index}]")
    elif not isinstance(old, xarray.Dataset):
        assert repr(old) == repr(new), where  # NaN too


@pytest.mark.parametrize("result", [everything(), nothing_found()], ids=["everything", "nothing found"])
def test_everything_comes_back_bit_for_bit(result, tmp_path):
    result.save(tmp_path / "r.nc")
    again = vk.load_result(tmp_path / "r.nc")
    assert_same(result, again)
    assert_same(Section.in_data(result.data), Section.in_data(again.data))
    assert set(again.data.variables) == set(result.data.variables)
    for name in result.data.variables:
        np.testing.assert_array_equal(again.data[name].values, result.data[name].values)


def test_the_section_of_a_structure_is_that_of_its_data():
    assert_same(section(), Section.in_data(section().data))


def test_opens_and_plots_without_numba_or_sympy(tmp_path):
    everything().save(tmp_path / "r.nc")
    code = (
        "import sys, vibrokit as vk\n"
        "r = vk.load_result(sys.argv[1])\n"
        "for draw in (r.plot, r.plot_history, r.plot_quasi_potential):\n"
        "    draw()[0].get_figure().savefig(sys.argv[2])\n"
        "assert not {'numba', 'sympy', 'matplotlib.pyplot'} & set(sys.modules)\n"
    )
    arguments = [sys.executable, "-c", code, str(tmp_path / "r.nc"), str(tmp_path / "p.png")]
    subprocess.run(arguments, check=True, capture_output=True)
    assert (tmp_path / "p.png").stat().st_size > 5000


def test_what_is_not_there_is_not_drawn():
    with pytest.raises(StructureError, match="no exit path"):
        nothing_found().plot_history()
    with pytest.raises(StructureError, match="attractor 0; there are those of 2"):
        everything().plot_quasi_potential(0)
    with pytest.raises(StructureError, match="no quasi-potential"):
        nothing_found().plot_quasi_potential()
    assert nothing_found().plot()


def test_time_is_drawn_in_sections():
    line, dots, *_ = everything().plot_history()
    np.testing.assert_allclose(dots.get_xdata(), np.arange(13), atol=1e-12)
    assert line.get_xdata()[-1] == pytest.approx(12)


def test_names_that_are_kept_for_energies_are_refused(tmp_path):
    data = everything().data.assign(energy_of_mine=("n", [1.0]))
    with pytest.raises(ResultFileError, match="'energy_of_mine'"):
        dataclasses.replace(everything(), data=data).save(tmp_path / "r.nc")
    assert not list(tmp_path.iterdir())


# Files from strangers


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> bytes:
    target = tmp_path_factory.mktemp("sound") / "r.nc"
    everything().save(target)
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
    return lambda data, header: data.assign({name: (dimensions, np.array(values))})


def say(key, value):
    """Put another value into the header; `...` takes the entry out."""

    def change(data, header):
        header.pop(key) if value is ... else header.update({key: value})
        return data

    return change


def region(value):
    return lambda data, header: data.assign_attrs(region=value)


def narrow(data, header):
    """Leave one number to each state of a path."""
    states = {name: (("path0_sample", "one"), data[name].values[:, :1]) for name in ("path0_q", "path0_p")}
    return data.assign(states)


LIES = {
    "no branches": (say("branch_methods", ...), "lacks 'branch_methods'"),
    "branches that are no texts": (say("branch_methods", [1, 2, 3, 4]), "no list of texts"),
    "one branch more": (say("branch_methods", ["ring"] * 5), "'branch_source' has shape"),
    "no value of branches": (drop("branch_value"), "no array 'branch_value'"),
    "a saddle below none": (put("energy_saddle", 0, -2), "'energy_saddle' goes from -2"),
    "a saddle that is half": (replaced("energy_saddle", [0.5, 1, 1], "energy"), "'energy_saddle' holds .* not whole"),
    "a source below zero": (put("branch_source", 0, -1), "'branch_source' goes from -1"),
    "a flag that is 2": (put("energy_certified", 0, 2), "'energy_certified' goes from"),
    "a certificate without evidence": (drop("energy_certificate_by_start"), "no array 'energy_certificate_by_start'"),
    "evidence in words": (
        replaced("energy_certificate_residual", ["a", "b", "c"], "energy"),
        "'energy_certificate_residual' is of kind",
    ),
    "no momenta": (drop("branch_path3_p"), "no array 'branch_path3_p'"),
    "a path through infinity": (put("path0_q", (3, 0), np.inf), "'path0_q' holds NaN or infinity"),
    "a path of one number": (narrow, "x and v are needed"),
    "a sample that is not there": (put("path0_on_section", 0, 10**6), "'path0_on_section' goes from"),
    "two labels alike": (put("transition_label", 1, 0), "3 labels, 2 of them different"),
    "a label below zero": (put("transition_label", 1, -4), "'transition_label' goes from -4"),
    "no upper bounds": (drop("transition_upper"), "no array 'transition_upper'"),
    "bounds inside out": (put("transition_lower", (0, 1), 1.0), "lower ≤ energies"),
    "NaN for an energy": (put("transition_energies", (0, 1), np.nan), "no NaN"),
    "a matrix in one row": (replaced("transition_energies", [1.0] * 9, "nine"), "shape"),
    "too many labels": (replaced("transition_label", np.arange(1000), "many"), "between 1000 attractors"),
    "no basins": (drop("basin"), "no array 'basin'"),
    "a cell that leads to no attractor": (put("basin", (0, 0), 3), "'basin' goes from -3 to 3"),
    "an attractor's points missing": (drop("points_1"), "'basin' goes from -3 to 2; -3 to 0"),
    "points of one number": (replaced("points_0", [[1.0]], "a", "b"), "x and v are needed"),
    "points at NaN": (put("points_0", (0, 0), np.nan), "'points_0' holds NaN"),
    "counts that claim more": (put("saddle_points_count", 0, 10**6), "shape .* is needed"),
    "a manifold through infinity": (put("stable_manifold_points", (0, 0), np.inf), "manifold_points' holds NaN"),
    "no region": (lambda d, h: d.drop_attrs(deep=False), "attribute 'region'"),
    "a region in words": (region("all"), "attribute 'region'"),
    "a region of three numbers": (region([0.0, 1.0, 2.0]), "attribute 'region'"),
    "a region inside out": (region([1.0, 0.0, 0.0, 1.0]), "region: x goes from 1"),
    "a potential without a box": (drop("quasi_potential_box_2"), "no array 'quasi_potential_box_2'"),
    "a potential's box inside out": (put("quasi_potential_box_2", (0, 0), 9.0), "quasi_potential_box_2"),
    "a potential of one node": (
        replaced("quasi_potential_2", np.ones((1, 1)), "one", "two"),
        "fewer than two nodes along a side",
    ),
    "a potential in one row": (replaced("quasi_potential_2", [1.0], "one"), "'quasi_potential_2' has shape"),
    "a potential in letters": (
        lambda d, h: d.assign(quasi_potential_2=d["quasi_potential_2"].astype("S1")),
        "'quasi_potential_2' is of kind",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("lie", "words"), LIES.values(), ids=LIES)
def test_lies_are_refused_in_a_sentence(lie, words, sound, tmp_path):
    data = xarray.load_dataset(io.BytesIO(sound), engine="scipy", decode_cf=False)
    text = data.attrs["vibrokit"]
    header = json.loads(text)
    data = lie(data, header)
    data.attrs["vibrokit"] = json.dumps(header)
    data.to_netcdf(tmp_path / "lie.nc", engine="scipy")
    with pytest.raises(ResultFileError, match=rf"lie\.nc is no result that vibrokit saved: .*{words}"):
        vk.load_result(tmp_path / "lie.nc")


@pytest.mark.filterwarnings("ignore:Duplicate dimension names")
def test_damaged_bytes_open_or_are_refused(sound, tmp_path):
    random = np.random.default_rng(3)
    for _ in range(100):
        damaged = bytearray(sound)
        for place in random.integers(0, len(sound) if random.random() < 0.3 else 6000, random.integers(1, 5)):
            damaged[place] = random.choice([0, 1, 127, 128, 255, random.integers(256)])
        del damaged[random.integers(len(sound) // 2, 2 * len(sound)) :]
        (tmp_path / "d.nc").write_bytes(damaged)
        with contextlib.suppress(ResultFileError):  # or a number was changed into another number
            assert isinstance(vk.load_result(tmp_path / "d.nc"), LeastActionResult)


# What is printed of it


def test_tables_have_energies_branches_and_transitions():
    text = report.analysis("least-action", everything())
    first, *_ = [line for line in text.splitlines() if line.startswith("0 → 1")]
    assert first.split()[3:] == ["0", "9e-05", "8.9999e-05", "9.0001e-05", "1e-11", "least", "action"]
    assert "2 → exit" in text
    assert text.count("0 → 1 ") == 3  # the best, it among the branches, and the other branch
    assert "from \\ to" in text
    assert "No exit" not in text
    assert "Stationary weights at D = 2e-05" in text


def test_without_transitions_nothing_is_said_of_them():
    text = report.analysis("least-action", nothing_found())
    assert "All is well" in text
    assert "from" not in text


def test_the_record_is_one_object_for_other_programs():
    structure = vk.find_structure(vk.load_scene("double-well"), cells=(10, 10), starts=(4, 4))
    found = report.record("s", 0, structure, {"least-action": everything()}, 1.0)
    text = json.loads(json.dumps(found, allow_nan=False))
    first, second, third = text["energies"]
    assert list(first) == ["source", "target", "method", "value", "lower", "upper", "residual", "saddle"]
    assert (second["upper"], third["lower"]) == (None, None)
    assert "saddle" not in third
    assert text["transitions"]["labels"] == [0, 1, 2]
    assert text["transitions"]["energies"][0][2] is None
