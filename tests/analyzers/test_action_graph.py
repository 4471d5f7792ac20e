"""The graph's quasi-potential where it is known in closed form, and whether its error estimate holds."""

import functools
import math
import os

import numpy as np
import pytest

import vibrokit as vk
from tests.analyzers.graph import linear
from tests.layers import long
from vibrokit.analyzers.exits import LeaveRegion
from vibrokit.analyzers.graph.search import GraphSearch
from vibrokit.analyzers.polishing.polish import polish
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Code
from vibrokit.results.energy import Bound

pytestmark = pytest.mark.slow

BARRIER = 0.25  # of −x²/2 + x⁴/4
WELLS = [long(0.01), 0.1, long(0.5), long(2.0)]  # their damping
SMALL = vk.ActionGraph(nodes=(64, 64))


def problem(osc, structure, label=0, exit_=None):
    return ExitProblem(osc, structure, structure.attractors[label], exit_ or vk.LeaveBasin())


def best(found, target):
    (energy,) = (energy for energy in found.estimates if energy.target == target)
    return energy


# --- double well without forcing: Ψ = 4ζω_n E


@functools.cache
def well(damping):
    osc = vk.load_scene("double-well").replace({"damping_ratio": damping})
    return osc, vk.find_structure(osc, cells=(100, 100), starts=(8, 8), manifolds=False)


@functools.cache
def solved(damping, nodes=320, steps=None):
    return GraphSearch(nodes=(nodes, nodes), steps_per_period=steps).search(problem(*well(damping)))


def solutions(search, problem):
    """On each number of nodes."""
    costs = search.begin(problem)
    while not costs.finished:
        costs.refine()
        yield costs.solution()


@pytest.mark.long
def test_each_solution_has_twice_the_nodes_and_comes_closer():
    found = list(solutions(GraphSearch(nodes=(280, 260)), problem(*well(0.1))))
    assert [each.potential.grids.shape for each in found] == [(70, 65), (140, 130), (280, 260)]
    errors = [abs(best(each, 1).value - 0.4 * BARRIER) for each in found]
    assert errors == sorted(errors, reverse=True)
    assert all(error <= best(each, 1).numerical_error for error, each in zip(errors, found, strict=True))


def misses(found, damping):
    """|V − 4ζE| over the whole well of x = −1, relative to the barrier; infinite where V is not known."""
    potential = found.potential
    x, v = np.moveaxis(potential.grids.nodes(0), -1, 0)
    energy = v**2 / 2 + x**4 / 4 - x**2 / 2 + BARRIER
    values = np.where(potential.values[0] < potential.ceiling, potential.values[0], np.inf)
    inside = (x < 0) & (energy < BARRIER)
    assert inside.sum() > 500
    return np.abs(values - 4 * damping * energy)[inside] / (4 * damping * BARRIER)


@pytest.mark.parametrize("damping", WELLS)
def test_barrier_of_the_double_well_by_default(damping):
    found = solved(damping)
    exact = 4 * damping * BARRIER
    (energy,) = found.estimates
    assert (energy.source, energy.target, energy.saddle, energy.bound) == (0, 1, 0, Bound.ESTIMATE)
    assert energy.value == pytest.approx(exact, rel=0.02)
    assert energy.lower == max(0.0, energy.value - energy.numerical_error) <= exact
    assert exact <= energy.upper <= energy.value + energy.numerical_error  # the action of a path
    assert found.energies == found.estimates
    assert misses(found, damping).max() <= 0.02  # in the whole well


@pytest.mark.parametrize(
    ("damping", "nodes", "steps"),
    [
        *[(0.3, 160, steps) for steps in (4, 8, 16)],
        *[long(0.05, 160, steps) for steps in (4, 8, 16)],
        *[(damping, 80, None) for damping in (0.1, 0.3)],
        *[long(damping, nodes, None) for damping, nodes in [(0.1, 160), (0.1, 320), (0.3, 160)]],
    ],
)
def test_the_error_estimate_holds_as_nodes_and_steps_refine(damping, nodes, steps):
    energy = best(solved(damping, nodes, steps), 1)
    assert abs(energy.value - 4 * damping * BARRIER) <= energy.numerical_error


