"""MFET: results, choices, bad input, checkpoints; physical numbers are in tests/physics/test_exit_times.py."""

import concurrent.futures as futures
import dataclasses
import math
import os
import signal
import subprocess
import sys
import textwrap
import threading

import distributed
import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import Coloured, double_well, scene
from vibrokit.analyzers.mfet import splitting
from vibrokit.analyzers.mfet.direct import Exits
from vibrokit.analyzers.mfet.measurement import exponential_p_value, mean_tests, rate_of
from vibrokit.errors import CheckpointError, FileError, SceneError, StructureError
from vibrokit.results.arrhenius import ArrheniusFit
from vibrokit.results.codes import Code
from vibrokit.results.exit_rate import ExitRate

WELL = scene(damping_ratio=0.2, spring=vk.CubicSpring(linear=-1.0, cubic=1.0), noise=vk.WhiteNoise(intensity=0.04))
QUICK = {"source": 0, "target_error": 0.1, "escapes": 8}


@pytest.fixture(scope="module")
def structure():
    return vk.find_structure(WELL, cells=(40, 40), manifolds=False, rng=0)


@pytest.fixture(scope="module")
def result(structure):
    return vk.MFET(intensities=(0.05, 0.04), **QUICK).run(WELL, structure)


def codes(found):
    return {finding.code for finding in found.findings}


def test_a_constant_amplitude_given_as_a_formula_is_white_noise(structure, result):
    """√D g dW with g = 2 is white noise of intensity 4 D; the two runs have different random numbers."""
    osc = dataclasses.replace(WELL, noise=vk.StateDependentNoise(0.01, "g", g=2.0))
    rate = vk.MFET(intensities=(0.01,), **QUICK).run(osc, structure).rates[0]
    (white,) = (one for one in result.rates if one.intensity == 0.04)
    assert rate.log_value == pytest.approx(white.log_value, abs=4 * math.hypot(rate.log_error, white.log_error))


# --- estimates against closed forms


def test_the_estimate_is_the_maximum_likelihood_one_where_all_have_left():
    exits = Exits(np.array([3, 5, 10]), np.array([1, 1, 1]), 18, 0)
    assert mean_tests(exits) == pytest.approx(6.0, rel=1e-15)


@pytest.mark.parametrize("delay", [0, 2000])
def test_mean_of_censored_times(delay):
    """Exponential times after a delay; of 200 samples, the mean is that of the law, as exact as 1/√n."""
    rng, mean, found = np.random.default_rng(4), 10_000, []
    for _ in range(200):
        times = np.sort(delay + np.ceil(rng.exponential(mean, 500))).astype(int)
        end = times[399]
        found.append(mean_tests(Exits(times[:400], np.zeros(400, int), int(np.minimum(times, end).sum()), 100)))
    spread = np.std(found) / np.mean(found)
    assert np.mean(found) == pytest.approx(mean + delay, abs=4 * np.std(found) / math.sqrt(200))
    assert spread < 1.25 / math.sqrt(400)


def test_intervals_cover_the_truth():
    """Of 1000 estimates from 12 exits, 95 % within three standard deviations of that number."""
    rng, covered = np.random.default_rng(8), 0
    for _ in range(1000):
        times = np.sort(np.ceil(rng.exponential(1e6, 15))).astype(int)
        rate = rate_of(Exits(times[:12], np.zeros(12, int), int(np.minimum(times, times[11]).sum()), 3), 12)
        covered += rate.log_lower <= -math.log(1e6) <= rate.log_upper
    assert covered >= 950 - 3 * math.sqrt(1000 * 0.95 * 0.05)


def test_no_exit_gives_a_bound():
    rate = rate_of(Exits(np.empty(0, int), np.empty(0, int), 1000, 5), 0)
    assert rate.log_value == -math.inf
    assert rate.log_upper == pytest.approx(math.log(-math.log(0.05) / 1000), rel=1e-12)  # the rule of three


