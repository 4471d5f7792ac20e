"""What LeastAction keeps when it is stopped, and attractors that have left already."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.analyzers.agreement import Evidence, reached_through_others
from vibrokit.analyzers.exits import LeaveRegion
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.path_solver import Effort
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.road import ExitRoad
from vibrokit.analyzers.sources import Source
from vibrokit.errors import StructureError
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound

# Noise that changes by rounding errors: detailed balance would make the searches needless.
NOISE = vk.StateDependentNoise(1e-4, "1 + c*x**2", c=1e-13)
OSC = dataclasses.replace(vk.load_scene("double-well").replace({"damping_ratio": 0.3}), noise=NOISE)
EXACT = 4 * 0.3 * 0.25
SMALL = {"graph": vk.GraphSearch(nodes=(40, 40), steps_per_period=8), "shooting": vk.Shooting(points=200, rounds=3)}


@pytest.fixture(scope="module")
def structure():
    return vk.find_structure(OSC, cells=(20, 20), starts=(8, 8), manifolds=False)


def stopped_at(structure, stage, done):
    """Run until something is done in a stage, and stop there."""

    def interrupt(update):
        if update.stage == stage and update.done >= done and not update.finished:
            raise KeyboardInterrupt

    return vk.LeastAction(**SMALL).run(OSC, structure, progress=interrupt)


@pytest.mark.parametrize(
    ("stage", "done", "methods", "certified"),
    [
        ("graph", 0, ["least action"], [True]),
        ("polishing", 0, [], []),
        ("polishing", 1, ["least action"], [True]),
        ("certifying", 0, ["least action"], [False]),
        ("certifying", 1, ["least action"], [True]),
        ("action plot", 0, ["least action"], [True]),
    ],
)
def test_what_was_found_before_a_stop_is_kept(structure, stage, done, methods, certified):
    result = stopped_at(structure, stage, done)
    assert not result.complete
    (finding,) = result.found(Code.STOPPED)
    assert finding.source == 0
    assert finding.values == {"stage": stage, "reason": "interrupt"}
    assert [energy.method for energy in result.energies] == methods
    assert [branch.certificate is not None for branch in result.branches] == certified
    for energy in result.energies:
        assert energy.lower <= EXACT <= energy.upper
    assert not result.found(Code.NO_EXIT_FOUND)


def test_the_time_limit_stops_likewise(structure):
    result = vk.LeastAction(**SMALL).run(OSC, structure, time_limit=1e-9)
    assert not result.complete
    (finding,) = result.found(Code.STOPPED)
    assert finding.values["reason"] == "time limit"


def test_the_result_has_the_graph_s_potential_and_the_work_done(structure):
    result = vk.LeastAction(**SMALL).run(OSC, structure)
    assert result.complete
    assert [(energy.source, energy.target) for energy in result.energies] == [(0, 1), (1, 0)]
    for energy in result.energies:
        assert energy.value == pytest.approx(EXACT, rel=1e-6)
        assert energy.lower <= EXACT <= energy.upper
    assert "quasi_potential" in result.data
    assert result.stats.newton_iterations > 10
    assert {"graph", "action plot", "polishing", "certifying"} <= set(result.stats.seconds)


def three_wells():
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=1.5, spring=vk.CustomSpring("x*(x**2 - 1)*(x**2 - 4)"),
        noise=vk.WhiteNoise(1e-2),
    )  # fmt: skip
    structure = vk.find_structure(osc, region=((-2.5, 2.5), (-1.0, 1.0)), cells=(40, 20), manifolds=False)
    assert [round(float(each.points[0, 0])) for each in structure.attractors] == [-2, 0, 2]
    return osc, structure


def test_attractors_that_are_reached_through_other_basins_are_known():
    osc, structure = three_wells()
    for label, beyond in ((0, {2}), (1, set()), (2, {0})):
        problem = ExitProblem(osc, structure, structure.attractor(label), vk.LeaveBasin())
        assert reached_through_others(problem) == beyond


def estimate(target, value, error):
    return ActivationEnergy(0, target, value, 0.0, value, "graph", Bound.ESTIMATE, numerical_error=error)


def graph_of(estimates, finer=0, steps=64, known=math.inf, last_for_all=False):
    cheapest = {each.target: SimpleNamespace(steps=steps, known=known) for each in estimates}
    return SimpleNamespace(
        estimates=estimates, finer=finer, cheapest=cheapest, most_steps=64, last_for_all=last_for_all,
        calibrated=lambda polished: estimates,
    )  # fmt: skip


ORBIT, SET = SimpleNamespace(repeats=True, label=0), SimpleNamespace(repeats=False, label=0)


@pytest.mark.parametrize(
    ("attractor", "last", "settled"),
    [(ORBIT, False, {1, 5}), (SET, False, {1, 5}), (ORBIT, True, {1, 2, 4, 5}), (SET, True, {1, 2, 4, 5})],
)
def test_exits_that_the_graph_tells_accurately_are_settled(attractor, last, settled):
    """Errors of a hundredth, a third and nine tenths of the paths' actions, an exit without a path, and one beyond."""
    paths = tuple(estimate(target, 1.0, 0.0) for target in (1, 2, 3, 5))
    errors = {1: 0.01, 2: 0.3, 3: 0.9, 4: 0.9, 5: 0.4}
    graph = graph_of([estimate(target, 1.0, error) for target, error in errors.items()], 1, last_for_all=last)
    assert Evidence(attractor, paths, graph, beyond=frozenset({5})).settled(0.01) == settled