@pytest.mark.long
def test_the_error_estimate_shrinks_with_nodes_and_steps():
    errors = [best(solved(0.3, 10 * steps, steps), 1).numerical_error for steps in (8, 16, 32)]
    assert errors[2] < 0.5 * errors[1] < 0.25 * errors[0]


# --- paths


@pytest.mark.parametrize("damping", [long(0.05), 0.3, long(1.0)])
def test_candidates_lead_from_the_attractor_over_the_exit_and_polish_to_the_barrier(damping):
    osc, structure = well(damping)
    found = solved(damping, 160, 16)
    candidate, *_ = found.candidates
    assert (candidate.source, candidate.target, candidate.finder) == (0, 1, "graph")
    assert candidate.action == pytest.approx(4 * damping * BARRIER, rel=0.05)
    np.testing.assert_allclose(np.diff(candidate.times), osc.section_interval / 16, rtol=1e-9)
    assert np.linalg.norm(candidate.states[0] - [-1.0, 0.0]) < 0.1
    settled = osc.section_map(candidate.states[-1:], 2000)
    assert settled[0] == pytest.approx([1.0, 0.0], abs=1e-2)
    (branch,) = polish(problem(osc, structure), found.candidates).branches
    assert branch.value == pytest.approx(4 * damping * BARRIER, rel=1e-6)


# --- linear scene: Ψ = ½ δqᵀ Σ⁻¹ δq = 2ζω_n (ω_n² δx² + δv²), first touch 2ζω_n³ (b − max x_s)²

STOP, AMPLITUDE, FREQUENCY = 1.0, 0.3, 0.57
SCENES = [(0.05, 1.0), (0.5, 1.0), (2.0, 1.0), (0.05, 1.7)]


@functools.cache
def touching(damping, natural=1.0):
    osc = vk.Oscillator(
        natural_frequency=natural,
        damping_ratio=damping,
        barriers=(vk.Barrier(vk.Hertz(50.0), STOP, "right"),),
        excitations=(vk.Harmonic(AMPLITUDE, FREQUENCY),),
        noise=vk.WhiteNoise(1e-3),
    )
    structure = vk.find_structure(osc, cells=(20, 20), starts=(4, 4), saddles=False, manifolds=False)
    clear = next(a.label for a in structure.attractors if a.impacts == 0)
    graph = GraphSearch(nodes=(120, 120), steps_per_period=8)
    return osc, structure, clear, graph.search(problem(osc, structure, clear, vk.FirstContact()))


def steady(damping, natural):
    """X of x_s = Re(X exp iΩt)."""
    return AMPLITUDE / (natural**2 - FREQUENCY**2 + 2j * damping * natural * FREQUENCY)


def least_touch(damping, natural):
    return 2 * damping * natural**3 * (STOP - abs(steady(damping, natural))) ** 2


@pytest.mark.long
@pytest.mark.parametrize(("damping", "natural"), SCENES)
def test_the_potential_and_the_first_touch_of_the_linear_scene(damping, natural):
    """V is the quadratic form at every phase, up to half of what the touch costs."""
    *_, found = touching(damping, natural)
    grids, exact = found.potential.grids, least_touch(damping, natural)
    for phase in range(grids.phases):
        turned = steady(damping, natural) * np.exp(1j * FREQUENCY * grids.time(phase))
        away = grids.nodes(phase) - np.array([turned.real, (1j * FREQUENCY * turned).real])
        psi = 2 * damping * natural * (natural**2 * away[..., 0] ** 2 + away[..., 1] ** 2)
        low = (psi < 0.5 * exact) & (grids.nodes(phase)[..., 0] < STOP)
        assert low.any()
        assert np.abs(found.potential.values[phase] - psi)[low].max() <= 0.02 * exact
    energy = best(found, -1)
    assert energy.value == pytest.approx(exact, rel=0.02)
    assert abs(energy.value - exact) <= energy.numerical_error


