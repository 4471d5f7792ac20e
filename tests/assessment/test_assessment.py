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
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.merging import merged
from vibrokit.results.mfet import MFETResult
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


@pytest.fixture(scope="module")
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


def test_allowed_intensity_is_the_inverse_of_the_mean_time(assessment):
    for wanted in ("8 h", "1 yr", "1000 yr"):
        found = assessment.allowed_intensity(0, wanted)
        assert assessment.mean_time(0, intensity=found.value).value == pytest.approx(
            {"8 h": 28800.0, "1 yr": 31557600.0, "1000 yr": 31557600.0e3}[wanted], rel=1e-6
        )
        assert found.lower < found.value < found.upper
        assert found.psd[0] == pytest.approx(2 * found.value)


def test_occupancies_balance_the_rates(assessment):
    for intensity in (4e-5, 1.5e-5, 8e-6):
        shares = assessment.occupancy(intensity=intensity)
        ways = [exact(way, intensity) for way in ((0, 1), (1, 0))]
        assert shares.values == pytest.approx(np.array(ways) / sum(ways), rel=1e-6)
        assert np.all(shares["lower"] <= shares)
        assert np.all(shares <= shares["upper"])


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
