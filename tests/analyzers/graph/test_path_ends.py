"""Path ends of an exit problem, as exit targets of the graph."""

import functools

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.analyzers.exits import Exit, LeaveBasin
from vibrokit.analyzers.graph.path_ends import exit_targets, targets_at
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.targets import FaceTarget, StateTarget
from vibrokit.analyzers.path_ends import AtFace, AtSaddle, InBasin, PathEnd
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.fixed_steps import RK4
from vibrokit.results.basins import ESCAPED


@functools.cache
def well():
    """Attractor 0 at x = −1, attractor 1 at x = 1, saddle 0 between them."""
    osc = vk.load_scene("double-well")
    return osc, vk.find_structure(osc, cells=(40, 40), starts=(8, 8), manifolds=False)


class Anywhere(PathEnd):
    """A path end that no method knows."""


class Given(LeaveBasin):
    """An exit with given path ends."""

    ends: tuple[PathEnd, ...] = ()

    def path_ends(self, osc, structure, source):
        return self.ends


def setup(exit_=None):
    osc, structure = well()
    return ExitProblem(osc, structure, structure.attractors[0], exit_ or vk.LeaveBasin()), StepModel(osc, RK4(256))


def test_a_saddle_is_its_points_with_the_direction_in_which_paths_leave():
    problem, model = setup()
    (target,) = exit_targets(problem, model)
    assert isinstance(target, StateTarget)
    assert (target.labels, target.saddle, target.depth) == ((1,), 0, None)
    np.testing.assert_allclose(target.states, problem.structure.saddles[0].points[:, :2])
    damping = problem.osc.damping_ratio
    rate = -damping + np.sqrt(damping**2 + 1)  # of x″ + 2ζx′ − x = 0
    assert target.direction[1] / target.direction[0] == pytest.approx(rate, rel=1e-4)
    assert target.scale > 0


def test_a_saddle_between_other_basins_is_ignored():
    assert targets_at(AtSaddle((1,), 0, on_own_boundary=False), *setup()) == []


def test_a_saddle_counts_for_all_attractors_that_it_leads_to_and_for_escape():
    (target,) = targets_at(AtSaddle((-1, 1, 5), 0), *setup())
    assert target.labels == (1, 5)
    (escape,) = targets_at(AtSaddle((-1, ESCAPED), 0), *setup())
    assert escape.labels == (ESCAPED,)
    assert targets_at(AtSaddle((-1,), 0), *setup()) == []


def test_orbits_inside_a_chaotic_set_are_left_to_that_set():
    assert targets_at(AtSaddle((1,), 0, embedded=True), *setup()) == []


def test_a_basin_is_the_cells_that_surely_belong_to_it_and_the_attractor():
    problem, model = setup()
    (target,) = targets_at(InBasin((1,)), problem, model)
    assert (target.labels, target.saddle, target.direction) == ((1,), -1, None)
    labels, region = problem.structure.basins.labels, problem.structure.basins.region
    np.testing.assert_allclose(target.depth, 2 * np.diff(region.bounds, axis=1)[:, 0] / labels.shape)
    assert 0 < len(target.states) < (labels == 1).sum()
    assert any(np.allclose(state, problem.structure.attractors[1].points[0]) for state in target.states)
    low, high = region.bounds.T
    cells = ((target.states - low) / (high - low) * labels.shape).astype(int)
    assert np.all(labels[tuple(cells.T)] == 1)


@pytest.mark.parametrize(("axis", "level"), [(0, 0.3), (1, -0.4)])
def test_a_face_has_its_axis_and_level(axis, level):
    (target,) = targets_at(AtFace((-1,), axis, level, 1), *setup())
    assert isinstance(target, FaceTarget)
    assert (target.labels, target.saddle, target.axis, target.level) == ((-1,), -1, axis, level)
    assert target.scale > 0


def test_an_unknown_path_end_is_refused():
    with pytest.raises(StructureError, match=r"paths that end at .*Anywhere.*AtFace"):
        exit_targets(*setup(Given(ends=(Anywhere((1,)),))))


@pytest.mark.parametrize("ends", [(), (AtSaddle((1,), 0, on_own_boundary=False),)])
def test_an_exit_without_any_usable_path_end_is_refused(ends):
    given = Given(ends=ends)
    assert isinstance(given, Exit)
    with pytest.raises(StructureError, match="no place where a path from left-rest may end"):
        exit_targets(*setup(given))