@pytest.mark.long
@pytest.mark.parametrize("damping", [0.05, 0.5])
def test_a_candidate_of_a_touch_touches_and_polishes(damping):
    osc, structure, clear, found = touching(damping)
    candidate, *_ = found.candidates
    assert candidate.states[:, 0].max() >= STOP
    orbit = steady(damping, 1.0) * np.exp(1j * FREQUENCY * candidate.times[0])
    assert math.hypot(*(candidate.states[0] - [orbit.real, (1j * FREQUENCY * orbit).real])) < 0.1
    (branch,) = polish(problem(osc, structure, clear, vk.FirstContact()), found.candidates).branches
    assert branch.value == pytest.approx(least_touch(damping, 1.0), rel=1e-8)


# --- the analyzer


def test_the_same_bits_on_one_thread_and_on_many(monkeypatch):
    found = []
    for threads in (1, 5):
        monkeypatch.setattr(os, "cpu_count", lambda threads=threads: threads)
        found.append(SMALL.search(problem(*well(0.05))))
    one, many = (solution.potential for solution in found)
    for values, others in zip(one.values, many.values, strict=True):
        np.testing.assert_array_equal(values, others)
    assert found[0].estimates[0].value == found[1].estimates[0].value
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
    assert [(e.source, e.value) for e in result.branches] == [(e.source, e.value) for e in result.energies]
    for energy in result.energies:
        assert 0 <= energy.lower <= 4 * 0.05 * BARRIER <= energy.upper
        assert math.isnan(energy.residual)
    first, second = (energy.value for energy in result.energies)
    assert first == pytest.approx(second, rel=0.02)  # the wells are mirror images
    assert result.complete
    assert [(found.code, found.source) for found in result.findings] == [(Code.GRAPH, 0), (Code.GRAPH, 1)]
    assert result.findings[0].values["nodes_x"] == 64
    assert result.findings[0].values["stepper"] == "RK4(steps=256)"


def test_only_the_source_asked_for():
    result = vk.ActionGraph(nodes=(64, 64), source=1).run(*well(0.05))
    assert [energy.source for energy in result.energies] == [1]
    assert result.data.source.values.tolist() == [1]


def test_saved_and_opened_it_is_the_same(result, tmp_path):
    result.save(tmp_path / "graph.nc")
    again = vk.load_result(tmp_path / "graph.nc")
    assert type(again) is type(result)
    assert [e.value for e in again.energies] == [e.value for e in result.energies]
    assert again.status == result.status
    assert again.settings == result.settings
    assert again.analyzer == SMALL
    assert set(again.data.variables) == set(result.data.variables)
    for name in result.data.variables:
        np.testing.assert_array_equal(again.data[name].values, result.data[name].values)


def test_the_data_are_those_of_the_search_with_units(result):
    found = SMALL.search(problem(*well(0.05)))
    data = result.data.sel(source=0)
    values, nodes = data.quasi_potential.values, found.potential.grids.nodes(0)
    known = np.isfinite(values)
    np.testing.assert_array_equal(values[known], found.potential.values[0][known])
    assert np.all(found.potential.values[0][~known] >= found.potential.ceiling)
    np.testing.assert_array_equal(data.quasi_potential_x, nodes[:, 0, 0])
    np.testing.assert_array_equal(data.quasi_potential_v, nodes[0, :, 1])
    path = np.column_stack([data.graph_path_t, data.graph_path_x, data.graph_path_v])
    candidate = found.candidates[0]
    exact = np.column_stack([candidate.times, candidate.states])
    np.testing.assert_array_equal(path[: len(exact)], exact)
    assert np.isnan(path[len(exact) :]).all()
    for array in (result.data.quasi_potential, result.data.quasi_potential_x, result.data.graph_path_t):
        assert array.attrs["units"]
        assert array.attrs["long_name"]


def test_pictures(result, tmp_path):
    result.save(tmp_path / "graph.nc")
    for source in (None, 0, "right-rest"):
        vk.load_result(tmp_path / "graph.nc").plot(source=source).figure.savefig(tmp_path / "graph.png")
        assert (tmp_path / "graph.png").stat().st_size > 5000
    with pytest.raises(StructureError, match="no attractor 7"):
        result.plot(source=7)


