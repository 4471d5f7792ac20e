"""The road of an assessment: order of its stages, what is known, checkpoints, interrupts and arguments."""

import dataclasses
import math

import pytest

import vibrokit as vk
from tests.assessment.test_assessment import BARRIERS, SCENE, STRUCTURE, rated
from tests.builders import energy
from tests.klein_kramers import double_well_rate
from tests.layers import long
from vibrokit.analyzers.settings import settings_of
from vibrokit.assessment.road import barrier, ladder
from vibrokit.errors import ParameterError, SceneError, StructureError, UnknownNameError, VibrokitError
from vibrokit.progress import current
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.mfet import MFETResult
from vibrokit.results.section import Section
from vibrokit.results.sgcm import SGCMResult
from vibrokit.scene_file import scene_data, scene_from_data

OSC = scene_from_data(SCENE)
DATA = scene_data(OSC)
KNOWN = dataclasses.replace(STRUCTURE, scene=DATA, complete=True, findings=())
SECTION = Section.of(KNOWN)
PATHS, BOTH = ("least-action", None), [("mfet", 0), ("sgcm", 0), ("mfet", 1), ("sgcm", 1)]


def made(analyzer, kind=None, **changes):
    """What an analyzer would return, at once."""
    sources = (0, 1) if analyzer.source is None else (analyzer.source,)
    common = {"scene": DATA, "settings": settings_of(analyzer), "complete": True, **changes}
    if kind is None:
        known = [energy(*way, value, lower=value, upper=value) for way, value in BARRIERS.items() if way[0] in sources]
        return LeastActionResult(energies=tuple(known), section=SECTION, **common)
    return dataclasses.replace(rated(kind, sources=sources), findings=(), section=SECTION, **common)


@pytest.fixture
def calls(monkeypatch):
    """Which analyzers ran, with source and intensities; all return made-up results.

    One is stopped by Ctrl-C if its number is in `stop`, and is incomplete by itself if minus that number is.
    """
    ran = []

    def stub(name, kind):
        def run(self, osc, structure, **options):
            ran.append((name, self.source, getattr(self, "intensities", None)))
            if len(ran) in stop:
                current().wind_up()
            whole = not {len(ran), -len(ran)} & set(stop)
            return made(self, kind, complete=whole, seconds=0.0 if whole else options["time_limit"] or 0.0)

        return run

    stop = []
    for cls, name, kind in (
        (vk.LeastAction, "least-action", None), (vk.MFET, "mfet", MFETResult), (vk.SGCM, "sgcm", SGCMResult)
    ):  # fmt: skip
        monkeypatch.setattr(cls, "run", stub(name, kind))
    monkeypatch.setattr("vibrokit.assessment.road.find_structure", lambda osc, **options: KNOWN)
    return ran, stop


def which(ran):
    return [one[:2] for one in ran]


def test_paths_come_first_then_the_state_that_is_left_soonest_and_all_methods_share_a_ladder(calls):
    ran, _ = calls
    found = vk.assess(OSC, accuracy=0.1)
    assert found.complete
    assert which(ran) == [PATHS, *BOTH]
    ladders = {source: {one[2] for one in ran if one[1] == source} for source in (0, 1)}
    assert all(len(ladder) == 1 for ladder in ladders.values())
    assert OSC.noise.intensity in next(iter(ladders[0]))
    assert found.reconciliation.agreed


def test_what_is_known_is_taken(calls):
    ran, _ = calls
    known = made(vk.LeastAction()), made(vk.MFET(), MFETResult), made(vk.SGCM(source=1), SGCMResult)
    found = vk.assess(OSC, known=(*known, KNOWN))
    assert which(ran) == [("sgcm", 0)]
    assert found.complete
    assert found.results["mfet"].rates == known[1].rates
    assert {rate.source for rate in found.results["sgcm"].rates} == {0, 1}


def test_what_is_known_of_one_state_does_not_stand_for_all(calls):
    ran, _ = calls
    vk.assess(OSC, methods=["least-action"], known=[made(vk.LeastAction(source=0))])
    vk.assess(OSC, methods=["least-action"], source=1, known=[made(vk.LeastAction())])
    assert which(ran) == [PATHS]


