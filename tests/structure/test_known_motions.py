"""What is known in closed form is found: harmonic balances, linear responses, and attractors outside a region."""

import math

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long
from tests.scenes import scene
from vibrokit.results.codes import Code
from vibrokit.structure.known_motions import balances_of, known_motions
from vibrokit.structure.regions import search_region
from vibrokit.structure.scales import length_of


def beam(linear=1.0, cubic=-0.48, damping=0.009, force=0.007, frequency=0.84, unit=1.0):
    """The rotating cantilever of arXiv 2305.19459 by default; lengths in some unit (m)."""
    return scene(
        damping_ratio=damping / 2,
        spring=vk.CubicSpring(linear, cubic / unit**2),
        excitations=(vk.Harmonic(force * unit, frequency),),
    )


def tube(hertz=58.0, *more):
    """A heat-exchanger tube between two stops (SI units)."""
    stops = tuple(vk.Barrier(vk.Linear(5.714286e6), s * 0.25e-3, n) for s, n in ((1, "right"), (-1, "left")))
    return scene(
        *stops,
        natural_frequency=250.7133,
        damping_ratio=0.008,
        excitations=(vk.Harmonic(17.142857, 2 * math.pi * hertz), *more),
    )


SMALL = {"cells": (10, 10), "starts": (8, 8), "saddles": False}


@pytest.mark.parametrize(
    "given",
    [
        {},  # the force exceeds the least that keeps up the large motion in a window of 0.3 % of the amplitude
        {"unit": 1e-3},
        {"cubic": 0.3, "frequency": 1.3, "force": 0.0206},
        {"cubic": 0.3, "frequency": 1.3, "force": 0.4},
    ],
)
def test_all_balances_of_one_harmonic_are_found(given):
    """Cubes of the closed form A² [(α + ¾βA² − ω²)² + (cω)²] = F² (Nayfeh & Mook, section 4.1)."""
    osc = beam(**given)
    values = {"cubic": -0.48, "force": 0.007, "frequency": 0.84, "unit": 1.0} | given
    bend, detuning = 0.75 * values["cubic"], 1.0 - values["frequency"] ** 2
    squares = np.roots(
        [bend**2, 2 * bend * detuning, detuning**2 + (0.009 * values["frequency"]) ** 2, -(values["force"] ** 2)]
    )
    expected = sorted(np.sqrt(squares[np.abs(squares.imag) < 1e-12].real) * values["unit"])
    found = sorted(one.amplitude for one in balances_of(osc, length_of(osc)) if abs(one.centre) < 1e-9)
    assert len(expected) == 3
    assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("rest", [0.0, 0.1e-3])
def test_the_linear_response_to_all_tones_is_a_start(rest):
    tones = (vk.Harmonic(3.0, 4 * math.pi * 58.0, 0.7), vk.Constant(rest * 250.7133**2))
    osc = tube(58.0, *tones)
    response = rest + 0j
    speed = 0j
    for tone in (osc.excitations[0], tones[0]):
        wave = tone.amplitude * np.exp(1j * tone.phase)
        wave /= 250.7133**2 - tone.frequency**2 + 2j * 0.008 * 250.7133 * tone.frequency
        response, speed = response + wave, speed + 1j * tone.frequency * wave
    starts = known_motions(osc, search_region(osc), length_of(osc))[:, :2]
    away = np.abs(starts - [response.real, speed.real]) / [0.25e-3, 0.25e-3 * 364.0]
    assert away.max(axis=1).min() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("unit", [long(1.0), 1e-3])
def test_the_softening_beam_has_two_orbits_and_escape(unit):
    """Shooting: the large orbit of amplitude 0.898, its saddle, and the tops of the potential at ±1.443."""
    found = vk.find_structure(beam(unit=unit), cells=(100, 100), manifolds=False)
    large = found.attractor("large-oscillation")
    assert large.points[0] / unit == pytest.approx([-0.141174, 0.794914], abs=2e-6)
    assert np.abs(large.orbit[:, 0]).max() / unit == pytest.approx(0.898, abs=5e-4)
    assert found.attractor("small-oscillation").orbit[:, 0].max() / unit == pytest.approx(0.0238, abs=1e-4)
    (between,) = (one for one in found.saddles if set(one.leads_to) == {0, 1})
    assert between.points[0] / unit == pytest.approx([0.165394, 0.786383], abs=2e-6)
    tops = sorted(float(one.points[0, 0]) / unit for one in found.saddles if min(one.leads_to) < 0)
    assert tops == pytest.approx([-1.443, 1.443], abs=5e-3)
    assert found.region.x[0] / unit < -1.443 < 1.443 < found.region.x[1] / unit


