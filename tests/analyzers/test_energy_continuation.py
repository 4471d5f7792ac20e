"""Activation energies along a parameter, against closed forms."""

import dataclasses

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long
from vibrokit.analyzers import energy_run
from vibrokit.errors import ParameterError, ResultFileError, SceneError, StructureError
from vibrokit.results.codes import Code
from vibrokit.results.energy_continuation import EnergyBranch, EnergyContinuation, LeastPathChange
from vibrokit.scene_file import scene_data
from vibrokit.structure.parameter_values import parameter_line

QUICK = vk.LeastAction(graph=None, shooting=vk.Shooting(points=2000, rounds=6))
WELLS = vk.load_scene("double-well")


@pytest.fixture(scope="module")
def wells():
    return vk.energy_continuation(
        WELLS, "damping_ratio", [0.4, 0.05, 0.1, 0.2], analyzer=QUICK, search=[0.1]
    )  # fmt: skip


def test_the_wells_of_a_potential_cost_what_they_must_at_any_damping(wells):
    """ΔU = 4ζω_n times the barrier 1/4; both wells are followed, though they cost the same."""
    assert wells.names == ("left-rest → right-rest", "right-rest → left-rest")
    np.testing.assert_array_equal(wells.values, [0.05, 0.1, 0.2, 0.4])
    for branch in wells.branches:
        np.testing.assert_allclose(branch.action, wells.values, rtol=1e-7)
        np.testing.assert_allclose(branch.derivative, 1.0, rtol=1e-6)
        assert (np.abs(branch.action - wells.values) <= branch.error + 1e-9 * branch.action).all()
    np.testing.assert_array_equal(wells.energy("left-rest"), wells.branches[0].action)
    assert wells.changes("left-rest") == ()
    assert wells.complete
    assert wells.found(Code.ENERGY_BRANCHES)


@pytest.mark.slow
def test_the_cheapest_exit_changes_where_two_stops_are_equally_far():
    """Of a forced linear oscillator, ΔU = 2ζω_n³ (b ∓ f − A)² for stops at ±b under a force f: equal at f = 0."""
    amplitude, frequency, zeta = 0.1, 0.57, 0.1
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=zeta,
        barriers=(vk.Barrier(vk.Hertz(50.0), 0.5, "right"), vk.Barrier(vk.Hertz(50.0), -0.5, "left")),
        excitations=(vk.Harmonic(amplitude, frequency), vk.Constant(0.03)), noise=vk.WhiteNoise(1e-3),
    )  # fmt: skip
    analyzer = dataclasses.replace(QUICK, exit=vk.FirstContact())
    found = vk.energy_continuation(osc, "force", [-0.03, -0.01, 0.01, 0.03], analyzer=analyzer)
    response = amplitude / np.hypot(1 - frequency**2, 2 * zeta * frequency)
    exact = 2 * zeta * (0.5 - np.abs(found.values) - response) ** 2
    np.testing.assert_allclose(found.energy("clear", "exit"), exact, rtol=1e-6)
    force = found.values  # which the action depends on as a power of this degree
    degree = -2 * np.abs(force) / (0.5 - np.abs(force) - response)
    np.testing.assert_allclose(found.sensitivity("clear"), degree, rtol=1e-4)
    (change,) = found.changes("clear")
    assert change.value == pytest.approx(0, abs=1e-6)
    (finding,) = found.found(Code.LEAST_PATH_CHANGES)
    assert finding.values["value"] == change.value


@pytest.mark.long
def test_a_path_that_ends_is_said_to_end():
    """A constant force beyond 2/√27 leaves one well of −x²/2 + x⁴/4."""
    osc = WELLS.replace(excitations=(vk.Constant(0.3),))
    found = vk.energy_continuation(osc, "force", [0.3, 0.37, 0.4], analyzer=QUICK, search=[0.3])
    shallow = found.branches[found.names.index("left-rest → right-rest")]
    assert np.isfinite(shallow.action[:2]).all()
    assert np.isnan(shallow.action[2])
    lost = found.found(Code.PATH_LOST)
    assert lost
    assert all(0.37 <= finding.values["value"] <= 0.385 for finding in lost)


