"""Sweeps: states, energies and mean times along a parameter against closed forms, and files."""

import dataclasses
import json
import math

import numpy as np
import pytest

import vibrokit as vk
from tests.builders import PROVENANCE, assert_same, full_continuation
from tests.klein_kramers import double_well_rate
from tests.scenes import scene
from vibrokit.assessment.sweep import among_others
from vibrokit.cli import main
from vibrokit.errors import ParameterError, StructureError
from vibrokit.report.data import sweep_data
from vibrokit.report.tables import along_table, coexistence_table, gap_table
from vibrokit.results.codes import Code
from vibrokit.results.continuation import Bifurcation, SteadyStates
from vibrokit.results.energy_continuation import EnergyBranch, EnergyContinuation
from vibrokit.results.finding import Finding
from vibrokit.results.sweep import Prefactor, Sweep

DAMPING = (0.08, 0.1, 0.12)
D = 0.02
SAMPLED = 0.5 * (math.pi / 256) ** 2  # of an amplitude: what samples of an orbit, 256 a period or more, may miss


def empty():
    """A sweep without energies."""
    states = full_continuation()
    return Sweep(
        parameter=states.parameter, symbol=states.symbol, unit=states.unit, states=states,
        prefactors=(Prefactor("clear", 1.0, 2.0, 0.1),), **PROVENANCE,
    )  # fmt: skip


def test_a_branch_exists_in_stretches_between_gaps():
    one = empty()
    found = [(span.name, span.first, span.begins, span.last, span.ends) for span in one.coexistence]
    low, gap, high = one.values
    assert found[0] == ("clear", low, "goes on", 1 / 3, "grazing")
    assert found[1] == ("clear", high, "nothing beyond", high, "goes on")
    assert found[2] == (one.names[1], low, "goes on", low, "nothing beyond")
    assert one.gaps == ((gap, "it diverged."),)


def along_contacts(depths, grazings, ends=()):
    """A sweep of one branch along 0, 1, 2, …: depths past both stops at each value; None without a state."""
    (one, *_) = full_continuation().states[0].attractors
    states = []
    for value, pair in enumerate(depths):
        found = [] if pair is None else [dataclasses.replace(one, peak_depth={"left": pair[0], "right": pair[1]})]
        states.append(SteadyStates(float(value), tuple(found), (0,) * len(found)))
    marks = [("grazing", value, side) for value, side in grazings] + [(kind, value, "") for value, kind in ends]
    made = dataclasses.replace(
        full_continuation(), states=tuple(states), branch_names=("one",),
        bifurcations=tuple(Bifurcation(kind, value, 0.0, 0, 1, np.zeros(2), side) for kind, value, side in marks),
    )  # fmt: skip
    return dataclasses.replace(empty(), states=made, scene={"barriers": [{"position": 1.0}, {"position": -1.0}]})


NONE, RIGHT, BOTH = (0.0, 0.0), (0.0, 0.1), (0.1, 0.1)


