"""Forces that repeat along x: running states, copies of attractors, and shares on the circle."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from tests.layers import long
from tests.scenes import scene
from tests.structure.stable import attractor
from vibrokit.results.basins import AT_COPY, ESCAPED
from vibrokit.results.codes import Code
from vibrokit.results.region import Region
from vibrokit.structure.along_x import turn_of
from vibrokit.structure.basins.landings import Landings, without_copies


def pendulum(*excitations, damping=0.1, force="sin(x)", **constants):
    return scene(damping_ratio=damping / 2, spring=vk.CustomSpring(force, **constants), excitations=excitations)


@pytest.mark.parametrize(
    ("force", "constants", "turn"),
    [
        ("sin(x)", {}, 2 * math.pi),
        ("sin(x)/b", {"b": 4.0}, 2 * math.pi),
        ("k*sin(a*x) + sin(2*a*x + 1)*v", {"k": 2.0, "a": 0.5}, 4 * math.pi),
        ("sin(x)**2", {}, math.pi),
        ("exp(cos(q*x))*sin(q*x)", {"q": 1e6}, 2e-6 * math.pi),
        ("x + sin(x)", {}, 0.0),
        ("sin(x)*x", {}, 0.0),
        ("sin(x) + sin(sqrt(2)*x)", {}, 0.0),
        ("sin(x**2)", {}, 0.0),
        ("x**3 - x", {}, 0.0),
    ],
)
def test_the_turn_of_a_force_is_recognised(force, constants, turn):
    assert turn_of(pendulum(force=force, **constants)) == pytest.approx(turn, rel=1e-12)


def test_between_stops_motion_does_not_turn_over():
    osc = pendulum()
    assert turn_of(osc.replace(barriers=(vk.Barrier(vk.Hertz(50.0), 0.5, "right"),))) == 0.0


def test_states_half_a_turn_to_either_side_are_copies():
    """Moved to the turn around x = 0, they lie at its two ends, up to rounding."""
    osc, region = pendulum(force="-sin(x)"), Region((-4.0, 4.0), (-1.0, 1.0))
    rests = [attractor((place, 0.0), "equilibrium") for place in (math.pi - 1e-9, 1e-9 - math.pi)]
    assert len(without_copies(osc, rests)) == 1
    landings = Landings(osc, rests, region, circle=True)
    assert landings.labels(np.array([0, 1]), np.array([0, 0])).tolist() == [0, 0]


@pytest.fixture(scope="module")
def driven():
    """The driven pendulum of bSTAB's first case (Stender & Hoffmann, Nonlinear Dyn. 107, 2022)."""
    rest = math.asin(0.5)
    region = ((rest - math.pi, rest + math.pi), (-10.0, 10.0))
    return vk.find_structure(pendulum(vk.Constant(0.5)), region=region, cells=(100, 100), manifolds=False)


@pytest.mark.long
def test_a_driven_pendulum_rests_or_runs(driven):
    running, rest = driven.attractors
    assert (running.name, running.turns, rest.name, rest.turns) == ("running", 1, "rest", 0)
    assert rest.basin_fraction == pytest.approx(0.152, abs=0.004 + 3 * rest.basin_fraction_error)
    assert running.basin_fraction + rest.basin_fraction == pytest.approx(1.0, abs=1e-3)
    assert driven.circle
    assert driven.shift == pytest.approx(2 * math.pi)
    (saddle,) = driven.saddles
    assert saddle.points[0] == pytest.approx([math.pi - math.asin(0.5), 0.0], abs=1e-12)
    assert set(saddle.leads_to) == {0, 1}


@pytest.mark.long
def test_a_running_state_balances_damping_and_drive(driven):
    """In one turn the drive does the work 2π·0.5, which damping 0.1 takes: 0.1 ∫ v dx."""
    x, v = driven.attractor("running").orbit.T
    assert x[-1] - x[0] == pytest.approx(2 * math.pi, abs=1e-9)
    assert np.trapezoid(v, x) == pytest.approx(2 * math.pi * 0.5 / 0.1, rel=1e-6)


@pytest.mark.long
def test_what_leaves_a_running_state_is_refused(driven):
    noisy = pendulum(vk.Constant(0.5)).replace(noise=vk.WhiteNoise(0.01))
    result = vk.ActionGraph(source="running", nodes=(32, 32)).run(noisy, driven)
    assert not result.energies
    assert any("turns over" in str(finding) for finding in result.findings)


@pytest.mark.long
def test_a_mirrored_pendulum_runs_the_other_way():
    found = vk.find_structure(
        pendulum(vk.Constant(-0.25), force="-sin(k*x)/k", k=2.0), cells=(40, 40), manifolds=False
    )  # fmt: skip
    assert {one.name: one.turns for one in found.attractors}.get("running") == -1
    assert np.ptp(found.region.x) == pytest.approx(math.pi)


