"""Scenes, structures and settings that analyzers of least action refuse."""

import dataclasses
import subprocess
import sys
import time
import tracemalloc

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import Coloured
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.polish import polish
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import SceneError, StepperError, StructureError, VibrokitError
from vibrokit.results.codes import Code

pytestmark = pytest.mark.slow

WELL = vk.load_scene("double-well")
QUICK = {"cells": (20, 20), "starts": (8, 8), "manifolds": False}
SMALL_GRAPH, SMALL_SHOOTING = vk.GraphSearch(nodes=(40, 40)), vk.Shooting(points=200, rounds=2)
SMALL = {"graph": SMALL_GRAPH, "shooting": SMALL_SHOOTING}
ANALYZERS = {"graph": vk.ActionGraph, "plot": vk.ActionPlot, "least": vk.LeastAction}


@pytest.fixture(scope="module")
def structure():
    return vk.find_structure(WELL, **QUICK)


@pytest.fixture(params=ANALYZERS.values(), ids=ANALYZERS)
def analyzer(request):
    return request.param


def problem_of(osc, structure, label=0):
    return ExitProblem(osc, structure, structure.attractor(label), vk.LeaveBasin())


def refused(kind, make, words):
    """Refused at once, in one line of whole sentences."""
    began = time.perf_counter()
    with pytest.raises(kind, match=words) as error:
        make()
    assert time.perf_counter() - began < 10
    text = str(error.value)
    assert isinstance(error.value, VibrokitError)
    assert "\n" not in text
    assert text.endswith(".")
    assert len(text) < 600


NO_SEARCHES = (3, "none", True, vk.LeaveBasin(), vk.GraphSearch, vk.Shooting, vk.ActionGraph(), vk.ActionPlot())
BAD_GRAPHS = [
    ({"steps_per_period": 7}, "even number"),
    *(({"steps_per_period": given}, "steps_per_period") for given in (0, 8.0, True, 10**6, "8")),
    ({"nodes": (31, 320)}, "32 or more"),
    *(({"nodes": given}, "nodes") for given in ((0, 0), 320, (320,), (320.5, 320), None)),
    *(({"max_memory_gib": given}, "positive number of GiB") for given in (0.0, -1, np.nan, "4", True)),
]
SETTINGS = [
    *((vk.FirstContact, {"side": given}, "side must be") for given in ("up", 1, [], True)),
    *((vk.LeaveBasin, {"for_good": given}, "for_good must be True or False") for given in ("no", 1, None)),
    *((vk.LeastAction, {"graph": given}, "graph must be a .*None to do without") for given in NO_SEARCHES),
    *((vk.LeastAction, {"shooting": given}, "shooting must be a .*None to do without") for given in NO_SEARCHES),
    (vk.LeastAction, {"shooting": vk.GraphSearch()}, "shooting must be a Shooting"),
    (vk.LeastAction, {"graph": vk.Shooting()}, "graph must be a GraphSearch"),
    (vk.LeastAction, {"shooting": None, "graph": None}, "at least one"),
    *((vk.LeastAction, {"orbits": given}, "orbits") for given in (-1, 1.5, "4", None, True, 10**9)),
    *((kind, *bad) for kind in (vk.GraphSearch, vk.ActionGraph) for bad in BAD_GRAPHS),
    (vk.LeaveBounds, {}, "no bound"),
    *((vk.LeaveBounds, {"x": given}, "least and the largest") for given in (1.0, ("a", 1.0))),
    *((vk.LeaveBounds, {"x": given}, "lower bound first") for given in ((1.0, 1.0), (2.0, -2.0), (np.nan, 1.0))),
    (vk.LeaveBounds, {"v": (2.0, -2.0)}, "lower bound first"),
]


@pytest.mark.parametrize(("kind", "settings", "words"), SETTINGS)
def test_settings(kind, settings, words):
    refused(StructureError, lambda: kind(**settings), words)


