import contextlib
import dataclasses
import subprocess
import sys

import numpy as np
import pytest
import xarray

import vibrokit as vk
from tests.builders import (
    assert_same,
    drop,
    empty_result,
    empty_structure,
    full_result,
    full_structure,
    put,
    replaced,
    rewritten,
)  # fmt: skip
from vibrokit.errors import StructureError
from vibrokit.results.energy import Bound
from vibrokit.results.files import ResultFileError
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.section import Section


@pytest.mark.parametrize("make", [full_result, empty_result])
def test_everything_comes_back_bit_for_bit(make, tmp_path):
    make().save(tmp_path / "r.nc")
    assert_same(make(), vk.load_result(tmp_path / "r.nc"))


def test_a_path_of_two_energies_is_saved_once(tmp_path):
    result = full_result()
    assert result.energies[0].path is result.branches[0].path
    result.save(tmp_path / "r.nc")
    again = vk.load_result(tmp_path / "r.nc")
    assert again.energies[0].path is again.branches[0].path
    with xarray.open_dataset(tmp_path / "r.nc", engine="scipy") as file:
        assert file.sizes["path"] == 3


def test_a_seed_longer_than_any_number_comes_back(tmp_path):
    dataclasses.replace(full_result(), seed=2**70).save(tmp_path / "r.nc")
    assert vk.load_result(tmp_path / "r.nc").seed == 2**70


@pytest.mark.parametrize("make", [full_structure, empty_structure])
def test_the_section_of_a_structure_comes_back(make):
    section = Section.of(make())
    result = dataclasses.replace(empty_result(), section=section)
    assert_same(section, LeastActionResult.from_dataset(result.to_dataset(), scene={}).section)


def test_xarray_alone_reads_a_result(tmp_path):
    result = full_result()
    result.save(tmp_path / "r.nc")
    with xarray.open_dataset(tmp_path / "r.nc", engine="scipy") as file:
        one = file.sel(source=2)
        assert one.source_name == "chaotic"
        np.testing.assert_array_equal(one.quasi_potential, result.data.quasi_potential[0])
        assert one.quasi_potential.attrs["units"] == file.energy_value.attrs["units"] == "m2 s-3"
        image = file.basin.plot()
        assert (image.axes.get_xlabel(), image.axes.get_ylabel()) == ("displacement [m]", "velocity [m s-1]")
        best = int(file.energy_path[0])
        path = file.isel(path=best, path_sample=slice(int(file.path_sample_count[best])))
        np.testing.assert_array_equal(path.path_x, result.energies[0].path.q[:, 0])
        np.testing.assert_array_equal(path.path_p2, result.energies[0].path.p[:, 1])
        assert file.energy_bound.values.tolist() == ["certified", "certified", "bracket"]
        assert file.attractor_name.values.tolist() == list(result.names)
        assert "No exit path from hammering-period-4 was found." in file.attrs["status"]
        assert set(file.attrs) >= {"title", "Conventions", "source", "history"}


@pytest.mark.parametrize("make", [full_structure, full_result])
def test_all_numbers_have_a_long_name_and_units(make):
    for name, array in make().to_dataset().variables.items():
        wanted = {"long_name"} if array.dtype.kind in "Ub" or name in ("basin", "source") else {"long_name", "units"}
        assert wanted <= set(array.attrs), name


def test_opens_and_plots_without_numba_or_sympy(tmp_path):
    full_result().save(tmp_path / "r.nc")
    code = (
        "import sys, vibrokit as vk\n"
        "r = vk.load_result(sys.argv[1])\n"
        "repr(r), r._repr_html_(), r.status, r.energy('clear')\n"
        "for draw in (r.plot, r.plot_history, r.plot_quasi_potential):\n"
        "    draw().figure.savefig(sys.argv[2])\n"
        "assert not {'numba', 'sympy', 'matplotlib.pyplot'} & set(sys.modules)\n"
    )
    arguments = [sys.executable, "-c", code, str(tmp_path / "r.nc"), str(tmp_path / "p.png")]
    subprocess.run(arguments, check=True, capture_output=True)
    assert (tmp_path / "p.png").stat().st_size > 5000


def test_what_does_not_exist_is_not_drawn():
    with pytest.raises(StructureError, match="no exit path"):
        empty_result().plot_history()
    with pytest.raises(StructureError, match="no quasi-potential of clear; it has those of chaotic"):
        full_result().plot_quasi_potential("clear")
    with pytest.raises(StructureError, match="there is no attractor 7"):
        full_result().plot_quasi_potential(7)
    with pytest.raises(StructureError, match="no quasi-potential"):
        empty_result().plot_quasi_potential()
    assert empty_result().plot().strands == ()


