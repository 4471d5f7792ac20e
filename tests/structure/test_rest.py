"""A mass at rest: tops of potential barriers, and cells that motion cannot leave for want of energy."""

import math

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long, slow
from tests.scenes import scene
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.codes import Code
from vibrokit.results.region import Region
from vibrokit.structure.basins.stop_cells import wells
from vibrokit.structure.rest import SteadyForce, tops_around

PUSHES = {"a": 0.0, "b": 0.0, "c": 0.0, "d": 0.0, "p": 0.0, "f": 0.0}


def polynomial(**values):
    """A spring with friction f sin²x v; all have one text, and share their kernels."""
    return vk.CustomSpring("a*x + b*x**2 + c*x**3 + d*x**5 - p + f*sin(x)**2*v", **PUSHES | values)


def shaken(spring, *, damping=0.02, force=0.007, stops=()):
    return scene(*stops, damping_ratio=damping, spring=spring, excitations=(vk.Harmonic(force, 0.84),))


def found_in(osc, **given):
    return vk.find_structure(osc, **{"cells": (40, 40), "rng": 0, "manifolds": False, "saddles": False} | given)


def stops(law, *sides):
    return tuple(vk.Barrier(law, 0.5 if side == "right" else -0.5, side) for side in sides or ("right", "left"))


@pytest.mark.parametrize("cubic", [slow(-0.01), long(-0.3), long(-1e-5)])
def test_a_region_contains_the_tops_of_a_softening_spring(cubic):
    """V = x²/2 − a x⁴/4 has its tops at ±1/√a, of height 1/(4a)."""
    osc, top = shaken(polynomial(a=1.0, c=cubic), damping=0.0045), 1 / math.sqrt(-cubic)
    lower, upper = tops_around(osc, -0.02, 0.02, 0.02)
    assert (lower.place, upper.place) == pytest.approx((-top, top), rel=1e-9)
    assert (lower.speed, upper.speed) == pytest.approx(2 * [top / math.sqrt(2)], rel=1e-3)
    structure = found_in(osc)
    assert structure.region.x[0] < -top < top < structure.region.x[1]
    assert max(structure.region.v) > top / math.sqrt(2)
    # Beyond the tops motion is lost, and the well is a good third of the cells.
    assert structure.attractors[0].basin_fraction == pytest.approx(0.31, abs=0.05)
    assert not structure.found(Code.TOPS_OUTSIDE)


@pytest.mark.long
def test_a_well_with_one_top_and_a_well_beyond_a_top():
    one_sided = found_in(shaken(polynomial(a=1.0, b=-1.0)))
    assert one_sided.region.x[0] < 0 < 1 < one_sided.region.x[1]
    two = found_in(shaken(polynomial(a=1.0, b=-1.5, c=0.5), force=1e-4))  # x (x − 1) (x − 2)/2
    assert [round(float(np.mean(each.orbit[:, 0]))) for each in two.attractors] in ([0, 2], [2, 0])


@pytest.mark.parametrize(
    ("barriers", "ordered"),
    [
        slow(stops(vk.Linear(1e3), "right"), lambda low, high: low < -1.826 < 0.5 < high < 0.7),  # the top on the left
        slow(stops(vk.Linear(0.5)), lambda low, high: low < -2.15 < 2.15 < high),  # 0.3 x³ = 1.5 x − 0.25 at 2.1476
        (stops(vk.Linear(1e3)), lambda low, high: -0.7 < low < -0.5 < 0.5 < high < 0.7),  # they hide the tops
    ],
    ids=["one stiff", "soft", "stiff"],
)
def test_stops_and_tops_are_both_reached(barriers, ordered):
    assert ordered(
        *found_in(shaken(polynomial(a=1.0, c=-0.3), stops=barriers), cells=(10, 10), starts=(12, 12)).region.x
    )


def test_a_region_that_leaves_out_a_top_says_so():
    structure = found_in(shaken(polynomial(a=1.0, c=-0.3)), region=((-0.06, 0.06), (-0.06, 0.06)))
    places = [finding.values["place"] for finding in structure.found(Code.TOPS_OUTSIDE)]
    assert places == pytest.approx([-1 / math.sqrt(0.3), 1 / math.sqrt(0.3)], rel=1e-9)


def test_a_mass_needs_the_speed_of_the_potential_to_reach_a_place():
    assert SteadyForce(shaken(polynomial(a=4.0))).speed_to_reach(-1.0, 3.0) == pytest.approx(6.0, rel=1e-4)


@pytest.mark.slow
def test_a_libration_is_recorded_where_its_points_are():
    """A pendulum that came to rest after turns is listed within its region, with its orbit."""
    structure = found_in(shaken(vk.CustomSpring("sin(x)"), force=1e-3), cells=(20, 20), starts=(12, 12))
    (libration,) = structure.attractors
    np.testing.assert_allclose(libration.orbit[0], libration.points[0], atol=1e-9)
    assert np.abs(libration.orbit[:, 0]).max() < 0.01
    assert not structure.found(Code.TOPS_OUTSIDE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("k", "a", "n", "push"),
    [
        long(1.0, 8.0, 3.0, 0.0),  # the outermost wells are 0.13 wide
        long(1e3, 8.0, 3e3, 0.0),
        (1.0, 12.0, 4.0, 1.0),
    ],
)
def test_all_wells_of_the_region_that_tops_widen_are_found(k, a, n, push):
    osc = scene(damping_ratio=0.1, spring=vk.CustomSpring("k*x + a*sin(n*x) - p", k=k, a=a, n=n, p=push))
    found = found_in(osc, cells=(20, 20))
    places = np.linspace(*found.region.x, 1_000_003)
    force = k * places + a * np.sin(n * places) - push
    rests = places[1:][(force[:-1] <= 0) & (force[1:] > 0)]
    assert sorted(one.points[0, 0] for one in found.attractors) == pytest.approx(
        rests, abs=2e-6 * np.ptp(found.region.x)
    )


