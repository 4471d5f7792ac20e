"""The graph's quasi-potential where it is known in closed form, and whether the error that it tells is true."""

import functools
import math
import os

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.analyzers.polishing.branches import polish_all
from vibrokit.errors import StructureError

BARRIER = 0.25  # of −x²/2 + x⁴/4
SMALL = vk.ActionGraph(cells=(64, 64))


# --- double well without forcing: Ψ = 4ζω_n E


@functools.cache
def well(damping):
    osc = vk.load_scene("double-well").replace({"damping_ratio": damping})
    return osc, vk.find_structure(osc, cells=(100, 100), starts=(8, 8), manifolds=False)


@functools.cache
def screened(damping, cells=(320, 320), fraction=None):
    return vk.ActionGraph(cells=cells, fraction=fraction).search(*well(damping), 0)


def misses(found, damping):
    """|V − 4ζE| over the whole well of x = −1, relative to the barrier; infinite where V is not known."""
    potential = found.potential
    x, v = np.moveaxis(potential.grids.nodes(0), -1, 0)
    energy = v**2 / 2 + x**4 / 4 - x**2 / 2 + BARRIER
    values = np.where(potential.values[0] < potential.unreached, potential.values[0], np.inf)
    inside = (x < 0) & (energy < BARRIER)
    assert inside.sum() > 500
    return np.abs(values - 4 * damping * energy)[inside] / (4 * damping * BARRIER)


@pytest.mark.parametrize("damping", [0.01, 0.1, 0.5, 2.0])
def test_barrier_of_the_double_well_by_default(damping):
    found = screened(damping)
    exact = 4 * damping * BARRIER
    value, error = found.targets[1]
    assert value == pytest.approx(exact, rel=0.02)
    assert abs(value - exact) <= error
    assert found.barriers == {0: (value, error)}
    assert found.saddles == {1: 0}


@pytest.mark.parametrize("damping", [0.01, 0.1, 0.5, 2.0])
def test_the_whole_well_by_default(damping):
    assert misses(screened(damping), damping).max() <= 0.02


@pytest.mark.parametrize("damping", [0.1, 0.3])
@pytest.mark.parametrize("cells", [80, 160, 320])
def test_the_error_told_is_true_as_cells_refine(damping, cells):
    value, error = screened(damping, (cells, cells)).targets[1]
    assert abs(value - 4 * damping * BARRIER) <= error


@pytest.mark.parametrize("damping", [0.05, 0.3])
@pytest.mark.parametrize("fraction", [4, 8, 16])
def test_the_error_told_is_true_as_steps_refine(damping, fraction):
    value, error = screened(damping, (160, 160), fraction).targets[1]
    assert abs(value - 4 * damping * BARRIER) <= error


