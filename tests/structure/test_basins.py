"""Where states lead: closed forms, numbers of other codes, and cells that share answers against cells that do not."""

import concurrent.futures as futures
import math
from multiprocessing import get_context

import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.stats import beta

import vibrokit as vk
from tests.scenes import scene
from tests.structure.stable import attractor
from vibrokit.progress import working
from vibrokit.results.basins import ESCAPED, NOT_FOLLOWED, UNSETTLED, Basins
from vibrokit.results.codes import Code
from vibrokit.results.region import Region
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.basins.grid import BasinGrid, classify_grid, with_fractions
from vibrokit.structure.basins.stop_cells import agreeing
from vibrokit.structure.orbits import refine_orbit

PAPER_STATES = ((0.466551, 0.002566), (0.023582, -0.049071))


def classifier(osc, points, bounds, **changes):
    region = Region.of(bounds)
    settings = {"settling": 1e-3, "budget": 700, "stepper": vk.RK4(256)}
    return BasinClassifier(osc, [attractor(p) for p in points], region, **settings | changes)


def far_from_others(labels, cells):
    """Cells with no other label among those nearer than `cells`."""
    size = 2 * cells - 1
    return minimum_filter(labels, size, mode="nearest") == maximum_filter(labels, size, mode="nearest")


@pytest.fixture(scope="module")
def duffing():
    osc = vk.load_scene("duffing")
    carried = osc.section_map([[0.0, 0.0], [1.0, 1.0], [-2.0, 2.0], [3.0, 0.0]], 300)
    farthest = np.argmax(np.linalg.norm(carried - carried[0], axis=1))
    orbits = [refine_orbit(osc, carried[index], 1, vk.RK4(256)) for index in (0, farthest)]
    return classifier(osc, [orbit.point for orbit in orbits], ((-3, 3), (-3, 3)))


@pytest.fixture(scope="module")
def hertz():
    osc = vk.load_scene("hertz-0.570")
    orbits = [refine_orbit(osc, np.array(guess), 1, vk.RK4(256)) for guess in PAPER_STATES]
    return classifier(osc, [orbit.point for orbit in orbits], ((-1, 1), (-1, 1)))


@pytest.fixture(scope="module")
def wells():
    return classifier(vk.load_scene("double-well"), [(-1.0, 0.0), (1.0, 0.0)], ((-2, 2), (-2, 2)))


# --- exact, or known from elsewhere


def test_duffing_fractions_are_those_of_two_other_codes(duffing):
    axis = np.linspace(-3, 3, 100)
    labels = duffing.labels(np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2))
    fractions = sorted(np.bincount(labels, minlength=2) / len(labels))
    np.testing.assert_allclose(fractions, [0.429, 0.571], atol=5e-4)


@pytest.mark.parametrize("margin", [None, 2])
def test_the_double_well_is_symmetric_to_the_last_cell(wells, margin):
    labels = classify_grid(wells, (100, 100), margin=margin).labels
    np.testing.assert_array_equal(labels, 1 - labels[::-1, ::-1])


@pytest.mark.parametrize(("cells", "count"), [(576, 576), (0, 576), (10, 10), (170, 576)])
def test_no_share_is_without_an_error(cells, count):
    """Beta(cells + 1/2, others + 1/2), against its standard deviation from SciPy."""
    labels = np.where(np.arange(count) < cells, 0, 1).astype(np.int16)[:, None]
    (found,) = with_fractions([attractor((0.0, 0.0))], Basins(Region((0, 1), (0, 1)), labels))
    assert found.basin_fraction == cells / count
    assert found.basin_fraction_error == pytest.approx(beta.std(cells + 0.5, count - cells + 0.5))


def test_a_softening_spring_lets_go_beyond_its_saddles():
    """x″ + 0.1x′ + x − x³ = 0: energy ¼ at the saddles x = ±1; it falls, so that below it the side decides."""
    spring = vk.CubicSpring(linear=1.0, cubic=-1.0)
    osc = scene(damping_ratio=0.05, spring=spring)
    escaping = classifier(osc, [(0.0, 0.0)], ((-1.6, 1.6), (-1.2, 1.2)))
    for margin in (None, 2):
        basins = classify_grid(escaping, (80, 80), margin=margin)
        x, v = basins.region.cell_centres((80, 80)).T
        low = 0.5 * v**2 + 0.5 * x**2 - 0.25 * x**4 < 0.25
        beyond = x * v > 0  # past the saddle and still going out, where the spring pushes it on
        labels = basins.labels.ravel()
        assert (labels[low & (np.abs(x) < 1)] == 0).all()
        assert (labels[(np.abs(x) > 1) & (low | beyond)] == ESCAPED).all()
        assert set(labels) == {0, ESCAPED}


