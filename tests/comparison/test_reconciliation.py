"""Reconciliation: planted errors, false alarms, every verdict, bad input, files."""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest
from scipy import stats

import vibrokit as vk
from tests.builders import (
    SCENE,
    assert_same,
    drop,
    energy,
    full_structure,
    put,
    rated_result,
    rewritten,
    say,
    section,
)  # fmt: skip
from vibrokit.cli import main
from vibrokit.comparison.pairs import Side, verdict_of
from vibrokit.comparison.quantities import Kind, Quantity
from vibrokit.comparison.tables import agreement_text
from vibrokit.comparison.verdicts import Agreement
from vibrokit.results.arrhenius import ArrheniusFit
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.mfet import MFETResult
from vibrokit.results.sgcm import SGCMResult

D = np.array([3e-5, 2e-5, 1.5e-5])
BARRIER = {(0, 1): 2e-4, (1, 0): 1.4e-4}
TWO = dataclasses.replace(
    section(), names=("clear", "hammering"), points=section().points[:2], labels=np.minimum(section().labels, 1)
)
ERRORS = {MFETResult: 0.05, SGCMResult: 0.02}


def log_times(drift=0.0):
    """ln τ = ln 30 + ΔU/D + drift · ln(1/D): slopes are ΔU + drift · D."""
    return {way: 3.4 + barrier / D - drift * np.log(D / 1e-5) for way, barrier in BARRIER.items()}


def least_action(shift=0.0, width=1e-6, **changes):
    found = tuple(
        energy(*way, value + shift, lower=value + shift - width, upper=value + shift + width)
        for way, value in BARRIER.items()
    )
    common = {"energies": found, "section": TWO, "scene": SCENE, "settings": {"analyzer": "least-action"}}
    return LeastActionResult(**(common | changes))


def rated(kind, times=None, width=2e-6, shift=0.0, **changes):
    """A result of MFET or SGCM with limits at the exact barriers, unless they are shifted."""
    limits = tuple(
        energy(*way, value + shift, lower=value + shift - width, upper=value + shift + width, method=kind.kind)
        for way, value in BARRIER.items()
    )
    made = {"section": TWO, "error": ERRORS[kind], "energies": limits} | changes
    return rated_result(kind, log_times() if times is None else times, D, **made)


def codes(*results, **options):
    return {verdict.code for verdict in vk.reconcile(*results, **options).verdicts}


def test_exact_results_agree_in_every_number():
    """Also of another noise intensity of the scene: each rate has its own."""
    quieter = {**SCENE, "noise": {**SCENE["noise"], "intensity": 1e-5}}
    found = vk.reconcile(least_action(), rated(SGCMResult, scene=quieter), rated(MFETResult))
    assert {v.code for v in found.verdicts} == {Agreement.AGREE}
    assert found.agreed
    assert found.methods == ("least-action", "sgcm", "mfet")
    assert found.exits == ((0, 1), (1, 0))
    assert {v.kind for v in found.verdicts} == {Kind.ENERGY, Kind.LOG_TIME, Kind.OCCUPANCY}
    slopes = [q.value for q in found.table("clear") if q.kind is Kind.SLOPE]
    np.testing.assert_allclose(slopes, BARRIER[0, 1])
    prefactors = [q.value for q in found.table("clear", "hammering") if q.kind is Kind.LOG_PREFACTOR]
    np.testing.assert_allclose(prefactors, 3.4)
    assert "least-action" in str(found)


# Errors that are planted, and none


