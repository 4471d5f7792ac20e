"""Answers of an assessment against closed forms of a two-state process, and files."""

import dataclasses
import math
import subprocess
import sys

import numpy as np
import pytest

import vibrokit as vk
from tests.builders import PROVENANCE, assert_same, energy, full_structure, rated_result, section
from vibrokit.assessment.assessment import Assessment
from vibrokit.errors import ParameterError, StructureError
from vibrokit.progress import Stats
from vibrokit.report.assessment import assessment_text
from vibrokit.results.codes import Code
from vibrokit.results.energy import Bound
from vibrokit.results.finding import Finding
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.mfet import MFETResult
from vibrokit.results.one_scene import merged, part_of
from vibrokit.results.sgcm import SGCMResult

D = np.array([4e-5, 2e-5, 1.2e-5])
BARRIERS = {(0, 1): 8e-5, (1, 0): 2e-4}
PREFACTOR = 30.0
WHOLE = full_structure()
STRUCTURE = dataclasses.replace(
    WHOLE,
    attractors=WHOLE.attractors[:2],
    basins=dataclasses.replace(WHOLE.basins, labels=np.minimum(WHOLE.basins.labels, 1)),
    saddles=(),
    manifolds=(),
)
SECTION = dataclasses.replace(
    section(), names=STRUCTURE.names, points=section().points[:2], labels=np.minimum(section().labels, 1)
)
SCENE = {**PROVENANCE["scene"], "noise": {"name": "white", "intensity": 1.5e-5}}
PERIOD = 2 * math.pi


def exact(way, intensity):
    return PREFACTOR * math.exp(BARRIERS[way] / intensity)


def rated(kind=MFETResult, error=0.02, sources=(0, 1)):
    times = {way: math.log(PREFACTOR) + barrier / D for way, barrier in BARRIERS.items() if way[0] in sources}
    return rated_result(kind, times, D, error, section=SECTION, scene=SCENE, relaxation=1.0)


@pytest.fixture(scope="session")
def assessment():
    paths = tuple(energy(*way, value, lower=value, upper=value) for way, value in BARRIERS.items())
    least = LeastActionResult(
        energies=paths, section=SECTION, scene=SCENE, settings={"analyzer": "least-action"}, complete=True
    )
    results = {"least-action": least, "mfet": rated(), "sgcm": rated(SGCMResult, 0.1)}
    return Assessment(scene=SCENE, structure=STRUCTURE, results=results, settings={"accuracy": 0.1})


@pytest.mark.parametrize("intensity", [None, 4e-5, 1.3e-5, 6e-6, 1e-6])
def test_mean_times(assessment, intensity):
    for way in BARRIERS:
        found = assessment.mean_time(*way, intensity=intensity)
        assert found.log_value == pytest.approx(math.log(exact(way, intensity or 1.5e-5)), rel=1e-9)
        assert found.lower < found.value < found.upper or math.isinf(found.value)
        assert found.extrapolated == (found.intensity < D.min())
        assert found.methods == ("mfet",)
        assert found.metastable
        assert dataclasses.replace(assessment.mean_time(way[0], intensity=intensity), question="") == (
            dataclasses.replace(found, question="")
        )


def test_probability_of_leaving(assessment):
    found = assessment.probability_of_leaving(0, "1 h")
    assert found.value == pytest.approx(-math.expm1(-3600.0 / exact((0, 1), 1.5e-5)), rel=1e-6)
    assert 0 < found.lower < found.value < found.upper < 1
    rare = assessment.probability_of_leaving(1, 1.0, intensity=1e-6)
    assert rare.value == pytest.approx(1.0 / exact((1, 0), 1e-6), rel=1e-6)


def test_probability_of_leaving_by_target_is_never_above_the_share_of_the_target(assessment):
    """Rates k and 3k to two targets: k/(k + 3k) (1 − exp(−4kt))."""
    times = {(0, 1): np.full(3, math.log(4e4)), (0, -2): np.full(3, math.log(4e4 / 3))}
    result = rated_result(MFETResult, times, D, 0.02, section=SECTION, scene=SCENE, relaxation=1.0)
    one = dataclasses.replace(assessment, results={"mfet": result})
    for time in (100.0, 1e4, 1e6):
        found = [one.probability_of_leaving(0, time, target) for target in (1, "escape", None)]
        exact_ones = [share * -math.expm1(-time / 1e4) for share in (0.25, 0.75, 1.0)]
        assert [each.value for each in found] == pytest.approx(exact_ones, rel=1e-6)
        assert all(each.lower <= each.value <= each.upper <= 1 for each in found)