@pytest.mark.parametrize("value", [0.5, 2.0])
def test_an_exit_of_which_path_and_graph_contradict_each_other_is_not_settled(value):
    graph = graph_of([estimate(1, value, 0.01)], 1, last_for_all=True)
    assert Evidence(ORBIT, (estimate(1, 1.0, 0.0),), graph, beyond=frozenset({1})).settled(0.5) == set()


@pytest.mark.parametrize(("finer", "useless"), [(0, {1, 2}), (1, {2}), (2, {2}), (3, set())])
def test_the_graph_is_not_refined_for_what_its_finest_grid_could_not_tell(finer, useless):
    """Each doubling of the nodes divides its error, of 2 here, by 8 at best."""
    paths = (estimate(2, 0.01, 0.0), estimate(1, 1.0, 0.0))
    graph = graph_of([estimate(1, 1.0, 2.0), estimate(2, 0.01, 2.0), estimate(3, 1.0, 9.0)], finer)
    assert Evidence(ORBIT, paths, graph).unresolvable == useless


@pytest.mark.parametrize(
    ("finer", "known", "useless"), [(0, math.inf, {1}), (1, math.inf, set()), (1, 0.5, set()), (1, 1e-3, {1})]
)
def test_grids_far_too_large_for_a_path_found_since_tell_nothing_of_finer_ones(finer, known, useless):
    graph = graph_of([estimate(1, 1.0, 2.0)], finer, known=known)
    assert Evidence(ORBIT, (estimate(1, 1e-3, 0.0),), graph).unresolvable == useless


@pytest.mark.parametrize(
    ("finer", "steps", "value", "useless"),
    [(0, 32, 0.8, {1}), (1, 32, 0.8, set()), (1, 64, 0.8, {1}), (1, 32, 0.95, {1})],
)
def test_v_below_a_path_tells_nothing_of_a_finer_graph_with_shorter_steps(finer, steps, value, useless):
    graph = graph_of([estimate(1, value, 12.0)], finer, steps=steps)
    assert Evidence(ORBIT, (estimate(1, 1.0, 0.0),), graph).unresolvable == useless


@pytest.mark.slow
def test_without_a_saddle_the_action_plot_bounds_the_energies():
    """Of a Duffing oscillator; its certified energy was confirmed by direct minimization of the action."""
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.05, spring=vk.CubicSpring(1.0, 0.3),
        excitations=(vk.Harmonic(0.4, 1.4),), noise=vk.WhiteNoise(1e-4),
    )  # fmt: skip
    found = vk.find_structure(osc, cells=(60, 60), starts=(8, 8), saddles=False, manifolds=False, rng=0)
    source = min(found.attractors, key=lambda attractor: np.ptp(attractor.orbit[:, 0]))
    few = vk.LeastAction(source=source.label, graph=vk.GraphSearch(nodes=(60, 60)), shooting=vk.Shooting(points=1500))
    (energy,) = few.run(osc, found).energies
    assert energy.bound is Bound.UPPER
    assert energy.path is not None
    assert 0.18001715 * (1 - 1e-6) <= energy.value == pytest.approx(0.18001715, rel=0.02)


