"""Saved records come back as they were, and xarray alone reads them."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
import xarray

import vibrokit as vk
from tests.builders import (
    REGION,
    assert_same,
    attractor,
    empty_result,
    empty_structure,
    full_continuation,
    full_result,
    full_structure,
)  # fmt: skip
from vibrokit.errors import ResultFileError
from vibrokit.results.basins import Basins
from vibrokit.results.record import Record
from vibrokit.results.section import Section


def empty_continuation():
    return dataclasses.replace(
        full_continuation(), states=(), branch_names=(), bifurcations=(), region=None, unit=None, symbol="", findings=()
    )


def wide_structure():
    """A structure whose states have a third component."""
    wide = attractor(0, "periodic", 1, points=np.array([[0.1, 0.2, 0.0]]))
    labels = np.zeros((4, 4), dtype=np.int16)
    return dataclasses.replace(empty_structure(), attractors=(wide,), basins=Basins(REGION, labels))


@pytest.mark.parametrize(
    "make",
    [
        full_structure, empty_structure, wide_structure, full_result, empty_result, full_continuation,
        empty_continuation, lambda: dataclasses.replace(empty_result(), section=Section.of(full_structure())),
        lambda: dataclasses.replace(empty_result(), seed=2**70),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("error")
def test_everything_comes_back_bit_for_bit(make, tmp_path):
    record = make()
    record.save(tmp_path / "r.nc")
    assert_same(record, vk.load_result(tmp_path / "r.nc"))
    provenance = {field.name: getattr(record, field.name) for field in dataclasses.fields(Record)}
    assert_same(record, type(record).from_dataset(record.to_dataset(), **provenance))
    make().save(tmp_path / "again.nc")
    assert (tmp_path / "again.nc").read_bytes() == (tmp_path / "r.nc").read_bytes()


def test_a_path_of_two_energies_is_saved_once(tmp_path):
    full_result().save(tmp_path / "r.nc")
    again = vk.load_result(tmp_path / "r.nc")
    assert again.energies[0].path is again.branches[0].path
    assert again.to_dataset().sizes["path"] == 3


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


def test_xarray_alone_reads_a_continuation(tmp_path):
    sweep = full_continuation()
    sweep.save(tmp_path / "c.nc")
    with xarray.open_dataset(tmp_path / "c.nc", engine="scipy") as file:
        np.testing.assert_array_equal(file.value, sweep.values)
        assert file.value.units == file.bifurcation_value.units == "rad s^-1"
        np.testing.assert_array_equal(file.value[file.attractor_at], [0.1 + 0.2, 0.1 + 0.2, 0.75])
        assert file.bifurcation_kind.values.tolist() == ["grazing", "Neimark–Sacker"]
        assert file.parameter == "excitations.0.frequency"


@pytest.mark.parametrize("make", [full_structure, full_result, full_continuation])
def test_all_numbers_have_a_long_name_and_units(make):
    for name, array in make().to_dataset().variables.items():
        wanted = {"long_name"} if array.dtype.kind in "Ub" or name in ("basin", "source") else {"long_name", "units"}
        assert wanted <= set(array.attrs), name


def test_opens_saves_and_plots_without_numba_or_sympy(tmp_path):
    full_result().save(tmp_path / "r.nc")
    full_structure().save(tmp_path / "s.nc")
    code = (
        "import sys, vibrokit as vk\n"
        "r, s = map(vk.load_result, sys.argv[1:3])\n"
        "r.save(sys.argv[1])\n"
        "assert 'matplotlib' not in sys.modules\n"
        "repr(r), r._repr_html_(), r.status, r.energy('clear'), repr(s), s._repr_html_()\n"
        "for draw in (s.plot_orbits, s.plot, r.plot, r.plot_history, r.plot_quasi_potential):\n"
        "    draw().figure.savefig(sys.argv[3])\n"
        "assert not {'numba', 'sympy', 'matplotlib.pyplot'} & set(sys.modules)\n"
    )
    arguments = [sys.executable, "-c", code, *(str(tmp_path / name) for name in ("r.nc", "s.nc", "p.png"))]
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