@pytest.mark.slow
def test_without_running_states_copies_are_escape():
    """Strongly damped, motion over a barrier comes to rest in the next well."""
    osc = pendulum(vk.Constant(1.8), damping=2.0, force="sin(x)/b", b=0.5)
    found = vk.find_structure(osc, cells=(40, 40), manifolds=False)
    (rest,) = found.attractors
    assert rest.points[0, 0] == pytest.approx(math.asin(0.9))
    assert not found.circle
    assert ESCAPED in {label for saddle in found.saddles for label in saddle.leads_to}
    assert found.found(Code.SHIFTED_COPIES)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("push", "tone", "region"),
    [(0.5, 0.0, None), (-0.4, 0.0, ((-math.pi, math.pi), (-6.0, 6.0))), long(0.0, 0.3, None)],
    ids=["default region", "one turn", "forced"],
)
def test_motion_that_ends_at_a_copy_has_not_escaped(push, tone, region, tmp_path):
    """Damping 0.6 lets nothing turn over; where a motion comes to rest, to whole turns, is compared with SciPy."""
    tones = [vk.Harmonic(tone, 0.8)] if tone else [vk.Constant(push)]
    found = vk.find_structure(
        pendulum(*tones, damping=0.6), region=region, cells=(60, 60), starts=(8, 8), manifolds=False
    )  # fmt: skip
    (rest,), basins = found.attractors, found.basins
    assert basins.fraction(ESCAPED) == 0.0
    assert 0.2 < basins.fraction(AT_COPY) == pytest.approx(1.0 - rest.basin_fraction, abs=1e-12)
    assert not found.found(Code.CELLS_LEFT_REGION)
    assert found.found(Code.CELLS_AT_COPIES)[0].values["fraction"] == basins.fraction(AT_COPY)
    assert {ESCAPED, 0} == set(found.saddles[0].leads_to)
    found.save(tmp_path / "copies.nc")
    assert np.array_equal(vk.load_result(tmp_path / "copies.nc").basins.labels, basins.labels)

    def rates(t, y):
        return [y[1], -0.6 * y[1] - math.sin(y[0]) + push + tone * math.cos(0.8 * t)]

    duration = 12 * 2 * math.pi / 0.8
    places = np.random.default_rng(1).choice(basins.region.cell_centres((60, 60)), 40, replace=False)
    ends = [solve_ivp(rates, (0.0, duration), place, rtol=1e-8, atol=1e-8).y[0, -1] for place in places]
    turns = (np.array(ends) - rest.points[0, 0]) / (2 * math.pi)
    assert np.abs(turns - np.rint(turns)).max() < 1e-2
    agree = (np.rint(turns) == 0) == (basins.at(places) == 0)
    assert agree.sum() >= 39  # a cell on the boundary may have another label than its centre


@pytest.mark.slow
def test_copies_in_a_wide_region_are_told_apart():
    osc = pendulum(damping=0.4)
    found = vk.find_structure(osc, region=((-3 * math.pi, 3 * math.pi), (-2.0, 2.0)), cells=(60, 40), saddles=False)
    places = sorted(float(one.points[0, 0]) for one in found.attractors)
    assert places == pytest.approx([-2 * math.pi, 0.0, 2 * math.pi], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("turns", [long(-1), 0.5])
def test_a_libration_is_listed_in_the_turn_of_its_region(turns):
    """At x = −2.407661 by an independent integration, or whole turns away."""
    low = 2 * math.pi * turns - math.pi
    osc = pendulum(vk.Harmonic(1.66, 1.0), damping=0.2)
    found = vk.find_structure(
        osc, region=((low, low + 2 * math.pi), (-4.0, 4.0)), cells=(16, 16), starts=(10, 10), saddles=False
    )  # fmt: skip
    (librating,) = (float(one.points[0, 0]) for one in found.attractors if not one.turns)
    assert low < librating < low + 2 * math.pi
    assert math.remainder(librating + 2.407661, 2 * math.pi) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.long
def test_a_forced_pendulum_librates_or_rotates_either_way():
    osc = pendulum(vk.Harmonic(1.66, 1.0), damping=0.2)
    region = ((-math.pi, math.pi), (-4.0, 4.0))
    found = vk.find_structure(osc, region=region, cells=(100, 100), saddles=False)
    assert sorted(np.sign(one.turns) for one in found.attractors) == [-1, 0, 1]
    (librating,) = (one for one in found.attractors if not one.turns)
    assert librating.basin_fraction == pytest.approx(0.23, abs=0.02)