def test_values_at_which_the_scene_is_refused_are_gaps():
    """As with damping below 0; the first and the last value are searched at only if there is a scene."""
    found = vk.energy_continuation(WELLS, "damping_ratio", [-0.1, 0.1, 0.2], analyzer=QUICK)
    assert found.settings["search"] == [0.1, 0.2]
    for branch in found.branches:
        np.testing.assert_allclose(branch.action, [np.nan, 0.1, 0.2], rtol=1e-7)
    (gap,) = found.found(Code.NOTHING_AT)
    assert gap.values["value"] == -0.1
    assert not found.found(Code.PATH_LOST)


def test_states_have_the_names_and_the_places_that_are_given(monkeypatch):
    """Paths leave those states alone that are listed, and are searched for only where these exist."""
    osc = WELLS.replace(damping_ratio=0.1)
    structure = vk.find_structure(osc, starts=(8, 8), manifolds=False)
    monkeypatch.setattr(energy_run, "find_structure", None)
    line = parameter_line("test", WELLS, "damping_ratio")
    run = energy_run.EnergyRun(
        WELLS, line, np.array([0.05, 0.1, 0.2]), QUICK, None, 0,
        structure_at=lambda value: (structure, ("one", "other")), existing={"other": [1]},
    )  # fmt: skip
    run.run()
    (curve,) = run.curves
    assert run.places == [1]
    assert (curve.source, curve.target) == ("other", "one")
    assert [curve.action(place) for place in range(3)] == pytest.approx([0.05, 0.1, 0.2], rel=1e-7)


@pytest.mark.parametrize(
    ("existing", "known", "searched", "wanted"),
    [
        (range(9), {0, 1, 8}, [0, 8], [5]),  # the middle of 2 to 7
        (range(9), {0, 1, 8}, [0, 5, 8], [3]),  # 5 was in vain; then the middle of 2 to 4
        (range(9), {0, 1}, [0, 2, 8], []),  # searches at both ends were in vain
        (range(3, 6), set(), [0, 8], [4]),  # a state that exists between the searched values only
        (range(9), set(range(9)), [0, 8], []),
    ],
)
def test_where_an_energy_is_missing_is_searched_next(existing, known, searched, wanted):
    line = parameter_line("test", WELLS, "damping_ratio")
    run = energy_run.EnergyRun(WELLS, line, np.arange(1.0, 10.0), QUICK, None, 0, existing={"a": existing})
    run.places, run.curves = searched, [energy_run._Curve("a", "b", dict.fromkeys(known))]
    assert run._further() == wanted


def test_it_can_be_saved_and_reopened(wells, tmp_path):
    wells.save(tmp_path / "wells.nc")
    again = vk.load_result(tmp_path / "wells.nc")
    assert isinstance(again, EnergyContinuation)
    assert (again.names, again.parameter, again.settings) == (wells.names, wells.parameter, wells.settings)
    for old, new in zip(wells.branches, again.branches, strict=True):
        for name in ("action", "error", "derivative"):
            np.testing.assert_array_equal(getattr(old, name), getattr(new, name))
    assert len(again.plot().curves) == 2


def record(*actions):
    """A record of paths of one exit at 0, 1, 2, ….; slopes by differences."""
    branches = tuple(
        EnergyBranch("a", "b", np.array(each), np.zeros(len(each)), np.gradient(np.array(each))) for each in actions
    )
    values = np.arange(len(actions[0]), dtype=float)
    return EnergyContinuation(
        parameter="p", symbol="p", unit=None, values=values, branches=branches, scene=scene_data(WELLS)
    )


