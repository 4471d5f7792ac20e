"""What analyzers of least action say of scenes, structures and settings that they cannot work with."""

import dataclasses
import subprocess
import sys
import time
import tracemalloc
from typing import ClassVar

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.polishing.branches import polish_all
from vibrokit.errors import SceneError, StepperError, StructureError, VibrokitError

WELL = vk.load_scene("double-well")
QUICK = {"cells": (20, 20), "starts": (8, 8), "manifolds": False}
SMALL_GRAPH, SMALL_PLOT = vk.ActionGraph(cells=(40, 40)), vk.ActionPlot(points=200, rounds=2)
BOTH = {"graph": SMALL_GRAPH, "plot": SMALL_PLOT}
ANALYZERS = {"graph": vk.ActionGraph, "plot": vk.ActionPlot, "least": vk.LeastAction}


@pytest.fixture(scope="module")
def structure():
    return vk.find_structure(WELL, **QUICK)


@pytest.fixture(params=ANALYZERS.values(), ids=ANALYZERS)
def analyzer(request):
    return request.param


def refused(kind, make, words):
    """What was said: one line, whole sentences, at once."""
    began = time.perf_counter()
    with pytest.raises(kind, match=words) as error:
        make()
    assert time.perf_counter() - began < 10
    said = str(error.value)
    assert isinstance(error.value, VibrokitError)
    assert "\n" not in said
    assert said.endswith(".")
    assert len(said) < 600


# --- scenes


def test_a_scene_without_noise(analyzer, structure):
    quiet = dataclasses.replace(WELL, noise=None)
    refused(SceneError, lambda: analyzer().run(quiet, structure), "no noise")


def test_one_attractor_only_and_another_basin_asked(analyzer):
    one = vk.find_structure(WELL, region=((0.5, 1.5), (-0.1, 0.1)), starts=(3, 3), cells=(4, 4))
    assert len(one.attractors) == 1
    refused(StructureError, lambda: analyzer().run(WELL, one), r"one attractor only.*FirstContact\(\)")


@pytest.mark.parametrize(("side", "words"), [(None, "no stop"), ("left", "no left stop")])
def test_no_stop_and_its_touch_asked(analyzer, structure, side, words):
    refused(StructureError, lambda: analyzer(exit=vk.FirstContact(side)).run(WELL, structure), words)


def test_no_stop_on_that_side(analyzer):
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.1,
        barriers=(vk.Barrier(vk.Hertz(50.0), 1.0, "right"),),
        noise=vk.WhiteNoise(1e-3),
    )
    structure = vk.find_structure(osc, saddles=False, **QUICK)
    refused(StructureError, lambda: analyzer(exit=vk.FirstContact("left")).run(osc, structure), "no left stop")


@pytest.mark.parametrize("side", ["up", 1, [], True])
def test_sides_that_are_none(side):
    refused(StructureError, lambda: vk.FirstContact(side), "side is")


@pytest.fixture(scope="module")
def centres(structure):
    """Without damping the wells are centres: their multipliers have size 1, and there is no quadratic form."""
    return WELL.replace({"damping_ratio": 0.0}), dataclasses.replace(
        structure, scene=dict(structure.scene) | {"damping_ratio": 0.0}
    )


def test_paths_are_not_polished_from_a_centre(centres):
    nowhere = Candidate(0, 1, np.array([0.0, 1.0]), np.array([[-1.0, 0.0], [0.1, 0.0]]), 1.0, "test")
    polished = polish_all(*centres, 0, (nowhere,), vk.LeaveBasin())
    assert polished.branches == ()
    assert "not hyperbolic" in polished.words[0]


def test_no_path_is_shot_from_a_centre(centres):
    refused(StructureError, lambda: SMALL_PLOT.search(*centres, 0), "multiplier")
    result = SMALL_PLOT.run(*centres)
    assert result.energies == ()
    assert all(f"Attractor {label} was left out: " in result.status for label in (0, 1))


def test_no_graph_grows_from_a_centre(centres):
    refused(StructureError, lambda: SMALL_GRAPH.search(*centres, 0), "multiplier")


class Slow(vk.NoiseModel):
    """Noise through a low pass."""

    extra_states: ClassVar = ("y",)

    rate: float = vk.parameter("r", "s^-1", above=0)

    def amplitude(self, x, v):
        return self.rate

    def force(self, y):
        return y

    def drift(self, x, v, y):
        return (-self.rate * y,)


SLOW = dataclasses.replace(WELL, noise=Slow(intensity=0.01, rate=0.3))


def test_noise_with_states_of_its_own():
    """The graph covers x and v only, and says what to take instead; LeastAction does without it, and says so."""
    structure = vk.find_structure(SLOW, **QUICK)
    refused(SceneError, lambda: SMALL_GRAPH.run(SLOW, structure), "of its own.*take ActionPlot")
    refused(SceneError, lambda: vk.LeastAction(plot=None, graph=SMALL_GRAPH).run(SLOW, structure), "take ActionPlot")
    result = vk.LeastAction(source=0, **BOTH).run(SLOW, structure)
    assert "without a graph: the noise has" in result.status


TOLD = """
from tests.bad_input import test_analyzers as here
structure = here.vk.find_structure(here.WELL, **here.QUICK)
try:
    here.ANALYZERS[{name!r}](source=0).run(here.SLOW, structure)
except here.VibrokitError as error:
    print(error)
"""