@pytest.mark.parametrize(("shifted", "sign"), [(0, -1), (1, 1), (2, -1)])
def test_a_method_that_errs_by_four_combined_errors_is_found(shifted, sign):
    """In turn: the energies of least action, the mean times of SGCM, those of MFET. The others stay exact."""
    combined = float(np.hypot(0.05, 0.02))
    times = {way: one + sign * 4 * combined for way, one in log_times().items()}
    results = [least_action(), rated(SGCMResult), rated(MFETResult)]
    if shifted == 0:  # a limit of 2e-6 and bounds of 1e-6, as 1.96 standard errors each
        results[0] = least_action(shift=sign * 4 * float(np.hypot(1e-6, 2e-6)) / 1.96)
    else:
        results[shifted] = rated((SGCMResult, MFETResult)[shifted - 1], times)
    found = vk.reconcile(*results)
    wrong = [v for v in found.verdicts if v.code is Agreement.DISAGREE]
    method, kind = found.methods[shifted], Kind.LOG_TIME if shifted else Kind.ENERGY
    pairs = {(v.one, v.other, v.source) for v in wrong}
    assert {v.kind for v in wrong} == {kind}
    assert pairs == {
        (v.one, v.other, v.source) for v in found.verdicts if v.kind is kind and method in (v.one, v.other)
    }
    assert all(abs(v.deviation) == pytest.approx(4.0, rel=0.02) for v in wrong)
    assert all(v.statistic == pytest.approx(16 * v.terms, rel=0.05) for v in wrong)
    assert not found.agreed


@pytest.mark.parametrize(("sign", "method"), [(-1, SGCMResult), (1, MFETResult)])
def test_a_limit_that_errs_by_four_combined_errors_is_found(method, sign):
    shift = sign * 4 * float(np.hypot(1e-6, 2e-6)) / 1.96
    (first, second) = vk.reconcile(least_action(), rated(method, shift=shift)).verdicts
    assert {first.code, second.code} == {Agreement.DISAGREE}
    assert (first.less_certain, first.remedy) == (method.kind, method.refined_by)


def test_numbers_that_err_alone_are_found_too():
    """Values are shifted and the intervals beside them are not."""
    exact, shift = rated(MFETResult), 4 * float(np.hypot(0.05, 0.02))
    wrong = dataclasses.replace(exact, data=exact.data.assign(log_rate=exact.data["log_rate"] - shift))
    found = vk.reconcile(rated(SGCMResult), wrong)
    assert {v.code for v in found.verdicts if v.kind is Kind.LOG_TIME} == {Agreement.DISAGREE}
    energies = tuple(dataclasses.replace(one, value=one.value + 6e-6) for one in least_action().energies)
    found = vk.reconcile(least_action(energies=energies), rated(SGCMResult))
    assert {v.code for v in found.verdicts if v.kind is Kind.ENERGY} == {Agreement.DISAGREE}


def test_one_wrong_exit_among_several_is_the_one_named():
    times = log_times()
    times[1, 0] = times[1, 0] + [0.0, 0.0, 5 * 0.054]
    found = vk.reconcile(rated(SGCMResult), rated(MFETResult, times))
    (wrong,) = [v for v in found.verdicts if v.code is Agreement.DISAGREE and v.kind is Kind.LOG_TIME]
    assert (wrong.source, wrong.target, wrong.intensity) == (1, 0, D[-1])
    assert wrong.about(found.names) == "hammering → clear"


def check_alarms(verdicts):
    """Alarms of 200 independent verdicts are as many as the level says, and p values are uniform."""
    assert len(verdicts) == 200
    alarms = sum(verdict.code is not Agreement.AGREE for verdict in verdicts)
    assert alarms == sum(verdict.p_value < 0.01 for verdict in verdicts)
    for level in (0.01, 0.1, 0.5):
        low, high = stats.binom.interval(0.999, len(verdicts), level)
        assert low <= sum(verdict.p_value < level for verdict in verdicts) <= high


def side(method, kind, values, error):
    """Numbers that err by normal errors, as one method has them."""
    made = [
        Quantity(kind, 0, 1, method, d, value, value - 1.96 * error, value + 1.96 * error, "commitment")
        for d, value in zip(D, values, strict=True)
    ]
    return Side(method, *((made[0], ()) if kind is Kind.ENERGY else (None, tuple(made))), ("", ""), "")