def circles():
    """x″ + x = −¼ x′ (r² − 1)(r² − 4), r² = x² + x′²: rest, and the circle r = 2, parted by the circle r = 1."""
    spring = vk.CustomSpring("x + v*(x**2 + v**2 - 1)*(x**2 + v**2 - 4)/4")
    osc = scene(damping_ratio=0.0, spring=spring)
    angles = np.linspace(0, 2 * np.pi, 401)
    circle = attractor((2.0, 0.0), "limit cycle", 2 * np.stack([np.cos(angles), -np.sin(angles)], axis=1))
    rest = attractor((0.0, 0.0), "equilibrium")
    return BasinClassifier(osc, [rest, circle], Region((-2.5, 2.5), (-2.5, 2.5)), 1e-3, 300, vk.RK4(256))


@pytest.mark.parametrize("margin", [None, 2])
def test_a_limit_cycle_is_reached_wherever_it_is_met(margin):
    basins = classify_grid(circles(), (100, 100), margin=margin)
    radius = np.linalg.norm(basins.region.cell_centres((100, 100)), axis=1).reshape(100, 100)
    np.testing.assert_array_equal(basins.labels, (radius > 1).astype(int))


@pytest.mark.slow
def test_chaos_is_told_from_the_orbit_beside_it():
    """Ueda's oscillator, x″ + 0.1x′ + x³ = 12 cos t: a chaotic attractor, and a small orbit of period 1."""
    osc = scene(
        damping_ratio=0.05,
        spring=vk.CubicSpring(linear=0.0, cubic=1.0),
        excitations=(vk.Harmonic(amplitude=12.0, frequency=1.0),),
    )
    orbit = refine_orbit(osc, np.array([0.892, -1.291]), 1, vk.RK4(256))
    many = osc.section_map(np.random.default_rng(0).uniform(2.5, 3.5, (256, 2)), 500)
    many = many[np.linalg.norm(many - orbit.point, axis=1) > 1e-3][:128]
    points = np.concatenate([many := osc.section_map(many) for _ in range(32)])
    region = Region((0.5, 4.5), (-7.0, 7.0))
    found = BasinClassifier(osc, [attractor(orbit.point), attractor(points, "chaotic")], region, 1e-3, 500, vk.RK4(256))
    for labels in (found.labels(region.cell_centres((40, 40))), classify_grid(found, (40, 40)).labels.ravel()):
        ends = osc.section_map(region.cell_centres((40, 40)), 1000)
        np.testing.assert_array_equal(labels, np.linalg.norm(ends - orbit.point, axis=1) > 1e-3)
        assert 0.01 < np.mean(labels == 0) < 0.5


def test_a_curve_that_is_crossed_is_not_reached():
    """A spiral to rest crosses a circle that is given out for a quasiperiodic attractor."""
    osc = scene(damping_ratio=0.001)
    angles = np.random.default_rng(0).uniform(0, 2 * np.pi, 4096)
    circle = 0.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    records = [attractor((0.0, 0.0), "equilibrium"), attractor(circle, "quasiperiodic")]
    rest = BasinClassifier(osc, records, Region((-1, 1), (-1, 1)), 2.5e-3, 1000, vk.RK4(256))
    assert (rest.labels(rest.region.cell_centres((20, 20))) == 0).all()


# --- sharing answers


@pytest.mark.parametrize("scene", ["duffing", "hertz"])
def test_cells_that_share_agree_with_cells_followed_to_the_end(scene, request):
    follower = request.getfixturevalue(scene)
    alone = classify_grid(follower, (150, 150), margin=None).labels
    shared = classify_grid(follower, (150, 150), margin=2).labels
    far = far_from_others(alone, 3)
    assert far.mean() > 0.3
    assert np.mean((alone == shared)[far]) >= 0.999
    assert np.mean(alone == shared) >= 0.999  # thin tongues too