RUNS = [
    (SceneError, {}, {"osc": dataclasses.replace(WELL, noise=None)}, "no noise"),
    (StructureError, {"exit": vk.FirstContact()}, {}, "no stop"),
    (StructureError, {"exit": vk.FirstContact("left")}, {}, "no left stop"),
    *(
        (StructureError, {"source": given}, {}, "there is no attractor")
        for given in (7, -1, "up", "", 0.5, True, [0], np.nan)
    ),
    (StructureError, {}, {"osc": WELL.replace({"damping_ratio": 0.06})}, "another scene"),
    *((StructureError, {}, {"structure": given}, "structure") for given in (None, "double-well", 3, WELL)),
    *((SceneError, {}, {"osc": given}, "[Oo]scillator") for given in (None, "double-well", 3)),
    *(
        (StructureError, {"exit": given}, {}, r"exit must be an Exit.*LeaveBasin\(\)")
        for given in ("x", None, 3, vk.LeaveBasin, vk.WhiteNoise(1.0))
    ),
    *((StepperError, {"stepper": given}, {}, "stepper must be a Stepper") for given in ("rk4", 3, vk.RK4)),
    (StructureError, {}, {"progress": 3}, "progress must be"),
    *(
        (StructureError, {}, {"time_limit": given}, "time_limit must be")
        for given in (0, -1.0, "1", np.nan, np.inf, True)
    ),
]


@pytest.mark.parametrize(("kind", "settings", "given", "words"), RUNS)
def test_runs(analyzer, structure, kind, settings, given, words):
    refused(kind, lambda: analyzer(**settings).run(**({"osc": WELL, "structure": structure} | given)), words)


# --- scenes


def test_only_one_attractor_and_no_other_basin(analyzer):
    one = vk.find_structure(WELL, region=((0.5, 1.5), (-0.1, 0.1)), starts=(3, 3), cells=(4, 4))
    assert len(one.attractors) == 1
    refused(StructureError, lambda: analyzer().run(WELL, one), r"only one attractor.*LeaveBounds\(x=\(")


def test_first_contact_without_a_stop_on_that_side(analyzer):
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.1,
        barriers=(vk.Barrier(vk.Hertz(50.0), 1.0, "right"),),
        noise=vk.WhiteNoise(1e-3),
    )
    structure = vk.find_structure(osc, saddles=False, **QUICK)
    refused(StructureError, lambda: analyzer(exit=vk.FirstContact("left")).run(osc, structure), "no left stop")


@pytest.fixture(scope="module")
def centres(structure):
    """Without damping the wells are centres: their multipliers have size 1, and there is no quadratic form."""
    return WELL.replace({"damping_ratio": 0.0}), dataclasses.replace(
        structure, scene=dict(structure.scene) | {"damping_ratio": 0.0}
    )


def test_paths_are_not_polished_from_a_centre(centres):
    nowhere = Candidate(0, 1, np.array([0.0, 1.0]), np.array([[-1.0, 0.0], [0.1, 0.0]]), 1.0, "test")
    refused(StructureError, lambda: polish(problem_of(*centres), (nowhere,)), "not hyperbolic")


def test_no_path_is_shot_from_a_centre(centres):
    refused(StructureError, lambda: SMALL_SHOOTING.search(problem_of(*centres)), "multiplier")
    result = vk.ActionPlot(points=200, rounds=2).run(*centres)
    assert result.energies == ()
    assert [finding.source for finding in result.found(Code.SOURCE_FAILED)] == [0, 1]


def test_no_graph_grows_from_a_centre(centres):
    refused(StructureError, lambda: SMALL_GRAPH.search(problem_of(*centres)), "multiplier")


@pytest.mark.long
def test_least_action_names_each_method_that_fails(centres):
    result = vk.LeastAction(source=0, **SMALL).run(*centres)
    assert result.energies == ()
    failed = result.found(Code.METHOD_FAILED)
    assert [finding.values["method"] for finding in failed] == ["graph", "action plot"]
    assert all("multiplier" in finding.values["reason"] for finding in failed)
    assert [finding.source for finding in result.found(Code.NO_EXIT_FOUND)] == [0]
    alone = vk.LeastAction(source=0, graph=None, shooting=SMALL_SHOOTING).run(*centres)
    assert [finding.code for finding in alone.findings] == [Code.SOURCE_FAILED]