def test_exponential_times_pass_and_others_fail():
    rng = np.random.default_rng(2)
    values = []
    for seed in range(300):
        times = np.sort(np.ceil(rng.exponential(1e4, 125))).astype(int)
        exits = Exits(times[:100], np.zeros(100, int), int(np.minimum(times, times[99]).sum()), 25)
        values.append(exponential_p_value(exits, seed))
    assert abs(np.mean(np.array(values) < 0.1) - 0.1) < 3 * math.sqrt(0.09 / 300)
    late = np.sort(np.ceil(1e4 + rng.exponential(1e4, 100))).astype(int)  # all need a while before they can leave
    assert exponential_p_value(Exits(late, np.zeros(100, int), int(late.sum()), 0), 0) > 1e-3
    even = np.sort(np.ceil(1e4 * rng.random(200))).astype(int)
    assert exponential_p_value(Exits(even, np.zeros(200, int), int(even.sum()), 0), 0) < 1e-6


def rates(log_times, errors, intensities):
    pairs = zip(intensities, log_times, errors, strict=True)
    return [ExitRate(0, 1, d, -y, e, "commitment", "direct") for d, y, e in pairs]


def test_fit_of_an_exact_law():
    d = np.array([0.05, 0.04, 0.02, 0.03])
    fit = ArrheniusFit.of(rates(2.0 + 0.3 / d, [0.1] * 4, d))
    assert (fit.slope, fit.log_prefactor) == pytest.approx((0.3, 2.0), rel=1e-12)
    assert not fit.drifts
    np.testing.assert_allclose(fit.local_slopes[0], 0.3, rtol=1e-12)
    design = np.column_stack([np.ones(4), 1 / np.sort(d)[::-1]]) / 0.1
    assert fit.slope_error == pytest.approx(math.sqrt(np.linalg.inv(design.T @ design)[1, 1]), rel=1e-9)
    with pytest.raises(StructureError, match="two noise intensities"):
        ArrheniusFit.of(rates([1.0], [0.1], [0.2]))


# --- a result


def test_rates_and_exit_times(result):
    assert [rate.intensity for rate in result.rates] == [0.05, 0.04]
    assert {(rate.source, rate.target, rate.event, rate.method) for rate in result.rates} == {
        (0, 1, "commitment", "direct")
    }
    times = result.exit_times(0, 0.05)
    assert len(times) >= 100
    assert (np.diff(times) >= 0).all()
    assert set(times["target"].values.tolist()) == {1}
    one = result.data.sel(source=0).isel(intensity_index=0)
    left_over = int(one["walkers_left_over"])
    assert float(one["time_at_risk"]) == pytest.approx(
        float(times.sum()) + left_over * float(times[-1]), rel=0.1
    )  # those that are left were watched to the end of the last round
    low, high = float(one["log_rate_lower"][0]), float(one["log_rate_upper"][0])
    assert low < result.rates[0].log_value < high


def test_escapes_end_in_the_other_core(result):
    found = result.escapes(0, 1, 0.05)
    assert found.sizes["escape"] == 8
    assert float(found["time"][-1]) == 0.0
    other = result.section.points[1][0, :2]
    ends = found.values[:, -1]
    deviations = np.sqrt(0.05 / (2 * 0.4) * np.array([0.5, 1.0]))  # of the linear motion around the other well
    assert (np.abs(ends - other) <= 1.1 * deviations).all()
    starts = found.values[:, 0]
    assert np.isfinite(starts).any()


@pytest.mark.slow
def test_the_way_to_a_bound_is_a_motion():
    """Tests of the exit are closer than the states that are kept: x changes by the mean of the velocities."""
    osc = scene(damping_ratio=0.2, noise=vk.WhiteNoise(intensity=0.05))
    alone = vk.find_structure(osc, region=((-1, 1), (-1, 1)), cells=(10, 10), manifolds=False)
    given = {"target_error": 0.2, "escapes": 3, "splitting": False, "intensities": (0.05,)}
    data = vk.MFET(exit=vk.LeaveBounds(x=(-0.4, 0.4)), **given).run(osc, alone).data.isel(source=0, intensity_index=0)
    x, v, times = (data[f"escape_{name}"].values for name in ("x", "v", "time"))
    steps = np.diff(x) - 0.5 * np.diff(times) * (v[:, 1:] + v[:, :-1])
    assert np.nanmax(np.abs(steps)) < 0.05 * np.nanmax(np.abs(x))
    assert (np.abs(x[:, -1]) > 0.4).all()


