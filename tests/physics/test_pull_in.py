"""Pull-in of an electrostatic actuator, and other motions between poles: closed forms of a potential with poles.

The actuator is set 2 of the transducers in Kolchuzhin's LMGT_MEMS_component_library (an example of ANSYS): mass
1e-4 kg, spring 200 N/m, damping 0.04 N s/m, plates of 1e-4 m² with a gap of 150 µm.
"""

import functools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import vibrokit as vk
from tests.layers import long, slow
from tests.scenes import scene
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Code

SQUARE, GAP = 2e6, 1.5e-4  # ω_n² (s⁻²), m
DAMPING = 0.1414214
COARSE = {"cells": (60, 60), "starts": (8, 8), "manifolds": False}
QUICK = vk.LeastAction(shooting=None, graph=vk.GraphSearch(nodes=(40, 40)))


def strength(voltage):
    """a = ε A V²/(2 m)."""
    return 8.8541878e-12 * 1e-4 * voltage**2 / (2 * 1e-4)


def actuator(voltage, mirrored=False, **more):
    formula = "w2*x + a/(h+x)**2" if mirrored else "w2*x - a/(h-x)**2"
    spring = vk.CustomSpring(formula, w2=SQUARE, a=strength(voltage), h=GAP)
    return vk.Oscillator(
        natural_frequency=math.sqrt(SQUARE), damping_ratio=DAMPING, spring=spring, noise=vk.WhiteNoise(0.05), **more
    )


def barrier(voltage, places, stop=0.0, stiffness=0.0):
    """4 ζ ω_n ΔV between two places, with a linear stop."""
    low, high = (
        0.5 * SQUARE * x**2 - strength(voltage) / (GAP - x) + 0.5 * stiffness * max(0.0, x - stop) ** 2 for x in places
    )
    return 4 * DAMPING * math.sqrt(SQUARE) * (high - low)


@functools.cache
def structure(voltage, mirrored=False):
    osc = actuator(voltage, mirrored)
    return osc, vk.find_structure(osc, **COARSE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("voltage", "rest", "saddle", "energy"),
    [
        (400.0, 21.4231e-6, 85.7230e-6, 1.102786),
        long(450.0, 32.4256e-6, 69.9493e-6, 0.2138763),
        long(300.0, 10.1922e-6, 106.8129e-6, 3.943319),
    ],
)
def test_one_state_and_its_escape_into_the_pole(voltage, rest, saddle, energy):
    osc, found = structure(voltage)
    (attractor,), (top,) = found.attractors, found.saddles
    assert attractor.points[0, 0] == pytest.approx(rest, rel=3e-6)
    assert top.points[0, 0] == pytest.approx(saddle, rel=1e-6)
    assert set(top.leads_to) == {0, ESCAPED}
    assert found.basins.region.x[1] <= GAP
    assert found.found(Code.STARTS_ENDED)
    assert not found.found(Code.STARTS_DIVERGED)
    (escape,) = QUICK.run(osc, found).energies
    assert escape.value == pytest.approx(energy, rel=1e-6)
    assert escape.value == pytest.approx(barrier(voltage, (attractor.points[0, 0], top.points[0, 0])), rel=1e-9)
    assert escape.target == ESCAPED


def test_the_share_of_the_basin_as_scipy_has_it():
    _, found = structure(400.0)
    a, omega = strength(400.0), math.sqrt(SQUARE)

    def captured(x, v):
        """In units of the gap and 1/ω_n."""
        scaled = a / (SQUARE * GAP**3)

        def rates(t, y):
            return [y[1], -2 * DAMPING * y[1] - y[0] + scaled / (1 - y[0]) ** 2]

        def arrival(t, y):
            return y[0] - 0.999

        arrival.terminal = True
        return solve_ivp(rates, (0.0, 60.0), (x / GAP, v / (GAP * omega)), events=arrival, rtol=1e-8).status == 1

    places = np.random.default_rng(0).choice(found.basins.region.cell_centres((60, 60)), 60, replace=False)
    labels = found.basins.at(places)
    assert {0, ESCAPED} == set(labels.tolist())
    agree = [captured(*place) == (label == ESCAPED) for place, label in zip(places, labels, strict=True)]
    assert sum(agree) >= 59  # a cell on the boundary may have another label than its centre


