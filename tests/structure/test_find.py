import numpy as np
import pytest

import vibrokit as vk
from vibrokit.errors import NoSectionError, ParameterError, StructureError
from vibrokit.results.region import Region
from vibrokit.structure.orbits import refine_orbit


def test_the_paper_scene_has_a_clear_and_a_hammering_state(paper):
    _, structure = paper
    clear, hammering = structure.attractors
    assert (clear.label, clear.impacts, clear.kind, clear.period) == (0, 0, "periodic", 1)
    assert hammering.impacts > 0
    assert sum(hammering.hits.values()) == hammering.impacts
    assert hammering.basin_fraction > clear.basin_fraction > 0  # as the paper says of ω = 0.570
    for attractor in structure.attractors:
        assert np.abs(attractor.multipliers).max() < 1
        # Liouville: both multipliers together are what friction leaves of an area, exp(−2ζω_n T).
        assert np.prod(attractor.multipliers).real == pytest.approx(np.exp(-0.02 * 2 * np.pi / 0.57), rel=1e-4)


def test_the_clear_state_is_the_linear_response(paper):
    osc, structure = paper
    response = 0.18 / (1 - 0.57**2 + 2j * 0.01 * 0.57)
    exact = [response.real + 0.2, (0.57j * response).real]
    orbit = refine_orbit(osc, structure.attractors[0].points[0], 1, vk.RK4(8192))
    np.testing.assert_allclose(orbit.point, exact, atol=1e-12)
    np.testing.assert_allclose(structure.attractors[0].points[0], exact, atol=1e-6)


def test_labels_are_where_the_flow_leads(paper):
    osc, structure = paper
    basins = structure.basins
    centres = basins.region.cell_centres(basins.labels.shape)
    picked = np.random.default_rng(0).choice(len(centres), 50, replace=False)
    ends = osc.section_map(centres[picked], 400, stepper=vk.RK4(512))
    points = np.array([attractor.points[0] for attractor in structure.attractors])
    nearest = np.argmin(np.linalg.norm(ends[:, None] - points, axis=2), axis=1)
    assert np.mean(nearest == basins.labels.ravel()[picked]) > 0.9  # cells on a boundary may differ by the step


def test_duffing_has_a_small_and_a_large_orbit():
    osc = vk.load_scene("duffing")
    structure = vk.find_structure(osc, cells=(60, 60), region=((-3, 3), (-3, 3)))
    sizes = [np.abs(osc.trajectory(a.points[0], 1).x).max() for a in structure.attractors]
    assert len(sizes) == 2
    assert min(sizes) < 1 < max(sizes)


def test_the_double_well_is_symmetric_to_the_last_cell():
    structure = vk.find_structure(vk.load_scene("double-well"), cells=(80, 80), region=((-2, 2), (-2, 2)))
    labels = structure.basins.labels
    np.testing.assert_array_equal(labels, 1 - labels[::-1, ::-1])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"damping_ratio": 0.0}, "damping"),
    ],
)
def test_scenes_without_attractors_are_refused(change, words):
    with pytest.raises(StructureError, match=words):
        vk.find_structure(vk.load_scene("hertz-0.570").replace(change))


def test_no_common_period_is_said():
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.1,
        excitations=(vk.Harmonic(0.1, 1.0), vk.Harmonic(0.1, 2**0.5)),
    )
    with pytest.raises(NoSectionError, match="no common period"):
        vk.find_structure(osc)


@pytest.mark.parametrize("bounds", [((1, -1), (0, 1)), ((0, 0), (0, 1)), ((0, float("nan")), (0, 1)), 3, ((0, 1),)])
def test_bad_regions(bounds):
    with pytest.raises(StructureError, match="region"):
        Region.of(bounds)


@pytest.mark.parametrize("budget", [0, -1, 1.5, True])
def test_bad_budgets(budget):
    with pytest.raises(StructureError, match="budget"):
        vk.find_structure(vk.load_scene("hertz-0.570"), budget=budget)


def test_a_budget_too_small_is_said():
    with pytest.raises(StructureError, match="raise budget"):
        vk.find_structure(vk.load_scene("hertz-0.570"), budget=1, starts=(4, 4), cells=(4, 4))


@pytest.mark.parametrize(
    "bad",
    [
        {"cells": 200}, {"cells": (0, 2)}, {"cells": (2.5, 3)}, {"cells": (10**6, 10**6)}, {"starts": None},
        {"starts": (0, 0)}, {"settling": 0}, {"settling": -1.0}, {"settling": "a"}, {"budget": 10**30},
    ],
    ids=str,
)  # fmt: skip
def test_bad_counts(bad):
    with pytest.raises(StructureError, match=next(iter(bad))):
        vk.find_structure(vk.load_scene("hertz-0.570"), **bad)


@pytest.mark.parametrize("rng", [-1, "x", 1.5])
def test_bad_seeds(rng):
    with pytest.raises(ParameterError, match="rng"):
        vk.find_structure(vk.load_scene("hertz-0.570"), rng=rng)
    with pytest.raises(ParameterError, match="rng"):
        vk.load_scene("hertz-0.570").trajectory([0, 0], 1, rng=rng)


def test_a_scene_whose_noise_depends_on_the_state():
    well = vk.load_scene("double-well")
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.05,
        spring=well.spring,
        noise=vk.StateDependentNoise(0.01, "1 + c*x**2", c=0.5),
    )
    assert len(vk.find_structure(osc, cells=(20, 20), starts=(8, 8)).attractors) == 2