def test_progress_counts_sweeps_of_each_attractor():
    seen = []
    SMALL.run(*well(0.05), progress=seen.append)
    for subject in ("left-rest", "right-rest"):
        done = [update.done for update in seen if update.stage == "graph" and update.subject == subject]
        assert len(done) > 20
        assert done == sorted(done)
        assert done[-1] > 100


# --- stopped, and refused


def stopped_after(count, graph, osc, structure):
    """The result of a graph that is interrupted after it was solved so many times."""
    solved = []

    def interrupt(update):
        if update.stage == "graph" and update.finished:
            solved.append(update)
        elif update.stage == "graph" and len(solved) == count:
            raise KeyboardInterrupt

    result = graph.run(osc, structure, progress=interrupt)
    assert not result.complete
    return result


@pytest.mark.parametrize(
    ("nodes", "stopped"), [((120, 120), 0), ((64, 64), 1)], ids=["on more nodes", "at the next attractor"]
)
def test_an_interrupt_keeps_the_first_solution_and_marks_it(nodes, stopped):
    result = stopped_after(1, vk.ActionGraph(nodes=nodes), *well(0.05))
    (energy,) = result.energies
    assert energy.source == 0
    assert energy.lower <= 4 * 0.05 * BARRIER <= energy.upper
    assert [(found.code, found.source) for found in result.findings] == [(Code.GRAPH, 0), (Code.STOPPED, stopped)]


def test_an_interrupt_while_a_cheap_exit_has_grids_of_its_own_keeps_the_other():
    osc, structure = three_wells()
    left, middle, right = sorted(structure.attractors, key=lambda attractor: attractor.points[0, 0])
    result = stopped_after(1, vk.ActionGraph(nodes=(64, 64), source=middle.label), osc, structure)
    exact = {left.label: 0.2 * barrier_between(0.0, -1.0), right.label: 0.2 * barrier_between(0.0, 0.4)}
    assert {energy.target for energy in result.energies} == set(exact)
    assert all(energy.lower <= exact[energy.target] <= energy.upper for energy in result.energies)


def test_an_interrupt_before_any_solution_leaves_nothing_and_says_so():
    result = stopped_after(0, vk.ActionGraph(nodes=(64, 64)), *well(0.05))
    assert result.energies == ()
    assert [found.code for found in result.findings] == [Code.STOPPED]


def test_the_time_limit_ends_a_search():
    result = vk.ActionGraph(nodes=(400, 400)).run(*well(0.05), time_limit=0.5)
    assert not result.complete
    assert result.energies == ()
    assert [found.code for found in result.findings] == [Code.STOPPED]


def test_an_attractor_that_satisfies_the_exit_costs_nothing(paper):
    result = vk.ActionGraph(source="hammering", exit=vk.FirstContact()).run(*paper)
    (energy,) = result.energies
    assert (energy.target, energy.value, energy.lower, energy.upper) == (-1, 0.0, 0.0, 0.0)
    assert Code.AT_EXIT in [found.code for found in result.findings]


# --- leaving a box in (x, v) without forcing: the least of ½ δqᵀ Σ⁻¹ δq on its faces


class Box(LeaveRegion):
    """A user's exit: |x| ≥ width or |v| ≥ speed."""

    width: float = math.inf
    speed: float = math.inf

    def bounds(self, osc):
        return np.array([[-self.width, self.width], [-self.speed, self.speed]])


BOXES = [
    Box(width=1.0),
    Box(speed=1.2),
    Box(width=1.0, speed=1.5),  # the wall is nearer, in units of Σ
    Box(width=1.5, speed=1.0),  # the speed is
]