@pytest.mark.parametrize(
    ("swept", "rows"),
    [
        (along_contacts([NONE, BOTH], [(0.25, "left"), (0.25 + 1e-12, "right"), (0.75, "right")]),
         [(0, "goes on", 0.25, "grazing", ""), (0.25, "grazing", 1, "goes on", "left right")]),
        (along_contacts([NONE, BOTH, RIGHT], [(0.25, "right"), (0.5, "left"), (1.25, "left"), (1.5, "left")]),
         [(0, "goes on", 0.25, "grazing", ""), (0.25, "grazing", 0.5, "grazing", "right"),
          (0.5, "grazing", 1.5, "grazing", "left right"), (1.5, "grazing", 2, "goes on", "right")]),
        (along_contacts([RIGHT, NONE], []),
         [(0, "goes on", 0.5, "not located", "right"), (0.5, "not located", 1, "goes on", "")]),
        (along_contacts([NONE, NONE], [(0.25, "left"), (0.75, "left")]),
         [(0, "goes on", 0.25, "grazing", ""), (0.25, "grazing", 0.75, "grazing", "left"),
          (0.75, "grazing", 1, "goes on", "")]),
        (along_contacts([NONE, None], [(0.25, "left")], [(0.75, "fold")]),  # it touches before it ends
         [(0, "goes on", 0.25, "grazing", ""), (0.25, "grazing", 0.75, "fold", "left")]),
        (along_contacts([None, NONE], [(0.75, "left")], [(0.25, "fold")]),
         [(0.25, "fold", 0.75, "grazing", "left"), (0.75, "grazing", 1, "goes on", "")]),
        (along_contacts([NONE, None], [(0.25, "left")]), [(0, "goes on", 0.25, "grazing", "")]),
    ],
)  # fmt: skip
def test_a_branch_has_a_row_for_each_set_of_stops_that_it_touches(swept, rows):
    found = [(one.first, one.begins, one.last, one.ends, " ".join(one.touches)) for one in swept.coexistence]
    assert found == rows
    table = coexistence_table(swept)
    assert table.header[5] == "contact"
    said = {"": "clear of stops", "left": "touches left", "right": "touches right"}
    assert [row[5] for row in table.rows] == [said.get(row[4], "touches left and right") for row in rows]
    lines = [line for line in swept.plot().ax.lines if line.get_label().startswith("one from ")]
    scale = swept.axis()[1]
    np.testing.assert_allclose([line.get_xdata()[0] * scale for line in lines], [row[0] for row in rows[1:]])
    assert [line.get_label().split(": ")[1] for line in lines] == [row[5] for row in table.rows[1:]]


def with_paths(unit=None):
    """The same with an exit path that was lost after the first value, in a unit."""
    one = empty()
    nan = np.array([math.nan] * 3)
    branch = EnergyBranch(
        "clear", "exit", np.array([0.5, math.nan, math.nan]), nan, np.array([2.0, math.nan, math.nan])
    )
    lost = Finding.of(Code.PATH_LOST, 0, parameter="p", value=float(one.values[0]) + 0.05, next=0.5, reason="a fold.")
    paths = EnergyContinuation(
        parameter=one.parameter, symbol=one.symbol, unit=one.unit, values=one.values, branches=(branch,),
        **PROVENANCE | {"findings": (lost,)},
    )  # fmt: skip
    settings = {"unit": unit, "parameter": {"barriers.0.position": 1.0, "barriers.1.position": -2.0}}
    stops = {"barriers": [{"position": 9.0}, {"position": 9.0}, {"position": 0.4}], "noise": {"intensity": 0.25}}
    return dataclasses.replace(one, energies=paths, settings=settings, scene=stops)


def test_stops_move_along_gaps_and_a_lost_path_has_a_mark():
    one = with_paths("Hz")
    np.testing.assert_allclose(one.stops, [one.values, -2 * one.values, [0.4] * 3])
    np.testing.assert_array_equal(one.intensity, [0.25] * 3)
    artists = one.plot()
    hertz = one.values / (2 * math.pi)
    (mark,) = artists.lost
    np.testing.assert_allclose(mark.get_xydata(), [[hertz[0], 0.5]])
    stops = [line for line in artists.ax.lines if line.get_label() in ("stops", "_stop")]
    np.testing.assert_allclose([line.get_ydata() for line in stops], one.stops)  # in m, as such lengths are read
    np.testing.assert_allclose(artists.curves[0].get_xdata(), hertz)
    assert "(Hz)" in artists.axes[-1].get_xlabel()
    (strength,) = (line for line in artists.axes[2].lines if line.get_label() == "_D")
    np.testing.assert_array_equal(strength.get_ydata(), [0.25] * 3)


def test_values_where_other_states_coexist_than_where_exits_were_searched_for():
    """Two states at the first value, where the search was, and one at the last."""
    one = with_paths("Hz")
    (branch,) = one.energies.branches
    branch = dataclasses.replace(branch, action=np.array([0.5, math.nan, 0.7]))
    paths = dataclasses.replace(one.energies, branches=(branch,), settings={"search": [float(one.values[0])]})
    (finding,) = among_others(dataclasses.replace(one, energies=paths))
    assert finding.code is Code.OTHER_STATES
    assert finding.values["at"] == pytest.approx([0.75 / (2 * math.pi)])
    paths = dataclasses.replace(paths, settings={"search": one.values[[0, 2]].tolist()})
    assert not [*among_others(dataclasses.replace(one, energies=paths))]