@pytest.mark.long
def test_both_cycles_of_a_birhythmic_oscillator_are_in_the_default_region():
    """Averaging: 2.639 and 4.840 stable, 3.962 unstable (Yamapi, Filatrella et al., doi 10.1063/1.4766678)."""
    force = "x - mu*(1 - x**2 + al*x**4 - be*x**6)*v"
    osc = scene(damping_ratio=0.0, spring=vk.CustomSpring(force, mu=0.1, al=0.144, be=0.005))
    found = vk.find_structure(osc, cells=(50, 50), manifolds=False)
    assert [one.orbit[:, 0].max() for one in found.attractors] == pytest.approx([2.63902, 4.83953], rel=1e-3)
    assert found.saddles[0].points[0, 0] == pytest.approx(3.96164, rel=1e-3)
    assert sum(one.basin_fraction for one in found.attractors) == pytest.approx(1.0, abs=0.01)
    assert len(found.saddles[0].orbit) > 100


@pytest.mark.long
def test_the_quiet_state_of_a_tube_is_found():
    """At 58 Hz its amplitude is 0.2450 mm in a gap of 0.25 mm, and its basin is smaller than a cell of most grids."""
    found = vk.find_structure(tube(), cells=(50, 50), saddles=False)
    clear = found.attractor("clear")
    assert clear.orbit[:, 0].max() == pytest.approx(0.2450e-3, abs=1e-7)
    assert len(found.attractors) == 5


def test_an_attractor_outside_the_region_is_said():
    """Over the top at 3 motion comes to rest at 40."""
    osc = scene(damping_ratio=0.1, spring=vk.CustomSpring("x*(x - 3)*(x - 40)/120"))
    found = vk.find_structure(osc, region=((-1.0, 4.0), (-1.0, 1.0)), **SMALL)
    (small,) = found.found(Code.REGION_TOO_SMALL)
    assert small.values["count"] == 1
    assert small.values["x_max"] > 40.0
    wide = vk.find_structure(osc, **SMALL)
    assert sorted(round(float(one.points[0, 0]), 9) for one in wide.attractors) == [0.0, 40.0]
    assert not wide.found(Code.REGION_TOO_SMALL)


@pytest.mark.long
@pytest.mark.parametrize(
    ("law", "frequency"),
    [(vk.Linear(1e6), 0.8), (vk.Linear(1e6), 1.1), long(vk.Hertz(1e8), 0.9)],
)
def test_grazing_is_located_by_the_frequency_as_by_the_amplitude(law, frequency):
    """The clear orbit touches the stop at 1 where A² = (1 − ω²)² + (0.1 ω)², whatever the law."""
    amplitude = math.hypot(1 - frequency**2, 0.1 * frequency)
    osc = scene(vk.Barrier(law, 1.0, "right"), damping_ratio=0.05, excitations=(vk.Harmonic(amplitude, frequency),))
    for parameter, there in (("frequency", frequency), ("amplitude", amplitude)):
        values = there * (1 + 0.02 * np.array([-1.53, -0.61, 0.37, 1.33]))
        found = vk.continuation(osc, parameter, values, cells=(8, 8), starts=(6, 6))
        touches = [one.value for one in found.bifurcations if one.kind == "grazing"]
        assert min(abs(value - there) for value in touches) < 1e-12


@pytest.mark.slow
def test_a_structure_says_how_motion_without_an_attractor_ended():
    """Over the tops of the softening beam motion leaves for good; of an overdamped pendulum it ends at copies."""
    (beyond,) = vk.find_structure(beam(), cells=(30, 30), saddles=False).found(Code.FOLLOWED_ON)
    assert beyond.values["diverged"] == beyond.values["followed"] > 10
    steep = scene(damping_ratio=1.0, spring=vk.CustomSpring("2*sin(x)"), excitations=(vk.Constant(1.8),))
    found = vk.find_structure(steep, cells=(30, 30), saddles=False)
    (copies,) = found.found(Code.CELLS_AT_COPIES)
    assert copies.values["fraction"] > 0.1
    assert found.found(Code.FOLLOWED_ON) == ()
