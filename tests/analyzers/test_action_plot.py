import dataclasses
import math

import numpy as np
import pytest

import vibrokit as vk
from tests.analyzers.graph import linear
from tests.layers import long, slow
from tests.scenes import scene
from vibrokit.analyzers.paths.local_potential import local_potential
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.shooting import Shooting
from vibrokit.analyzers.shooting.starts import Ring
from vibrokit.errors import StructureError
from vibrokit.progress import TRAJECTORIES
from vibrokit.results.codes import Code
from vibrokit.results.energy import Bound
from vibrokit.structure.orbits import refine_orbit


def problem(osc, structure, source=0, exit_=None):
    return ExitProblem(osc, structure, structure.attractors[source], exit_ or vk.LeaveBasin())


@pytest.fixture(scope="module")
def ring(paper):
    """An action plot from the ring, and what a listener was told meanwhile."""
    seen = []
    return vk.ActionPlot(radius=1e-6, points=3000).run(*paper, progress=seen.append), seen


@pytest.fixture(scope="module")
def domain(paper):
    """An action plot of the clear state from the whole domain, and what a listener was told meanwhile."""
    seen = []
    return vk.ActionPlot(points=3000, source=0).run(*paper, progress=seen.append), seen


@pytest.mark.slow
def test_clear_state_is_near_what_the_paper_has_and_far_easier_to_leave(ring):
    result, _ = ring
    clear, hammering = (next(e for e in result.energies if e.source == label) for label in (0, 1))
    # The paper's three methods give 7.3e-5 to 8.2e-5 for leaving N and 1.07e-3 to 1.15e-3 for leaving I.
    assert 6e-5 < clear.value < 1.1e-4
    assert 5 < hammering.value / clear.value < 40
    assert clear.target == 1
    assert clear.bound is Bound.UPPER
    assert clear.method == "action plot (ring)"
    assert clear.lower == 0
    assert clear.value + clear.numerical_error == clear.upper > clear.value
    assert not result.failed
    assert result.complete


@pytest.mark.slow
def test_the_path_pays_its_action_and_starts_on_the_ring(paper, ring):
    osc, structure = paper
    energy = ring[0].energies[0]
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
    starts, _ = Ring(orbit.point, potential, 1e-3).states(np.linspace(0, 6, 7)[:, None] / 7)
    # Linear regime: Ψ = 2ζω_n³ δx² + 2ζω_n δv² = 0.02 radius² in all directions.
    np.testing.assert_allclose(starts[:, -1], 0.02 * 1e-6, rtol=1e-6)


@pytest.mark.slow
def test_the_same_bits_on_every_run(paper, domain):
    again = vk.ActionPlot(points=3000, source=0).run(*paper)
    np.testing.assert_array_equal(again.data["action"], domain[0].data["action"])
    assert [energy.upper for energy in again.energies] == [energy.upper for energy in domain[0].energies]


@pytest.mark.parametrize(
    "bad",
    [
        {"radius": 0.0}, {"radius": float("nan")}, {"radius": "small"}, {"points": 2}, {"points": 1.5}, {"rounds": -1},
        {"tolerance": 0.0}, {"budget": 0},
    ],
)  # fmt: skip
def test_bad_settings(bad):
    with pytest.raises(StructureError, match=next(iter(bad))):
        vk.ActionPlot(**bad)


@pytest.mark.slow
def test_the_whole_domain_finds_no_worse_than_the_ring(ring, domain):
    result, _ = domain
    (energy,) = result.energies
    assert energy.value <= ring[0].energies[0].value
    assert energy.value + energy.numerical_error == energy.upper
    data = result.data.sel(source=0)
    for name in ("angle", "radius", "action", "exit_status", "target", "exit_x", "exit_v"):
        assert data[name].dims == ("start",)
        assert data[name].attrs["long_name"]
    assert {data[name].attrs["units"] for name in ("action", "exit_x", "exit_v")} == {"m2 s-3", "m", "m s-1"}
    assert 0 <= data["angle"].min() < data["angle"].max() < 2 * math.pi
    assert 0 < data["radius"].min() < data["radius"].max() < 1
    assert data["action"].min() <= energy.value
    assert set(data["exit_status"].values) <= set(data["exit_status"].attrs["flag_values"])
    (shots,) = result.found(Code.SHOTS)
    assert shots.values["paths"] == data.sizes["start"]
    assert shots.values["escaped"] == np.isfinite(data["action"].values).sum()
    (refinement,) = result.found(Code.REFINEMENT)
    assert refinement.values["change"] <= vk.ActionPlot().tolerance


@pytest.mark.slow
def test_all_distinct_paths_are_branches_and_the_best_is_the_energy(domain):
    result, _ = domain
    (found,) = result.found(Code.SHOTS)
    actions = [branch.value for branch in result.branches]
    assert actions == sorted(actions)
    assert 1 < len(actions) == found.values["branches"]
    assert result.branches[0] is result.energies[0]
    for branch in result.branches:
        assert branch.path.action[-1] == pytest.approx(branch.value, rel=1e-6)
        assert branch.lower == 0
        assert branch.upper >= branch.value
    assert all(math.isnan(branch.numerical_error) for branch in result.branches[1:])


def test_candidates_are_ranked_paths_on_the_grid_of_eighths(paper):
    osc, structure = paper
    found = Shooting(points=3000).search(problem(osc, structure))
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