def test_tables_are_in_the_unit_of_the_user():
    one = with_paths("Hz")
    hertz = one.values / (2 * math.pi)
    rows = along_table(one).rows
    assert float(rows[0][1]) == pytest.approx(hertz[0])
    assert float(rows[0][6]) == pytest.approx(one.values[0] * 2.0 / 0.5)  # the logarithmic derivative
    assert float(coexistence_table(one).rows[0][1]) == pytest.approx(hertz[0])
    assert gap_table(one).rows == ((f"{hertz[1]:.8g}", "it diverged."),)
    assert along_table(one).header[1] == "barriers.0.position = −barriers.1.position/2 (Hz)"


@pytest.mark.parametrize(
    ("text", "base", "unit", "size"),
    [("65 Hz", "rad s^-1", "Hz", 2 * math.pi), ("0.3 mm", "m", "mm", 1e-3), ("6 N", "m s^-2", "N", 1 / 0.35)],
)
def test_without_a_unit_of_its_own_it_is_shown_in_that_of_the_scene(text, base, unit, size):
    one = with_paths()
    given = {**one.scene, "mass": 0.35, "given": {one.parameter: text}}
    found = dataclasses.replace(one, unit=base, scene=given)
    label, scale = found.axis()
    assert label.endswith(f"({unit})")
    assert scale == pytest.approx(size, rel=1e-15)
    np.testing.assert_allclose(found.plot().curves[0].get_xdata(), one.values / size)
    assert dataclasses.replace(found, settings={**one.settings, "unit": "km"}).shown_in == "km"
    assert one.shown_in is None


def amplitude(frequency, zeta=0.1, force=0.1):
    """Of the linear response of tests.scenes.scene."""
    return force / np.hypot(1 - frequency**2, 2 * zeta * frequency)


def between_stops(gap=0.3, zeta=0.1, **more):
    stops = (vk.Barrier(vk.Hertz(50.0), gap, "right"), vk.Barrier(vk.Hertz(50.0), -gap, "left"))
    return scene(*stops, damping_ratio=zeta, excitations=(vk.Harmonic(0.1, 0.6),), **more)


@pytest.mark.slow
def test_linear_response_and_grazing_along_a_frequency_in_hertz():
    """The amplitude is that of the linear response, and grazing where it reaches the gap: a quadratic in ω²."""
    zeta, gap = 0.1, 0.3
    grazing = math.sqrt(1 - 2 * zeta**2 - math.sqrt((1 - 2 * zeta**2) ** 2 - 1 + (0.1 / gap) ** 2))
    hertz = np.array([0.11, 0.095, 0.14])
    found = vk.sweep(between_stops(gap), "frequency", hertz.tolist(), unit="Hz", starts=(4, 4))
    np.testing.assert_allclose(found.values, 2 * math.pi * np.sort(hertz), rtol=1e-15)
    low, high, push = found.along(found.names[0])
    np.testing.assert_allclose(high[:2], amplitude(found.values[:2]), rtol=SAMPLED)
    np.testing.assert_allclose(low[:2], -high[:2], rtol=SAMPLED)
    assert (push > 0).tolist() == [False, False, True]
    (touch, *_) = (one for one in found.states.bifurcations if one.kind == "grazing")
    assert touch.value == pytest.approx(grazing, rel=1e-8)
    clear, hits = (one for one in found.coexistence if one.name == "clear-and-hammering")
    assert clear.last == hits.first == pytest.approx(grazing, rel=1e-8)
    assert (clear.touches, hits.touches) == ((), ("left", "right"))
    said = [finding.values["value"] for finding in found.found(Code.BIFURCATION) if finding.values["kind"] == "grazing"]
    assert said[0] == pytest.approx(grazing / (2 * math.pi), rel=1e-8)
    assert found.energies is None


