"""Sweeps on small grids by hand, where the least cost over all predecessors is known in closed form."""

import numpy as np
import pytest

from vibrokit.kernels.sweeps import (
    best_node,
    descend,
    descend_all,
    evaluate_rows,
    interpolate,
    interpolate_all,
    sweep_rows,
)

N = 24
HIGH = 1e6
FORM = np.array([[0.9, 0.3], [0.3, 0.6]])  # A of ½ xᵀ A x, x measured from the middle of the grid
MIDDLE = np.array([11.0, 12.0])  # a node: between nodes the interpolation of a minimum is kept above them


def nodes(n=N):
    return np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), axis=-1).astype(float)


def quadratic(points, form=FORM):
    away = points - MIDDLE
    return 0.5 * np.einsum("...i,ij,...j->...", away, form, away)


class Step:
    """Arguments of a sweep whose steps all have one root and lead from b(y) = y + drift."""

    def __init__(self, before, root=(1.0, 0.0, 1.0), drift=(0.0, 0.0)):
        n, m = before.shape
        self.before, self.after = before, np.full((n, m), HIGH)
        self.centres = nodes(n) + drift
        self.roots = np.tile(np.array(root), (n, m, 1))
        self.predecessors = np.clip(self.centres, 1.0, n - 2.0)
        self.uphill = self.predecessors.copy()
        self.ceilings = np.full((n, m), HIGH)
        self.fixed = np.zeros((n, m), dtype=np.uint8)
        self.active = np.ones((n, m), dtype=np.uint8)
        self.changed = np.zeros((n, m), dtype=np.uint8)

    def sweep(self, first=0, last=None, order=1, reach=0, tolerance=1e-9):
        rows = (first, len(self.before) if last is None else last)
        sweep_rows(*self.arrays, *rows, tolerance, self.uphill, order, reach)
        return self

    def evaluate(self):
        evaluate_rows(*self.arrays, 0, len(self.before), 1e-9)
        return self

    @property
    def arrays(self):
        steps = (self.before, self.after, self.centres, self.roots, self.predecessors)
        return (*steps, self.ceilings, self.fixed, self.active, self.changed)


def inner(values, margin=5):
    return values[margin:-margin, margin:-margin]


# --- interpolation


@pytest.mark.parametrize("point", [(7.0, 9.0), (7.25, 9.5), (1.0, 1.0), (21.9, 3.4)])
def test_a_quadratic_form_is_interpolated_exactly_with_its_derivatives(point):
    value, ds, dt, dss, dst, dtt = interpolate(quadratic(nodes()), *point)
    assert value == pytest.approx(quadratic(np.array(point)), rel=1e-12)
    assert (ds, dt) == pytest.approx(tuple(FORM @ (point - MIDDLE)), rel=1e-10)
    assert (dss, dst, dtt) == pytest.approx((FORM[0, 0], FORM[0, 1], FORM[1, 1]), rel=1e-10)


def test_interpolation_is_linear_across_a_ridge():
    """min(s, 2r − s) has curvature at its top only: the pieces on either side do not overshoot."""
    values = np.minimum(nodes()[..., 0], 20.0 - nodes()[..., 0])
    for s in (8.5, 9.5, 10.5, 11.5):
        assert interpolate(values, s, 12.0)[0] == pytest.approx(min(s, 20.0 - s), abs=1e-12)


def test_interpolation_never_falls_below_the_nodes_around():
    values = (nodes()[..., 0] - 10.5) ** 2 * 1.0
    values[11, :] = 0.0
    assert interpolate(values, 10.5, 12.0)[0] >= 0.0


def test_nan_points_stay_nan():
    found = interpolate_all(quadratic(nodes()), np.array([[5.0, 5.0], [np.nan, np.nan]]))
    assert found[0] == pytest.approx(quadratic(np.array([5.0, 5.0])))
    assert np.isnan(found[1])


# --- one step


