"""Closed forms against integration, and units that are wrong."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.assessment.linear_response import linear_response
from vibrokit.assessment.oddities import OddityCode
from vibrokit.assessment.plausibility import Measure, contact_time, plausibility
from vibrokit.scene_file import bundled_scenes, scene_from_data

PUBLIC = Path(__file__).parents[1] / "benchmarks" / "public_cases.toml"


def stops(law, left, right):
    return vk.Barrier(law, right, "right"), vk.Barrier(law, left, "left")


TUBE = vk.Oscillator(  # mass 0.35 kg, 22 kN/m, 2 MN/m, 6 N at 65 Hz, 1e-3 N²/Hz
    natural_frequency=math.sqrt(22e3 / 0.35), damping_ratio=0.008,
    barriers=stops(vk.Linear(2e6 / 0.35), -2.5e-4, 2.5e-4),
    excitations=(vk.Harmonic(6 / 0.35, 2 * math.pi * 65),), noise=vk.WhiteNoise(1e-3 / 0.35**2 / 2),
)  # fmt: skip
BALL = vk.Oscillator(  # a steel ball of 33 g on a leaf spring between plates
    natural_frequency=2 * math.pi * 40, damping_ratio=0.05, barriers=stops(vk.Hertz(1.0e11 * 0.468), -1e-4, 1e-4),
    excitations=(vk.Harmonic(3.0, 2 * math.pi * 50),), noise=vk.WhiteNoise(2e-5),
)  # fmt: skip


def codes(osc):
    return {oddity.code for oddity in plausibility(osc).oddities}


def test_rows_of_the_tube_are_closed_forms():
    found, natural, zeta = plausibility(TUBE), TUBE.natural_frequency, 0.008
    w, force, gap, noise = 2 * math.pi * 65, 6 / 0.35, 2.5e-4, TUBE.noise.intensity
    amplitude = force / math.hypot(natural**2 - w**2, 2 * zeta * natural * w)
    assert found.oddities == ()
    for measure, subject, exact in (
        (Measure.NATURAL_HZ, "", natural / (2 * math.pi)),
        (Measure.QUALITY, "", 1 / (2 * zeta)),
        (Measure.DECAY_TIME, "", 1 / (zeta * natural)),
        (Measure.FREQUENCY_RATIO, "excitations.0", w / natural),
        (Measure.AMPLITUDE_OVER_GAP, "left", amplitude / gap),
        (Measure.NOISE_RMS, "", math.sqrt(noise / (4 * zeta * natural**3))),
        (Measure.CONTACT_TIME, "right", math.pi / math.sqrt(2e6 / 0.35)),
        (Measure.FIRST_CONTACT, "right", 2 * zeta * natural**3 * (gap - amplitude) ** 2),
        (Measure.PSD, "", 1e-3 / 0.35**2),
        (Measure.PSD_G, "", 1e-3 / 0.35**2 / 9.80665**2),
    ):
        assert found.value(measure, subject) == pytest.approx(exact, rel=1e-7), measure
    assert "NaN" not in str(found)
    assert "nan" not in str(found)


def test_the_tube_grazes_its_stops_where_its_amplitude_is_the_gap():
    """F/√((ω_n² − ω²)² + (2ζω_nω)²) = gap at 57.69 Hz."""
    for hz, touches in ((57.68, True), (57.70, False)):
        osc = TUBE.replace({"excitations.0.frequency": 2 * math.pi * hz})
        assert (plausibility(osc).value(Measure.AMPLITUDE_OVER_GAP, "right") > 1) is touches


def test_above_grazing_no_state_is_clear():
    """At F/√((ω_n² − ω²)² + (2ζω_nω)²) = gap the linear motion grazes; an offset rest has the nearer stop."""
    w, natural = 2 * math.pi * 65, TUBE.natural_frequency
    grazing = 2.5e-4 * math.hypot(natural**2 - w**2, 2 * 0.008 * natural * w)
    for ratio in (0.99, 1.0, 1.02, 7.3):
        changed = TUBE.replace({"excitations.0.amplitude": ratio * grazing})
        odd = [one for one in plausibility(changed).oddities if one.code is OddityCode.NO_CLEAR_STATE]
        assert [one.values["ratio"] for one in odd] == ([pytest.approx(ratio)] if ratio > 1.01 else [])
    assert "would be 7.3 times the gap" in str(odd[0])
    (moved,) = plausibility(changed.replace({"barriers.1.position": -5e-4})).oddities
    assert (moved.values["side"], moved.values["ratio"]) == ("right", pytest.approx(7.3))
    assert OddityCode.NO_CLEAR_STATE in codes(changed.replace(spring=vk.LinearSpring(natural**2)))


@pytest.mark.parametrize(
    "changes",
    [
        {"spring": vk.CubicSpring(TUBE.natural_frequency**2, 1.0)},  # nearly linear, and not certain
        {"damping_ratio": 0.0},  # free oscillations last, so that the forced one is not the only motion
        {"friction": vk.DryFriction(1e-9, 1e-3)},
        {"excitations": (vk.Harmonic(200.0, 408.0), vk.Harmonic(200.0, 408.0 * math.sqrt(2)))},  # no section
    ],
)
def test_where_the_linear_response_decides_nothing_it_says_nothing_of_clear_states(changes):
    forced = TUBE.replace({"excitations.0.amplitude": 200.0})
    assert OddityCode.NO_CLEAR_STATE in codes(forced)
    assert OddityCode.NO_CLEAR_STATE not in codes(forced.replace(**changes))


@pytest.mark.parametrize(("power", "law"), [(1.0, vk.Linear(40.0)), (1.5, vk.Hertz(40.0)), (2.0, None), (0.5, None)])
def test_contact_times_of_power_laws(power, law):
    """T = 2 (d/v) ∫₀¹ du/√(1 − u^(n+1)), d = ((n+1) v²/2k)^(1/(n+1))."""
    law = law or vk.CustomLaw("k*depth**n", k=40.0, n=power)
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, barriers=(vk.Barrier(law, 0.0, "left"),))
    for speed in (1e-6, 0.2, 1e3):
        depth = ((power + 1) * speed**2 / 80.0) ** (1 / (power + 1))
        shape = math.sqrt(math.pi) * math.gamma(1 + 1 / (power + 1)) / math.gamma(0.5 + 1 / (power + 1))
        assert contact_time(osc, 0, speed) == pytest.approx(2 * depth / speed * shape, rel=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize("law", [vk.Linear(1e5), vk.Hertz(1e6)])
def test_contact_times_are_those_of_integration(law):
    """A weak spring and no damping; the velocity changes its sign, and the mass is back at the stop."""
    osc = vk.Oscillator(natural_frequency=0.1, damping_ratio=0.0, barriers=(vk.Barrier(law, 0.0, "right"),))
    expected = contact_time(osc, 0, 0.5)
    path = osc.trajectory((0.0, 0.5), duration=expected, samples=10**5)
    assert abs(path.x[-1]) < 1e-3 * path.x.max()
    assert path.v[-1] == pytest.approx(-0.5, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spring", "tones"),
    [
        (None, (vk.Harmonic(0.1, 0.7, 0.3), vk.Harmonic(0.2, 1.4), vk.Constant(0.3))),
        (vk.CubicSpring(1.0, 1e-4), (vk.Harmonic(0.1, 0.5), vk.Constant(-0.2))),
        (vk.LinearSpring(4.0), (vk.Harmonic(0.1, 1.5),)),
    ],
)
def test_the_response_is_that_of_integration(spring, tones):
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, spring=spring, excitations=tones)
    found = linear_response(osc)
    path = osc.trajectory(osc.section_map([[0.0, 0.0]], periods=60)[0], periods=1, samples=2048)
    assert found.rest + found.right == pytest.approx(path.x.max(), rel=1e-4)
    assert found.rest - found.left == pytest.approx(path.x.min(), rel=1e-4)
    assert found.speed == pytest.approx(np.abs(path.v).max(), rel=1e-4)


def test_excitations_of_one_frequency_add_up():
    tones = (vk.Harmonic(0.3, 1.3), vk.Harmonic(0.1, 1.3))
    found = linear_response(vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=tones))
    assert found.right == pytest.approx(0.4 / math.hypot(1 - 1.3**2, 0.2 * 1.3), rel=1e-8)


@pytest.mark.parametrize(
    ("osc", "changes", "code"),
    [
        (TUBE, {"natural_frequency": TUBE.natural_frequency / (2 * math.pi)}, OddityCode.NATURAL_FREQUENCY_IN_HZ),
        (TUBE, {"excitations.0.frequency": 65.0}, OddityCode.FORCING_IN_HZ),
        (TUBE, {"damping_ratio": 0.8}, OddityCode.HEAVY_DAMPING),
        (TUBE, {"barriers.1.position": 2.5e-4}, OddityCode.MISSING_SIGN),
        (TUBE, {"barriers.0.position": 0.25, "barriers.1.position": -0.25}, OddityCode.AMPLITUDE_SMALL),
        (TUBE, {"excitations.0.amplitude": 6e3 / 0.35}, OddityCode.AMPLITUDE_LARGE),
        (TUBE, {"excitations.0.amplitude": 6e-3 / 0.35}, OddityCode.AMPLITUDE_SMALL),
        (TUBE, {"barriers.0.law.stiffness": 2e3 / 0.35}, OddityCode.STOP_SOFT),
        (TUBE, {"noise.intensity": TUBE.noise.intensity * 1e6}, OddityCode.NOISE_STRONG),
        (TUBE, {"noise.intensity": TUBE.noise.intensity * 1e-6}, OddityCode.NOISE_WEAK),
        (BALL, {"natural_frequency": 40.0}, OddityCode.NATURAL_FREQUENCY_IN_HZ),
        (BALL, {"excitations.0.frequency": 50.0}, OddityCode.FORCING_IN_HZ),
        (BALL, {"barriers.0.position": -1e-4, "barriers.1.position": -1.1e-4}, OddityCode.MISSING_SIGN),
        (BALL, {"excitations.0.frequency": 2 * math.pi * 5e4}, OddityCode.FREQUENCY_FAR),
        (BALL, {"barriers.0.law.stiffness": 1e17}, OddityCode.CONTACT_BRIEF),
    ],
)
def test_wrong_units_are_odd(osc, changes, code):
    assert codes(osc) == set()
    assert code in codes(osc.replace(changes))


def test_a_spring_that_bends_before_the_stop_has_no_linear_response_there():
    def found(position):
        stop = vk.Barrier(vk.Linear(50.0), position, "right")
        return plausibility(
            vk.Oscillator(
                natural_frequency=1.0, damping_ratio=0.1, spring=vk.CubicSpring(-1.0, 1.0), barriers=(stop,),
                excitations=(vk.Harmonic(0.01, 1.2), vk.Constant(-0.01)), noise=vk.WhiteNoise(1e-4),
            )
        )  # fmt: skip

    assert found(1.05).value(Measure.NATURAL_RAD) == pytest.approx(math.sqrt(2.0), rel=0.01)
    assert found(0.5).value(Measure.REST) == pytest.approx(-1.0, rel=0.01)  # the other well is behind the stop
    assert found(1.05).value(Measure.AMPLITUDE_OVER_GAP, "right") > 0
    assert math.isnan(found(3.0).value(Measure.AMPLITUDE_OVER_GAP, "right"))
    assert found(3.0).value(Measure.CONTACT_TIME, "right") > 0


def test_a_stop_that_the_constant_force_presses_on_is_preloaded():
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.1, barriers=(vk.Barrier(vk.Linear(50.0), 0.1, "right"),),
        excitations=(vk.Constant(0.3), vk.Harmonic(0.1, 0.8)),
    )  # fmt: skip
    assert OddityCode.PRELOADED in codes(osc)


def test_bundled_scenes_are_not_odd():
    assert {name: codes(vk.load_scene(name)) for name in bundled_scenes()} == {
        name: set() for name in bundled_scenes()
    }  # fmt: skip


@pytest.mark.long
def test_right_scenes_of_other_people_are_rarely_odd():
    """Of the 91, three are nearly overdamped, one is pressed on its stop, and one microscope's tip touches softly."""
    cases = tomllib.loads(PUBLIC.read_text())["cases"]
    scenes = {case["name"]: scene_from_data(case["scene"]) for case in cases if isinstance(case.get("scene"), dict)}
    odd = {name: found for name, osc in scenes.items() if (found := codes(osc))}
    assert odd == {
        "langevin double well": {OddityCode.HEAVY_DAMPING},
        "kramers double well": {OddityCode.HEAVY_DAMPING},
        "lift-off from a preloaded stop": {OddityCode.PRELOADED},
        "washboard 0.5 0.9": {OddityCode.HEAVY_DAMPING},
        "tapping-mode afm": {OddityCode.STOP_SOFT},
    }