def test_nothing_is_sure_to_leave_before_it_has_relaxed(assessment):
    """An exit time that is shifted by up to ten relaxations and exponential after them is in the interval."""
    slow = dataclasses.replace(
        assessment,
        results={
            "mfet": dataclasses.replace(
                rated(), data=rated().data.assign(relaxation_time=lambda d: 60.0 * d.relaxation_time)
            )
        },
    )
    mean = slow.mean_time(0).value
    for time in (100.0, 600.0, 3000.0, 2e4, 1e5):
        found = slow.probability_of_leaving(0, time)
        for delay in (0.0, 300.0, 600.0):
            late = -math.expm1(-max(time - delay, 0.0) / (mean - delay))
            assert found.lower <= late <= found.upper
    assert slow.probability_of_leaving(0, 600.0).lower == 0.0
    assert slow.probability_of_leaving(0, "1 yr").lower == pytest.approx(1.0)


def test_allowed_intensity_is_the_inverse_of_the_mean_time(assessment):
    for wanted in ("8 h", "1 yr", "1000 yr"):
        found = assessment.allowed_intensity(0, wanted)
        assert assessment.mean_time(0, intensity=found.value).value == pytest.approx(
            {"8 h": 28800.0, "1 yr": 31557600.0, "1000 yr": 31557600.0e3}[wanted], rel=1e-6
        )
        assert found.lower < found.value < found.upper
        assert found.psd[0] == pytest.approx(2 * found.value)


@pytest.mark.parametrize(
    ("unit", "size", "said"),
    [("g_n^2/Hz", 9.80665**2, True), ("N^2/Hz", 1 / 4, True), ("(m/s^2)^2/Hz", 1.0, False)],
)
def test_allowed_intensity_is_also_in_the_unit_of_the_scene(assessment, unit, size, said):
    """The one-sided density is 2D; the mass of 2 kg divides forces."""
    given = {"noise.intensity": f"{3e-5 / size!r} {unit}"}
    found = dataclasses.replace(assessment, scene={**SCENE, "mass": 2.0, "given": given}).allowed_intensity(0, "1 yr")
    value, lower, upper = (2 * one / size for one in (found.value, found.lower, found.upper))
    assert found.number.endswith(f", which is {value:.3g} ({lower:.3g} to {upper:.3g}) {unit}") is said
    assert found.number.startswith(str(assessment.allowed_intensity(0, "1 yr").number))


def test_occupancies_balance_the_rates(assessment):
    for intensity in (4e-5, 1.5e-5, 8e-6):
        shares = assessment.occupancy(intensity=intensity)
        ways = [exact(way, intensity) for way in ((0, 1), (1, 0))]
        assert shares.values == pytest.approx(np.array(ways) / sum(ways), rel=1e-6)
        assert np.all(shares["lower"] <= shares)
        assert np.all(shares <= shares["upper"])


@pytest.mark.parametrize("slower", [10.0, 1e16])
def test_occupancies_until_a_rare_escape(assessment, slower):
    """Each state escapes so many times more rarely than it is left for the other one: at 10, in one of eleven cases."""
    ways = BARRIERS | {(0, -2): BARRIERS[0, 1], (1, -2): BARRIERS[1, 0]}
    times = {way: math.log(PREFACTOR) + b / D + math.log(slower) * (way[1] < 0) for way, b in ways.items()}
    result = rated_result(MFETResult, times, D, 0.02, section=SECTION, scene=SCENE, relaxation=1.0)
    leaky = dataclasses.replace(assessment, results={**assessment.results, "mfet": result, "sgcm": result})
    shares, exits = leaky.occupancy(intensity=2e-5), [1 / exact(way, 2e-5) for way in BARRIERS]
    chain = np.array([[-exits[0], exits[0]], [exits[1], -exits[1]]]) - np.diag(exits) / slower
    values, vectors = np.linalg.eig(chain.T)
    slowest = np.argmax(values)
    assert shares.values == pytest.approx(vectors[:, slowest] / vectors[:, slowest].sum(), rel=1e-6)
    assert float(shares["log_escape_time"]) == pytest.approx(math.log(slower / (shares.values @ exits)))
    assert "time before motion escapes" in assessment_text("leaky", leaky)
    assert vk.occupancies(result).sel(intensity=2e-5).values == pytest.approx(shares.values)
    assert (vk.occupancies(result)["log_escape_time"] < math.inf).all()


def test_methods_are_reconciled(assessment):
    assert assessment.reconciliation.agreed
    assert assessment.reconciliation.methods == ("least-action", "mfet", "sgcm")


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda a: a.mean_time("nowhere"), "no attractor"),
        (lambda a: a.mean_time(0, "escape"), "no exit rate"),
        (lambda a: a.mean_time(0, intensity=0.0), "positive"),
        (lambda a: a.mean_time(0, intensity="much"), "positive"),
        (lambda a: a.allowed_intensity(0, 0.1), "a period at least"),
        (lambda a: a.energy(0, "escape"), "no activation energy"),
    ],
)
def test_questions_without_an_answer(assessment, ask, words):
    with pytest.raises(StructureError, match=words):
        ask(assessment)


