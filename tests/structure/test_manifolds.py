"""Manifolds against closed forms, against the basins that they bound, and against themselves."""

import dataclasses
import functools
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import scene
from tests.structure.stable import saddle
from vibrokit.kernels.ensemble import Stop, run_ensemble
from vibrokit.results.saddle import ManifoldEnd
from vibrokit.structure.curves import Domain, Growth, Limits
from vibrokit.structure.manifolds import grow_manifolds
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

DOUBLE_WELL = vk.load_scene("double-well")
SQUARE = ((-1.0, 1.0), (-1.0, 1.0))
WIDE = ((-3.0, 3.0), (-3.0, 3.0))


def distances(points, curve):
    """Distance of each point to a curve of straight chords."""
    start, step = curve[:-1], np.diff(curve, axis=0)
    size = np.maximum((step**2).sum(axis=1), 1e-300)
    found = []
    for point in points:
        share = np.clip(((point - start) * step).sum(axis=1) / size, 0.0, 1.0)
        found.append(np.linalg.norm(start + share[:, None] * step - point, axis=1).min())
    return np.array(found)


# --- closed forms


@pytest.mark.parametrize("stepper", [None, vk.Order8(1e-11)], ids=repr)
def test_the_undamped_double_well_has_its_figure_of_eight(stepper):
    """½v² − ½x² + ¼x⁴ = 0, the level of the energy that holds the saddle; it returns to the saddle."""
    osc = vk.load_scene("double-well").replace({"damping_ratio": 0.0})
    branches = list(grow_manifolds(osc, 3, saddle([0.0, 0.0]), region=((-1.6, 1.6), (-1.0, 1.0)), stepper=stepper))
    assert [(b.stable, b.side) for b in branches] == [(True, -1), (True, 1), (False, -1), (False, 1)]
    loop = _loop_length()
    for branch in branches:
        x, v = branch.curve.T
        assert abs(v**2 / 2 - x**2 / 2 + x**4 / 4).max() < 1e-8
        assert (branch.side * x).min() > -1e-4
        assert branch.side * x.max() * branch.side == pytest.approx(math.sqrt(2) if branch.side > 0 else 0.0, abs=1e-4)
        assert (branch.saddle, branch.point) == (3, 0)
        if stepper:  # RK4's rounding decides when it leaves again
            assert branch.arc_length == pytest.approx(loop, rel=1e-3)
            assert branch.end is ManifoldEnd.AT_REST
    stable, unstable = branches[1].curve, branches[3].curve
    assert stable[1, 1] < 0.0 < unstable[1, 1]


def _loop_length():
    """Length of one loop of v² = x² − x⁴/2, by x = √2 sin θ that has no singular end."""
    angle = np.linspace(0.0, math.pi / 2, 200_001)
    x = math.sqrt(2) * np.sin(angle)
    v = x * np.sqrt(np.maximum(1.0 - x**2 / 2, 0.0))
    return 2 * np.hypot(np.diff(x), np.diff(v)).sum()


@pytest.mark.parametrize("ratio", [0.0, 0.3, 2.0])
def test_a_linear_saddle_has_straight_lines_to_the_edge(ratio):
    """x″ + 2ζx′ − x = 0: v = λx with λ = −ζ ± √(ζ² + 1), to |x| = 3 or |v| = 3, the region widened by its size."""
    osc = scene(damping_ratio=ratio, spring=vk.CubicSpring(-1.0, 0.0))
    for branch in grow_manifolds(osc, 0, saddle([0.0, 0.0]), region=SQUARE):
        rate = -ratio + (-1 if branch.stable else 1) * math.hypot(ratio, 1.0)
        x, v = branch.curve.T
        assert abs(v - rate * x).max() < 1e-7
        assert np.abs(branch.curve[-1]).max() == pytest.approx(3.0, rel=1e-12)
        assert branch.side * x[-1] > 0.0
        assert branch.end is ManifoldEnd.LEAVES_REGION


def test_a_branch_ends_before_it_takes_too_many_sections():
    osc, region = vk.load_scene("duffing"), ((-3.0, 3.0), (-3.0, 3.0))
    (found,) = vk.find_structure(osc, cells=(20, 20), manifolds=False).saddles
    given = {"region": region, "stepper": vk.RK4(128), "stable": (False,)}
    whole = list(grow_manifolds(osc, 0, found, **given))
    short = list(grow_manifolds(osc, 0, found, most_sections=2000, **given))
    for one, other in zip(whole, short, strict=True):
        assert other.end in (ManifoldEnd.MOST_SECTIONS, one.end)
        np.testing.assert_array_equal(other.curve, one.curve[: len(other.curve)])
    assert any(branch.end is ManifoldEnd.MOST_SECTIONS for branch in short)
    assert min(len(branch.curve) for branch in short) > 10