@pytest.mark.parametrize(("kind", "sizes"), [(Kind.LOG_TIME, (0.05, 0.02)), (Kind.ENERGY, (2e-6, 1e-6))])
def test_false_alarms_come_as_often_as_the_level_says(kind, sizes):
    """Exact numbers with normal errors as stated, 200 times."""
    rng, exact = np.random.default_rng(2), np.full(3, 1e-4) if kind is Kind.ENERGY else log_times()[0, 1]
    check_alarms(
        [
            verdict_of(
                tuple(side(f"{n}", kind, exact + size * rng.standard_normal(3), size) for n, size in enumerate(sizes)),
                0, 1, 0.01,
            )
            for _ in range(200)
        ]
    )  # fmt: skip


@pytest.mark.long
def test_false_alarms_of_whole_results_come_as_often_as_the_level_says():
    """The same of results of MFET and SGCM, of energies, and of shares of time."""
    rng, found = np.random.default_rng(0), {kind: [] for kind in (Kind.LOG_TIME, Kind.ENERGY, Kind.OCCUPANCY)}
    for _ in range(200):
        results = []
        for kind, error in ERRORS.items():
            times = {way: one + error * rng.standard_normal(3) for way, one in log_times().items()}
            results.append(rated(kind, times, versions={}))
        energies = [least_action(shift=e * rng.standard_normal() / 1.96, width=e) for e in (1e-6, 2e-6)]
        for verdict in (*vk.reconcile(*results).verdicts, *vk.reconcile(*energies).verdicts):
            if verdict.source == 0:  # a state's share, and energies shifted together, are one trial each
                found[verdict.kind].append(verdict)
    for verdicts in found.values():
        check_alarms(verdicts)


# Each verdict


def test_slopes_that_drift_towards_the_energy():
    """A prefactor ∝ D^(−4): slopes ΔU + 4 D, so that the limit by a straight line misses ΔU."""
    shift = 4 * float(D[-2:].mean())
    found = vk.reconcile(least_action(), rated(SGCMResult, log_times(4.0), shift=shift, width=2e-5))
    for verdict in found.verdicts:
        assert verdict.code is Agreement.ARRHENIUS_NOT_REACHED
        assert (verdict.one, verdict.other) == ("least-action", "sgcm")
        assert verdict.first > verdict.last > verdict.energy == BARRIER[verdict.source, verdict.target]
        assert verdict.deviation < 0
    assert found.agreed


@pytest.mark.parametrize(("unit", "duration"), [(1.0, 1.0), (1e-7, 1e3)])
def test_a_density_whose_limit_misses_the_certified_energy(unit, duration):
    """A one-sided Hertz stop (ζ = 0.03, k = 40 at 0.4, 0.3 cos 1.35 t), leaving its hammering state.

    Times in periods at ΔU/D = 4, 7, 12, 20 from runs of SGCM and MFET, the density's limit, and the certified energy;
    also in other units.
    """
    certified, period = 0.119755 * unit, 2 * np.pi / 1.35 * duration
    known = {
        SGCMResult: ([5.40, 8.87, 14.62, 23.46], [0.03, 0.04, 0.11, 0.14]),
        MFETResult: ([5.33, 8.83, 14.62, 23.48], [0.05, 0.04, 0.05, 0.06]),
    }
    limit = energy(0, 1, 0.1323 * unit, lower=0.1237 * unit, upper=0.1410 * unit)
    results = [least_action(energies=(energy(0, 1, certified, lower=certified, upper=certified),))]
    for kind, (logs, errors) in known.items():
        times, error = {(0, 1): np.log(period) + logs}, np.array(errors)[:, None]
        results.append(
            rated_result(kind, times, certified / np.array([4, 7, 12, 20]), error, section=TWO, energies=(limit,))
        )
    first, second, third = vk.reconcile(*results).verdicts
    assert (first.code, second.code, third.code) == (
        Agreement.ARRHENIUS_NOT_REACHED,
        Agreement.ARRHENIUS_NOT_REACHED,
        Agreement.AGREE,
    )
    assert first.first > first.last > certified
    assert third.terms == 4


def test_an_interval_of_a_limit_holds_the_energy_or_its_slopes_drift():
    """Shifts between what is inside the interval and what the level finds."""
    for factor in (0.5, 1.1, 1.2, 1.5, 3.0):
        found = vk.reconcile(least_action(width=1e-8), rated(SGCMResult, log_times(2.0), shift=factor * 2e-6))
        assert all(v.code is not Agreement.AGREE for v in found.verdicts) == (factor > 1)


