"""Tops of potential barriers: default regions contain them, however weak the forces are."""

import math

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.results.codes import Code
from vibrokit.structure.rest import SteadyForce, tops_around

WEAK = (vk.Harmonic(0.007, 0.84),)


def scene(spring, *, damping=0.02, forces=WEAK, stops=()):
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping, spring=spring, excitations=forces, barriers=stops
    )


def found_in(osc, **given):
    return vk.find_structure(osc, cells=(40, 40), rng=0, manifolds=False, saddles=False, **given)


@pytest.mark.parametrize("cubic", [-0.3, -0.01, -1e-5])
def test_a_region_contains_the_tops_of_a_softening_spring(cubic):
    """V = x²/2 − a x⁴/4 has its tops at ±1/√a, of height 1/(4a)."""
    osc, top = scene(vk.CubicSpring(1.0, cubic), damping=0.0045), 1 / math.sqrt(-cubic)
    lower, upper = tops_around(osc, -0.02, 0.02, 0.02)
    assert (lower.place, upper.place) == pytest.approx((-top, top), rel=1e-9)
    assert (lower.speed, upper.speed) == pytest.approx(2 * [top / math.sqrt(2)], rel=1e-3)
    structure = found_in(osc)
    assert structure.region.x[0] < -top < top < structure.region.x[1]
    assert max(structure.region.v) > top / math.sqrt(2)
    # Beyond the tops motion is lost, and the well is a good third of the cells.
    assert structure.attractors[0].basin_fraction == pytest.approx(0.31, abs=0.05)
    assert not structure.found(Code.TOPS_OUTSIDE)


def test_a_well_with_one_top_and_a_well_beyond_a_top():
    one_sided = found_in(scene(vk.CustomSpring("x - x**2")))
    assert one_sided.region.x[0] < 0 < 1 < one_sided.region.x[1]
    wells = found_in(scene(vk.CustomSpring("x*(x - 1)*(x - 2)/2"), forces=(vk.Harmonic(1e-4, 0.84),)))
    assert [round(float(np.mean(each.orbit[:, 0]))) for each in wells.attractors] in ([0, 2], [2, 0])


def test_stops_and_tops_are_both_reached():
    """A stop on one side leaves the top on the other; a soft stop moves its top outwards, and a stiff one hides it."""
    spring = vk.CubicSpring(1.0, -0.3)
    stops = vk.Barrier(vk.Linear(1e3), 0.5, "right"), vk.Barrier(vk.Linear(1e3), -0.5, "left")
    soft = tuple(vk.Barrier(vk.Linear(0.5), sign * 0.5, side) for sign, side in ((1, "right"), (-1, "left")))
    low, high = found_in(scene(spring, stops=stops[:1])).region.x
    assert low < -1.826 < 0.5 < high < 0.7
    low, high = found_in(scene(spring, stops=soft)).region.x
    assert low < -2.15 < 2.15 < high  # 0.3 x³ = x + 0.5 (x − 0.5) at 2.1476
    low, high = found_in(scene(spring, stops=stops)).region.x
    assert -0.7 < low < -0.5 < 0.5 < high < 0.7


def test_a_region_that_leaves_out_a_top_says_so():
    structure = found_in(scene(vk.CubicSpring(1.0, -0.3)), region=((-0.06, 0.06), (-0.06, 0.06)))
    places = [finding.values["place"] for finding in structure.found(Code.TOPS_OUTSIDE)]
    assert places == pytest.approx([-1 / math.sqrt(0.3), 1 / math.sqrt(0.3)], rel=1e-9)


def test_a_mass_needs_the_speed_of_the_potential_to_reach_a_place():
    assert SteadyForce(scene(vk.CustomSpring("4*x"))).speed_to_reach(-1.0, 3.0) == pytest.approx(6.0, rel=1e-4)


def test_a_libration_is_recorded_where_its_points_are():
    """A pendulum that came to rest after turns is listed within its region, with its orbit."""
    structure = found_in(scene(vk.CustomSpring("sin(x)"), forces=(vk.Harmonic(1e-3, 0.84),)))
    (libration,) = structure.attractors
    np.testing.assert_allclose(libration.orbit[0], libration.points[0], atol=1e-9)
    assert np.abs(libration.orbit[:, 0]).max() < 0.01
    assert not structure.found(Code.TOPS_OUTSIDE)


@pytest.mark.parametrize(
    ("formula", "values", "force"),
    [
        ("x + a*sin(3*x)", {"a": 8.0}, lambda x: x + 8 * np.sin(3 * x)),  # the outermost wells are 0.13 wide
        pytest.param(
            "k*x + a*sin(n*x)",
            {"a": 8.0, "k": 1e3, "n": 3e3},
            lambda x: 1e3 * x + 8 * np.sin(3e3 * x),
            marks=pytest.mark.slow,
        ),
        pytest.param("x + 12*sin(4*x) - 1", {}, lambda x: x + 12 * np.sin(4 * x) - 1, marks=pytest.mark.slow),
    ],
)
def test_all_wells_of_the_region_that_tops_widen_are_found(formula, values, force):
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, spring=vk.CustomSpring(formula, **values))
    found = vk.find_structure(osc, rng=0, cells=(40, 40), saddles=False)
    places = np.linspace(*found.region.x, 1_000_003)
    wells = places[1:][(force(places[:-1]) <= 0) & (force(places[1:]) > 0)]
    assert sorted(one.points[0, 0] for one in found.attractors) == pytest.approx(
        wells, abs=2e-6 * np.ptp(found.region.x)
    )