@pytest.mark.slow
def test_both_gaps_together_with_values_at_which_the_scene_is_refused():
    """Motion that is clear of the stops does not know the gap; it grazes where that is its amplitude."""
    tied = {"barriers.0.position": 1.0, "barriers.1.position": -1.0}
    gaps = [-10.0, 150.0, 200.0]
    found = vk.sweep(between_stops(), tied, gaps, unit="mm", starts=(4, 4))
    assert found.gaps[0][0] == pytest.approx(-0.01)
    assert [value for value, _ in found.gaps] == [found.values[0]]
    assert {span.begins for span in found.coexistence} == {"nothing beyond", "grazing"}
    (on,) = (span.name for span in found.coexistence if span.ends == "goes on")
    (clear,) = (span for span in found.coexistence if not span.touches)
    assert clear.first == pytest.approx(amplitude(0.6), rel=1e-8)
    (touch, *_) = (one for one in found.states.bifurcations if one.kind == "grazing")
    assert touch.value == pytest.approx(amplitude(0.6), rel=1e-8)
    np.testing.assert_allclose(found.along(on)[1][2], amplitude(0.6), rtol=SAMPLED)
    assert found.plot().ax.get_ylabel().endswith("(mm)")


def test_noise_changes_mean_times_only():
    """ΔU = 4ζω_n/4 at each level by detailed balance, and ln τ changes by ΔU of 1/D; D is half the spectral density."""
    osc = vk.load_scene("double-well").replace({"noise.intensity": D})
    zeta, levels = osc.damping_ratio, np.array([0.0, D, 2 * D, 4 * D])
    found = vk.sweep(osc, "intensity", levels.tolist(), unit="(m/s²)²/Hz", source="left", starts=(8, 8))
    np.testing.assert_allclose(found.intensity, levels / 2)
    np.testing.assert_allclose(found.energy("left-rest"), zeta, rtol=1e-8)
    np.testing.assert_array_equal(found.sensitivity("left-rest"), 0.0)
    time, error = found.log_mean_time("left-rest")
    assert math.isinf(time[0])
    np.testing.assert_allclose(np.diff(time[1:]), np.diff(2 * zeta / levels[1:]), rtol=1e-8)
    exact = [-double_well_rate(zeta, level / 2) for level in levels[1:]]
    assert np.all(np.abs(time[1:] - exact) < 2 * error[1:] + np.abs(np.log(zeta / (2.5 * levels[1:]))))
    assert len(found.prefactors) == 1  # one structure, one energy, one simulation
    assert len({id(states.attractors) for states in found.states.states}) == 1
    ((_, strong),) = ((one.source, one.values["ratio"]) for one in found.found(Code.NOISE_NOT_WEAK))
    assert strong == pytest.approx(zeta / (2 * D))


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"parameter": "frequenzy"}, "nearest is 'excitations.0.frequency'"),
        ({"parameter": {"barriers.0.position": 1, "frequency": 1}}, "tie parameters of one unit"),
        ({"unit": "mm"}, "allowed are units of rad s.-1, such as Hz or rad/s"),
        ({"unit": "furlong"}, "furlong"),
        ({"values": [0.5, 0.5]}, "more than once"),
        ({"values": []}, "one or more"),
        ({"values": [0.5, math.inf]}, "finite"),
        ({"values": ["0.5 Hz"]}, "finite numbers"),
    ],
)
def test_what_is_refused(changed, text):
    given = {"parameter": "frequency", "values": [0.5, 0.6]} | changed
    with pytest.raises(ParameterError, match=text):
        vk.sweep(between_stops(), given.pop("parameter"), given.pop("values"), **given)


def test_an_interrupt_leaves_the_states_and_a_file(tmp_path):
    def listener(update):
        if update.stage == "searched values":
            raise KeyboardInterrupt

    osc = between_stops(noise=vk.WhiteNoise(1e-4))
    found = vk.sweep(osc, "frequency", [0.6], starts=(4, 4), progress=listener)
    assert not found.complete
    assert found.names == ("clear",)
    (stop,) = found.found(Code.STOPPED)
    assert stop.values["reason"] == "interrupt"
    found.save(tmp_path / "sweep.nc")
    again = vk.load_result(tmp_path / "sweep.nc")
    np.testing.assert_allclose(again.along("clear")[1], amplitude(0.6), rtol=SAMPLED)


