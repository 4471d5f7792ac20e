"""Sweeps: states, energies and mean times along a parameter against closed forms, and files."""

import numpy as np
import pytest

import vibrokit as vk
from tests.builders import PROVENANCE, assert_same, full_continuation
from tests.klein_kramers import double_well_rate
from vibrokit.cli import main
from vibrokit.errors import ParameterError, StructureError
from vibrokit.results.sweep import Prefactor, Sweep

DAMPING = (0.08, 0.1, 0.12)
D = 0.02


def empty():
    """A sweep without energies."""
    states = full_continuation()
    return Sweep(
        parameter=states.parameter, symbol=states.symbol, unit=states.unit, states=states,
        prefactors=(Prefactor("clear", 1.0, 2.0, 0.1),), **PROVENANCE,
    )  # fmt: skip


def test_each_branch_exists_within_the_values():
    one = empty()
    for span in one.coexistence:
        assert one.values[0] <= span.first <= span.last <= one.values[-1]
    assert [span.name for span in one.coexistence] == list(one.names)


def test_what_a_sweep_without_paths_cannot_say():
    one = empty()
    with pytest.raises(StructureError):
        one.energy("clear")
    with pytest.raises(StructureError):
        one.log_mean_time("nobody")
    with pytest.raises(ParameterError):
        one.plot(unit="furlong")
    one.plot()


def test_a_file_holds_it(tmp_path):
    one = empty()
    one.save(tmp_path / "sweep.nc")
    assert_same(one, vk.load_result(tmp_path / "sweep.nc"))


@pytest.mark.parametrize(
    "words",
    [
        ["frequency", "1", "2", "--count", "1"],
        ["frequency", "1Hz", "2"],
        ["frequency", "1mm", "2mm"],
        ["frequency", "one", "2"],
        ["barriers.0.position=x", "1", "2"],
        ["barriers.0.position=1,frequency=1", "1", "2"],
        ["frequenzy", "1", "2"],
    ],
)
def test_bad_words_on_the_command_line(words, capsys):
    assert main(["sweep", "hertz-0.570", *words]) == 2
    assert capsys.readouterr().err.startswith("vibrokit: ")


@pytest.fixture(scope="module")
def well():
    osc = vk.load_scene("double-well").replace({"noise.intensity": D})
    return vk.sweep(osc, "damping_ratio", DAMPING, search=DAMPING[::2], cells=(40, 40), starts=(8, 8))


@pytest.mark.slow
def test_energies_and_mean_times_of_a_double_well(well):
    """ΔU is ζ where damping is constant (detailed balance), and rates follow from the Klein–Kramers operator."""
    assert well.complete
    assert [(span.begins, span.ends) for span in well.coexistence] == [("goes on", "goes on")] * 2
    for name in ("left-rest", "right-rest"):
        np.testing.assert_allclose(well.energy(name), DAMPING, rtol=1e-8)
        log_time, error = well.log_mean_time(name)
        exact = [-double_well_rate(damping, D) for damping in DAMPING]
        # The prefactor is that of ΔU/D = 5, and the exact times are at ΔU/D from 4 to 6: it may vary as D does.
        assert np.all(np.abs(log_time - exact) < 2 * error + abs(np.log(np.array(DAMPING) / (5 * D))))


@pytest.mark.slow
def test_the_table_of_a_sweep_is_what_it_says(well, tmp_path):
    report = well.report()
    (table,) = [table for table in report.tables if table.name == "along"]
    assert len(table.rows) == 2 * len(DAMPING)
    assert float(table.rows[0][5]) == pytest.approx(DAMPING[0], rel=1e-7)
    stopped = vk.sweep(
        vk.load_scene("double-well"), "damping_ratio", DAMPING, cells=(40, 40), starts=(8, 8), time_limit=1e-3
    )
    assert not stopped.complete
