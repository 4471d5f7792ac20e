"""A mass at rest: tops of potential barriers, and cells that motion cannot leave for want of energy."""

import math

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.codes import Code
from vibrokit.results.region import Region
from vibrokit.structure.basins.stop_cells import wells
from vibrokit.structure.rest import SteadyForce, tops_around

WEAK = (vk.Harmonic(0.007, 0.84),)


def sprung(spring, *, damping=0.02, forces=WEAK, stops=()):
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping, spring=spring, excitations=forces, barriers=stops
    )


def found_in(osc, **given):
    return vk.find_structure(osc, cells=(40, 40), rng=0, manifolds=False, saddles=False, **given)


@pytest.mark.parametrize("cubic", [-0.3, -0.01, -1e-5])
def test_a_region_contains_the_tops_of_a_softening_spring(cubic):
    """V = x²/2 − a x⁴/4 has its tops at ±1/√a, of height 1/(4a)."""
    osc, top = sprung(vk.CubicSpring(1.0, cubic), damping=0.0045), 1 / math.sqrt(-cubic)
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
    one_sided = found_in(sprung(vk.CustomSpring("x - x**2")))
    assert one_sided.region.x[0] < 0 < 1 < one_sided.region.x[1]
    two = found_in(sprung(vk.CustomSpring("x*(x - 1)*(x - 2)/2"), forces=(vk.Harmonic(1e-4, 0.84),)))
    assert [round(float(np.mean(each.orbit[:, 0]))) for each in two.attractors] in ([0, 2], [2, 0])


def test_stops_and_tops_are_both_reached():
    """A stop on one side leaves the top on the other; a soft stop moves its top outwards, and a stiff one hides it."""
    spring = vk.CubicSpring(1.0, -0.3)
    stops = vk.Barrier(vk.Linear(1e3), 0.5, "right"), vk.Barrier(vk.Linear(1e3), -0.5, "left")
    soft = tuple(vk.Barrier(vk.Linear(0.5), sign * 0.5, side) for sign, side in ((1, "right"), (-1, "left")))
    low, high = found_in(sprung(spring, stops=stops[:1])).region.x
    assert low < -1.826 < 0.5 < high < 0.7
    low, high = found_in(sprung(spring, stops=soft)).region.x
    assert low < -2.15 < 2.15 < high  # 0.3 x³ = x + 0.5 (x − 0.5) at 2.1476
    low, high = found_in(sprung(spring, stops=stops)).region.x
    assert -0.7 < low < -0.5 < 0.5 < high < 0.7


def test_a_region_that_leaves_out_a_top_says_so():
    structure = found_in(sprung(vk.CubicSpring(1.0, -0.3)), region=((-0.06, 0.06), (-0.06, 0.06)))
    places = [finding.values["place"] for finding in structure.found(Code.TOPS_OUTSIDE)]
    assert places == pytest.approx([-1 / math.sqrt(0.3), 1 / math.sqrt(0.3)], rel=1e-9)


def test_a_mass_needs_the_speed_of_the_potential_to_reach_a_place():
    assert SteadyForce(sprung(vk.CustomSpring("4*x"))).speed_to_reach(-1.0, 3.0) == pytest.approx(6.0, rel=1e-4)


def test_a_libration_is_recorded_where_its_points_are():
    """A pendulum that came to rest after turns is listed within its region, with its orbit."""
    structure = found_in(sprung(vk.CustomSpring("sin(x)"), forces=(vk.Harmonic(1e-3, 0.84),)))
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
    rests = places[1:][(force(places[:-1]) <= 0) & (force(places[1:]) > 0)]
    assert sorted(one.points[0, 0] for one in found.attractors) == pytest.approx(
        rests, abs=2e-6 * np.ptp(found.region.x)
    )


TINY = 1e-14  # friction that depends on x: too little to change the motion, enough that energy is not asked for

SCENES = {
    "double well": ("x**3 - x", 0.05, ()),
    "tilted": ("x**3 - x - 0.2", 0.02, ()),
    "three wells": ("x*(x**2 - 1)*(x**2 - 4)/4", 0.1, ()),
    "overdamped": ("x**3 - x", 2.0, ()),
    "escape": ("x - x**2", 0.05, ()),
    "both sides": ("x - x**3", 0.05, ()),
    "pendulum": ("sin(x)", 0.1, ()),
    "pressed": (
        "x**3 - x",
        0.05,
        (vk.Barrier(vk.Hertz(1e3), 0.9, "right"), vk.Barrier(vk.Linear(500.0), -0.8, "left")),
    ),
    "one well": ("x", 0.05, (vk.Barrier(vk.Hertz(100.0), 0.5, "right"),)),
}