def test_a_second_result_of_a_method_stands_beside_the_first(calls):
    first = made(vk.MFET(), MFETResult)
    other = dataclasses.replace(
        first, data=first.data.assign(rate_intensity=first.data["rate_intensity"] / 1.7), findings=()
    )
    found = vk.assess(OSC, known=[first, other, first])
    assert [name for name in found.results if name.startswith("mfet")] == ["mfet", "mfet 2"]


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, long(4)])
def test_an_assessment_that_was_stopped_goes_on(calls, tmp_path, number):
    ran, stop = calls
    path = tmp_path / "a.nc"
    stop.append(number)
    first = vk.assess(OSC, checkpoint=path, time_limit=None)
    assert not first.complete
    assert which(ran) == [PATHS, *BOTH][:number]
    stop.clear()
    ran.clear()
    second = vk.assess(OSC, checkpoint=path, time_limit=None)
    assert which(ran) == [PATHS, *BOTH][number - 1 :]
    assert second.complete
    ran.clear()
    third = vk.assess(OSC, known=[path])
    assert third.complete
    assert not ran
    assert sum(one.seconds for one in third.results.values()) == pytest.approx(
        sum(one.seconds for one in second.results.values())
    )
    vk.assess(OSC, known=[third], accuracy=0.05)
    assert which(ran) == [PATHS, *BOTH]


@pytest.mark.long
@pytest.mark.parametrize("number", [1, 5])
def test_an_incomplete_result_is_no_stop(calls, tmp_path, number):
    ran, stop = calls
    stop.append(-number)
    first = vk.assess(OSC, checkpoint=tmp_path / "a.nc", time_limit=None)
    assert which(ran) == [PATHS, *BOTH]
    assert not first.complete
    ran.clear()
    stop.clear()
    assert vk.assess(OSC, checkpoint=tmp_path / "a.nc").complete
    assert which(ran) == [[PATHS, *BOTH][number - 1]]


@pytest.mark.long
@pytest.mark.parametrize("number", [1, long(4)])
def test_a_finer_assessment_that_was_stopped_keeps_the_coarser_one(calls, tmp_path, number):
    ran, stop = calls
    path = tmp_path / "a.nc"
    vk.assess(OSC, accuracy=0.1, checkpoint=path)
    ran.clear()
    stop.append(number)
    finer = vk.assess(OSC, accuracy=0.05, checkpoint=path, time_limit=None)
    assert not finer.complete
    assert which(ran) == [PATHS, *BOTH][:number]
    stop.clear()
    ran.clear()
    assert vk.assess(OSC, accuracy=0.1, known=[path]).complete
    assert not ran
    again = vk.assess(OSC, accuracy=0.05, checkpoint=path)
    assert again.complete
    assert which(ran) == [PATHS, *BOTH][number - 1 :]


OTHER = scene_data(vk.load_scene("duffing"))
PATH = made(vk.LeastAction())


def elsewhere(**changes):
    return dataclasses.replace(PATH, section=dataclasses.replace(SECTION, **changes))


@pytest.mark.parametrize(
    ("known", "words"),
    [
        (made(vk.LeastAction(), scene=OTHER), "another scene"),
        (dataclasses.replace(KNOWN, scene=OTHER), "another scene"),
        (made(vk.LeastAction(exit=vk.FirstContact())), "other exits"),
        (elsewhere(names=("a", "b")), "has the attractors a, b"),
        (elsewhere(points=SECTION.points[::-1]), "elsewhere"),
        (3.0, "a structure, a result or an assessment"),
    ],
)
def test_what_is_known_of_something_else_is_refused(calls, known, words):
    with pytest.raises(StructureError, match=words):
        vk.assess(OSC, known=[known])
    assert not calls[0]


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"accuracy": 0.0}, ParameterError), ({"accuracy": 1}, ParameterError),
        ({"accuracy": math.nan}, ParameterError), ({"accuracy": "high"}, ParameterError),
        ({"methods": []}, ParameterError), ({"methods": "sgcm"}, ParameterError),
        ({"methods": ["sgmc"]}, UnknownNameError), ({"methods": 5}, ParameterError),
        ({"time_limit": 0}, StructureError),
        ({"accuracy": 10**400}, ParameterError), ({"source": 1.5}, ParameterError), ({"source": ""}, ParameterError),
        ({"source": True}, ParameterError), ({"rng": -1}, ParameterError), ({"rng": "a"}, ParameterError),
        ({"executor": "pool"}, StructureError), ({"known": 1}, StructureError), ({"known": None}, StructureError),
        ({"known": "no-such-file.nc"}, VibrokitError),
        ({"source": "nowhere"}, StructureError), ({"checkpoint": "no/such/folder/a.nc"}, VibrokitError),
        ({"exit": "leave-basin"}, StructureError),
    ],
)  # fmt: skip
def test_arguments_that_are_refused(calls, options, error):
    with pytest.raises(error):
        vk.assess(OSC, **options)
    assert not calls[0]