def test_time_is_drawn_in_sections():
    drawn = full_result().plot_history()
    np.testing.assert_allclose(drawn.momentum_points[0].get_xdata(), np.arange(13), atol=1e-12)
    assert drawn.momenta[0].get_xdata()[-1] == pytest.approx(12)


def test_a_quasi_potential_lies_on_its_nodes():
    drawn = full_result().plot_quasi_potential()
    half_x, half_v = 1 / 19, 0.6 / 15
    np.testing.assert_allclose(
        drawn.image.get_extent(), [-1 - half_x, 1 + half_x, -0.9 - half_v, 0.3 + half_v], rtol=1e-12
    )
    np.testing.assert_array_equal(
        drawn.image.get_array().filled(np.nan).T, full_result().data.quasi_potential.values[0]
    )  # fmt: skip
    assert drawn.attractor.get_label() == "chaotic"


# Energies by name


def test_an_energy_is_found_by_label_or_name():
    result = full_result()
    first, second, third = result.energies
    assert result.energy("clear", "hammering") is result.energy(0, 1) is result.energy(0) is first
    assert result.energy("hamm", "clear") is second
    assert result.energy("chaotic", "exit") is result.energy(2, -1) is third
    assert [result.exit_of(energy) for energy in result.energies] == [
        "clear → hammering-period-4", "hammering-period-4 → clear", "chaotic → exit",
    ]  # fmt: skip


def test_the_exit_of_least_energy_is_the_default():
    result = full_result()
    cheaper = dataclasses.replace(result.energies[0], target=2, value=1e-6)
    assert dataclasses.replace(result, energies=(*result.energies, cheaper)).energy("clear") is cheaper


@pytest.mark.parametrize(
    ("source", "target", "words"),
    [
        ("clear", "chaotic", "no energy of clear → chaotic; the result has clear → hammering-period-4, "),
        ("clear", "exit", "no energy of clear → exit"),
        ("claer", None, "no attractor 'claer'; the nearest is 'clear'"),
        ("c", None, "clear or chaotic"),
        (3, None, "no attractor 3; there are 0 .clear., 1"),
        (-1, None, "no attractor -1"),
        (True, None, "no attractor True"),
    ],
)
def test_an_energy_that_does_not_exist(source, target, words):
    with pytest.raises(StructureError, match=words):
        full_result().energy(source, target)


# Files from strangers


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> bytes:
    target = tmp_path_factory.mktemp("sound") / "r.nc"
    full_result().save(target)
    return target.read_bytes()


def test_the_bounds_come_back_as_what_they_rest_on(sound, tmp_path):
    (tmp_path / "r.nc").write_bytes(rewritten(sound, put("energy_bound", 0, "estimate")))
    assert vk.load_result(tmp_path / "r.nc").energies[0].bound is Bound.ESTIMATE