@pytest.mark.slow
def test_the_mirrored_actuator():
    osc, found = structure(400.0, mirrored=True)
    assert found.attractors[0].points[0, 0] == pytest.approx(-21.4231e-6, rel=3e-6)
    assert found.saddles[0].points[0, 0] == pytest.approx(-85.7230e-6, rel=1e-6)
    (escape,) = QUICK.run(osc, found).energies
    assert escape.value == pytest.approx(1.102786, rel=1e-6)


@pytest.mark.slow
def test_pull_in_is_a_fold():
    """The balance x (h − x)² = a/ω_n² has its maximum at x = h/3."""
    values = np.linspace(3e-7, 1.3e-6, 6)
    found = vk.continuation(actuator(400.0), "spring.a", values, cells=(10, 10), starts=(8, 8))
    (fold,) = found.bifurcations
    assert fold.kind == "fold"
    assert fold.value == pytest.approx(4 / 27 * SQUARE * GAP**3, rel=1e-12)
    assert fold.point[0] == pytest.approx(GAP / 3, rel=1e-6)


@pytest.mark.long
def test_a_switch_latches_before_the_pole():
    stiffness, stop = 1e10, 1.4e-4
    osc = actuator(400.0, barriers=(vk.Barrier(vk.Linear(stiffness), stop, "right"),))
    found = vk.find_structure(osc, **COARSE)
    rest, latched = (attractor.points[0, 0] for attractor in found.attractors)

    def force(x):
        return SQUARE * x - strength(400.0) / (GAP - x) ** 2 + stiffness * (x - stop)

    assert rest == pytest.approx(21.4231e-6, rel=3e-6)
    assert latched == pytest.approx(brentq(force, stop, 1.44e-4), rel=1e-9)
    inner, outer = sorted(found.saddles, key=lambda saddle: saddle.points[0, 0])
    assert set(inner.leads_to) == {0, 1}
    assert set(outer.leads_to) == {1, ESCAPED}
    result = QUICK.run(osc, found)
    assert result.energy(0, 1).value == pytest.approx(1.102786, rel=1e-6)
    back = barrier(400.0, (latched, inner.points[0, 0]), stop, stiffness)
    through = barrier(400.0, (latched, outer.points[0, 0]), stop, stiffness)
    assert result.energy(1, 0).value == pytest.approx(back, rel=1e-6)
    assert result.energy(1, "escape").value == pytest.approx(through, rel=1e-6)


@pytest.mark.long
def test_a_comb_between_two_poles():
    a, damping = 0.05, 0.1
    osc = scene(
        damping_ratio=damping, spring=vk.CustomSpring("x - a/(1-x)**2 + a/(1+x)**2", a=a), noise=vk.WhiteNoise(1e-3)
    )
    found = vk.find_structure(osc, **COARSE)
    top = brentq(lambda x: x - a / (1 - x) ** 2 + a / (1 + x) ** 2, 0.5, 0.9)
    assert sorted(saddle.points[0, 0] for saddle in found.saddles) == pytest.approx([-top, top], rel=1e-9)
    assert found.basins.region.x == (-1.0, 1.0)
    (escape,) = QUICK.run(osc, found).energies
    height = 0.5 * top**2 - a / (1 - top) - a / (1 + top) + 2 * a
    assert escape.value == pytest.approx(4 * damping * height, rel=1e-6)


@pytest.mark.parametrize(
    ("formula", "rest"),
    [
        ("x - 2 - 0.5*x**-1.5", lambda x: x - 2 - 0.5 * x**-1.5),  # of all starts none can pass x = 0
        slow("x - 2 - 0.5/x**3", lambda x: x - 2 - 0.5 / x**3),
        slow("0.2*(x - 2) + log(x)", lambda x: 0.2 * (x - 2) + math.log(x)),
    ],
)
def test_all_motion_settles_on_one_side_of_a_wall(formula, rest):
    osc = scene(damping_ratio=0.05, spring=vk.CustomSpring(formula))
    found = vk.find_structure(osc, **COARSE)
    (attractor,) = found.attractors
    assert attractor.points[0, 0] == pytest.approx(brentq(rest, 0.5, 9.0), rel=1e-9)
    assert found.basins.region.x[0] >= 0.0
    if "log" not in formula:  # whose work is finite, so that fast motion reaches x = 0
        assert attractor.basin_fraction == 1.0