def test_a_classifier_with_a_grid_agrees_with_one_without(duffing):
    quick = duffing.sharing(classify_grid(duffing, (100, 100)), 2)
    states = np.random.default_rng(1).uniform(-4, 4, (500, 2))  # some start outside
    assert np.mean(quick.labels(states) == duffing.labels(states)) >= 0.998


def test_refined_cells_agree_with_a_fine_grid(duffing):
    refined = classify_grid(duffing, (60, 60), refine=2)
    fine = classify_grid(duffing, (240, 240), margin=None).labels
    assert refined.labels.shape == (240, 240)
    assert np.mean(refined.labels == fine) >= 0.99
    assert np.mean((refined.labels == fine)[far_from_others(fine, 4)]) >= 0.999


# --- region, budget, phase


def test_leaving_the_region_on_the_way_is_no_end(wells):
    small = classifier(wells.osc, [(-1.0, 0.0), (1.0, 0.0)], ((-1.3, 1.3), (-0.3, 0.3)), settling=4e-3)
    gone = wells.osc.section_map(small.region.cell_centres((30, 30)))
    assert np.mean(np.abs(gone[:, 1]) > 0.3) > 0.05  # some do leave
    states = small.region.cell_centres((30, 30))
    np.testing.assert_array_equal(small.labels(states), wells.labels(states))
    quick = small.sharing(classify_grid(small, (60, 60)), 2)
    assert np.mean(quick.labels(states) == wells.labels(states)) >= 0.998


def test_too_small_a_budget_leaves_cells_unsettled(duffing):
    short = classifier(duffing.osc, [a.points for a in duffing.attractors], ((-3, 3), (-3, 3)), budget=3)
    labels = classify_grid(short, (20, 20)).labels
    assert set(labels.ravel()) <= {UNSETTLED, ESCAPED, 0, 1}
    assert np.mean(labels == UNSETTLED) > 0.8
    assert (short.labels(np.array([[40.0, 0.0]])) == ESCAPED).all()  # outside when the time is up
    assert short.labels(np.empty((0, 2))).shape == (0,)


@pytest.mark.parametrize("share", [0.3, 2.6])
def test_states_between_sections_are_carried_to_the_next(duffing, share):
    states = duffing.region.cell_centres((8, 8))
    time = share * duffing.osc.section_interval
    rest = math.ceil(share) * duffing.osc.section_interval - time
    ends = [duffing.osc.trajectory(s, duration=rest, start_time=time).states[-1] for s in states]
    np.testing.assert_array_equal(duffing.labels(states, start_time=time), duffing.labels(np.array(ends)))


# --- interruption, executors


def interrupted(grid, calls):
    """The labels of a grid whose work is interrupted at a call of its listener, and what the listener was told."""
    seen = []

    def listener(update):
        seen.append(update)
        if len(seen) == calls:
            raise KeyboardInterrupt

    with working(listener):
        try:
            grid.fill()
        except KeyboardInterrupt:
            assert len(seen) >= calls
    return grid.basins.labels, seen