def test_a_saved_result_is_the_same(result, tmp_path):
    result.save(tmp_path / "exits.nc")
    again = vk.load_result(tmp_path / "exits.nc")
    assert again.rates == result.rates
    assert again.analyzer == result.analyzer
    assert again.data.identical(result.data)
    for draw in (again.plot, again.plot_rates, again.plot_slopes, again.plot_exit_times, again.plot_escapes):
        assert draw().ax is not None


def test_matrix_of_rates_and_occupancies(structure):
    both = vk.MFET(intensities=(0.05,), target_error=0.1, escapes=0).run(WELL, structure)
    matrix = np.exp(both.log_rates.sel(intensity=0.05).values)
    assert (np.diag(matrix) == 0).all()
    share = vk.occupancies(both).sel(intensity=0.05)
    assert float(share.sum()) == pytest.approx(1.0, rel=1e-12)
    assert float(share[0]) * matrix[0, 1] == pytest.approx(float(share[1]) * matrix[1, 0], rel=1e-12)
    assert float(share[0]) == pytest.approx(0.5, abs=4 * 0.5 * 0.5 * math.sqrt(2) * 0.1)  # by symmetry
    with pytest.raises(StructureError):
        vk.occupancies(vk.LeastAction())


@pytest.mark.slow
def test_where_no_excursion_leaves_there_is_no_rate(structure, monkeypatch):
    monkeypatch.setattr(splitting, "_LEVELS", 1)  # of about 70 that are needed
    found = vk.MFET(intensities=(0.01,), source=0, splitting=True, replicas=16, escapes=0).run(WELL, structure)
    assert found.rates == ()
    (finding,) = found.found(Code.NO_EXCURSION_LEFT)
    assert finding.values["replicas"] == 16
    assert not found.found(Code.SPLITTING_NOT_CONVERGED)


# --- the same bits


@pytest.mark.slow
@pytest.mark.parametrize(
    ("splitting", "pool"), [(False, futures.ThreadPoolExecutor), (True, futures.ProcessPoolExecutor)]
)
def test_any_executor_gives_the_same_bits(splitting, pool, structure):
    analyzer = vk.MFET(
        intensities=(0.05,), source=0, target_error=0.3, splitting=splitting, replicas=16, escapes=2, seed=5
    )
    alone = analyzer.run(WELL, structure)
    with pool(2) as executor:
        assert analyzer.run(WELL, structure, executor=executor).data.identical(alone.data)


@pytest.mark.long
def test_workers_of_dask_one_of_which_is_killed(structure):
    analyzer = vk.MFET(intensities=(0.022,), source=0, target_error=0.08, splitting=False, escapes=2)
    alone = analyzer.run(WELL, structure)
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        first, *_ = client.run(os.getpid).values()
        killer = threading.Timer(2.0, os.kill, (first, signal.SIGKILL))
        killer.start()
        found = analyzer.run(WELL, structure, executor=client.get_executor())
        killer.join()
        assert first not in client.run(os.getpid).values()
    assert found.data.identical(alone.data)


def test_the_seed_decides(structure, result):
    (other,) = vk.MFET(intensities=(0.05,), seed=1, **QUICK).run(WELL, structure).rates
    assert other.log_value != result.rates[0].log_value


# --- checkpoints

SCRIPT = """
    import sys
    import vibrokit as vk
    structure = vk.load_result(sys.argv[1])
    analyzer = vk.MFET(intensities=(0.05, 0.03), source=0, target_error=0.05, escapes=4)
    import vibrokit.analyzers.checkpoint as checkpoint
    checkpoint._PAUSE = 0.0  # so that there is something to resume from
    found = analyzer.run(structure.oscillator, structure, checkpoint=sys.argv[2])
    found.save(sys.argv[3])
"""