@pytest.mark.slow
def test_progress_counts_paths(domain, ring):
    shooting = [update for update in domain[1] if update.stage == "action plot"]
    counts = [update.done for update in shooting]
    assert counts == sorted(counts)
    assert counts[-1] >= 3000
    assert {update.unit for update in shooting} == {TRAJECTORIES}
    assert {update.subject for update in shooting} == {"clear"}
    assert {update.total for update in shooting} == {None}  # refinement ends when the actions no longer change
    assert {update.total for update in ring[1] if update.stage == "action plot"} == {3000}  # there is none of the ring


class Interrupt:
    """A listener that interrupts the work when some stage has counted so many."""

    def __init__(self, stage, count):
        self.stage, self.count = stage, count

    def __call__(self, update):
        if update.stage == self.stage and update.done >= self.count and not update.finished:
            self.count = math.inf
            raise KeyboardInterrupt


def interrupted(paper, stage, count, **settings):
    result = vk.ActionPlot(**settings).run(*paper, progress=Interrupt(stage, count))
    assert result.found(Code.STOPPED)
    assert not result.complete
    return result


def test_an_interrupt_keeps_what_was_finished(paper):
    """Nothing of the first grid; the rounds before; the paths without their errors."""
    assert interrupted(paper, "action plot", 1, points=300).energies == ()
    refining = interrupted(paper, "action plot", 3000, points=1000, source=0)
    (energy,), (shots,), (stopped,) = refining.energies, refining.found(Code.SHOTS), refining.found(Code.STOPPED)
    assert stopped.values == {"stage": "action plot", "reason": "interrupt"}
    assert 1000 <= shots.values["paths"] <= 3000
    assert math.isnan(energy.numerical_error)  # the error would take another integration
    assert energy.upper == energy.value
    estimating = interrupted(paper, "errors of the action plot", 1, points=300, rounds=3, source=0)
    whole = vk.ActionPlot(points=300, rounds=3, source=0).run(*paper)
    assert [energy.value for energy in estimating.energies] == [energy.value for energy in whole.energies]


@pytest.mark.parametrize("kind", [slow("chaotic"), long("quasiperiodic"), "limit cycle"])
def test_motion_without_an_orbit_to_start_from_is_a_finding(paper, kind):
    osc, structure = paper
    strange = dataclasses.replace(structure.attractors[1], kind=kind)
    changed = dataclasses.replace(structure, attractors=(structure.attractors[0], strange))
    result = vk.ActionPlot(points=300, rounds=0).run(osc, changed)
    (failed,) = result.found(Code.SOURCE_FAILED)
    assert failed.source == 1
    assert kind in failed.values["reason"]
    assert [energy.source for energy in result.energies] == [0]
    with pytest.raises(StructureError, match=kind):
        Shooting().search(problem(osc, changed, 1))


@pytest.mark.parametrize(("damping", "least", "most"), [(0.05, 23_000, 25_000), (1e-3, 6000, 7500), (1e-5, 900, 1100)])
def test_weakly_damped_attractors_are_left_by_fewer_paths(damping, least, most):
    """A path that grows from a hundredth of the exit's distance takes ln(100) / (2 π ζ) periods of the free motion."""
    attractor = problem(linear.oscillator(damping), linear.structure(damping))
    found = Shooting(rounds=0, budget=1).search(attractor)
    assert least < len(found.shots.boxes.centres) < most


def test_too_little_work_is_a_finding(paper):
    few = vk.ActionPlot(points=300, rounds=1, source=0).run(*paper)
    assert few.found(Code.REFINEMENT_TOO_SHORT)
    assert not few.found(Code.REFINEMENT)
    none = vk.ActionPlot(points=300, source=0, budget=1).run(*paper)
    assert none.energies == ()
    assert none.found(Code.NO_EXIT_FOUND)
    assert none.failed


@pytest.mark.slow
def test_first_contact_of_the_linear_scene():
    """ΔU = 2ζω_n³ (b − max x_s)², x_s the forced steady state; one attractor is enough."""
    forced = {"excitations": (vk.Harmonic(0.3, 0.57),), "noise": vk.WhiteNoise(1e-3)}
    osc = scene(vk.Barrier(vk.Hertz(stiffness=50.0), 1.0, "right"), damping_ratio=0.05, **forced)
    structure = vk.find_structure(osc, cells=(20, 20), starts=(4, 4), saddles=False, manifolds=False)
    clear = next(a for a in structure.attractors if a.impacts == 0)
    energy = vk.ActionPlot(points=2000, source=clear.label, exit=vk.FirstContact()).run(osc, structure).energies[0]
    largest = 0.3 / math.hypot(1 - 0.57**2, 2 * 0.05 * 0.57)
    exact = 2 * 0.05 * (1.0 - largest) ** 2
    # A test falls within T/64 of the touch, where the mass is at most ½ x (2π/64 · 1/0.57)² short of the stop.
    short = 0.5 * (2 * math.pi / 64 / 0.57) ** 2
    assert exact * (1 - 1e-3) <= energy.value <= exact * ((1 - largest + short) / (1 - largest)) ** 2
    assert energy.target == -1
    assert energy.value - energy.numerical_error <= exact <= energy.upper


@pytest.mark.slow
def test_a_state_that_touches_without_noise_has_energy_zero(paper):
    osc, structure = paper
    result = vk.ActionPlot(points=300, rounds=0, exit=vk.FirstContact("right")).run(osc, structure)
    (finding,) = result.found(Code.AT_EXIT)
    assert finding.source == 1
    assert [energy.source for energy in result.energies] == [0, 1]
    assert result.energy(1).value == result.energy(1).upper == 0
    assert result.data["source"].values.tolist() == [0]