def least(point, root, form=FORM):
    """min over x of ½ xᵀAx + ½ |R (x − b)|², and where."""
    r = np.array([[root[0], root[1]], [0.0, root[2]]])
    away = np.linalg.solve(form + r.T @ r, r.T @ r @ (point - MIDDLE))
    miss = r @ (away + MIDDLE - point)
    return 0.5 * away @ form @ away + 0.5 * miss @ miss, away + MIDDLE


@pytest.mark.parametrize("root", [(1.0, 0.0, 1.0), (0.7, -0.4, 1.3)])
def test_newton_descends_to_the_exact_minimum(root):
    point = np.array([6.0, 15.0])
    cost, at = least(point, root)
    found, s, t = descend(quadratic(nodes()), *point, point, np.array(root))
    assert found == pytest.approx(cost, rel=1e-10)
    assert (s, t) == pytest.approx(tuple(at), abs=1e-3)


def test_the_cheapest_node_within_reach():
    before = np.full((N, N), 1.0)
    before[9, 14] = 0.0
    centre, root = np.array([12.0, 10.0]), np.array([0.1, 0.0, 0.1])
    cost = 0.5 * 0.01 * (3**2 + 4**2)
    assert best_node(before, centre, root, 1.0, 8) == pytest.approx((cost, 9, 14))
    assert best_node(before, centre, root, 1.0, 3)[1] != 9  # out of reach
    assert best_node(before, centre, root, 0.5 * cost, 8)[1] == -1  # nothing costs so little


def test_descents_from_several_points_keep_the_cheapest():
    """Two valleys: only the start in the deeper one leads to the least cost."""
    s = nodes()[..., 0]
    before = np.minimum((s - 5) ** 2 + 3.0, (s - 17) ** 2)
    centres, roots = np.array([[9.0, 12.0], [np.nan, np.nan]]), np.array([[0.1, 0.0, 0.1]] * 2)
    starts = np.array([[[5.0, 12.0], [17.0, 12.0]]] * 2)
    costs, predecessors = descend_all(before, starts, centres, roots, 1.0)
    exact = 17 - 8 * 0.005 / (1 + 0.005)  # of (s − 17)² + 0.005 (s − 9)²
    assert predecessors[0] == pytest.approx((exact, 12.0), abs=1e-3)
    assert costs[0] == pytest.approx((exact - 17) ** 2 + 0.005 * (exact - 9) ** 2, rel=1e-6)
    assert costs[1] == np.inf


def test_a_lighter_step_is_longer_and_its_cost_is_not_weighted():
    centres, roots = np.array([[16.0, 12.0]]), np.array([[1.0, 0.0, 1.0]])
    before, starts = quadratic(nodes(), np.eye(2)), centres[:, None]
    (normal,), (at,) = descend_all(before, starts, centres, roots, 1.0)
    (light,), (further,) = descend_all(before, starts, centres, roots, 0.25)
    assert np.linalg.norm(further - centres[0]) > 1.5 * np.linalg.norm(at - centres[0])
    assert light > normal
    assert light == pytest.approx(quadratic(further, np.eye(2)) + 0.5 * np.sum((further - centres[0]) ** 2), rel=1e-9)


# --- sweeps


@pytest.mark.parametrize("order", [1, -1])
def test_repeated_sweeps_add_steps_of_a_known_shortest_path(order):
    """From rest, k steps to y along the straight path: ½ yᵀ (A⁻¹ + k (RᵀR)⁻¹)⁻¹ y."""
    root = np.array([[0.8, 0.2], [0.0, 0.9]])
    before = quadratic(nodes())
    for steps in range(1, 4):
        before = Step(before, (0.8, 0.2, 0.9)).sweep(order=order, reach=8).after
        form = np.linalg.inv(np.linalg.inv(FORM) + steps * np.linalg.inv(root.T @ root))
        np.testing.assert_allclose(inner(before), inner(quadratic(nodes(), form)), rtol=1e-4, atol=1e-9)