@pytest.mark.parametrize(("growth", "turn"), [(1.5, 0.3), (40.0, 0.1)])
def test_a_map_with_a_curve_in_closed_form(growth, turn):
    """(x, y) → (λx, μy + x³) has the unstable manifold y = x³/(λ³ − μ)."""

    def images(states, count):
        for _ in range(count):
            states = np.column_stack([growth * states[:, 0], turn * states[:, 1] + states[:, 0] ** 3])
        return states

    domain = Domain(np.zeros(2), np.array([1e-6, 0.0]), growth, np.zeros(2))
    limits = Limits(np.array([-1.0, -1.0]), np.array([2.0, 2.0]), 0.01, 0.2, 2.5)
    curve, end = Growth(domain, images, limits).run()
    factor = 1.0 / (growth**3 - turn)
    assert abs(curve[:-1, 1] - factor * curve[:-1, 0] ** 3).max() < 1e-12
    assert np.linalg.norm(np.diff(curve, axis=0), axis=1).sum() == pytest.approx(2.5, rel=1e-12)
    assert end is ManifoldEnd.ARC_LENGTH


# --- a scene without stops, and the paper's, each with two attractors and one saddle between


@functools.cache
def duffing():
    """The scene of two attractors and a saddle: its saddle, its attractors, its branches."""
    osc, exact = vk.load_scene("duffing"), vk.Order8(1e-11)
    point = refine_orbit(osc, np.array([-1.39, 1.82]), 1, exact).point
    attractors = [refine_orbit(osc, np.array(guess), 1, exact).point for guess in ((-0.43, 0.09), (1.36, 2.42))]
    return osc, point, np.array(attractors), list(grow_manifolds(osc, 0, saddle(point), region=WIDE))


@functools.cache
def paper():
    osc, exact = vk.load_scene("hertz-0.570"), vk.FreeFlight(1e-11)
    point = refine_orbit(osc, np.array([0.5345, -0.0384]), 1, exact).point
    attractors = np.array([[0.466551, 0.002566], [0.023582, -0.049071]])
    return osc, point, attractors, list(grow_manifolds(osc, 0, saddle(point), region=SQUARE))


SCENES = pytest.mark.parametrize("scene", [duffing, paper])


@SCENES
def test_unstable_branches_come_to_the_attractors(scene):
    _, _, attractors, branches = scene()
    ends = [branch.curve[-1] for branch in branches if not branch.stable]
    gaps = np.linalg.norm(np.array(ends)[:, None] - attractors, axis=2)
    assert sorted(gaps.argmin(axis=1)) == [0, 1]
    assert gaps.min(axis=1).max() < 1e-4  # RK4 shifts them by as much
    assert all(branch.end is ManifoldEnd.AT_REST for branch in branches if not branch.stable)


@SCENES
def test_the_stable_manifold_is_the_boundary_of_the_basins(scene):
    osc, _, attractors, branches = scene()
    stepper = vk.Order8(1e-8) if scene is duffing else vk.FreeFlight(1e-8)
    stop = Stop(points=attractors, point_labels=np.array([0, 1]), metrics=np.tile(np.eye(2) / 1e-3, (2, 1, 1)))
    for branch in branches[:2]:
        lengths = np.cumsum(np.linalg.norm(np.diff(branch.curve, axis=0), axis=1))
        along = np.searchsorted(lengths, np.linspace(0.05, 0.9, 20))  # farther on, other arms of it come close
        chords = branch.curve[along + 1] - branch.curve[along]
        normal = np.column_stack([-chords[:, 1], chords[:, 0]]) / np.linalg.norm(chords, axis=1)[:, None]
        for distance in (-2e-3, 2e-3):  # some times what RK4 and straight chords are off
            sides = branch.curve[along] + distance * normal
            labels = run_ensemble(osc, Flow.STATE, stepper, sides, 1000, stop=stop).label
            assert (labels == labels[0]).mean() > 0.99
            assert labels[0] >= 0
            if distance < 0:
                other = labels[0]
        assert labels[0] != other