LIES = {
    "no branches": (drop("branch_method"), "no array 'branch_method'"),
    "methods that are numbers": (replaced("branch_method", [1, 2, 3, 4]), "'branch_method' is of type"),
    "one method more": (replaced("branch_method", ["ring"] * 5, "five"), "'branch_method' has shape"),
    "an unknown bound": (put("energy_bound", 0, "certain"), "'energy_bound' holds 'certain'; it may hold exact"),
    "no value of branches": (drop("branch_value"), "no array 'branch_value'"),
    "no numerical error": (drop("energy_numerical_error"), "no array 'energy_numerical_error'"),
    "a value in words": (replaced("energy_value", ["a", "b", "c"]), "'energy_value' is of type"),
    "a saddle below none": (put("energy_saddle", 0, -2), "'energy_saddle' goes from -2"),
    "a saddle that is half": (replaced("energy_saddle", [0.5, 1, 1]), "'energy_saddle' holds .* not whole"),
    "a source below zero": (put("branch_source", 0, -1), "'branch_source' goes from -1"),
    "a source above all": (put("branch_source", 0, 3), "from attractor 3 to 1, and there are 3"),
    "a target above all": (put("energy_target", 0, 3), "from attractor 0 to 3, and there are 3"),
    "a flag that is 2": (replaced("energy_certified", [2, 0, 1]), "'energy_certified' goes from"),
    "a certificate without evidence": (drop("energy_certificate_by_start"), "no array 'energy_certificate_by_start'"),
    "evidence in words": (
        replaced("energy_certificate_residual", ["a", "b", "c"]), "'energy_certificate_residual' is of type",
    ),
    "no momenta": (drop("path_p2"), "no array 'path_p2'"),
    "a path that is missing": (put("energy_path", 0, 3), "has path 3, and there are 3"),
    "a path below none": (put("branch_path", 0, -2), "'branch_path' goes from -2"),
    "a path through infinity": (put("path_x", (0, 3), np.inf), "'path_x' holds NaN or infinity"),
    "a path without samples": (put("path_sample_count", 0, 0), "has 0 samples"),
    "samples that claim more": (put("path_sample_count", 0, 10**6), "'path_sample_count' goes from"),
    "a sample that is not there": (put("path_section", (0, 0), 10**6), "fewer than its points on the section"),
    "a sample below zero": (put("path_section", (0, 0), -1), "'path_section' holds"),
    "no basins": (drop("basin"), "no array 'basin'"),
    "a cell that leads to no attractor": (put("basin", (0, 0), 3), "'basin' goes from -3 to 3"),
    "no names": (drop("attractor_name"), "no array 'attractor_name'"),
    "no attractors' points": (drop("attractor_points_x"), "no array 'attractor_points_x'"),
    "an attractor without points": (put("attractor_visit_count", 0, 0), "one of its attractors has no points"),
    "points at NaN": (put("attractor_points_v", (0, 0), np.nan), "'attractor_points_v' holds NaN"),
    "counts that claim more": (put("saddle_visit_count", 0, 10**6), "'saddle_visit_count' goes from"),
    "a manifold through infinity": (put("stable_manifold_x", 0, np.inf), "'stable_manifold_x' holds NaN"),
    "no region": (drop("region_v"), "no array 'region_v'"),
    "a region in words": (replaced("region_x", ["all", "of"]), "'region_x' is of type"),
    "a region of three numbers": (replaced("region_x", [0.0, 1.0, 2.0], "three"), "'region_x' has shape"),
    "a region inside out": (put("region_v", 0, 9.0), "region: v goes from 9"),
}  # fmt: skip


@pytest.mark.parametrize(("lie", "words"), LIES.values(), ids=LIES)
def test_lies_are_refused_in_a_sentence(lie, words, sound, tmp_path):
    (tmp_path / "lie.nc").write_bytes(rewritten(sound, lie))
    with pytest.raises(ResultFileError, match=rf"lie\.nc is no result that this vibrokit can open: .*{words}"):
        vk.load_result(tmp_path / "lie.nc")


POTENTIALS = {
    "no nodes": (drop("quasi_potential_x"), "no array 'quasi_potential_x'"),
    "nodes backwards": (put("quasi_potential_v", (0, 0), 9.0), "in ascending order"),
    "one node": (
        lambda d, h: d.isel(node_x=[0]), "at least two nodes",
    ),
    "in one row": (replaced("quasi_potential", [1.0], "source"), "'quasi_potential' has shape"),
    "in letters": (lambda d, h: d.assign(quasi_potential=d["quasi_potential"].astype("S1")), "is of type"),
    "of an unknown attractor": (put("source", 0, 3), "'source' goes from 3"),
}  # fmt: skip


@pytest.mark.parametrize(("lie", "words"), POTENTIALS.values(), ids=POTENTIALS)
def test_data_that_is_not_a_quasi_potential_is_not_drawn(lie, words, sound, tmp_path):
    (tmp_path / "lie.nc").write_bytes(rewritten(sound, lie))
    with pytest.raises(ResultFileError, match=words):
        vk.load_result(tmp_path / "lie.nc").plot_quasi_potential()


@pytest.mark.filterwarnings("ignore")  # of xarray, about names and units that damage made strange
def test_damaged_bytes_open_or_are_refused(sound, tmp_path):
    random = np.random.default_rng(3)
    opened = 0
    for _ in range(100):
        damaged = bytearray(sound)
        for place in random.integers(0, len(sound) if random.random() < 0.3 else 12_000, random.integers(1, 5)):
            damaged[place] = random.choice([0, 1, 127, 128, 255, random.integers(256)])
        del damaged[random.integers(len(sound) // 2, 2 * len(sound)) :]
        (tmp_path / "d.nc").write_bytes(damaged)
        with contextlib.suppress(ResultFileError):  # or a number was changed into another number
            opened += isinstance(vk.load_result(tmp_path / "d.nc"), LeastActionResult)
    assert 0 < opened < 100
