"""Other beginnings of a known path: on a forced double well they are the same path, since no other competes."""

import dataclasses

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.analyzers.graph.beginnings import beginnings
from vibrokit.analyzers.problem import ExitProblem

pytestmark = pytest.mark.slow

OSC = vk.load_scene("double-well").replace({"damping_ratio": 0.3})
GRAPH = vk.GraphSearch(nodes=(60, 60), steps_per_period=8)


@pytest.fixture(scope="module")
def problem():
    structure = vk.find_structure(OSC, cells=(20, 20), starts=(8, 8), manifolds=False)
    return ExitProblem(OSC, structure, structure.attractors[0], vk.LeaveBasin())


@pytest.fixture(scope="module")
def energy(problem):
    (found,) = vk.LeastAction(graph=GRAPH, shooting=None, source=0).run(OSC, problem.structure).energies
    return found


@pytest.fixture(scope="module")
def potential(problem):
    return GRAPH.search(problem).potential


def test_they_end_where_the_path_ends_and_cost_as_much(problem, potential, energy):
    found = beginnings(problem, potential, energy)
    assert found
    for candidate in found:
        speed = np.abs(np.diff(energy.path.q[:, :2], axis=0)).max(axis=0) * 128 / 8
        assert (np.abs(candidate.states[-1] - energy.path.q[-1, :2]) <= speed).all()
        np.testing.assert_allclose(np.diff(candidate.times), candidate.times[1])
        assert candidate.action == pytest.approx(energy.value, rel=0.05)


def test_none_without_a_path(problem, potential, energy):
    assert beginnings(problem, potential, dataclasses.replace(energy, path=None)) == []


def test_none_for_a_path_that_spends_its_action_at_once(problem, potential, energy):
    path = dataclasses.replace(energy.path, section=energy.path.section[-1:])
    assert beginnings(problem, potential, dataclasses.replace(energy, path=path)) == []
