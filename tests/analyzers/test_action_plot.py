import numpy as np
import pytest

import vibrokit as vk
from vibrokit.analyzers.quasi_potential import local_potential
from vibrokit.analyzers.ring import ring_starts
from vibrokit.errors import SceneError, StructureError
from vibrokit.structure.orbits import refine_orbit


def test_clear_state_is_near_what_the_paper_has_and_far_easier_to_leave(paper):
    osc, structure = paper
    result = vk.ActionPlot(points=3000).run(osc, structure)
    clear, hammering = (next(e for e in result.energies if e.source == label) for label in (0, 1))
    # The paper's three methods give 7.3e-5 to 8.2e-5 for leaving N and 1.07e-3 to 1.15e-3 for leaving I.
    assert 6e-5 < clear.value < 1.1e-4
    assert 5 < hammering.value / clear.value < 40
    assert clear.target == 1
    assert clear.lower <= clear.value <= clear.upper


def test_the_path_pays_its_action_and_starts_on_the_ring(paper):
    osc, structure = paper
    energy = vk.ActionPlot(points=500, source=0).run(osc, structure).energies[0]
    path = energy.path
    step = np.diff(path.t)
    paid = np.sum(step * (path.p[1:, 1] ** 2 + path.p[:-1, 1] ** 2) / 4)  # ∫ ½ p₂² dt by trapezoids
    assert path.action[-1] - path.action[0] == pytest.approx(paid, rel=1e-3)
    assert path.action[-1] == pytest.approx(energy.value, rel=1e-6)
    orbit = refine_orbit(osc, structure.attractors[0].points[0], 1, vk.RK4())
    assert np.linalg.norm(path.q[0] - orbit.point) == pytest.approx(1e-6, rel=1e-6)
    assert np.all(np.diff(path.action) >= 0)


def test_starts_lie_on_the_quadratic_quasi_potential(paper):
    osc, structure = paper
    orbit = refine_orbit(osc, structure.attractors[0].points[0], 1, vk.RK4())
    potential = local_potential(osc, orbit, vk.RK4())
    starts = ring_starts(orbit.point, potential, 1e-3, np.linspace(0, 6, 7))
    # Linear regime: Ψ = 2ζω_n³ δx² + 2ζω_n δv² = 0.02 radius² in all directions.
    np.testing.assert_allclose(starts[:, -1], 0.02 * 1e-6, rtol=1e-6)


def test_the_same_bits_on_every_run(paper):
    osc, structure = paper
    first, second = (vk.ActionPlot(points=200, source=0).run(osc, structure) for _ in range(2))
    np.testing.assert_array_equal(first.data["action_0"], second.data["action_0"])


def test_no_noise_is_refused(paper):
    osc, structure = paper
    quiet = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.01, barriers=osc.barriers, excitations=osc.excitations)
    with pytest.raises(SceneError, match="no noise"):
        vk.ActionPlot().run(quiet, structure)


def test_one_attractor_is_refused():
    osc = vk.load_scene("double-well")
    structure = vk.find_structure(osc, region=((0.5, 1.5), (-0.1, 0.1)), starts=(3, 3), cells=(4, 4))
    with pytest.raises(StructureError, match="one attractor only"):
        vk.ActionPlot().run(osc, structure)


@pytest.mark.parametrize("bad", [{"radius": 0.0}, {"radius": float("nan")}, {"points": 2}, {"points": 1.5}])
def test_bad_settings(bad):
    with pytest.raises(StructureError, match=next(iter(bad))):
        vk.ActionPlot(**bad)


def test_unknown_source(paper):
    osc, structure = paper
    with pytest.raises(StructureError, match="no attractor of label 7"):
        vk.ActionPlot(source=7).run(osc, structure)