@pytest.mark.parametrize(
    ("drift", "options"),
    [
        (-4.0, {"shift": 7e-5}),  # the other way
        (1.0, {"shift": 4e-4, "error": 1e-3}),  # too small to reach the energy
    ],
)
def test_slopes_that_do_not_excuse_a_limit(drift, options):
    found = vk.reconcile(least_action(), rated(SGCMResult, log_times(drift), width=2e-5, **options))
    assert {v.code for v in found.verdicts} == {Agreement.DISAGREE}


@pytest.mark.parametrize("changes", [{"relaxation": 1e9}, {"held": 0.4}])
def test_states_that_are_not_metastable(changes):
    found = vk.reconcile(least_action(), rated(SGCMResult, **changes), rated(MFETResult))
    of_exits = [v for v in found.verdicts if v.kind is not Kind.OCCUPANCY]
    assert {v.code for v in of_exits if "sgcm" in (v.one, v.other)} == {Agreement.NOT_METASTABLE}
    assert {v.code for v in of_exits if "sgcm" not in (v.one, v.other)} == {Agreement.AGREE}
    one = next(v for v in of_exits if v.other == "sgcm")
    assert (one.relaxations < 10) == ("relaxation" in changes)
    assert (one.core_share < 0.5) == ("held" in changes)


def test_intensities_at_which_a_state_is_not_metastable_do_not_count():
    times = log_times()
    wrong = {way: one + np.array([1.0, 0.0, 0.0]) for way, one in times.items()}
    relaxation = float(np.exp(times[0, 1][0])) / 5  # left after 5 of them at the first D, after 140 at the second
    found = vk.reconcile(rated(SGCMResult, relaxation=relaxation), rated(MFETResult, wrong))
    (verdict,) = found.verdicts_of("clear")
    assert (verdict.code, verdict.terms) == (Agreement.AGREE, 2)


def test_events_that_differ():
    to = [{"exit": {"name": "leave-basin", "to": goal, "for_good": True}} for goal in (None, "hammering")]
    settings = [{"analyzer": "sgcm"} | to[0], {"analyzer": "mfet"} | to[1]]
    for changes, events in (
        (({}, {"event": "basin"}), ("commitment", "basin")),
        (({"settings": settings[0]}, {"settings": settings[1]}), ("leave-basin", "leave-basin, to = hammering")),
    ):
        found = vk.reconcile(rated(SGCMResult, **changes[0]), rated(MFETResult, **changes[1]))
        verdicts = [v for v in found.verdicts if v.kind is Kind.LOG_TIME]
        assert {v.code for v in verdicts} == {Agreement.EVENTS_DIFFER}
        assert {(v.event_one, v.event_other) for v in verdicts} == {events}
    found = vk.reconcile(least_action(), rated(MFETResult, event="basin"))
    assert {v.code for v in found.verdicts} == {Agreement.AGREE}  # energies are of the same exit


def test_errors_as_large_as_the_number_resolve_nothing():
    found = vk.reconcile(least_action(), rated(SGCMResult, error=3.0, width=9e-4), rated(MFETResult))
    of_exits = [v for v in found.verdicts if v.kind is not Kind.OCCUPANCY]
    assert {v.code for v in of_exits if "sgcm" in (v.one, v.other)} == {Agreement.UNDER_RESOLVED}
    assert {v.less_certain for v in of_exits if "sgcm" in (v.one, v.other)} == {"sgcm"}


def test_an_exit_that_one_method_does_not_know_is_under_resolved():
    times = {**log_times(), (0, -1): 20.0 + 3e-4 / D}
    found = vk.reconcile(rated(SGCMResult, times), rated(MFETResult))
    (verdict,) = found.verdicts_of("clear", "exit")
    assert (verdict.code, verdict.less_certain) == (Agreement.UNDER_RESOLVED, "mfet")
    assert found.exits == ((0, -1), (0, 1), (0, None), (1, 0))
    (leaving,) = found.verdicts_of("clear")
    assert leaving.code is Agreement.AGREE  # the third exit is so rare that it adds nothing


