"""Unstable orbits from a grid of starts, against the index theorem, Liouville's law and the logistic route to chaos."""

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import scene
from tests.structure.stable import stable_orbits
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.results.region import Region
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.unstable_orbits import unstable_orbits
from vibrokit.symbolic.flow_kind import Flow

STOPS = ((-0.7, 0.8), (-1.0, 1.0))


def index(multipliers):
    """Index of a fixed point of a map: the sign of det(1 − DF)."""
    return int(np.sign(np.prod(1 - np.asarray(multipliers)).real))


@pytest.mark.parametrize(
    ("name", "starts", "bounds"),
    [
        ("hertz-0.570", [(0.466551, 0.002566), (0.023582, -0.049071)], STOPS),
        ("hertz-0.525", [(0.448438, 0.001891)], STOPS),
        ("duffing", [(0, 0), (2, 1)], ((-3, 3), (-3, 3))),
    ],
)
def test_indices_of_all_fixed_points_add_up_to_one(name, starts, bounds):
    # A map that takes a disc into itself: Lefschetz.
    osc = vk.load_scene(name)
    unstable = unstable_orbits(osc, 1, region=bounds)
    stable = stable_orbits(osc, *starts)
    assert sum(index(orbit.multipliers) for orbit in (*stable, *unstable)) == 1
    assert any(index(orbit.multipliers) == -1 for orbit in unstable)


@pytest.mark.slow
@pytest.mark.parametrize("period", [2, 3, 5])
def test_orbits_of_longer_period_are_born_in_pairs_or_by_doubling(period):
    # The index of the map's power is 1 too, so that those of all its fixed points that are no fixed points of the map
    # add up to 1 less what the fixed points of the map have under its power.
    osc = vk.load_scene("hertz-0.525")
    fixed = [stable_orbits(osc, (0.448438, 0.001891))[0], *unstable_orbits(osc, 1, region=STOPS)]
    found = unstable_orbits(osc, period, region=STOPS, starts=(16, 16))
    assert found
    total = sum(index(orbit.multipliers**period) for orbit in fixed)
    assert total + period * sum(index(orbit.multipliers) for orbit in found) == 1
    for orbit in found:
        assert orbit.period == len(orbit.points) == period
        assert orbit.residual <= 1e-10
        assert orbit.error <= 1e-8
        left = np.exp(-2 * osc.damping_ratio * period * osc.section_interval)
        assert np.prod(orbit.multipliers).real == pytest.approx(left, rel=1e-7)
        assert np.abs(orbit.multipliers).tolist() == sorted(np.abs(orbit.multipliers), reverse=True)
        np.testing.assert_allclose(np.exp(orbit.exponents * orbit.duration), orbit.multipliers)
        # Visited one after the other, by another stepper than the one that found them.
        images = osc.section_map(orbit.points, stepper=vk.Order8(1e-12))
        np.testing.assert_allclose(images, np.roll(orbit.points, -1, axis=0), atol=1e-9)


def test_flip_saddles_are_named_and_do_not_depend_on_the_starts():
    osc = vk.load_scene("hertz-0.525")
    few, many = (unstable_orbits(osc, 1, region=STOPS, starts=(n, n)) for n in (8, 24))
    assert [orbit.kind for orbit in few] == [orbit.kind for orbit in many] == ["flip saddle", "saddle"]
    for orbit, same in zip(few, many, strict=True):
        np.testing.assert_allclose(orbit.points, same.points, rtol=0, atol=1e-10)
        assert orbit.leads_to == ()


def test_a_classifier_finds_where_the_branches_lead():
    osc = vk.load_scene("hertz-0.570")
    both = stable_orbits(osc, (0.466551, 0.002566), (0.023582, -0.049071))
    classifier = BasinClassifier(osc, both, Region.of(STOPS), 1e-3, 1000, ensemble_stepper(osc, Flow.STATE))
    (saddle,) = unstable_orbits(osc, 1, region=STOPS, classifier=classifier)
    assert set(saddle.leads_to) == {0, 1}


def test_equilibria_of_a_scene_without_forcing():
    # A spring with five equilibria, x (x² − 1) (x² − 4): those at ±1 are hilltops, the others wells.
    spring = vk.CustomSpring("x*(x**2 - 1)*(x**2 - 4)")
    osc = scene(damping_ratio=0.05, spring=spring)
    found = unstable_orbits(osc, 1, region=((-3, 3), (-3, 3)))
    np.testing.assert_allclose([orbit.points[0] for orbit in found], [[-1, 0], [1, 0]], atol=1e-12)
    rates = -0.05 + np.array([1, -1]) * np.sqrt(0.05**2 + 6)  # the slope of the spring there is −6
    for orbit in found:
        np.testing.assert_allclose(orbit.exponents, rates, rtol=1e-9)
        assert (orbit.kind, orbit.duration) == ("saddle", 0.0)


def test_a_repeller():
    # x″ − μ (1 − x²) x′ + x = 0 leaves the origin spirally, at μ/2 ± i √(1 − μ²/4).
    spring = vk.CustomSpring("x + mu*(x**2 - 1)*v", mu=1.0)
    osc = scene(damping_ratio=0.0, spring=spring)
    (orbit,) = unstable_orbits(osc, 1, region=((-3, 3), (-3, 3)), starts=(9, 9))
    assert orbit.kind == "repeller"
    np.testing.assert_allclose(orbit.points, [[0, 0]], atol=1e-12)
    np.testing.assert_allclose(sorted(orbit.exponents, key=np.imag), [0.5 - 0.75**0.5 * 1j, 0.5 + 0.75**0.5 * 1j])