def test_predecessors_lie_on_the_straight_path():
    step = Step(quadratic(nodes())).sweep()
    exact = np.array([least(node, (1.0, 0.0, 1.0))[1] for node in nodes().reshape(-1, 2)]).reshape(N, N, 2)
    np.testing.assert_allclose(inner(step.predecessors), inner(exact), atol=1e-3)


def test_the_motion_carries_the_potential_along():
    """V = c s falls by ½ c²/r² for a step that pays, in coordinates that the motion shifts by a node and a half."""
    slope, stiff = 0.6, 0.8
    before = slope * nodes()[..., 0]
    step = Step(before, (stiff, 0.0, stiff), drift=(1.5, -0.5)).sweep()
    exact = slope * (nodes()[..., 0] + 1.5) - 0.5 * slope**2 / stiff**2
    np.testing.assert_allclose(inner(step.after), inner(exact), rtol=1e-9)


def test_a_wide_search_finds_a_cheap_place_that_known_predecessors_miss():
    before = np.full((N, N), 5.0)
    before[12:15, 12:15] = 0.0
    near = Step(before, (0.5, 0.0, 0.5)).sweep()
    wide = Step(before, (0.5, 0.0, 0.5)).sweep(reach=8)
    assert near.after[12, 6] > 4.9  # flat all around, so nothing leads there
    assert wide.after[12, 6] == pytest.approx(0.125 * 6**2, rel=1e-6)


def test_evaluation_keeps_predecessors_and_errs_by_the_square_of_their_error():
    """½ |R (x − b)|² + V(x) grows by ½ dᵀ (A + RᵀR) d at a distance d from the best x."""
    best = Step(quadratic(nodes())).sweep()
    step, miss = Step(quadratic(nodes())), np.array([0.03, -0.02])
    step.predecessors = np.clip(best.predecessors + miss, 1.0, N - 2.0)
    kept = step.predecessors.copy()
    step.evaluate()
    np.testing.assert_array_equal(step.predecessors, kept)
    np.testing.assert_allclose(inner(step.after - best.after), 0.5 * miss @ (FORM + np.eye(2)) @ miss, rtol=0.05)


@pytest.mark.parametrize("work", [Step.sweep, Step.evaluate])
def test_what_is_fixed_asleep_capped_or_unreachable(work):
    step = Step(quadratic(nodes()))
    step.fixed[8, 8], step.after[8, 8] = 1, 7.0
    step.active[10, 10] = 0
    step.ceilings[9, 9] = 0.01
    step.centres[7, 7] = np.nan
    work(step)
    assert step.after[8, 8] == 7.0
    assert step.after[10, 10] == step.after[7, 7] == HIGH
    assert step.after[9, 9] == 0.01
    assert [step.changed[k, k] for k in (7, 8, 9, 10, 11)] == [0, 0, 1, 0, 1]


def test_a_node_asleep_is_evaluated_in_a_wide_search():
    step = Step(quadratic(nodes()))
    step.active[:] = 0
    step.sweep(reach=4)
    assert inner(step.after).max() < HIGH


def test_a_change_below_the_tolerance_is_not_passed_on():
    step = Step(1.0 + quadratic(nodes())).sweep()
    step.after *= 1 + 1e-6
    step.sweep(tolerance=1e-5)
    assert not inner(step.changed).any()
    step.after *= 1 + 1e-4
    step.sweep(tolerance=1e-5)
    assert inner(step.changed).all()


@pytest.mark.parametrize("order", [1, -1])
def test_the_result_does_not_depend_on_who_does_the_other_rows(order):
    before = quadratic(nodes()) + np.sin(nodes()).sum(axis=-1) ** 2
    forth, back = Step(before), Step(before)
    for first in (0, 8, 16):
        forth.sweep(first, first + 8, order=order)
    for first in (16, 8, 0):
        back.sweep(first, first + 8, order=order)
    np.testing.assert_array_equal(forth.after, back.after)
    np.testing.assert_array_equal(forth.predecessors, back.predecessors)