def test_a_sweep_without_paths_in_a_file_and_what_it_cannot_say(tmp_path):
    one = empty()
    one.save(tmp_path / "sweep.nc")
    assert_same(one, vk.load_result(tmp_path / "sweep.nc"))
    one.plot()
    for error, ask in (
        (StructureError, lambda: one.energy("clear")),
        (StructureError, lambda: one.energy("nobody")),
        (StructureError, lambda: one.log_mean_time("nobody")),
        (ParameterError, lambda: one.plot(unit="furlong")),
    ):
        with pytest.raises(error):
            ask()


@pytest.mark.parametrize(
    "words",
    [
        "frequency 1 2 --count 1", "frequency 1Hz 2", "frequency 1mm 2mm", "frequency one 2",
        "frequency 1Hz 2Hz --search 1", "barriers.0.position=x 1 2", "barriers.0.position=1,frequency=1 1 2",
        "frequenzy 1 2",
    ],
)  # fmt: skip
def test_bad_words_on_the_command_line(words, capsys):
    assert main(["sweep", "hertz-0.570", *words.split()]) == 2
    assert capsys.readouterr().err.startswith("vibrokit: ")


@pytest.mark.slow
def test_a_sweep_as_json(tmp_path, monkeypatch, capsys):
    """States along the frequency; without paths no energies."""
    monkeypatch.chdir(tmp_path)
    words = "sweep hertz-0.570 frequency 0.56 0.57 --count 2 --states-only --json -o s.nc"
    assert main(words.split()) == 0
    found, saved = json.loads(capsys.readouterr().out), vk.load_result("s.nc")
    assert found["values"] == [0.56, 0.57]
    assert [one["name"] for one in found["branches"]] == list(saved.names)
    assert [one["name"] for one in found["coexistence"]] == [one.name for one in saved.coexistence]
    (hammering,) = [one for one in found["branches"] if one["name"] == "hammering"]
    assert hammering["largest_x"] == saved.along("hammering")[1].tolist()
    assert "energy" not in hammering
    assert sorted(path.name for path in tmp_path.iterdir()) == ["s.nc"]  # no figure


@pytest.fixture(scope="module")
def well():
    osc = vk.load_scene("double-well").replace({"noise.intensity": D})
    return vk.sweep(osc, "damping_ratio", DAMPING, search=DAMPING[::2], starts=(8, 8))


@pytest.mark.slow
def test_energies_and_mean_times_of_a_double_well(well):
    """ΔU is ζ where damping is constant (detailed balance), and rates follow from the Klein–Kramers operator."""
    assert well.complete
    assert [(span.begins, span.ends) for span in well.coexistence] == [("goes on", "goes on")] * 2
    for name in ("left-rest", "right-rest"):
        np.testing.assert_allclose(well.energy(name), DAMPING, rtol=1e-8)
        np.testing.assert_array_equal(well.energy(name[:2]), well.energy(name))
        np.testing.assert_allclose(well.sensitivity(name), 1.0, rtol=1e-6)
        log_time, error = well.log_mean_time(name)
        exact = [-double_well_rate(damping, D) for damping in DAMPING]
        # The prefactor is that of ΔU/D = 5, and the exact times are at ΔU/D from 4 to 6: it may vary as D does.
        assert np.all(np.abs(log_time - exact) < 2 * error + abs(np.log(np.array(DAMPING) / (5 * D))))


@pytest.mark.slow
def test_energies_of_a_sweep_as_json(well):
    for branch in sweep_data(well)["branches"]:
        assert branch["energy"] == pytest.approx(DAMPING, rel=1e-8)
        assert branch["log_mean_time"] == well.log_mean_time(branch["name"])[0].tolist()


@pytest.mark.slow
def test_the_table_of_a_sweep_is_what_it_says(well, tmp_path):
    report = well.report()
    (table,) = [table for table in report.tables if table.name == "along"]
    assert len(table.rows) == 2 * len(DAMPING)
    assert float(table.rows[0][5]) == pytest.approx(DAMPING[0], rel=1e-7)
    stopped = vk.sweep(vk.load_scene("double-well"), "damping_ratio", DAMPING, starts=(8, 8), time_limit=1e-3)
    assert not stopped.complete