@pytest.mark.parametrize("record", [KNOWN, PATH])
def test_a_checkpoint_does_not_replace_another_record(calls, tmp_path, record):
    path = tmp_path / "kept.nc"
    record.save(path)
    with pytest.raises(StructureError, match="another file"):
        vk.assess(OSC, checkpoint=path)
    assert type(vk.load_result(path)) is type(record)
    assert vk.assess(OSC, known=path).complete


QUIET = [dataclasses.replace(OSC, noise=noise) for noise in (None, vk.WhiteNoise(0.0))]


@pytest.mark.parametrize("scene", [None, "hertz-0.570", 3, *QUIET])
def test_what_is_no_scene_or_has_no_noise_is_refused(calls, scene):
    with pytest.raises(SceneError, match="noise" if scene in QUIET else "Oscillator"):
        vk.assess(scene)


def test_a_single_state_is_kept_and_first_contact_is_offered(calls, monkeypatch, tmp_path):
    one = dataclasses.replace(
        KNOWN,
        attractors=KNOWN.attractors[:1],
        basins=dataclasses.replace(KNOWN.basins, labels=0 * KNOWN.basins.labels),
    )
    monkeypatch.setattr("vibrokit.assessment.road.find_structure", lambda osc, **options: one)
    with pytest.raises(StructureError, match="FirstContact"):
        vk.assess(OSC, checkpoint=tmp_path / "a.nc")
    assert vk.load_result(tmp_path / "a.nc").names == one.names


def test_what_a_share_of_the_time_did_not_suffice_for_is_run_again(calls):
    """Each of the made-up runs takes no time, so that all of it is left."""
    ran, stop = calls
    stop.append(-3)
    found = vk.assess(OSC, time_limit=1000.0)
    assert which(ran) == [PATHS, *BOTH, BOTH[1]]
    assert found.complete


@pytest.mark.parametrize(
    ("energies", "intensity", "decisive"),
    [
        ((3.5e-9, 6e-5), 2e-5, 6e-5),  # noise passes the first at once
        ((6e-5, 3.5e-9), 1e-9, 3.5e-9),
        ((3.5e-9, 2e-9), 2e-5, 2e-9),  # both at once: of weaker noise at least something is said
        ((9e-5,), 2e-5, 9e-5),
        ((), 2e-5, math.inf),
    ],
)
def test_an_exit_that_noise_passes_at_once_does_not_decide(energies, intensity, decisive):
    assert barrier(energies, intensity) == decisive


@pytest.mark.parametrize("unit", [1.0, 1e-6])
def test_the_ladder_has_the_noise_of_the_scene_where_it_is_in_range(unit):
    found = ladder(8e-5 * unit, 1e-5 * unit)
    assert 1e-5 * unit in found
    assert list(found) == sorted(found, reverse=True)
    assert 1e-9 * unit not in ladder(8e-5 * unit, 1e-9 * unit)


WELL = vk.Oscillator(
    natural_frequency=1.0, damping_ratio=0.2, spring=vk.CubicSpring(-1.0, 1.0), noise=vk.WhiteNoise(0.025)
)


@pytest.mark.long
def test_a_double_well_lasts_as_long_as_its_spectrum_says():
    """ΔU/D = 8, exact rate by the spectrum of the Klein–Kramers operator."""
    both = vk.assess(WELL, accuracy=0.3, time_limit=None, methods=["least-action", "sgcm"])
    found = vk.assess(WELL, accuracy=0.3, time_limit=None, source=0, known=[both])
    exact = -double_well_rate(0.2, 0.025)
    (simulated,) = (rate for rate in found.results["mfet"].rates if rate.intensity == 0.025)
    assert abs(-simulated.log_value - exact) < 3 * simulated.log_error
    for source in (0, 1):
        own = found.mean_time(source)
        assert own.log_lower < exact < own.log_upper
        assert found.energy(source).value == pytest.approx(0.2, rel=1e-6)
        allowed = found.allowed_intensity(source, math.exp(exact))
        assert allowed.lower < 0.025 < allowed.upper
    shares = found.occupancy()
    assert (shares["lower"] <= 0.5).all()
    assert (shares["upper"] >= 0.5).all()
    assert found.reconciliation.agreed