WELL = {"a": -1.0, "c": 1.0}
SCENES = {  # the spring, its damping, stops
    "double well": (WELL, 0.05, ()),
    "tilted": (WELL | {"p": 0.2}, 0.05, ()),
    "three wells": ({"a": 1.0, "c": -1.25, "d": 0.25}, 0.1, ()),  # x (x² − 1) (x² − 4)/4
    "overdamped": (WELL, 2.0, ()),
    "escape": ({"a": 1.0, "b": -1.0}, 0.05, ()),
    "both sides": ({"a": 1.0, "c": -1.0}, 0.05, ()),
    "pendulum": (None, 0.1, ()),
    "pressed": (WELL, 0.05, (vk.Barrier(vk.Hertz(1e3), 0.9, "right"), vk.Barrier(vk.Linear(500.0), -0.8, "left"))),
    "one well": ({"a": 1.0}, 0.05, (vk.Barrier(vk.Hertz(100.0), 0.5, "right"),)),
}


def relaxing(name, friction=0.0):
    """A scene of the table, with friction that depends on x: then its energy is not asked for."""
    values, damping, barriers = SCENES[name]
    turning = vk.CustomSpring("sin(x) + f*sin(x)**2*v", f=friction)
    spring = turning if values is None else polynomial(**values, f=friction)
    return scene(*barriers, damping_ratio=damping, spring=spring)


@pytest.mark.parametrize(
    ("name", "margin"),
    [
        *((name, None) for name in ("double well", "pendulum")),
        *(slow(name, None) for name in ("escape", "pressed")),
        *(slow(name, 2) for name in ("double well", "escape")),
        *map(long, ("tilted", "pressed"), (None, 2)),
        *(long(name, None) for name in ("three wells", "overdamped", "both sides", "one well")),
    ],
)
def test_basins_are_those_of_motion_that_is_followed(name, margin):
    quick, plain = relaxing(name), relaxing(name, 1e-14)  # too little friction to change the motion
    assert (quick.model.relaxes, plain.model.relaxes) == (True, False)
    given = {"cells": (40, 40), "starts": (12, 12), "saddles": True}
    found, expected = found_in(quick, margin=margin, **given), found_in(plain, margin=None, **given)
    np.testing.assert_allclose(found.basins.region.bounds, expected.basins.region.bounds, rtol=1e-9)
    assert [a.points[0, 0] for a in found.attractors] == pytest.approx([a.points[0, 0] for a in expected.attractors])
    assert np.mean(found.basins.labels != expected.basins.labels) <= 1e-3  # cells on a boundary
    places = [sorted(round(float(saddle.points[0, 0]), 9) for saddle in each.saddles) for each in (found, expected)]
    assert places[0] == places[1]
    assert [saddle.leads_to for saddle in found.saddles] == [saddle.leads_to for saddle in expected.saddles]


def test_a_well_is_the_set_of_states_with_less_energy_than_its_barrier():
    osc = relaxing("double well")
    structure = found_in(osc)
    region = structure.basins.region
    cells = wells(osc, structure.attractors, region, (200, 200))
    x, v = np.moveaxis(region.cell_centres((200, 200)).reshape(200, 200, 2), -1, 0)
    energy = x**4 / 4 - x**2 / 2 + v**2 / 2
    assert np.all(energy[cells.labels != UNSETTLED] < 0)
    assert np.all(cells.labels[energy < -0.03] == (x[energy < -0.03] > 0))
    assert set(np.unique(cells.labels)) == {UNSETTLED, 0, 1}


@pytest.mark.parametrize(
    "osc",
    [
        scene(damping_ratio=0.05, spring=vk.CustomSpring("x - m*(1 - x**2)*v", m=0.3)),
        scene(damping_ratio=0.05, spring=vk.CustomSpring("x - m*v", m=0.3)),
        scene(damping_ratio=0.05, excitations=(vk.Harmonic(0.1, 0.7),)),
        scene(*stops(vk.CustomLaw("k*depth*(1 + c*rate)", k=5.0, c=0.3), "right"), damping_ratio=0.05),
    ],
    ids=["friction of both signs", "negative friction", "forcing", "stops that dissipate"],
)
def test_motion_that_gains_energy_has_no_wells(osc):
    assert wells(osc, (), Region((-2.0, 2.0), (-2.0, 2.0))) is None


def test_a_singular_force_ends_the_well():
    """A gap that closes at x = 1: states beyond it belong to no well."""
    osc = scene(damping_ratio=0.05, spring=vk.CustomSpring("x - b/(1 - x)**2", b=0.1))
    structure = found_in(osc)
    cells = wells(osc, structure.attractors, Region((-1.0, 1.5), (-1.0, 1.0)), (100, 100))
    (rest,) = (place for place, a in enumerate(structure.attractors) if a.points[0, 0] < 0.5)
    x = np.linspace(-1.0, 1.5, 101)
    assert np.any(cells.labels == rest)
    assert np.all(cells.labels[x[1:] > 0.59] == UNSETTLED)  # the barrier is at 0.587
    wide = wells(osc, structure.attractors, Region((-1.0, 30.0), (-1.0, 1.0)), (400, 100))
    places = np.linspace(-1.0, 30.0, 401)
    assert np.all(wide.labels[(places[1:] > 0.59) & (places[:-1] < 1.0)] == UNSETTLED)