def scene(name, friction=0.0):
    spring, damping, stops = SCENES[name]
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping, barriers=stops,
        spring=vk.CustomSpring(f"{spring} + c*sin(x)**2*v", c=friction),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "margin"), [(name, None) for name in SCENES] + [("double well", 2), ("escape", 2), ("pressed", 2)]
)
def test_basins_are_those_of_motion_that_is_followed(name, margin):
    quick, plain = scene(name), scene(name, TINY)
    assert quick.model.relaxes
    assert not plain.model.relaxes
    given = {"cells": (60, 60), "rng": 0, "manifolds": False}
    found, expected = vk.find_structure(quick, margin=margin, **given), vk.find_structure(plain, margin=None, **given)
    np.testing.assert_allclose(found.basins.region.bounds, expected.basins.region.bounds, rtol=1e-9)
    assert [a.points[0, 0] for a in found.attractors] == pytest.approx([a.points[0, 0] for a in expected.attractors])
    assert np.mean(found.basins.labels != expected.basins.labels) <= 1e-3  # cells on a boundary
    places = [sorted(round(float(saddle.points[0, 0]), 9) for saddle in each.saddles) for each in (found, expected)]
    assert places[0] == places[1]
    assert [saddle.leads_to for saddle in found.saddles] == [saddle.leads_to for saddle in expected.saddles]


def test_a_well_is_the_set_of_states_with_less_energy_than_its_barrier():
    osc = scene("double well")
    structure = vk.find_structure(osc, rng=0, manifolds=False)
    region = structure.basins.region
    cells = wells(osc, structure.attractors, region, (200, 200))
    x, v = np.moveaxis(region.cell_centres((200, 200)).reshape(200, 200, 2), -1, 0)
    energy = x**4 / 4 - x**2 / 2 + v**2 / 2
    assert np.all(energy[cells.labels != UNSETTLED] < 0)
    assert np.all(cells.labels[energy < -0.03] == (x[energy < -0.03] > 0))
    assert set(np.unique(cells.labels)) == {UNSETTLED, 0, 1}


def test_motion_that_gains_energy_has_no_wells():
    """Negative friction, forcing, friction that depends on x, and stops that dissipate."""
    region = Region((-2.0, 2.0), (-2.0, 2.0))
    for osc in (
        vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, spring=vk.CustomSpring("x - m*(1 - x**2)*v", m=0.3)),
        vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, spring=vk.CustomSpring("x - m*v", m=0.3)),
        vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, excitations=(vk.Harmonic(0.1, 0.7),)),
        vk.Oscillator(
            natural_frequency=1.0, damping_ratio=0.05,
            barriers=(vk.Barrier(vk.CustomLaw("k*depth*(1 + c*rate)", k=5.0, c=0.3), 0.5, "right"),),
        ),
    ):  # fmt: skip
        assert wells(osc, (), region) is None


def test_a_singular_force_ends_the_well():
    """A gap that closes at x = 1: states beyond it belong to no well."""
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.05, spring=vk.CustomSpring("x - b/(1 - x)**2", b=0.1)
    )  # fmt: skip
    structure = vk.find_structure(osc, rng=0, manifolds=False)
    cells = wells(osc, structure.attractors, Region((-1.0, 1.5), (-1.0, 1.0)), (100, 100))
    (rest,) = (place for place, a in enumerate(structure.attractors) if a.points[0, 0] < 0.5)
    x = np.linspace(-1.0, 1.5, 101)
    assert np.any(cells.labels == rest)
    assert np.all(cells.labels[x[1:] > 0.59] == UNSETTLED)  # the barrier is at 0.587
    wide = wells(osc, structure.attractors, Region((-1.0, 30.0), (-1.0, 1.0)), (400, 100))
    places = np.linspace(-1.0, 30.0, 401)
    assert np.all(wide.labels[(places[1:] > 0.59) & (places[:-1] < 1.0)] == UNSETTLED)