def test_the_error_told_shrinks_with_cells_and_steps():
    errors = [
        screened(0.3, (40 * fraction // 4, 40 * fraction // 4), fraction).targets[1][1] for fraction in (8, 16, 32)
    ]
    assert errors[2] < 0.5 * errors[1] < 0.25 * errors[0]


# --- paths


@pytest.mark.parametrize("damping", [0.05, 0.3, 1.0])
def test_candidates_lead_from_the_attractor_over_the_exit_and_polish_to_the_barrier(damping):
    osc, structure = well(damping)
    found = screened(damping, (160, 160), 16)
    candidate, *_ = found.candidates
    assert (candidate.source, candidate.target, candidate.finder) == (0, 1, "graph")
    assert candidate.action == pytest.approx(4 * damping * BARRIER, rel=0.05)
    np.testing.assert_allclose(np.diff(candidate.times), osc.section_interval / 16, rtol=1e-9)
    assert np.linalg.norm(candidate.states[0] - [-1.0, 0.0]) < 0.1
    settled = osc.section_map(candidate.states[-1:], 2000)
    assert settled[0] == pytest.approx([1.0, 0.0], abs=1e-2)
    (branch,) = polish_all(osc, structure, 0, found.candidates, vk.LeaveBasin()).branches
    assert branch.value == pytest.approx(4 * damping * BARRIER, rel=1e-6)


# --- linear scene: Ψ = ½ δqᵀ Σ⁻¹ δq = 2ζω_n (ω_n² δx² + δv²), first touch 2ζω_n³ (b − max x_s)²

STOP, AMPLITUDE, FREQUENCY = 1.0, 0.3, 0.57
SCENES = [(0.01, 1.0), (0.05, 1.0), (0.5, 1.0), (2.0, 1.0), (0.05, 1.7)]


@functools.cache
def touching(damping, natural=1.0, cells=160, fraction=8):
    osc = vk.Oscillator(
        natural_frequency=natural,
        damping_ratio=damping,
        barriers=(vk.Barrier(vk.Hertz(50.0), STOP, "right"),),
        excitations=(vk.Harmonic(AMPLITUDE, FREQUENCY),),
        noise=vk.WhiteNoise(1e-3),
    )
    structure = vk.find_structure(osc, cells=(20, 20), starts=(4, 4), saddles=False, manifolds=False)
    clear = next(a.label for a in structure.attractors if a.impacts == 0)
    graph = vk.ActionGraph(cells=(cells, cells), fraction=fraction, exit=vk.FirstContact())
    return osc, structure, clear, graph.search(osc, structure, clear)


def steady(damping, natural):
    """X of x_s = Re(X exp iΩt)."""
    return AMPLITUDE / (natural**2 - FREQUENCY**2 + 2j * damping * natural * FREQUENCY)


def least_touch(damping, natural):
    return 2 * damping * natural**3 * (STOP - abs(steady(damping, natural))) ** 2


@pytest.mark.parametrize(("damping", "natural"), SCENES)
def test_quadratic_potential_of_the_linear_scene(damping, natural):
    """At every phase, up to half of what the touch costs."""
    *_, found = touching(damping, natural)
    grids, exact = found.potential.grids, least_touch(damping, natural)
    for phase in range(grids.phases):
        turned = steady(damping, natural) * np.exp(1j * FREQUENCY * grids.time(phase))
        away = grids.nodes(phase) - np.array([turned.real, (1j * FREQUENCY * turned).real])
        psi = 2 * damping * natural * (natural**2 * away[..., 0] ** 2 + away[..., 1] ** 2)
        low = (psi < 0.5 * exact) & (grids.nodes(phase)[..., 0] < STOP)
        assert low.any()
        assert np.abs(found.potential.values[phase] - psi)[low].max() <= 0.02 * exact


@pytest.mark.parametrize(("damping", "natural"), SCENES)
def test_first_touch_of_the_linear_scene(damping, natural):
    *_, found = touching(damping, natural)
    exact = least_touch(damping, natural)
    value, error = found.targets[-1]
    assert value == pytest.approx(exact, rel=0.02)
    assert abs(value - exact) <= error


@pytest.mark.parametrize("damping", [0.05, 0.5])
def test_a_candidate_of_a_touch_touches_and_polishes(damping):
    osc, structure, clear, found = touching(damping)
    candidate, *_ = found.candidates
    assert candidate.states[:, 0].max() >= STOP
    orbit = steady(damping, 1.0) * np.exp(1j * FREQUENCY * candidate.times[0])
    assert math.hypot(*(candidate.states[0] - [orbit.real, (1j * FREQUENCY * orbit).real])) < 0.1
    (branch,) = polish_all(osc, structure, clear, found.candidates, vk.FirstContact()).branches
    assert branch.value == pytest.approx(least_touch(damping, 1.0), rel=1e-8)


# --- the analyzer


def test_the_same_bits_on_one_thread_and_on_many(monkeypatch):
    found = []
    for threads in (1, 5):
        monkeypatch.setattr(os, "cpu_count", lambda threads=threads: threads)
        found.append(SMALL.search(*well(0.05), 0))
    one, many = (screen.potential for screen in found)
    for values, others in zip(one.values, many.values, strict=True):
        np.testing.assert_array_equal(values, others)
    assert found[0].targets == found[1].targets
    for candidate, other in zip(found[0].candidates, found[1].candidates, strict=True):
        np.testing.assert_array_equal(candidate.states, other.states)


@pytest.fixture(scope="module")
def result():
    return SMALL.run(*well(0.05))


def test_a_result_has_energies_with_bounds(result):
    assert [(e.source, e.target, e.method, e.saddle) for e in result.energies] == [
        (0, 1, "graph", 0),
        (1, 0, "graph", 0),
    ]
    for energy in result.energies:
        assert 0 <= energy.lower <= 4 * 0.05 * BARRIER <= energy.upper
        assert math.isnan(energy.residual)
    first, second = (energy.value for energy in result.energies)
    assert first == pytest.approx(second, rel=0.02)  # the wells are mirror images
    assert "Attractor 0, by " in result.status


def test_only_the_source_asked_for():
    result = vk.ActionGraph(cells=(64, 64), source=1).run(*well(0.05))
    assert [energy.source for energy in result.energies] == [1]
    assert "quasi_potential_0" not in result.data


def test_saved_and_opened_it_is_the_same(result, tmp_path):
    result.save(tmp_path / "graph.nc")
    again = vk.load_result(tmp_path / "graph.nc")
    assert type(again) is type(result)
    assert [e.value for e in again.energies] == [e.value for e in result.energies]
    assert again.status == result.status
    assert set(again.data.variables) == set(result.data.variables)
    for name in result.data.variables:
        np.testing.assert_array_equal(again.data[name].values, result.data[name].values)


def test_the_potential_in_the_data_is_that_of_the_search(result):
    potential = SMALL.search(*well(0.05), 0).potential
    values, box = result.data["quasi_potential_0"].values, result.data["quasi_potential_box_0"].values
    known = np.isfinite(values)
    np.testing.assert_array_equal(values[known], potential.values[0][known])
    assert np.all(potential.values[0][~known] >= potential.unreached)
    np.testing.assert_array_equal(box, potential.grids.boxes[0])


@pytest.mark.parametrize("label", [None, 0, 1])
def test_pictures(result, label, tmp_path):
    result.save(tmp_path / "graph.nc")
    artists = vk.load_result(tmp_path / "graph.nc").plot(label=label)
    artists[0].axes.get_figure().savefig(tmp_path / "graph.png")
    assert (tmp_path / "graph.png").stat().st_size > 5000


def test_no_picture_of_what_is_not_there(result):
    with pytest.raises(StructureError, match="attractor 7; there are those of 0, 1"):
        result.plot(label=7)


def test_progress_grows_to_its_end():
    seen = []
    SMALL.run(*well(0.05), progress=lambda done, total: seen.append(done / total))
    assert seen == sorted(seen)
    assert seen[-1] == 1


# --- three wells: two ways out of the middle one, the one far cheaper

RESTS = (-1.6, -1.0, 0.0, 0.4, 0.7)  # zeros of the force: wells and hilltops in turn


@functools.cache
def three_wells():
    formula = "*".join(f"(x - ({rest}))" for rest in RESTS)
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.05, spring=vk.CustomSpring(f"4*{formula}"), noise=vk.WhiteNoise(1e-4)
    )
    structure = vk.find_structure(osc, region=((-2.2, 1.2), (-1.5, 1.5)), cells=(80, 80), manifolds=False)
    return osc, structure


def barrier_between(bottom, top):
    potential = np.polynomial.Polynomial.fromroots(RESTS).integ() * 4
    return potential(top) - potential(bottom)


def test_a_cheap_way_out_is_priced_as_well_as_a_dear_one():
    osc, structure = three_wells()
    left, middle, right = sorted(structure.attractors, key=lambda attractor: attractor.points[0, 0])
    exact = {left.label: 0.2 * barrier_between(0.0, -1.0), right.label: 0.2 * barrier_between(0.0, 0.4)}
    assert exact[left.label] > 12 * exact[right.label]
    found = vk.ActionGraph(cells=(160, 160)).search(osc, structure, middle.label)
    for target, value in exact.items():
        assert found.targets[target][0] == pytest.approx(value, rel=0.02)
        assert abs(found.targets[target][0] - value) <= found.targets[target][1]