@pytest.mark.parametrize("name", ANALYZERS)
def test_a_structure_without_the_states_that_the_noise_has(name):
    """Noise may differ, but not in what states are made of. Elsewhere, for kernels given short states end a process."""
    done = subprocess.run([sys.executable, "-c", TOLD.format(name=name)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-500:]
    assert "state" in done.stdout
    assert done.stdout.endswith(".\n")


# --- structures


def test_an_unknown_attractor(analyzer, structure):
    refused(StructureError, lambda: analyzer(source=7).run(WELL, structure), "no attractor of label 7")
    for search in (vk.ActionGraph().search, vk.ActionPlot().search):
        refused(StructureError, lambda search=search: search(WELL, structure, 7), "no attractor of label 7")


@pytest.mark.parametrize("source", ["0", 0.5, True, [0], np.nan], ids=repr)
def test_labels_that_are_no_numbers(analyzer, structure, source):
    refused(VibrokitError, lambda: analyzer(source=source).run(WELL, structure), "label|source")


def test_a_structure_of_another_scene(analyzer, structure):
    other = WELL.replace({"damping_ratio": 0.06})
    refused(StructureError, lambda: analyzer().run(other, structure), "another scene")


@pytest.mark.parametrize("given", [None, "double-well", 3, WELL], ids=lambda given: type(given).__name__)
def test_what_is_no_structure(analyzer, given):
    refused(StructureError, lambda: analyzer().run(WELL, given), "which is none")


@pytest.mark.parametrize("given", [None, "double-well", 3], ids=repr)
def test_what_is_no_scene(analyzer, structure, given):
    refused(SceneError, lambda: analyzer().run(given, structure), "oscillator")


# --- settings


@pytest.mark.parametrize("given", ["x", None, 3, vk.LeaveBasin, vk.WhiteNoise(1.0)], ids=str)
def test_what_is_no_exit(analyzer, structure, given):
    refused(StructureError, lambda: analyzer(exit=given).run(WELL, structure), r"exit is .*LeaveBasin\(\) or FirstCo")


@pytest.mark.parametrize("given", ["rk4", 3, vk.RK4], ids=str)
def test_what_is_no_stepper(analyzer, structure, given):
    refused(StepperError, lambda: analyzer(stepper=given).run(WELL, structure), "stepper")


def test_what_is_no_progress(analyzer, structure):
    refused(StructureError, lambda: analyzer().run(WELL, structure, progress=3), "progress")


@pytest.mark.parametrize("name", ["graph", "plot"])
@pytest.mark.parametrize("given", [3, "none", True, vk.LeaveBasin(), vk.ActionGraph, vk.ActionPlot], ids=str)
def test_what_is_no_search(name, given):
    refused(StructureError, lambda: vk.LeastAction(**{name: given}), f"{name} is .*None to do without")


def test_searches_are_not_taken_for_each_other():
    refused(StructureError, lambda: vk.LeastAction(plot=vk.ActionGraph()), "plot is")
    refused(StructureError, lambda: vk.LeastAction(graph=vk.ActionPlot()), "graph is")


def test_without_any_search():
    refused(StructureError, lambda: vk.LeastAction(plot=None, graph=None), "one at least")


@pytest.mark.parametrize("orbits", [-1, 1.5, "4", None, True, 10**9], ids=repr)
def test_numbers_of_orbits(orbits):
    refused(StructureError, lambda: vk.LeastAction(orbits=orbits), "orbits")


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"fraction": 7}, "even number"),
        ({"fraction": 0}, "fraction is"),
        ({"fraction": 8.0}, "fraction is"),
        ({"fraction": True}, "fraction is"),
        ({"fraction": 10**6}, "fraction is"),
        ({"fraction": "8"}, "fraction is"),
        ({"cells": (31, 320)}, "32 or more"),
        ({"cells": (0, 0)}, "cells"),
        ({"cells": 320}, "cells"),
        ({"cells": (320,)}, "cells"),
        ({"cells": (320.5, 320)}, "cells"),
        ({"cells": None}, "cells"),
        ({"memory": 0.0}, "positive number of GiB"),
        ({"memory": -1}, "positive number of GiB"),
        ({"memory": float("nan")}, "positive number of GiB"),
        ({"memory": "4"}, "positive number of GiB"),
        ({"memory": True}, "positive number of GiB"),
    ],
    ids=str,
)
def test_settings_of_the_graph(bad, words):
    refused(StructureError, lambda: vk.ActionGraph(**bad), words)


# --- memory


@pytest.mark.parametrize("cells", [(20_000, 20_000), (31_000, 31_000), (32, 30_000_000)], ids=str)
def test_memory_is_named_before_it_is_taken(structure, cells):
    tracemalloc.start()
    try:
        refused(StructureError, lambda: vk.ActionGraph(cells=cells).search(WELL, structure, 0), "needs .* GiB")
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()


def test_too_much_memory_leaves_nothing_of_the_graph_and_says_so(structure):
    result = vk.ActionGraph(cells=(20_000, 20_000)).run(WELL, structure)
    assert result.energies == ()
    for label in (0, 1):
        assert f"Attractor {label} was left out: a graph of 20000 × 20000 nodes" in result.status
    least = vk.LeastAction(plot=SMALL_PLOT, graph=vk.ActionGraph(cells=(20_000, 20_000)), source=0).run(WELL, structure)
    assert "without a graph: a graph of 20000 × 20000 nodes" in least.status


def test_more_memory_may_be_allowed_and_less(structure):
    refused(StructureError, lambda: vk.ActionGraph(memory=1e-3).search(WELL, structure, 0), "0.001 GiB are allowed")
    assert vk.ActionGraph(cells=(40, 40), memory=0.01).search(WELL, structure, 0).targets