def test_all_work_belongs_to_a_named_stage(structure):
    work = vk.LeastAction(source=0, **SMALL)
    work.run(OSC, structure)  # imports what is imported at first use only
    seconds = dict(work.run(OSC, structure).stats.seconds)
    rest = seconds.pop("LeastAction")
    assert set(seconds) - {"compiling"} == {
        "reversed relaxation", "exit targets", "graph", "starts of exit paths", "cells of the basins", "action plot",
        "closest approach", "ends of exit paths", "polishing", "certifying", "whole paths",
    }  # fmt: skip
    assert rest < 0.05 * sum(seconds.values())


@pytest.mark.long
def test_the_graph_is_refined_as_far_as_the_accuracy_asks(structure):
    graph = vk.GraphSearch(nodes=(200, 200), steps_per_period=8)

    def nodes_used(accuracy):
        result = vk.LeastAction(source=0, shooting=SMALL["shooting"], graph=graph, accuracy=accuracy).run(
            OSC, structure
        )
        (used,), (energy,) = result.found(Code.GRAPH), result.energies
        assert energy.bound is Bound.CERTIFIED
        assert EXACT - energy.lower <= max(accuracy, 0.05) * EXACT
        return used.values["nodes_x"]

    assert [nodes_used(accuracy) for accuracy in (0.5, 1e-6)] == [100, 200]


class StraightLine(Source):
    """A source of a user: from the attractor to beyond each saddle, at constant velocity."""

    name = "straight lines"
    searches = True
    effort = Effort.FROM_ORBIT

    def propose(self, problem, polished):
        """Return one line for each saddle and each attractor that it leads to."""
        start, step = problem.attractor.points[0, :2], problem.scene.section_interval / 8
        times = step * np.arange(17)
        for end in problem.path_ends:
            goal = 1.1 * problem.structure.saddles[end.saddle].points[0, :2] - 0.1 * start
            line = start + (goal - start) * np.linspace(0, 1, 17)[:, None]
            states = np.column_stack([line[:, 0], np.full(17, (goal - start)[0] / times[-1])])
            for target in end.targets:
                yield Candidate(problem.source, target, times, states, 1.0, self.name)


class Other(StraightLine):
    """A source with a fault, after good candidates."""

    name = "others"

    def __init__(self, fault):
        self.fault = fault

    def propose(self, problem, polished):
        for good in super().propose(problem, polished):
            yield good
            yield self.fault(good)


def raised(error):
    raise error


def replaced(**values):
    return lambda good: dataclasses.replace(good, **values)


FAULTS = {
    "it cannot.": lambda good: raised(StructureError("it cannot.")),
    "ValueError: no": lambda good: raised(ValueError("no")),
    "Candidate objects, got 'a path'": lambda good: "a path",
    "leaves 1": replaced(source=1),
    "leads to 7": replaced(target=7),
    "action nan": replaced(action=math.nan),
    "5 times": lambda good: dataclasses.replace(good, times=good.times[:5]),
    "positive and equal": lambda good: dataclasses.replace(good, times=good.times**2),
    "finite states": lambda good: dataclasses.replace(good, states=0 * good.states),
    "states from the attractor": lambda good: dataclasses.replace(good, states=math.nan * good.states),
}


def test_a_source_of_a_user_proposes_and_is_polished(structure):
    problem = ExitProblem(OSC, structure, structure.attractors[0], vk.LeaveBasin())
    found = ExitRoad(problem, [StraightLine()]).run()
    (energy,) = found.estimates
    assert energy.value == pytest.approx(EXACT, rel=1e-6)
    assert energy.certificate is not None
    assert (energy.bound, energy.lower) == (Bound.UPPER, 0.0)  # nothing has excluded a cheaper path
    assert energy.proposed_by == StraightLine.name