@pytest.mark.slow
@pytest.mark.long
def test_killed_at_any_moment_it_goes_on_with_the_same_bits(structure, tmp_path):
    """Killed at 3 moments, which also fall into writing; then it is resumed, and the result is that of no pause."""
    structure.save(tmp_path / "structure.nc")
    rng = np.random.default_rng(6)

    def run(checkpoint, target, seconds):
        given = [sys.executable, "-c", textwrap.dedent(SCRIPT), "structure.nc", checkpoint, target]
        process = subprocess.Popen(given, cwd=tmp_path)
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.wait()

    run("undisturbed.ckpt", "whole.nc", 300)
    whole = vk.load_result(tmp_path / "whole.nc")
    for seconds in rng.uniform(1.0, 6.0, 3):
        run("killed.ckpt", "resumed.nc", seconds)
        (tmp_path / "resumed.nc").unlink(missing_ok=True)
        if rng.random() < 0.2:
            (tmp_path / "killed.ckpt").unlink(missing_ok=True)
    run("killed.ckpt", "resumed.nc", 300)
    assert vk.load_result(tmp_path / "resumed.nc").data.identical(whole.data)


def test_a_resumed_run_repeats_nothing_and_other_checkpoints_are_refused(structure, tmp_path):
    place, analyzer = tmp_path / "work.ckpt", vk.MFET(intensities=(0.05,), **QUICK)
    first, again = (analyzer.run(WELL, structure, checkpoint=place) for _ in range(2))
    assert again.data.identical(first.data)
    assert again.stats.intervals < 0.5 * first.stats.intervals
    for other in (
        vk.MFET(intensities=(0.05,), seed=1, **QUICK), vk.MFET(intensities=(0.06,), **QUICK),
        vk.MFET(intensities=(0.05,), stepper=vk.RK4(512), **QUICK),
    ):  # fmt: skip
        with pytest.raises(CheckpointError, match="the setting "):
            other.run(WELL, structure, checkpoint=place)
    content = place.read_bytes()
    for damaged in (content[:-7], content[:40], b"", b"x" * 1000):
        place.write_bytes(damaged)
        with pytest.raises(CheckpointError):
            analyzer.run(WELL, structure, checkpoint=place)
    with pytest.raises(StructureError, match="checkpoint"):
        vk.ActionGraph().run(WELL, structure, checkpoint=tmp_path / "other.ckpt")
    with pytest.raises(FileError, match="folder"):
        vk.MFET(**QUICK).run(WELL, structure, checkpoint=tmp_path / "none" / "work.ckpt")


