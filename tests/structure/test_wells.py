"""Cells that motion cannot leave for want of energy, against motion that is followed to the end."""

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.region import Region
from vibrokit.structure.basins.stop_cells import wells

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