def test_lines_cross_where_they_must_and_gaps_are_no_crossings():
    assert record([1.0, 2.0, 3.0], [2.5, 2.25, 2.0]).changes("a") == (LeastPathChange(pytest.approx(1.2), 0, 1),)
    assert record([1.0, np.nan, np.nan], [2.0, 2.0, 2.0]).changes("a") == ()
    least = record([1.0, np.nan, 3.0], [np.nan, np.nan, 2.0]).energy("a")
    np.testing.assert_array_equal(least, [1.0, np.nan, 2.0])


@pytest.mark.parametrize(
    ("changed", "kind", "text"),
    [
        ({"parameter": "colour"}, ParameterError, "colour"),
        ({"values": []}, ParameterError, "one or more"),
        ({"values": [0.1, float("nan")]}, ParameterError, "finite"),
        ({"values": [0.1, 0.1]}, ParameterError, "more than once"),
        ({"values": [-0.2, -0.1]}, StructureError, "damping_ratio must be"),
        ({"search": [0.3]}, ParameterError, "0.3 is none of them"),
        ({"analyzer": vk.ActionPlot()}, StructureError, "must be a LeastAction"),
        ({"osc": 3}, SceneError, "must be an Oscillator"),
        ({"osc": WELLS.replace(noise=None)}, SceneError, "no noise"),
    ],
)
def test_what_is_refused(changed, kind, text):
    given = {"osc": WELLS, "parameter": "damping_ratio", "values": [0.1, 0.2], "analyzer": QUICK} | changed
    with pytest.raises(kind, match=text):
        vk.energy_continuation(given.pop("osc"), given.pop("parameter"), given.pop("values"), **given)


def test_a_record_of_no_exit_names_those_it_has(wells):
    with pytest.raises(StructureError, match="left-rest → right-rest"):
        wells.energy("clear")


def test_values_out_of_order_are_refused_on_opening(wells):
    dataset = wells.to_dataset()
    dataset["value"] = dataset["value"][::-1]
    with pytest.raises(ResultFileError, match="do not ascend"):
        EnergyContinuation.from_dataset(dataset, scene=wells.scene)


def test_a_time_limit_before_the_first_path_leaves_an_incomplete_record(tmp_path):
    found = vk.energy_continuation(WELLS, "damping_ratio", [0.1], analyzer=QUICK, time_limit=0.01)
    assert not found.complete
    assert found.branches == ()
    (stopped,) = found.found(Code.STOPPED)
    assert stopped.values["reason"] == "time limit"
    found.save(tmp_path / "c.nc")
    assert vk.load_result(tmp_path / "c.nc").branches == ()


@pytest.mark.slow
@pytest.mark.parametrize("stopped_in", [long("attractors"), "action plot"])
def test_an_interrupt_in_a_search_ends_the_work(stopped_in):
    """What is called keeps what it has and returns; nothing more may be searched for or followed after that."""
    begun = []

    def listener(update):
        begun.append(update.stage)
        if update.stage == stopped_in and begun.count("searched values") >= 1 and "exit paths" in begun:
            raise KeyboardInterrupt

    noise = vk.StateDependentNoise(1e-4, "1 + c*x**2", c=1e-13)  # with detailed balance there is no action plot
    wells = dataclasses.replace(WELLS, noise=noise)
    found = vk.energy_continuation(wells, "damping_ratio", [0.1, 0.2], analyzer=QUICK, search=[0.1], progress=listener)
    assert found.complete  # the stage is over before the first path is followed
    begun.clear()
    found = vk.energy_continuation(
        wells, "damping_ratio", [0.1, 0.4], analyzer=QUICK, search=[0.1, 0.4], progress=listener
    )
    assert not found.complete
    (stop,) = found.found(Code.STOPPED)
    assert stop.values["reason"] == "interrupt"
    assert [np.isfinite(branch.action).tolist() for branch in found.branches] == [[True, True]] * 2