def test_an_interrupt_leaves_what_was_done(duffing):
    whole = classify_grid(duffing, (240, 240))
    _, seen = interrupted(BasinGrid(duffing, (240, 240)), math.inf)
    counts = []
    for calls in np.linspace(1, len(seen), 7).astype(int):
        partial, _ = interrupted(BasinGrid(duffing, (240, 240)), calls)
        followed = partial != NOT_FOLLOWED
        np.testing.assert_array_equal(partial[followed], whole.labels[followed])
        counts.append(int(followed.sum()))
    assert counts == sorted(counts)
    assert counts[0] == 0
    assert counts[-1] == 240**2
    assert 0 < counts[-2] < 240**2
    total = sum((240 // side) ** 2 for side in (4, 2, 1))
    assert {(update.stage, update.unit, update.total) for update in seen} == {("basins", "cells", total)}
    done = [update.done for update in seen]
    assert (done[0], done[-1], done) == (0, total, sorted(done))


def test_an_interrupt_while_a_grid_is_refined_keeps_the_other_cells(duffing):
    coarse, fine = (classify_grid(duffing, (60, 60), refine=refine).labels for refine in (0, 1))
    away = agreeing(coarse, 2).repeat(2, axis=0).repeat(2, axis=1)  # from the boundary: these are not followed again
    _, seen = interrupted(BasinGrid(duffing, (60, 60), refine=1), math.inf)
    known = []
    for call in [call for call, update in enumerate(seen, start=1) if 60**2 < update.done < update.total]:
        partial, _ = interrupted(BasinGrid(duffing, (60, 60), refine=1), call)
        followed = partial != NOT_FOLLOWED
        assert followed[away].all()
        np.testing.assert_array_equal(partial[followed], fine[followed])
        known.append(followed.mean())
    assert away.mean() <= min(known) < max(known) < 1


def test_a_grid_whose_finer_one_would_take_too_many_sections_is_the_last(duffing, monkeypatch):
    fine = BasinGrid(duffing, None)
    fine.fill()
    assert fine.basins.labels.shape == (200, 200)
    assert all(finding.code is not Code.COARSE_GRID for finding in fine.findings)
    monkeypatch.setattr("vibrokit.structure.basins.grid._MOST_SECTIONS", 20_000)
    grid = BasinGrid(duffing, None, refine=1)
    _, seen = interrupted(grid, math.inf)
    assert seen[-1].done == seen[-1].total
    (finding,) = (finding for finding in grid.findings if finding.code is Code.COARSE_GRID)
    assert grid.basins.labels.shape == (2 * finding.values["nx"], 2 * finding.values["nv"]) == (100, 100)
    assert finding.values["sections"] > 20_000
    assert grid.basins.fraction(0) == pytest.approx(fine.basins.fraction(0), abs=0.02)
    given = BasinGrid(duffing, (200, 200))
    given.fill()
    np.testing.assert_array_equal(given.basins.labels, fine.basins.labels)


@pytest.mark.parametrize("cells", [(1, 1), (1, 3), (4, 1), (2, 2), (5, 3)], ids=str)
@pytest.mark.parametrize("scene", ["duffing", "hertz"])
def test_attractors_own_their_places_on_any_grid(scene, cells, request):
    """Of some of these grids, the cells around one attractor lead to the other."""
    known = request.getfixturevalue(scene)
    grid = BasinGrid(known, cells)
    grid.fill()
    found = grid.basins
    assert [int(label) for a in known.attractors for label in found.at(a.points)] == [0, 1]
    assert (Code.GRID_REFINED in {finding.code for finding in grid.findings}) == (found.labels.shape != cells)
    assert Code.ATTRACTOR_LOST not in {finding.code for finding in grid.findings}


def test_an_attractor_in_a_large_grid_is_found_by_splitting_few_cells():
    """A well at x = 1 that is narrower than a cell: those around it are split, and the others keep their labels."""
    spring = vk.CustomSpring("x + 500*(x - 1)*exp(-((x - 1)/w)**2)", w=0.01)
    osc = scene(damping_ratio=0.05, spring=spring)
    places = [(0.0, 0.0), (0.9979155389726735, 0.0)]  # the second by Brent's method
    grid = BasinGrid(classifier(osc, places, ((-2, 2), (-2, 2)), settling=1e-4, stepper=vk.RK4(512)), (80, 80))
    labels, seen = interrupted(grid, math.inf)
    assert [finding.code for finding in grid.findings] == [Code.GRID_REFINED]
    assert (labels.shape, grid.basins.at(np.array(places)).tolist()) == ((160, 160), [0, 1])
    kept = next(update.done for update in seen if update.stage == "basins of lost attractors" and update.done)
    assert 0.9 * labels.size < kept < labels.size


def test_executors_carry_the_work_to_the_same_labels(duffing):
    points = [a.points for a in duffing.attractors]
    expected = classify_grid(duffing, (70, 70)).labels
    pools = (futures.ThreadPoolExecutor(2), futures.ProcessPoolExecutor(1, mp_context=get_context("spawn")))
    for pool in pools:
        with pool:
            carried = classifier(duffing.osc, points, ((-3, 3), (-3, 3)), executor=pool)
            np.testing.assert_array_equal(classify_grid(carried, (70, 70)).labels, expected)