@pytest.mark.slow
def test_two_wells_between_the_poles_of_a_tangent():
    osc = scene(damping_ratio=0.05, spring=vk.CustomSpring("tan(x) - 1.5*x"))
    found = vk.find_structure(osc, **COARSE)
    rest = brentq(lambda x: math.tan(x) - 1.5 * x, 0.5, 1.5)
    assert [a.points[0, 0] for a in found.attractors] == pytest.approx([-rest, rest], rel=1e-9)
    assert [a.basin_fraction for a in found.attractors] == pytest.approx([0.5, 0.5], abs=0.01)
    assert found.basins.region.x == pytest.approx((-0.5 * math.pi, 0.5 * math.pi))


@pytest.mark.long
def test_no_exit_leads_across_a_pole():
    """Behind the pole the formula has another state, which has no meaning for the motion before it."""
    osc = actuator(400.0)
    found = vk.find_structure(osc, region=((-1e-4, 3e-4), (-0.3, 0.3)), **COARSE)
    assert [attractor.points[0, 0] < GAP for attractor in found.attractors] == [True, False]
    result = QUICK.run(osc, found)
    assert [(energy.source, energy.target) for energy in result.energies] == [(0, ESCAPED)]
    assert result.energies[0].value == pytest.approx(1.102786, rel=1e-6)


@pytest.mark.long
def test_rates_between_two_poles_agree():
    """By simulation and by the density, neither of which crosses a pole, and by symmetry."""
    osc = scene(damping_ratio=0.1, spring=vk.CustomSpring("tan(x) - 1.5*x"), noise=vk.WhiteNoise(0.014))
    found = vk.find_structure(osc, **COARSE)
    rates = [
        rate
        for analyzer in (vk.MFET(intensities=(0.014,)), vk.SGCM(intensities=(0.014,)))
        for rate in analyzer.run(osc, found).rates
    ]
    assert len(rates) == 4
    values = np.array([rate.value for rate in rates])
    errors = np.array([math.log(rate.upper / rate.lower) for rate in rates])  # two standard errors or more
    assert (np.abs(np.log(values / values.mean())) < errors.max()).all()


def shaken(formula, **values):
    """In units of the gap and 1/ω_n, with a weak force beside the rest."""
    return scene(damping_ratio=0.1, spring=vk.CustomSpring(formula, **values), excitations=(vk.Harmonic(0.01, 0.8),))


def settled(spring):
    """State of the forced motion from rest after 30 periods, by SciPy; (1 − x)² = b/x has a root at 1.204 as well."""
    period = 2 * math.pi / 0.8

    def rates(t, y):
        return [y[1], -0.2 * y[1] - spring(y[0]) + 0.01 * math.cos(0.8 * t)]

    return solve_ivp(rates, (0.0, 30 * period), (0.0, 0.0), rtol=1e-11, atol=1e-13).y[:, -1]


@pytest.mark.parametrize(
    ("formula", "values", "spring", "borders"),
    [
        ("x - b/(1-x)**2", {"b": 0.05}, lambda x: x - 0.05 / (1 - x) ** 2, (-math.inf, 1.0)),
        slow("x + b/(1+x)**2", {"b": 0.05}, lambda x: x + 0.05 / (1 + x) ** 2, (-1.0, math.inf)),
        long("x - b/(1-x)**2 + b/(1+x)**2", {"b": 0.05}, lambda x: x - 0.05 / (1 - x) ** 2 + 0.05 / (1 + x) ** 2,
            (-1.0, 1.0)),
        long("x - b/sqrt(1-x)", {"b": 0.2}, lambda x: x - 0.2 / math.sqrt(1 - x), (-math.inf, 1.0)),
    ],
)  # fmt: skip
def test_a_weak_force_shows_nothing_behind_a_border(formula, values, spring, borders):
    found = vk.find_structure(shaken(formula, **values), **COARSE)
    (attractor,) = found.attractors
    assert attractor.points[0] == pytest.approx(settled(spring), abs=1e-8)
    assert borders[0] <= found.basins.region.x[0] < found.basins.region.x[1] <= borders[1]
    assert found.saddles
    assert all(set(saddle.leads_to) == {0, ESCAPED} for saddle in found.saddles)


@pytest.mark.slow
def test_motion_behind_the_pole_is_found_in_a_region_there():
    found = vk.find_structure(shaken("x - b/(1-x)**2", b=0.05), region=((1.05, 1.5), (-0.3, 0.3)), **COARSE)
    (attractor,) = found.attractors
    assert attractor.points[0, 0] == pytest.approx(1.2046, abs=1e-3)
    assert not found.found(Code.REGION_TOO_SMALL)