@pytest.mark.long
@pytest.mark.parametrize("scene", [(0.05, 1.0), (0.5, 1.7)])
@pytest.mark.parametrize("box", BOXES, ids=str)
def test_a_box_costs_what_its_cheapest_face_costs(scene, box):
    """2ζω_n³ b² for |x| = b, at rest; 2ζω_n c² for |v| = c, at x = 0."""
    damping, natural = scene
    faces = 2 * damping * natural * np.array([(natural * box.width) ** 2, box.speed**2])
    osc, structure = linear.oscillator(*scene), linear.structure(*scene)
    found = GraphSearch(nodes=(120, 120), steps_per_period=8).search(problem(osc, structure, 0, box))
    (energy,) = found.estimates
    assert energy.target == -1
    assert energy.value == pytest.approx(faces.min(), rel=0.02)
    assert abs(energy.value - faces.min()) <= energy.numerical_error
    exact = np.repeat(np.sort(faces[np.isfinite(faces)]), 2)
    assert all(abs(end.value - face) <= end.numerical_error for end, face in zip(found.energies, exact, strict=True))
    cheapest = int(np.argmin(faces))
    end = found.candidates[0].states[-1]
    assert abs(end[cheapest]) == (box.width, box.speed)[cheapest]
    assert end[1 - cheapest] == pytest.approx(0.0, abs=0.1)


# --- three wells: two exits from the middle one, one of them far cheaper

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


@pytest.mark.long
def test_a_cheap_exit_is_solved_as_well_as_a_costly_one():
    osc, structure = three_wells()
    left, middle, right = sorted(structure.attractors, key=lambda attractor: attractor.points[0, 0])
    exact = {left.label: 0.2 * barrier_between(0.0, -1.0), right.label: 0.2 * barrier_between(0.0, 0.4)}
    assert exact[left.label] > 12 * exact[right.label]
    first, *_, last = solutions(GraphSearch(nodes=(160, 160)), problem(osc, structure, middle.label))
    for target, value in exact.items():
        assert best(last, target).value == pytest.approx(value, rel=0.02)
        assert abs(best(last, target).value - value) <= best(last, target).numerical_error
    assert best(last, right.label).numerical_error < best(first, right.label).numerical_error
    assert [energy.target for energy in last.energies] == [right.label, left.label]  # the cheapest first


@pytest.mark.long
def test_a_saddle_at_the_tip_of_a_basin_is_reached():
    """Escape of a softening oscillator, over a saddle where its basin is thinner than a cell.

    Polished paths cost 0.1273162369 and 0.1306644174.
    """
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.03, spring=vk.CubicSpring(1.0, -0.05),
        excitations=(vk.Harmonic(0.15, 0.9),), noise=vk.WhiteNoise(1e-4),
    )  # fmt: skip
    structure = vk.find_structure(osc, cells=(60, 60), manifolds=False, rng=0)
    large, small = structure.attractors
    assert (large.name, small.name) == ("large-oscillation", "small-oscillation")
    found = vk.ActionGraph(nodes=(90, 90)).run(osc, structure)
    for attractor, value in ((large, 0.1273162369), (small, 0.1306644174)):
        (escape,) = (each for each in found.energies if (each.source, each.target) == (attractor.label, ESCAPED))
        assert escape.value == pytest.approx(value, rel=0.01)
        assert 0 < escape.lower <= value * (1 + 1e-9) <= escape.upper * (1 + 2e-9)


@pytest.mark.long
def test_steps_become_shorter_than_a_stiff_contact():
    """Hertz stops of k = 1e4: 8 steps in a period give a quarter of the energy.

    The polished path costs 1.428600353e-3.
    """
    stops = (vk.Barrier(vk.Hertz(1e4), 0.4, "right"), vk.Barrier(vk.Hertz(1e4), -0.4, "left"))
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.03, barriers=stops, excitations=(vk.Harmonic(0.3, 0.8),),
        noise=vk.WhiteNoise(1e-4),
    )  # fmt: skip
    structure = vk.find_structure(osc, manifolds=False, rng=0)
    found = vk.ActionGraph(nodes=(180, 180), source=0).run(osc, structure)
    (energy,) = found.energies
    assert abs(energy.value - 1.428600353e-3) <= min(energy.numerical_error, 0.5 * energy.value)
    assert energy.numerical_error < energy.value