SLOW = dataclasses.replace(WELL, noise=Coloured(intensity=0.01, rate=0.3))


def test_noise_with_its_own_states():
    """The graph covers x and v only, and names an alternative; LeastAction goes on without it, with a finding."""
    structure = vk.find_structure(SLOW, **QUICK)
    refused(SceneError, lambda: SMALL_GRAPH.search(problem_of(SLOW, structure)), "of its own.*shooting alone")
    for analyzer in (vk.LeastAction(shooting=None, graph=SMALL_GRAPH), vk.LeastAction(source=0, **SMALL)):
        result = analyzer.run(SLOW, structure)
        (failed,) = result.found(Code.METHOD_FAILED)
        assert failed.values["method"] == "graph"
        assert "the noise has" in failed.values["reason"]
        assert all(0 < energy.lower < energy.value for energy in result.energies)  # white noise bounds them


APART = """
from tests.bad_input import test_analyzers as here
structure = here.vk.find_structure(here.WELL, **here.QUICK)
try:
    here.ANALYZERS[{name!r}](source=0).run(here.SLOW, structure)
except here.VibrokitError as error:
    print(error)
"""


@pytest.mark.long
@pytest.mark.parametrize("name", ANALYZERS)
def test_a_structure_without_the_states_that_the_noise_has(name):
    """Noise may differ, but not the size of a state. A kernel given short states ends its process, so this is apart."""
    done = subprocess.run([sys.executable, "-c", APART.format(name=name)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-500:]
    assert "state" in done.stdout
    assert done.stdout.endswith(".\n")


# --- memory


@pytest.mark.parametrize("nodes", [(20_000, 20_000), (31_000, 31_000), (32, 30_000_000)], ids=str)
def test_memory_is_named_before_it_is_taken(structure, nodes):
    tracemalloc.start()
    try:
        graph = vk.GraphSearch(nodes=nodes)
        refused(StructureError, lambda: graph.search(problem_of(WELL, structure)), "needs .* GiB")
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()


def test_a_graph_that_needs_too_much_memory_is_a_finding(structure):
    result = vk.ActionGraph(nodes=(20_000, 20_000)).run(WELL, structure)
    assert result.energies == ()
    assert [finding.source for finding in result.found(Code.SOURCE_FAILED)] == [0, 1]
    too_large = vk.GraphSearch(nodes=(20_000, 20_000))
    noise = vk.StateDependentNoise(1e-4, "1 + c*x**2", c=1e-13)  # with detailed balance there is no graph search
    osc = dataclasses.replace(WELL, noise=noise)
    least = vk.LeastAction(shooting=SMALL_SHOOTING, graph=too_large, source=0).run(osc, structure)
    for finding in (*result.found(Code.SOURCE_FAILED), *least.found(Code.METHOD_FAILED)):
        assert "a graph of 20000 × 20000 nodes" in finding.values["reason"]
    assert len(least.found(Code.METHOD_FAILED)) == 1


def test_more_memory_may_be_allowed_and_less(structure):
    little = vk.GraphSearch(max_memory_gib=1e-3)
    refused(StructureError, lambda: little.search(problem_of(WELL, structure)), "max_memory_gib is 0.001")
    assert vk.GraphSearch(nodes=(40, 40), max_memory_gib=0.01).search(problem_of(WELL, structure)).estimates


@pytest.mark.parametrize("amplitude", ["v", "x**2 - 1", "sqrt(0.9 - x**2)"])
@pytest.mark.parametrize("analyzer", [vk.ActionGraph(nodes=(40, 40)), vk.ActionPlot(points=200, rounds=2)], ids=str)
def test_noise_without_a_value_or_without_effect_at_the_attractor(structure, analyzer, amplitude):
    osc = WELL.replace(noise=vk.StateDependentNoise(1e-2, amplitude))
    found = analyzer.run(osc, structure)
    assert found.energies == ()
    assert len(found.found(Code.SOURCE_FAILED)) == 2
