"""Saddles on basin boundaries against closed forms, SciPy's DOP853, Liouville's law and averaging."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import vibrokit as vk
from tests.layers import slow
from tests.scenes import Coloured, double_well, scene
from tests.structure.stable import stable_orbits
from vibrokit.kernels.choice import ensemble_stepper, single_stepper
from vibrokit.results.basins import ESCAPED, Basins
from vibrokit.results.codes import Code
from vibrokit.results.region import Region
from vibrokit.structure.attractors.describe import describe_orbit
from vibrokit.structure.autonomous import equilibria, find_cycle
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.basins.grid import classify_grid
from vibrokit.structure.boundaries.meetings import meeting_cells
from vibrokit.structure.boundaries.saddles import SaddleSearch
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.trade.reference import reference_map


def settled(osc, attractors, bounds, cells=(80, 80), budget=1000, stepper=None):
    """Return a classifier, and the grid of its basins."""
    region = Region.of(bounds)
    chosen = stepper or ensemble_stepper(osc, Flow.STATE)
    classifier = BasinClassifier(osc, attractors, region, 1e-3, budget, chosen)
    return classifier, classify_grid(classifier, cells)


def searched(classifier, basins, rng=0, **limits):
    search = SaddleSearch(classifier, basins, single_stepper(classifier.osc, Flow.STATE_VARIATIONAL), **limits)
    search.run(np.random.default_rng(rng))
    return search


def saddles_of(osc, attractors, bounds, rng=0, **options):
    search = searched(*settled(osc, attractors, bounds, **options), rng)
    return search.saddles, search.findings


WELLS = ((-2, 2), (-2, 2))


def hilltop(damping, slope):
    """Rates at a hilltop where the force grows as slope · x: λ² + 2ζλ − slope = 0."""
    return -damping + np.array([1, -1]) * np.sqrt(damping**2 + slope)


def test_the_double_well_has_one_saddle_at_its_top():
    osc = double_well()
    (saddle,), findings = saddles_of(osc, stable_orbits(osc, (-1, 0.1), (1, -0.1)), WELLS)
    rates = hilltop(0.05, 1.0)
    np.testing.assert_allclose(saddle.points, [[0, 0]], atol=1e-12)
    np.testing.assert_allclose(saddle.exponents, rates, rtol=1e-9)
    np.testing.assert_allclose(saddle.multipliers, np.exp(2 * np.pi * rates), rtol=1e-9)
    assert (saddle.kind, saddle.period, saddle.duration) == ("saddle", 1, 0.0)
    assert saddle.leads_to == (0, 1)  # the well at −1, then that at 1
    assert saddle.residual <= 1e-10
    assert saddle.error <= 1e-8
    assert [(finding.code, dict(finding.values)) for finding in findings] == [(Code.SADDLES, {"count": 1})]


def test_a_hilltop_too_fast_to_be_straddled_for_a_turn():
    # Deviations grow by exp(2π · 4.5) = 2e12 in 2π/ω_n: what is 1e-10 apart is wells apart after it.
    osc = scene(damping_ratio=0.5, spring=vk.CubicSpring(linear=-25.0, cubic=25.0))
    (saddle,), _ = saddles_of(osc, stable_orbits(osc, (-1, 0.1), (1, -0.1)), ((-2, 2), (-10, 10)), cells=(40, 40))
    np.testing.assert_allclose(saddle.points, [[0, 0]], atol=1e-10)
    np.testing.assert_allclose(saddle.exponents, hilltop(0.5, 25.0), rtol=1e-9)
    assert saddle.leads_to == (0, 1)


@pytest.mark.slow
def test_a_saddle_that_presses_on_a_stop():
    # A softening spring, x − x³, whose hilltop at x = 1 a weak stop at 0.9 moves outwards; beyond it the mass escapes.
    osc = scene(
        vk.Barrier(vk.Hertz(stiffness=1.0), position=0.9, side="right"),
        damping_ratio=0.1,
        spring=vk.CubicSpring(linear=1.0, cubic=-1.0),
    )
    found, findings = saddles_of(osc, stable_orbits(osc, (0.1, 0)), ((-1.3, 1.3), (-1, 1)), cells=(60, 60), budget=200)
    top = brentq(lambda x: x - x**3 + (x - 0.9) ** 1.5, 1.0, 1.3, xtol=1e-15)
    slope = 3 * top**2 - 1 - 1.5 * np.sqrt(top - 0.9)
    assert len(found) == 2, findings
    for saddle, x, grows, ends in zip(found, (-1.0, top), (2.0, slope), ((ESCAPED, 0), (0, ESCAPED)), strict=True):
        np.testing.assert_allclose(saddle.points, [[x, 0]], atol=1e-10)
        np.testing.assert_allclose(saddle.exponents, hilltop(0.1, grows), rtol=1e-8)
        assert saddle.leads_to == ends


@pytest.mark.slow
def test_stops_whose_force_jumps():
    # Its variational equations are not RK4's: the branches are entered from the exact saddle.
    law = vk.CustomLaw("stiffness*depth + loss*rate", stiffness=20.0, loss=0.5)
    stops = tuple(vk.Barrier(law, position=side * 1.2, side=name) for side, name in ((-1, "left"), (1, "right")))
    osc = double_well(barriers=stops)
    (saddle,), _ = saddles_of(osc, stable_orbits(osc, (-1, 0.1), (1, -0.1)), WELLS, cells=(40, 40))
    np.testing.assert_allclose(saddle.points, [[0, 0]], atol=1e-12)
    assert saddle.leads_to == (0, 1)


def mapped_by_scipy(force, state, duration, stop=None):
    """Carry a state by DOP853, restarted at each contact: x″ = force(t, x, v), and push beyond ±stop."""
    end, t, z, side = duration, 0.0, np.asarray(state, dtype=float), 0

    def rates(t, z, side):
        push = -side * 50.0 * max(side * z[0] - stop, 0.0) ** 1.5 if side else 0.0
        return [z[1], force(t, *z) + push]

    def touch(side, direction):
        def event(t, z, _):
            return side * z[0] - stop

        event.terminal, event.direction = True, direction
        return event

    if stop is not None:
        side = next((s for s in (1, -1) if s * z[0] > stop), 0)
    while t < end:
        watched = [] if stop is None else [touch(side, -1.0)] if side else [touch(1, 1.0), touch(-1, 1.0)]
        run = solve_ivp(rates, (t, end), z, "DOP853", args=(side,), rtol=1e-12, atol=1e-14, events=watched or None)
        t, z = run.t[-1], run.y[:, -1]
        if run.status == 1:
            side = 0 if side else (1, -1)[next(n for n, times in enumerate(run.t_events) if len(times))]
    return z


def derivative_by_scipy(force, state, duration, stop=None, step=1e-6):
    """Derivative of the map by central differences."""
    columns = [
        mapped_by_scipy(force, state + move, duration, stop) - mapped_by_scipy(force, state - move, duration, stop)
        for move in step * np.eye(2)
    ]
    return np.stack(columns, axis=1) / (2 * step)


def check_against_scipy(osc, saddle, force, stop=None):
    duration = saddle.period * osc.section_interval
    point = saddle.points[0]
    np.testing.assert_allclose(mapped_by_scipy(force, point, duration, stop), point, atol=1e-9)
    multipliers = np.linalg.eigvals(derivative_by_scipy(force, point, duration, stop))
    np.testing.assert_allclose(sorted(saddle.multipliers.real), sorted(multipliers), rtol=1e-5)
    # Liouville: both multipliers together are what friction leaves of an area.
    left = np.exp(-2 * osc.damping_ratio * osc.natural_frequency * duration)
    assert np.prod(saddle.multipliers).real == pytest.approx(left, rel=1e-8)
    np.testing.assert_allclose(np.exp(saddle.exponents * duration), saddle.multipliers)
    assert saddle.residual <= 1e-10
    assert saddle.error <= 1e-8


def test_the_duffing_oscillator_has_one_boundary_saddle():
    osc = vk.load_scene("duffing")
    found, findings = saddles_of(osc, stable_orbits(osc, (0, 0), (2, 1)), ((-3, 3), (-3, 3)))
    assert len(found) == 1, findings
    assert (found[0].kind, found[0].period, set(found[0].leads_to)) == ("saddle", 1, {0, 1})
    check_against_scipy(osc, found[0], lambda t, x, v: 0.4 * np.cos(1.4 * t) - 0.1 * v - x - 0.3 * x**3)


@pytest.mark.long
def test_a_weakly_damped_boundary_takes_long_to_reach_its_saddle():
    # An island of period 3 beside the small oscillation: its boundary closes in by exp(−0.02 · 2π/3.3) in a period.
    osc = scene(spring=vk.CubicSpring(linear=1.0, cubic=0.2), excitations=(vk.Harmonic(amplitude=3.0, frequency=3.3),))
    structure = vk.find_structure(osc, cells=(100, 100), starts=(12, 12), manifolds=False)
    assert [attractor.period for attractor in structure.attractors] == [1, 1, 3]
    assert [(saddle.kind, saddle.period, set(saddle.leads_to)) for saddle in structure.saddles] == [
        ("saddle", 1, {0, 1, 2}), ("saddle", 3, {0, 2}),
    ]  # fmt: skip
    # One branch of the first saddle winds between the small oscillation and the island.
    saddle, direction = structure.saddles[0], np.array([0.0264, 0.9997])
    starts = saddle.points + np.geomspace(1, np.abs(saddle.multipliers).max(), 64)[:, None] * 1e-4 * direction
    for side, labels in ((-1, {0, 2}), (1, {1})):
        ends = osc.section_map(saddle.points + side * (starts - saddle.points), 3000)
        apart = [np.linalg.norm(ends[:, None] - each.points, axis=2).min(axis=1) for each in structure.attractors]
        assert set(np.argmin(apart, axis=0)) == labels
    for saddle in structure.saddles:
        check_against_scipy(osc, saddle, lambda t, x, v: 3 * np.cos(3.3 * t) - 0.02 * v - x - 0.2 * x**3)


def test_equilibria_are_counted_once_where_the_force_is_exactly_0_between_two_places():
    # x (x² − 1) (x² − 4): the places that are looked at include 0, and in the second range ±1.
    osc = scene(spring=vk.CustomSpring("x*(x**2 - 1)*(x**2 - 4)"), damping_ratio=0.1)
    for edge in (2.5, 3.0, 2.0):
        found = [float(orbit.point[0]) for orbit in equilibria(osc, -edge, edge)]
        np.testing.assert_allclose(found, [-2, -1, 0, 1, 2], atol=1e-12)


def paper_force(t, x, v):
    return 0.18 * np.cos(0.57 * t) + 0.2 - 0.02 * v - x


@pytest.fixture(scope="module")
def stops():
    """hertz-0.570, its two attractors, and the boundary between them."""
    osc = vk.load_scene("hertz-0.570")
    attractors = stable_orbits(osc, (0.466551, 0.002566), (0.023582, -0.049071))
    return osc, attractors, *settled(osc, attractors, ((-0.7, 0.8), (-1.0, 1.0)), cells=(120, 120))


def test_the_paper_scene_has_one_boundary_saddle(stops):
    osc, _, classifier, basins = stops
    orbit_stepper = single_stepper(osc, Flow.STATE_VARIATIONAL)
    points = []
    for seed, stepper in ((0, classifier.stepper), (1, vk.RK4(512)), (2, orbit_stepper)):
        few = {"trackers": 3, "sections": 40} if stepper is orbit_stepper else {}
        changed = dataclasses.replace(classifier, stepper=stepper)
        search = searched(changed, basins, seed, **few)
        found = search.saddles
        assert len(found) == 1, search.findings
        points.append(found[0].points[0])
        assert (found[0].kind, found[0].period, set(found[0].leads_to)) == ("saddle", 1, {0, 1})
    np.testing.assert_allclose(points, points[:1] * 3, rtol=0, atol=1e-10)  # whatever stepper tracks the boundary
    check_against_scipy(osc, found[0], paper_force, stop=0.5)


@pytest.mark.slow
def test_an_unstable_limit_cycle_parts_rest_from_motion():
    # x″ + v (2ζ − a x² + b x⁴) + x = 0 averages to 2ζ/2 − a A²/8 + b A⁴/16 = 0 on its cycles (first order in these).
    osc = scene(damping_ratio=0.005, spring=vk.CustomSpring("x + v*(-a*x**2 + b*x**4)", a=0.08, b=0.04))
    inner, outer = np.sort(np.sqrt(np.roots([0.04 / 16, -0.08 / 8, 0.005])))
    exact = single_stepper(osc, Flow.STATE_VARIATIONAL)
    cycle = find_cycle(osc, osc.section_map([[outer, 0.0]], 200)[0], exact, longest=20.0)
    attractors = (*stable_orbits(osc, (0.0, 0.0)), describe_orbit(osc, cycle, exact))
    (saddle,), findings = saddles_of(osc, attractors, ((-2.5, 2.5), (-2.5, 2.5)), cells=(40, 40))
    assert (saddle.kind, saddle.period, saddle.leads_to) == ("repeller", 1, (0, 1)), findings
    assert np.abs(saddle.points[0, 0]) == pytest.approx(inner, rel=1e-3)  # averaging is right to second order
    assert saddle.duration == pytest.approx(2 * np.pi, rel=1e-3)
    # d/dA of the averaged drift −A (2ζ/2 − a A²/8 + b A⁴/16) is the rate at which neighbours leave.
    assert saddle.exponents[0].real == pytest.approx(0.08 * inner**2 / 4 - 0.04 * inner**4 / 4, rel=1e-2)
    assert saddle.multipliers[1] == pytest.approx(1.0, abs=1e-8)


def test_cells_that_did_not_settle_are_passed_over():
    region = Region((0, 5), (0, 1))
    far = meeting_cells(Basins(region, np.array([[0], [-1], [-1], [1], [-1]], dtype=np.int16)))
    assert {pair: cells.tolist() for pair, cells in far.items()} == {(0, 1): [[0, 3]]}
    near = meeting_cells(Basins(region, np.array([[1], [0], [-1], [1], [-2]], dtype=np.int16)))
    assert {pair: cells.tolist() for pair, cells in near.items()} == {(-2, 1): [[4, 3]], (0, 1): [[1, 0]]}
    assert meeting_cells(Basins(region, np.zeros((5, 1), dtype=np.int16))) == {}


def test_one_basin_has_no_boundary():
    osc = double_well()
    found, (finding,) = saddles_of(osc, stable_orbits(osc, (1, 0)), ((0.9, 1.1), (-0.05, 0.05)), cells=(8, 8))
    assert found == ()
    assert (finding.code, finding.values["count"]) == (Code.SADDLES, 0)


@pytest.mark.parametrize(("amplitude", "wound"), [slow(0.05, False), (0.1, True)])
def test_the_boundary_is_chaotic_above_melnikovs_amplitude(amplitude, wound):
    # x″ + δ x′ − x + x³ = γ cos ωt: the hilltop's manifolds cross, and the boundary is fractal, for
    # γ > 4 δ cosh(πω/2) / (3 √2 π ω) (Moon and Holmes, 1979); to first order in δ and γ.
    delta, omega = 0.1, 0.8
    critical = 4 * delta * np.cosh(np.pi * omega / 2) / (3 * np.sqrt(2) * np.pi * omega)
    assert (amplitude > 1.3 * critical) if wound else (amplitude < critical / 1.3)
    osc = double_well(excitations=(vk.Harmonic(amplitude=amplitude, frequency=omega),))
    found, findings = saddles_of(osc, stable_orbits(osc, (-0.95, 0), (1.05, 0)), ((-1.8, 1.8), (-1.5, 1.5)))
    chaotic = [finding for finding in findings if finding.code is Code.CHAOTIC_EDGE]
    assert [(finding.source, finding.target) for finding in chaotic] == [(0, 1)] * wound
    assert any(saddle.kind == "chaotic" for saddle in found) == wound
    named = [saddle for saddle in found if saddle.kind != "chaotic" and not saddle.embedded]
    assert all(set(saddle.leads_to) == {0, 1} and saddle.residual <= 1e-10 for saddle in named)
    if wound:
        (set_,) = (saddle for saddle in found if saddle.kind == "chaotic")
        inside = [saddle for saddle in found if saddle.embedded]
        assert len(inside) == chaotic[0].values["orbits"] > 0
        for orbit in inside:  # hyperbolic, on the boundary, and visited by motions on the set
            assert np.sum(np.abs(orbit.multipliers) > 1) == 1
            assert (set(orbit.leads_to), orbit.residual <= 1e-10) == ({0, 1}, True)
            apart = np.linalg.norm(orbit.points[:, None] - set_.points, axis=2).min(axis=1)
            assert apart.max() < 0.1 * np.ptp(set_.points)
        assert (set_.period, set_.leads_to) == (0, (0, 1))
        assert len(set_.points) > 50
        assert set_.exponents[0].real == chaotic[0].values["exponent"] > 0.1  # a factor e in less than 1.5 periods
        # Motions on it follow the map, to what 60 · 1e-10 widths grow to on the hilltop in a period, but for the joins.
        images = osc.section_map(set_.points[:-1], stepper=ensemble_stepper(osc, Flow.STATE))
        jumps = np.linalg.norm(images - set_.points[1:], axis=1) > 1e-4
        assert jumps.sum() < chaotic[0].values["count"]
        # The scene is its own mirror image half a period later: so are its saddles.
        np.testing.assert_allclose(named[0].multipliers, named[1].multipliers, rtol=1e-8)
    else:
        assert len(found) == 1


@pytest.mark.long
def test_branches_are_followed_from_beyond_the_error_of_the_stepper():
    """Nearer to the saddle of period 6, fixed steps across this stop have a stable orbit that the scene has not."""
    osc = scene(vk.Barrier(vk.Linear(1000.0), 0.2, "right"), damping_ratio=0.03, excitations=(vk.Harmonic(0.4, 2.6),))
    structure = vk.find_structure(osc, manifolds=False)
    periods = {attractor.period: attractor.label for attractor in structure.attractors}
    (saddle,) = (saddle for saddle in structure.saddles if saddle.period == 6)
    assert set(saddle.leads_to) == {periods[2], periods[6]}


@pytest.mark.long
def test_an_orbit_that_motion_leaves_slower_than_the_budget_is_found_in_its_strip():
    """Nothing settles near a symmetric orbit with a multiplier of 1.008, so that the boundary cannot be followed."""
    stops = vk.Barrier(vk.Hertz(2000.0), 0.5, "right"), vk.Barrier(vk.Hertz(2000.0), -0.5, "left")
    osc = scene(*stops, damping_ratio=0.1, excitations=(vk.Harmonic(0.4, 0.8),))
    structure = vk.find_structure(osc, manifolds=False, rng=0)
    (saddle,) = structure.saddles
    assert set(saddle.leads_to) == {0, 1}
    step = 1e-6
    near = saddle.points[0] + step * np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    still, *moved = reference_map(osc, near)
    np.testing.assert_allclose(still, saddle.points[0], atol=1e-10)
    slopes = np.column_stack([(moved[0] - moved[1]), (moved[2] - moved[3])]) / (2 * step)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(slopes)), np.sort(saddle.multipliers.real), rtol=1e-5)


def test_boundaries_that_an_edge_budget_is_too_small_for_are_named():
    structure = vk.find_structure(vk.load_scene("hertz-0.570"), edge_budget=10_000, manifolds=False)
    assert not structure.saddles
    (finding,) = structure.found(Code.EDGE_BUDGET)
    assert finding.values == {"count": 1, "budget": 10_000}
    others = (Code.BOUNDARY_LOST, Code.CHAOTIC_EDGE, Code.EDGE_NOT_CONVERGED)
    assert not any(structure.found(code) for code in others)
    assert structure.settings["edge_budget"] == 10_000


def test_basins_that_a_saddle_connects_count_as_one_where_a_saddle_to_others_is_missing():
    """Two orbits in each of two wells: next to the hilltop, motion on the boundary of any pair ends inside a well."""
    damping, slope, force, frequency = 0.1, 5.0, 0.3, 2.5
    osc = scene(
        damping_ratio=damping, spring=vk.CubicSpring(-slope, slope), excitations=(vk.Harmonic(force, frequency),)
    )
    structure = vk.find_structure(osc, cells=(100, 100), starts=(12, 12), manifolds=False, rng=0)
    assert [attractor.period for attractor in structure.attractors] == [1, 1, 1, 1]
    linear = force / (-slope - frequency**2 + 2j * damping * frequency)
    hilltops = [saddle for saddle in structure.saddles if np.abs(saddle.points[0, 0]) < 0.1]
    (hilltop,) = hilltops
    assert hilltop.points[0] == pytest.approx([linear.real, (1j * frequency * linear).real], abs=1e-4)
    right = {attractor.label for attractor in structure.attractors if attractor.points[0, 0] > 0}
    assert 0 < len(right & set(hilltop.leads_to)) < len(set(hilltop.leads_to))
    assert len(structure.saddles) == 3


@pytest.mark.slow
def test_a_third_state_of_the_noise():
    osc = double_well(noise=Coloured(intensity=0.01, rate=0.3))
    (saddle,), _ = saddles_of(osc, stable_orbits(osc, (-1, 0.1, 0), (1, -0.1, 0)), WELLS, cells=(40, 40))
    np.testing.assert_allclose(saddle.points, [[0, 0, 0]], atol=1e-12)
    grows, falls = hilltop(0.05, 1.0)
    np.testing.assert_allclose(saddle.exponents, [grows, -0.3, falls], rtol=1e-9)
    assert (saddle.kind, saddle.leads_to) == ("saddle", (0, 1))