def test_no_common_intensity_leaves_the_energies():
    other = rated_result(
        MFETResult, {(0, 1): 3.4 + 2e-4 / (2.5 * D)}, 2.5 * D, section=TWO, energies=rated(MFETResult).energies
    )
    (verdict,) = vk.reconcile(rated(SGCMResult), other).verdicts_of("clear")
    assert (verdict.code, verdict.kind) == (Agreement.AGREE, Kind.ENERGY)


# Leaving at all


def test_rates_to_several_targets_are_added_for_leaving_at_all():
    times = {(0, 1): 3.0 + 2e-4 / D, (0, -1): 3.0 + 2e-4 / D}
    found = vk.reconcile(rated(SGCMResult, times), rated(MFETResult, times))
    known = [q for q in found.table("clear") if q.kind is Kind.LOG_TIME]
    np.testing.assert_allclose([q.value for q in known], np.tile(times[0, 1] - np.log(2), 2))
    errors = [q.error for q in known]  # halves of the rate with independent errors
    np.testing.assert_allclose(errors, np.repeat([0.02, 0.05], 3) / np.sqrt(2), rtol=1e-6)


# Files and bad input


def test_a_saved_one_comes_back_and_draws(tmp_path):
    found = vk.reconcile(least_action(), rated(SGCMResult), rated(MFETResult, event="basin", complete=False))
    found.save(tmp_path / "r.nc")
    again = vk.load_result(tmp_path / "r.nc")
    assert_same(found, again)
    assert str(found) == str(again)
    artists = again.plot()
    assert len(artists.points) == 4
    assert len(artists.lines) == 2
    x, y = artists.lines[0].get_data()
    assert (y[1] - y[0]) / (x[1] - x[0]) == pytest.approx(BARRIER[0, 1])


@pytest.mark.parametrize(
    "change",
    [
        say("settings", {}),
        say("settings", {"level": 0.01, "methods": [1]}),
        put("quantity_source", 0, 9),
        put("verdict_target", 0, 9),
        put("verdict_target", 0, -4),
        put("quantity_source", 0, -1),
        drop("verdict_code"),
        drop("quantity_value"),
    ],
)
def test_a_damaged_file_is_refused(change, tmp_path):
    path = tmp_path / "r.nc"
    vk.reconcile(least_action(), rated(SGCMResult)).save(path)
    path.write_bytes(rewritten(path.read_bytes(), change))
    with pytest.raises(vk.errors.ResultFileError):
        vk.load_result(path)