def test_a_checkpoint_that_cannot_be_written_costs_no_result(structure, tmp_path, monkeypatch):
    def full(path, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("vibrokit.analyzers.checkpoint.write_atomically", full)
    found = vk.MFET(intensities=(0.05,), **QUICK).run(WELL, structure, checkpoint=tmp_path / "work.ckpt")
    assert Code.CHECKPOINT_NOT_WRITTEN in codes(found)
    assert found.complete
    assert len(found.rates) == 1
    assert not list(tmp_path.iterdir())


# --- limits and bad input


def test_a_time_limit_before_the_first_exit_gives_a_bound(structure):
    found = vk.MFET(intensities=(0.004,), source=0, splitting=False).run(WELL, structure, time_limit=1.0)
    assert not found.complete
    assert found.rates == ()
    assert {Code.NO_EXIT_SEEN, Code.STOPPED} <= codes(found)


def test_noise_too_strong_for_a_metastable_state(structure):
    found = vk.MFET(intensities=(1.0,), **QUICK).run(WELL, structure)
    assert {Code.NOT_METASTABLE, Code.TARGET_NOT_METASTABLE} <= codes(found)


def test_steps_ten_times_too_long_are_noticed(structure):
    """Six steps in 2π: RK4 damps by as much as the damper."""
    found = vk.MFET(intensities=(0.05,), stepper=vk.RK4(6), **(QUICK | {"target_error": 0.05})).run(WELL, structure)
    assert Code.STEPS_CHANGE_RATE in codes(found)


@pytest.mark.parametrize(
    "settings",
    [
        {"intensities": (0.0,)}, {"intensities": ()}, {"intensities": (0.1, -0.1)}, {"intensities": "0.1"},
        {"target_error": 0.0}, {"target_error": 2.0}, {"target_error": True}, {"seed": -1}, {"seed": 1.5},
        {"splitting": 3}, {"escapes": -1}, {"replicas": 1}, {"from_orbit": "yes"},
    ],
)  # fmt: skip
def test_settings_that_are_refused(settings):
    with pytest.raises(StructureError, match="MFET"):
        vk.MFET(**settings)


def test_scenes_that_are_refused():
    quiet = scene(damping_ratio=0.2, spring=vk.CubicSpring(linear=-1.0, cubic=1.0), noise=vk.WhiteNoise(intensity=0.0))
    still = vk.find_structure(quiet, cells=(20, 20), manifolds=False, rng=0)
    with pytest.raises(StructureError, match="intensity 0"):
        vk.MFET().run(quiet, still)
    silent = dataclasses.replace(quiet, noise=None)
    with pytest.raises(SceneError):
        vk.MFET().run(silent, vk.find_structure(silent, cells=(20, 20), manifolds=False, rng=0))


@pytest.mark.long
def test_coloured_noise_of_short_correlation_acts_like_white_noise(structure):
    """The correlation time is 1/100 of the other times; what it changes in the rate is of that order."""
    slow = scene(damping_ratio=0.2, spring=vk.CubicSpring(linear=-1.0, cubic=1.0), noise=Coloured(0.05, 100.0))
    known = vk.find_structure(slow, cells=(20, 20), manifolds=False, rng=0)
    white = vk.MFET(intensities=(0.05,), **(QUICK | {"target_error": 0.05})).run(WELL, structure)
    coloured = vk.MFET(intensities=(0.05,), stepper=vk.RK4(1024), **QUICK).run(slow, known)
    (one,), (other,) = white.rates, coloured.rates
    assert abs(one.log_value - other.log_value) < 3 * math.hypot(one.log_error, other.log_error)


@pytest.mark.slow
def test_each_event_is_counted_apart():
    osc = double_well(noise=vk.WhiteNoise(intensity=2e-2))
    known = vk.find_structure(osc, cells=(100, 100), manifolds=False, rng=0)
    found = {
        good: vk.MFET(exit=vk.LeaveBasin(for_good=good), intensities=(2e-2,), **QUICK).run(osc, known)
        for good in (True, False)
    }
    (settled,), (crossed,) = found[True].rates, found[False].rates
    assert [settled.event, crossed.event] == ["commitment", "basin"]
    assert crossed.value > 1.2 * settled.value


@pytest.mark.long
def test_motion_on_a_third_attractor_goes_on():
    """Three wells: the time from side to side is that of the Markov chain with the rates between neighbours."""
    spring = vk.CustomSpring("x*(x**2 - 1)*(x**2 - 4)/8")
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.3, spring=spring, noise=vk.WhiteNoise(intensity=0.05))
    wells = vk.find_structure(osc, region=((-3, 3), (-3, 3)), cells=(60, 60), manifolds=False, rng=0)
    left, middle, right = (a.name for a in sorted(wells.attractors, key=lambda each: each.points[0, 0]))

    def rates(source, **to):
        given = {"intensities": (0.05,), "escapes": 0, "splitting": False}
        found = vk.MFET(source=source, exit=vk.LeaveBasin(**to), **given).run(osc, wells).rates
        return {rate.target: rate for rate in found}

    outer, inner = rates(left), rates(middle)
    direct = rates(left, to=right)
    assert list(direct) == [wells.attractor(right).label]
    expected = 2 / sum(rate.value for rate in outer.values()) + 2 / sum(rate.value for rate in inner.values())
    (rate,) = direct.values()
    assert abs(math.log(rate.mean_time / expected)) < 0.25  # five standard errors of the three together
    for refused in ({"exit": vk.LeaveBasin(to=right), "splitting": True}, {"exit": vk.LeaveBasin(to=left)}):
        found = vk.MFET(source=left, **refused).run(osc, wells)
        assert [finding.code for finding in found.findings] == [Code.SOURCE_FAILED]
    with pytest.raises(StructureError, match="no attractor"):
        vk.MFET(source=left, exit=vk.LeaveBasin(to="nowhere")).run(osc, wells)
