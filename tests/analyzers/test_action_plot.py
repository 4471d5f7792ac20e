import dataclasses
import math

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.analyzers.exits import FirstContact
from vibrokit.analyzers.quasi_potential import local_potential
from vibrokit.analyzers.shooting.starts import ring_starts
from vibrokit.errors import SceneError, StructureError
from vibrokit.structure.orbits import refine_orbit


def test_clear_state_is_near_what_the_paper_has_and_far_easier_to_leave(paper):
    osc, structure = paper
    result = vk.ActionPlot(radius=1e-6, points=3000).run(osc, structure)
    clear, hammering = (next(e for e in result.energies if e.source == label) for label in (0, 1))
    # The paper's three methods give 7.3e-5 to 8.2e-5 for leaving N and 1.07e-3 to 1.15e-3 for leaving I.
    assert 6e-5 < clear.value < 1.1e-4
    assert 5 < hammering.value / clear.value < 40
    assert clear.target == 1
    assert clear.lower <= clear.value <= clear.upper


def test_the_path_pays_its_action_and_starts_on_the_ring(paper):
    osc, structure = paper
    energy = vk.ActionPlot(radius=1e-6, points=500, source=0).run(osc, structure).energies[0]
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
    first, second = (vk.ActionPlot(points=200, rounds=4, source=0).run(osc, structure) for _ in range(2))
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


@pytest.mark.parametrize(
    "bad",
    [
        {"radius": 0.0},
        {"radius": float("nan")},
        {"radius": "small"},
        {"points": 2},
        {"points": 1.5},
        {"rounds": -1},
        {"tolerance": 0.0},
        {"budget": 0},
    ],
)
def test_bad_settings(bad):
    with pytest.raises(StructureError, match=next(iter(bad))):
        vk.ActionPlot(**bad)


def test_unknown_source(paper):
    osc, structure = paper
    with pytest.raises(StructureError, match="no attractor of label 7"):
        vk.ActionPlot(source=7).run(osc, structure)


def test_the_whole_domain_finds_no_worse_than_the_ring(paper):
    osc, structure = paper
    ring = vk.ActionPlot(radius=1e-6, points=3000, source=0).run(osc, structure).energies[0]
    result = vk.ActionPlot(points=3000, source=0).run(osc, structure)
    domain = result.energies[0]
    assert domain.value <= ring.value
    assert domain.lower <= domain.value <= domain.upper
    data = result.data
    for name in ("angle", "radius", "action", "status", "target", "exit_x", "exit_v"):
        assert data[f"{name}_0"].dims == ("start_0",)
    assert data["angle_0"].values.min() >= 0
    assert data["angle_0"].values.max() < 2 * math.pi
    assert data["radius_0"].values.min() > 0
    assert data["radius_0"].values.max() < 1
    assert np.nanmin(data["action_0"].values) <= domain.value


def test_candidates_are_ranked_paths_on_the_grid_of_eighths(paper):
    osc, structure = paper
    found = vk.ActionPlot(points=3000).search(osc, structure, 0)
    actions = [candidate.action for candidate in found.candidates]
    assert actions == sorted(actions)
    assert len(actions) > 1
    orbit = structure.attractors[0].points[0]
    for candidate in found.candidates:
        assert (candidate.source, candidate.target) == (0, 1)
        eighths = candidate.times / (osc.section_interval / 8)
        np.testing.assert_allclose(eighths, np.arange(len(eighths)) + eighths[0], atol=1e-9)
        assert eighths[0] == pytest.approx(8 * round(eighths[0] / 8))
        assert np.linalg.norm(candidate.states[0] - orbit) < 0.01  # near the source
        settled = osc.section_map(candidate.states[-1:], 300)
        assert np.linalg.norm(settled[0] - structure.attractors[1].points[0]) < 1e-3  # beyond the boundary


def test_progress_grows_to_its_end(paper):
    osc, structure = paper
    seen = []
    vk.ActionPlot(points=300, rounds=3).run(osc, structure, progress=lambda done, total: seen.append(done / total))
    assert seen == sorted(seen)
    assert seen[-1] == 1


def test_an_interrupt_ends_it_and_leaves_it_usable(paper):
    osc, structure = paper

    def interrupt(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        vk.ActionPlot(points=300).run(osc, structure, progress=interrupt)
    assert vk.ActionPlot(points=300, rounds=0, source=0).run(osc, structure).energies


@pytest.mark.parametrize("kind", ["chaotic", "quasiperiodic", "limit cycle"])
def test_motion_without_an_orbit_to_start_from_is_left_out_with_the_reason(paper, kind):
    osc, structure = paper
    strange = dataclasses.replace(structure.attractors[1], kind=kind)
    changed = dataclasses.replace(structure, attractors=(structure.attractors[0], strange))
    result = vk.ActionPlot(points=300, rounds=0).run(osc, changed)
    assert f"Attractor 1 was left out: it is {kind}" in result.status
    with pytest.raises(StructureError, match=kind):
        vk.ActionPlot().search(osc, changed, 1)


def linear_scene(damping=0.05, amplitude=0.3, frequency=0.57, stop=1.0):
    law = vk.Hertz(stiffness=50.0)
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=damping,
        barriers=(vk.Barrier(law, stop, "right"),),
        excitations=(vk.Harmonic(amplitude, frequency),),
        noise=vk.WhiteNoise(1e-3),
    )


def test_first_contact_of_the_linear_scene():
    """ΔU = 2ζω_n³ (b − max x_s)², x_s the forced steady state; one attractor is enough."""
    osc = linear_scene()
    structure = vk.find_structure(osc, cells=(20, 20), starts=(4, 4), saddles=False, manifolds=False)
    clear = next(a for a in structure.attractors if a.impacts == 0)
    energy = vk.ActionPlot(points=2000, source=clear.label, exit=FirstContact()).run(osc, structure).energies[0]
    largest = 0.3 / math.hypot(1 - 0.57**2, 2 * 0.05 * 0.57)
    exact = 2 * 0.05 * (1.0 - largest) ** 2
    # A look falls within T/64 of the touch, where the mass is at most ½ x (2π/64 · 1/0.57)² short of the stop.
    short = 0.5 * (2 * math.pi / 64 / 0.57) ** 2
    assert exact * (1 - 1e-3) <= energy.value <= exact * ((1 - largest + short) / (1 - largest)) ** 2
    assert energy.lower <= exact


def test_a_state_that_touches_by_itself_is_left_out(paper):
    osc, structure = paper
    result = vk.ActionPlot(points=300, rounds=0, exit=FirstContact("right")).run(osc, structure)
    assert "Attractor 1 was left out: it counts as out by itself" in result.status
    assert [energy.source for energy in result.energies] == [0]