@pytest.mark.slow
def test_saved_results_are_compared_without_numba(tmp_path):
    for name, made in {"a.nc": least_action(), "b.nc": rated(SGCMResult), "c.nc": rated(MFETResult)}.items():
        made.save(tmp_path / name)
    code = (
        "import sys; from vibrokit.cli import main; "
        "status = main(['reconcile', 'a.nc', 'b.nc', 'c.nc', '-o', 'd.nc']); "
        "assert not {'numba', 'sympy', 'vibrokit.analyzers'} & set(sys.modules), 'imported'; sys.exit(status)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "All methods agree." in done.stdout
    assert vk.load_result(tmp_path / "d.nc").agreed


def test_the_command_line_gives_json_and_a_status(tmp_path, capsys):
    paths = [str(tmp_path / name) for name in ("a.nc", "b.nc")]
    least_action(shift=5e-5).save(paths[0])
    rated(SGCMResult).save(paths[1])
    assert main(["reconcile", *paths, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert {v["code"] for v in found["verdicts"]} == {"disagree"}
    assert not found["agreed"]
    assert main(["reconcile", paths[0]]) == 2
    assert main(["reconcile", *paths, "--level", "1"]) == 2


def test_what_was_not_compared_is_said():
    whole = vk.reconcile(least_action(), rated(MFETResult))
    assert agreement_text(whole) == "All methods agree."
    one = {(0, 1): log_times()[0, 1]}
    found = vk.reconcile(least_action(), rated(MFETResult, one, energies=(), complete=False))
    text = agreement_text(found)
    assert "All methods" not in text
    assert "hammering → clear by mfet" in text
    assert "Incomplete: mfet" in text


def test_two_intensities_do_not_contradict_an_energy():
    """hertz-0.570, hammering → clear by MFET at ΔU/D = 4 and 7; the slope is 0.001158, certified are 8.1709e-4."""
    certified = 8.1709e-4
    intensities = np.array([2.04272e-4, 1.16727e-4])
    fit = ArrheniusFit.of(
        [ExitRate(0, 1, d, -y, 0.048, "", "") for d, y in zip(intensities, (10.8318, 15.0836), strict=True)]
    )
    low, high = fit.interval
    assert fit.slope == pytest.approx(1.158e-3, rel=1e-3)
    limit = energy(0, 1, fit.slope, lower=max(low, 0.0), upper=high)
    exact = least_action(energies=(energy(0, 1, certified, lower=0.98 * certified, upper=certified),))
    times = {(0, 1): [10.8318, 15.0836]}
    slope = rated_result(MFETResult, times, intensities, 0.048, energies=(limit,), section=TWO)
    (verdict,) = vk.reconcile(exact, slope).verdicts
    assert (verdict.code, verdict.less_certain, verdict.remedy) == (
        Agreement.UNDER_RESOLVED, "mfet", "add noise intensities",
    )  # fmt: skip


def test_incomplete_results_are_used_as_far_as_they_go_and_a_second_one_has_a_number():
    half = {way: np.where(D > 2e-5, one, np.nan) for way, one in log_times().items()}
    found = vk.reconcile(rated(SGCMResult), rated(MFETResult, half, complete=False))
    (verdict,) = found.verdicts_of("clear")
    assert (verdict.code, verdict.terms) == (Agreement.AGREE, 1)
    assert not found.complete
    assert [one.values["method"] for one in found.found(vk.Code.USED_INCOMPLETE)] == ["mfet"]
    assert vk.reconcile(rated(MFETResult), rated(MFETResult)).methods == ("mfet", "mfet 2")


OTHER_SCENE = {**SCENE, "damping_ratio": 0.02}
MOVED = dataclasses.replace(TWO, points=(TWO.points[0] + 0.1, TWO.points[1]))
RENAMED = dataclasses.replace(TWO, names=("clear", "other"))


@pytest.mark.parametrize(
    ("results", "words"),
    [
        ((), "two results or more"),
        ((least_action(),), "two results or more"),
        ((least_action(), rated(SGCMResult, scene=OTHER_SCENE)), "damping_ratio"),
        ((least_action(), rated(SGCMResult, section=MOVED)), "clear"),
        ((least_action(), rated(SGCMResult, section=RENAMED)), "other"),
        ((least_action(), full_structure()), "energies or rates"),
        ((least_action(), 3.0), "energies or rates"),
        ((least_action(energies=least_action().energies[:1]), least_action(energies=least_action().energies[1:])),
         "no exit in common"),
        ((least_action(energies=()), least_action()), "no exit in common"),
    ],
)  # fmt: skip
def test_what_cannot_be_compared_is_refused(results, words):
    with pytest.raises(vk.errors.StructureError, match=words):
        vk.reconcile(*results)
    with pytest.raises(vk.errors.NoSuchFileError):
        vk.reconcile("none.nc", *results)


@pytest.mark.parametrize("level", [0, 1, -0.1, 2.0, float("nan"), "0.1", True, None])
def test_a_level_outside_0_and_1_is_refused(level):
    with pytest.raises(vk.errors.ParameterError, match="level"):
        vk.reconcile(least_action(), rated(SGCMResult), level=level)


def test_questions_about_exits_that_are_not_there():
    found = vk.reconcile(least_action(), rated(SGCMResult))
    with pytest.raises(vk.errors.StructureError, match="clear → hammering"):
        found.table("clear", "exit")
    with pytest.raises(vk.errors.StructureError, match="attractor"):
        found.table("elsewhere")