def test_durations_that_are_none(assessment):
    for ask in (assessment.probability_of_leaving, assessment.allowed_intensity):
        with pytest.raises(ParameterError):
            ask(0, "a while")


def test_without_energies_nothing_is_said_beyond_the_rates(assessment):
    alone = dataclasses.replace(assessment, results={"mfet": rated()})
    assert alone.mean_time(0).value > 0
    with pytest.raises(StructureError, match="no activation energy"):
        alone.mean_time(0, intensity=1e-6)


def test_files(assessment, tmp_path):
    path = tmp_path / "a.nc"
    assessment.save(path)
    again = vk.load_result(path)
    assert isinstance(again, Assessment)
    assert list(again.results) == list(assessment.results)
    assert_same(assessment.structure, again.structure)
    for name, one in assessment.results.items():
        assert type(again.results[name]) is type(one)
        assert again.results[name].rates == one.rates
    assert again.mean_time(0) == assessment.mean_time(0)
    code = (
        f"import sys, vibrokit as vk; a = vk.load_result({str(path)!r}); "
        "a.mean_time(0), a.reconciliation; repr(a); print('numba' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_results_of_different_attractors_are_merged():
    whole, parts = rated(), [rated(sources=(label,)) for label in (0, 1)]
    assert merged(parts).rates == whole.rates
    assert merged(parts[:1]) is parts[0]
    with pytest.raises(StructureError, match="same attractor"):
        merged([whole, parts[0]])
    with pytest.raises(StructureError, match="one analyzer"):
        merged([parts[0], rated(SGCMResult, sources=(1,))])


def test_parts_of_a_result_have_its_work_together():
    stats = Stats(trajectories=7, steps=1001, seconds={"density": 3.0, "graph": 1.0})
    whole = dataclasses.replace(rated(), stats=stats, seconds=5.0)
    again = merged([part_of(whole, label) for label in (0, 1)])
    assert (again.stats, again.seconds) == (stats, 5.0)
    more = dataclasses.replace(part_of(whole, 1), stats=Stats(trajectories=4, seconds={"splitting": 2.0}))
    found = merged([part_of(whole, 0), more]).stats
    assert (found.trajectories, found.steps) == (3 + 4, 500)
    assert found.seconds == {"density": 1.5, "graph": 0.5, "splitting": 2.0}


def test_a_state_is_left_by_the_least_of_its_energies_and_lasts_by_those_with_rates(assessment):
    """The strongest bounds are of each exit; an exit without rates does not say how mean times go on."""
    shallow = energy(0, -1, 1e-9, lower=0.0, upper=1e-9, bound=Bound.UPPER)
    loose = energy(0, 1, 7e-5, lower=0.0, upper=7e-5, bound=Bound.UPPER)
    paths = assessment.results["least-action"]
    paths = dataclasses.replace(paths, energies=(shallow, loose, *paths.energies))
    both = dataclasses.replace(assessment, results={**assessment.results, "least-action": paths})
    assert both.energy(0).value == 1e-9
    assert both.energy(0, 1).value == BARRIERS[0, 1]
    assert both.mean_time(0, intensity=8e-6).value == pytest.approx(exact((0, 1), 8e-6), rel=1e-6)


@pytest.mark.parametrize(("intensity", "words"), [(1e-5, "wider than its basin"), (2e-5, "not known")])
def test_a_state_that_noise_makes_wider_than_its_basin_has_no_time(assessment, intensity, words):
    found = Finding.of(Code.CORE_EXCEEDS_BASIN, 0, intensity=intensity, share=0.3)
    part = dataclasses.replace(rated(sources=(1,)), findings=(found,))
    one = dataclasses.replace(assessment, results={"mfet": part})
    assert words in one.lasting(0)[0]
    assert words in str(one.summary)
    assert "mfet" in one.lasting(1)[1]


def test_a_file_of_work_that_was_stopped_before_it_had_a_state(assessment, tmp_path):
    none = dataclasses.replace(
        STRUCTURE, attractors=(), basins=dataclasses.replace(STRUCTURE.basins, labels=0 * STRUCTURE.basins.labels - 1)
    )
    stopped = dataclasses.replace(assessment, structure=none, results={}, complete=False)
    stopped.save(tmp_path / "a.nc")
    again = vk.load_result(tmp_path / "a.nc")
    assert (again.names, again.complete, dict(again.results)) == ((), False, {})