@pytest.mark.parametrize("says", FAULTS)
def test_a_fault_of_a_source_is_a_finding_and_what_it_proposed_before_is_used(structure, says):
    problem = ExitProblem(OSC, structure, structure.attractors[0], vk.LeaveBasin())
    found = ExitRoad(problem, [Other(FAULTS[says])]).run()
    assert found.estimates[0].value == pytest.approx(EXACT, rel=1e-6)
    (failed,) = (finding for finding in found.findings if finding.code is Code.METHOD_FAILED)
    assert failed.values["method"] == "others"
    assert says in failed.values["reason"]


class Unnamed(Source):
    """A source without a name, which proposes nothing."""

    def propose(self, problem, polished):
        return ()


def test_a_source_without_a_name_has_that_of_its_class():
    assert (Unnamed.name, StraightLine.name) == ("Unnamed", "straight lines")


def test_the_sources_after_an_empty_one_give_the_path_of_a_proven_minimum():
    """The energy is known beforehand, by detailed balance; its path is that of the relaxations."""
    osc = vk.load_scene("double-well")
    found = vk.find_structure(osc, cells=(40, 40), manifolds=False, saddles=True, rng=0)

    class EmptyFirst(vk.LeastAction):
        def sources(self, problem):
            return [Unnamed(), *super().sources(problem)]

    (energy,) = EmptyFirst(source=0).run(osc, found).energies
    assert energy.value == pytest.approx(4 * osc.damping_ratio / 4, rel=1e-9)
    assert energy.certificate is not None
    assert energy.proposed_by == "reversed relaxation"


TOLD = [Code.NOTHING_PROPOSED, Code.METHOD_FAILED]


class Nothing(StraightLine):
    """A source that proposes nothing, or not even that."""

    def __init__(self, answer):
        self.answer = answer

    def propose(self, problem, polished):
        return self.answer


def test_a_source_that_proposes_nothing_is_a_finding_and_one_that_fails_alone_an_error(structure):
    problem = ExitProblem(OSC, structure, structure.attractors[0], vk.LeaveBasin())
    found = ExitRoad(problem, [Nothing(()), Nothing(None), StraightLine()]).run()
    assert found.estimates[0].value == pytest.approx(EXACT, rel=1e-6)
    codes = [finding.code for finding in found.findings]
    assert codes[:2] == TOLD
    assert [code for code in codes if code in TOLD] == TOLD
    with pytest.raises(StructureError, match="TypeError"):
        ExitRoad(problem, [Nothing(None)]).run()


class LeaveLeft(LeaveRegion):
    """Being to the right of x = −0.5; the left well is to the left of it."""

    def bounds(self, osc):
        return np.array([[-0.5, np.inf], [-np.inf, np.inf]])


@pytest.mark.parametrize("name", ["is_out", "beyond", "faces", "stop", "path_ends"])
def test_a_region_with_a_test_of_its_own_is_refused(name):
    """Exit paths would not follow it: a corner, x ≥ c and v ≥ w, had the energy of its faces."""
    with pytest.raises(StructureError, match=name):
        type("Corner", (LeaveRegion,), {name: lambda self, *given: None, "bounds": LeaveLeft.bounds})


@pytest.mark.parametrize(
    "given", [[[0.5, -0.5], [-1, 1]], [[-1, 1]], [-1, 1], [["low", 1], [-1, 1]], None, [[math.nan, 1], [-1, 1]]]
)
def test_bounds_that_are_no_rectangle_are_refused(structure, given):
    class Wrong(LeaveRegion):
        def bounds(self, osc):
            return given

    with pytest.raises(StructureError, match="Wrong: bounds must return"):
        vk.LeastAction(source=0, exit=Wrong(), **SMALL).run(OSC, structure)


def test_an_attractor_that_has_left_already_costs_nothing(structure):
    result = vk.LeastAction(source="left-rest", exit=LeaveLeft(), **SMALL).run(OSC, structure)
    (energy,) = result.energies
    assert (energy.source, energy.target) == (0, -1)
    assert (energy.value, energy.lower, energy.upper, energy.numerical_error) == (0, 0, 0, 0)
    assert energy.bound is Bound.CERTIFIED
    (finding,) = result.found(Code.AT_EXIT)
    assert finding.source == 0
    assert result.complete
