"""Mirror images of exit paths: energies are those of a search of its own, and only symmetric scenes have them."""

import dataclasses
import functools

import numpy as np
import pytest
import scipy.interpolate

import vibrokit as vk
from tests.layers import long
from vibrokit.analyzers.mirrored import mirrored
from vibrokit.analyzers.paths.mirror import Mirror
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sources import MirrorImages
from vibrokit.results.codes import Code

LEAST = vk.LeastAction(graph=vk.GraphSearch(nodes=(120, 120)), shooting=vk.Shooting(points=2000, rounds=8))
SYMMETRIC = {
    "forced": {"excitations": (vk.Harmonic(amplitude=0.1, frequency=0.8),)},
    "third harmonic": {"excitations": (vk.Harmonic(0.08, 0.8), vk.Harmonic(0.02, 2.4))},
    "unforced": {"excitations": (), "noise": vk.StateDependentNoise(1e-4, "1 + c*x**2", c=0.1)},
}
STOP = vk.Barrier(vk.Linear(30.0), 1.7, "right")  # beyond the paths
OTHERS = {
    "noise": {"noise": vk.StateDependentNoise(1e-4, "1 + c*x", c=0.1)},
    "one stop": {"barriers": (STOP,)},
    "second harmonic": {"excitations": (vk.Harmonic(0.1, 0.8), vk.Harmonic(0.02, 1.6))},
}


@functools.cache
def wells(kind):
    more = {"noise": vk.WhiteNoise(intensity=1e-4)} | SYMMETRIC["forced"] | (SYMMETRIC | OTHERS)[kind]
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, spring=vk.CubicSpring(-1.0, 1.0), **more)
    return osc, vk.find_structure(osc, cells=(80, 80), starts=(10, 10), manifolds=False)


@functools.cache
def both(kind):
    return LEAST.run(*wells(kind))


@pytest.mark.long
@pytest.mark.parametrize("kind", ["forced", "unforced", "third harmonic"])
def test_the_second_well_has_the_energies_that_a_search_finds_there(kind):
    osc, structure = wells(kind)
    first, second = both(kind).energies
    (image,) = both(kind).found(Code.MIRROR_IMAGE)
    assert (image.source, image.target) == (second.source, second.target) == (first.target, first.source)
    assert (second.lower, second.bound) == (first.lower, first.bound)
    assert second.value == pytest.approx(first.value, rel=1e-10)
    alone = vk.LeastAction(source=second.source, graph=LEAST.graph, shooting=LEAST.shooting).run(osc, structure)
    assert not alone.found(Code.MIRROR_IMAGE)
    assert alone.energies[0].value == pytest.approx(second.value, rel=1e-9)
    assert alone.energies[0].certificate is not None
    assert second.certificate.residual < 1e-9


@pytest.mark.long
@pytest.mark.parametrize("kind", ["forced", "unforced"])
def test_the_second_well_has_the_mirror_image_of_the_quasi_potential(kind):
    """Around the second well it is what the graph finds there."""
    osc, structure = wells(kind)
    searched = both(kind).data.isel(source=1)
    alone = dataclasses.replace(LEAST, source=1, shooting=None).run(osc, structure).data.isel(source=0)
    found, wanted = (
        scipy.interpolate.RegularGridInterpolator(
            (each.quasi_potential_x.values, each.quasi_potential_v.values), each.quasi_potential.values
        )(structure.attractors[1].points[0, :2] + np.array([[0.0, 0.0], [-0.1, 0.1], [0.2, 0.0], [0.1, -0.2]]))
        for each in (searched.dropna("node_x", how="all").dropna("node_v", how="all"), alone)
    )
    np.testing.assert_allclose(found, wanted, rtol=0.05, atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["forced", *map(long, OTHERS)])
def test_only_a_symmetric_scene_has_mirror_images(kind):
    osc, structure = wells(kind)
    labels = [Mirror(ExitProblem(osc, structure, one, vk.LeaveBasin())).image for one in structure.attractors]
    assert labels == ([1, 0] if kind == "forced" else [None, None])


@pytest.mark.slow
def test_the_image_of_a_path_begins_on_the_section_half_a_period_later():
    osc, structure = wells("forced")
    left, right = structure.attractors
    known = both("forced").energies[:1]
    mirror = Mirror(ExitProblem(osc, structure, right, vk.LeaveBasin()))
    (image,) = mirror.candidates(known)
    period = 2 * np.pi / 0.8
    path = known[0].path
    half = np.searchsorted(path.t, period / 2 - 1e-9)
    assert image.times[0] == pytest.approx(period)
    assert np.ptp(np.diff(image.times)) < 1e-9
    np.testing.assert_allclose(image.times, path.t[half:] + period / 2, atol=1e-9)
    np.testing.assert_array_equal(image.states, -path.q[half:])
    np.testing.assert_array_equal(image.momenta, -path.p[half:])
    assert (image.source, image.target) == (right.label, left.label)
    assert mirror.candidates(both("forced").energies[1:]) == []  # it leaves the attractor itself


@pytest.mark.slow
def test_one_way_out_of_a_state_that_is_its_own_image_gives_the_other():
    spring = vk.CustomSpring("x*(x**2 - 1)*(x**2 - 4)/4")
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.3, spring=spring, excitations=(vk.Harmonic(0.05, 0.8),),
        noise=vk.WhiteNoise(intensity=1e-3),
    )  # fmt: skip
    structure = vk.find_structure(osc, cells=(80, 80), starts=(10, 10), manifolds=False)
    middle = structure.attractor("middle-oscillation")
    found = vk.LeastAction(source=middle.label, graph=None, shooting=LEAST.shooting).run(osc, structure)
    one = found.branches[0]
    problem = ExitProblem(osc, structure, middle, vk.LeaveBasin())
    (image,) = MirrorImages().propose(problem, (one,))
    assert {image.target, one.target} == {0, 2}
    assert MirrorImages().propose(problem, found.branches) == []


@pytest.mark.slow
@pytest.mark.parametrize("change", [{"value": 1.001}, {"path": None}, {"bound": vk.Bound.EXACT}], ids=str)
def test_an_attractor_whose_images_are_not_found_again_is_searched(change):
    osc, structure = wells("forced")
    energy = both("forced").energies[0]
    if "value" in change:
        change = {"value": change["value"] * energy.value, "upper": 2 * energy.value}
    known = vk.Analysis((dataclasses.replace(energy, **change),), branches=both("forced").branches[:1])
    assert mirrored(ExitProblem(osc, structure, structure.attractors[1], vk.LeaveBasin()), known, None) is None