@SCENES
def test_images_of_a_branch_lie_on_it(scene):
    """By the stepper that grew it, to what chords of this length and bend are off: chord · angle/8."""
    osc, _, _, branches = scene()
    width = np.diff(np.array(WIDE if scene is duffing else SQUARE))[0, 0]
    for branch in branches[2:]:
        nodes = branch.curve[: len(branch.curve) // 2 : 20]
        images = run_ensemble(osc, Flow.STATE, vk.RK4(1024), nodes).states
        assert distances(images, branch.curve).max() < 0.01 * 0.2 / 8 * width


@SCENES
def test_chords_and_angles_keep_their_bounds(scene):
    width = np.diff(np.array(WIDE if scene is duffing else SQUARE))[0, 0]
    for branch in scene()[3]:
        steps = np.diff(branch.curve, axis=0) / width
        chords = np.linalg.norm(steps, axis=1)
        heads = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        angles, longer = np.abs(np.diff(heads)), np.maximum(chords[1:], chords[:-1])
        assert chords.max() <= 0.01
        shared = longer > 1e-4
        assert angles[shared & (np.minimum(chords[1:], chords[:-1]) > 1e-4)].max() <= 0.2 + 1e-9
        assert (longer * angles)[shared & (np.minimum(chords[1:], chords[:-1]) > 1e-4)].max() <= 1e-3 + 1e-9


@pytest.mark.parametrize("length", [1e-9, 0.37, 5.0])
def test_the_arc_length_asked_for(length):
    osc, point, _, _ = duffing()
    for branch in grow_manifolds(osc, 0, saddle(point), region=WIDE, arc_length=length, stable=(True,)):
        assert branch.arc_length == pytest.approx(length, rel=1e-9)


def test_a_finer_curve_lies_within_what_the_coarser_one_claims():
    osc, point, _, coarse = duffing()
    fine = list(grow_manifolds(osc, 0, saddle(point), region=WIDE, spacing=0.005, bend=0.1))
    for one, other in zip(coarse, fine, strict=True):
        assert len(other.curve) > 1.3 * len(one.curve)
        assert distances(one.curve[:-1:7], other.curve).max() < 0.005 * 0.1 / 8 * 6.0
        middles = 0.5 * (one.curve[1:] + one.curve[:-1])[::7]
        assert distances(middles, other.curve).max() < (0.01 * 0.2 + 0.005 * 0.1) / 8 * 6.0


@pytest.mark.long
def test_another_stepper_finds_the_same_curve():
    osc, point, _, branches = paper()
    exact = list(grow_manifolds(osc, 0, saddle(point), region=SQUARE, stepper=vk.FreeFlight(1e-8), arc_length=3.0))
    for one, other in zip(exact, branches, strict=True):
        assert np.quantile(distances(one.curve[::5], other.curve), 0.95) < 5e-4


@pytest.mark.slow
def test_a_flip_saddle_and_an_orbit_of_two_points():
    """Driven double well: both multipliers are negative, so each branch is carried to the other side and back."""
    osc = DOUBLE_WELL.replace({"damping_ratio": 0.125})
    osc = dataclasses.replace(osc, excitations=(vk.Harmonic(0.3, 1.0),), noise=None)
    orbit = refine_orbit(osc, np.array([0.13, 0.19]), 1, vk.Order8(1e-11))
    assert np.linalg.eigvals(orbit.monodromy).max() < 0.0
    region = ((-1.5, 1.5), (-1.0, 1.0))
    flip = list(grow_manifolds(osc, 0, saddle(orbit.point, kind="flip saddle"), region=region, arc_length=4.0))
    for one, other in ((flip[2], flip[3]), (flip[3], flip[2])):
        along = np.cumsum(np.linalg.norm(np.diff(one.curve, axis=0), axis=1))
        nodes = one.curve[1:][along < 0.25]  # the map stretches by 8, and the curves are 4 long
        images = run_ensemble(osc, Flow.STATE, vk.RK4(1024), nodes).states
        assert distances(images, other.curve).max() < 1e-3
    twice = list(
        grow_manifolds(
            osc, 0, saddle(orbit.point, orbit.point, period=2), region=region, arc_length=4.0, stable=[False]
        )
    )
    assert [branch.point for branch in twice] == [0, 0, 1, 1]
    assert distances(twice[1].curve, flip[3].curve).max() < 1e-3


def test_the_same_bits_from_any_executor():
    osc, point, _, branches = duffing()
    with ThreadPoolExecutor(1) as pool:
        again = list(grow_manifolds(osc, 0, saddle(point), region=WIDE, executor=pool))
    assert all(np.array_equal(one.curve, other.curve) for one, other in zip(branches, again, strict=True))


# --- where there is nothing to grow


def test_the_saddle_is_outside():
    for branch in grow_manifolds(DOUBLE_WELL, 0, saddle([0.0, 0.0]), region=((5.0, 6.0), (5.0, 6.0))):
        assert branch.curve.tolist() == [[0.0, 0.0]]
        assert branch.end is ManifoldEnd.SADDLE_OUTSIDE


def test_a_direction_that_all_but_vanishes_in_a_period_is_not_followed():
    osc = dataclasses.replace(
        DOUBLE_WELL.replace({"damping_ratio": 2.0}), excitations=(vk.Harmonic(0.05, 1.0),), noise=None
    )
    branches = list(grow_manifolds(osc, 0, saddle([0.0, 0.0]), region=((-1.6, 1.6), (-1.0, 1.0))))
    assert all(len(branch.curve) == 1 and branch.end is ManifoldEnd.TOO_EXTREME for branch in branches[:2])
    assert all(branch.arc_length > 0.5 and branch.end is ManifoldEnd.AT_REST for branch in branches[2:])
