"""Value iteration with continuous predecessors: one step of time applied to a function on a grid.

V_after(y) = min over x of V_before(x) + ½ |R (x − b)|², where b(y) and the upper triangular R(y) are given for every
node y of the grid after, and x is any point of the grid before. Points are in units of nodes, so that nodes are whole
numbers. V is interpolated by quadratic pieces whose curvature is what neighbouring nodes agree on (Min & Gibou, J.
Comput. Phys. 225, 300, 2007): exact for quadratic forms, and linear across the ridges where two paths cost the same.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

_NEWTON = 6  # iterations; the next sweep goes on from where they end
_HALVINGS = 3  # of a step that does not descend
_CONVERGED = 1e-4  # of a node distance; the cost is quadratic there
_CONVEX = 0.1  # of the step's own curvature: what V must leave of it for Newton's method to use that of V as well

Array = NDArray[np.float64]
Flags = NDArray[np.uint8]


@njit(nogil=True, cache=True, error_model="numpy")
def _common(a: float, b: float) -> float:
    """Harmonic mean of two curvatures of one sign, 0 for those of different signs."""
    return 2.0 * a * b / (a + b) if a * b > 0.0 else 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def interpolate(values: Array, s: float, t: float) -> tuple[float, float, float, float, float, float]:
    """Return V, ∂V/∂s, ∂V/∂t, ∂²V/∂s², ∂²V/∂s∂t, ∂²V/∂t² at a point of a grid, at least a node from its edge."""
    i = min(max(int(s), 1), values.shape[0] - 3)
    j = min(max(int(t), 1), values.shape[1] - 3)
    x, y = s - i, t - j
    p, q, r, u = values[i, j], values[i + 1, j], values[i, j + 1], values[i + 1, j + 1]
    a, b, c, d = values[i - 1, j], values[i + 2, j], values[i - 1, j + 1], values[i + 2, j + 1]
    e, f, g, h = values[i, j - 1], values[i, j + 2], values[i + 1, j - 1], values[i + 1, j + 2]
    low_s, high_s = _common(a - 2.0 * p + q, p - 2.0 * q + b), _common(c - 2.0 * r + u, r - 2.0 * u + d)
    low_t, high_t = _common(e - 2.0 * p + r, p - 2.0 * r + f), _common(g - 2.0 * q + u, q - 2.0 * u + h)
    twist = p - q - r + u
    turn_s, turn_t = high_s - low_s, high_t - low_t
    bend_s, bend_t = low_s + turn_s * y, low_t + turn_t * x
    round_s, round_t = 0.5 * x * (x - 1.0), 0.5 * y * (y - 1.0)
    value = p + (q - p) * x + (r - p) * y + twist * x * y + round_s * bend_s + round_t * bend_t
    if value < min(p, q, r, u, a, b, c, d, e, f, g, h):  # a valley too narrow for the grid
        value = p + (q - p) * x + (r - p) * y + twist * x * y
        bend_s = bend_t = turn_s = turn_t = 0.0
    slope_s = q - p + twist * y + (x - 0.5) * bend_s + round_t * turn_t
    slope_t = r - p + twist * x + (y - 0.5) * bend_t + round_s * turn_s
    return value, slope_s, slope_t, bend_s, twist + (x - 0.5) * turn_s + (y - 0.5) * turn_t, bend_t


@njit(nogil=True, cache=True, error_model="numpy")
def _step_cost(s: float, t: float, centre: Array, root: Array) -> float:
    """Return ½ |R (x − b)|², as a sum of squares, which rounding cannot make negative however long and thin R is."""
    ds, dt = s - centre[0], t - centre[1]
    first, second = root[0] * ds + root[1] * dt, root[2] * dt
    return 0.5 * (first * first + second * second)


@njit(nogil=True, cache=True, error_model="numpy")
def _total_cost(before: Array, s: float, t: float, centre: Array, root: Array, most: float) -> float:
    """Return the cost of a path that comes by a point of the grid before; infinite where the step alone costs `most`.

    V is not negative, so that a step which costs as much as the cheapest path known needs no interpolation.
    """
    step = _step_cost(s, t, centre, root)
    return math.inf if step >= most else interpolate(before, s, t)[0] + step


@njit(nogil=True, cache=True, error_model="numpy")
def _clamped(value: float, count: int) -> float:
    """Return the nearest coordinate that can be interpolated."""
    return min(max(value, 1.0), count - 2.0)


@njit(nogil=True, cache=True, error_model="numpy")
def descend(before: Array, s: float, t: float, centre: Array, root: Array) -> tuple[float, float, float]:
    """Return the local minimum of the cost near a point by Newton's method, as (cost, s, t)."""
    found = math.inf
    a, b, c = root[0] * root[0], root[0] * root[1], root[1] * root[1] + root[2] * root[2]
    for _ in range(_NEWTON):
        value, gs, gt, hss, hst, htt = interpolate(before, s, t)
        found = value + _step_cost(s, t, centre, root)
        ds, dt = s - centre[0], t - centre[1]
        first = root[0] * ds + root[1] * dt
        gs += root[0] * first
        gt += root[1] * first + root[2] * root[2] * dt
        hss, hst, htt = hss + a, hst + b, htt + c
        det, own = hss * htt - hst * hst, a * root[2] * root[2]
        if not (hss > _CONVEX * a and htt > _CONVEX * c and det > _CONVEX * _CONVEX * own):
            hss, hst, htt, det = a, b, c, own
        step_s, step_t = (hst * gt - htt * gs) / det, (hst * gs - hss * gt) / det
        if abs(step_s) < _CONVERGED and abs(step_t) < _CONVERGED:
            return found, s, t
        moved = False
        for _ in range(_HALVINGS):
            new_s, new_t = _clamped(s + step_s, before.shape[0]), _clamped(t + step_t, before.shape[1])
            if _total_cost(before, new_s, new_t, centre, root, found) < found:
                moved = True
                break
            step_s *= 0.3
            step_t *= 0.3
        if not moved:
            return found, s, t
        s, t = new_s, new_t
    return _total_cost(before, s, t, centre, root, math.inf), s, t


@njit(nogil=True, cache=True, error_model="numpy")
def best_node(before: Array, centre: Array, root: Array, most: float, reach: int) -> tuple[float, int, int]:
    """Return the cheapest node within reach that costs less than `most`, as (cost, i, j); i is −1 if none does."""
    far = math.sqrt(2.0 * max(most, 0.0))
    wide = min(far * math.hypot(root[1] / root[2], 1.0) / root[0], reach)
    high = min(far / root[2], reach)
    found, at_i, at_j = most, -1, -1
    n, m = before.shape
    for i in range(max(1, math.ceil(centre[0] - wide)), min(n - 2, math.floor(centre[0] + wide)) + 1):
        for j in range(max(1, math.ceil(centre[1] - high)), min(m - 2, math.floor(centre[1] + high)) + 1):
            here = before[i, j] + _step_cost(i, j, centre, root)
            if here < found:
                found, at_i, at_j = here, i, j
    return found, at_i, at_j


@njit(nogil=True, cache=True, error_model="numpy")
def sweep_rows(
    before: Array,  # (n, m): V on the grid before
    after: Array,  # (n, m): V on the grid after
    centres: Array,  # (n, m, 2): b of each node of the grid after; NaN where there is none
    roots: Array,  # (n, m, 3): R as (ss, st, tt)
    predecessors: Array,  # (n, m, 2): best x known of each node; improved
    ceilings: Array,  # (n, m): upper bounds of V
    fixed: Flags,  # (n, m): nodes whose V is given
    active: Flags,  # (n, m): nodes of the grid before near which V has changed
    changed: Flags,  # (n, m): set for nodes of the grid after whose V changed by more than the tolerance, else cleared
    first: int,
    last: int,  # rows to do: first ≤ i < last
    tolerance: float,  # relative
    uphill: Array,  # (n, m, 2): points that are always tried
    order: int,  # 1 from the first row and column to the last, −1 the other way round
    reach: int,  # nodes to each side of b among which a cheaper predecessor is searched; 0 to improve known ones only
) -> None:
    """Improve some rows of nodes of the grid after, in place.

    If reach is 0, only nodes with predecessors in active places are evaluated. The predecessors of the two neighbours
    done before are tried, within these rows only, so that the result does not depend on who does the others.
    """
    n, m = before.shape
    for row in range(last - first):
        i = first + row if order > 0 else last - 1 - row
        for column in range(m):
            j = column if order > 0 else m - 1 - column
            changed[i, j] = 0
            if fixed[i, j] or math.isnan(centres[i, j, 0]):
                continue
            s, t = predecessors[i, j, 0], predecessors[i, j, 1]
            if reach == 0 and not active[int(s + 0.5), int(t + 0.5)]:
                continue
            ceiling = ceilings[i, j]
            centre, root = centres[i, j], roots[i, j]
            found = _total_cost(before, s, t, centre, root, math.inf)
            for tried in range(4):
                if tried == 0:
                    new_s, new_t = _clamped(centre[0], n), _clamped(centre[1], m)
                elif tried == 1:
                    new_s, new_t = uphill[i, j, 0], uphill[i, j, 1]
                else:
                    ni, nj = (i, j - order) if tried == 2 else (i - order, j)
                    if not (first <= ni < last and 0 <= nj < m) or math.isnan(centres[ni, nj, 0]):
                        continue
                    new_s, new_t = predecessors[ni, nj, 0], predecessors[ni, nj, 1]
                here = _total_cost(before, new_s, new_t, centre, root, found)
                if here < found:
                    found, s, t = here, new_s, new_t
            if reach > 0:
                here, ni, nj = best_node(before, centre, root, min(found, ceiling), reach)
                if ni >= 0 and here < found:
                    found, s, t = here, float(ni), float(nj)
            if found < ceiling:
                found, s, t = descend(before, s, t, centre, root)
            predecessors[i, j, 0], predecessors[i, j, 1] = s, t
            found = min(found, ceiling)
            if abs(found - after[i, j]) > tolerance * after[i, j]:
                changed[i, j] = 1
            after[i, j] = found


@njit(nogil=True, cache=True, error_model="numpy")
def evaluate_rows(
    before: Array,
    after: Array,
    centres: Array,
    roots: Array,
    predecessors: Array,
    ceilings: Array,
    fixed: Flags,
    active: Flags,
    changed: Flags,
    first: int,
    last: int,
    tolerance: float,
) -> None:
    """Recompute V on some rows of nodes of the grid after, in place, from predecessors that are kept.

    Arguments as of `sweep_rows`. It costs one interpolation, and V hardly depends on a predecessor that is nearly best.
    """
    for i in range(first, last):
        for j in range(before.shape[1]):
            changed[i, j] = 0
            if fixed[i, j] or math.isnan(centres[i, j, 0]):
                continue
            s, t = predecessors[i, j, 0], predecessors[i, j, 1]
            if not active[int(s + 0.5), int(t + 0.5)]:
                continue
            ceiling = ceilings[i, j]
            found = min(_total_cost(before, s, t, centres[i, j], roots[i, j], ceiling), ceiling)
            if abs(found - after[i, j]) > tolerance * after[i, j]:
                changed[i, j] = 1
            after[i, j] = found


@njit(nogil=True, cache=True, error_model="numpy")
def interpolate_all(values: Array, points: Array) -> Array:
    """Return V at points (count, 2) of a grid; NaN where a point is NaN."""
    found = np.empty(len(points))
    for k in range(len(points)):
        if math.isnan(points[k, 0]):
            found[k] = math.nan
        else:
            found[k] = interpolate(values, points[k, 0], points[k, 1])[0]
    return found


@njit(nogil=True, cache=True, error_model="numpy")
def descend_all(before: Array, starts: Array, centres: Array, roots: Array, step_weight: float) -> tuple[Array, Array]:
    """Return the least cost of reaching some points, and the predecessors.

    Descents begin at starts (count, tries, 2), and the best result is kept, for centres (count, 2) and roots
    (count, 3). In the choice of the predecessor the step's cost has a weight against V: below 1, those from which V
    falls faster are preferred. Costs (count,) are not weighted, and infinite where there is no b; predecessors have
    shape (count, 2).
    """
    n, m = before.shape
    costs, predecessors = np.full(len(starts), math.inf), np.ones((len(starts), 2))
    for k in range(len(starts)):
        if math.isnan(centres[k, 0]):
            continue
        root = roots[k] * math.sqrt(step_weight)
        least = math.inf
        for start in range(starts.shape[1]):
            s, t = _clamped(starts[k, start, 0], n), _clamped(starts[k, start, 1], m)
            found, s, t = descend(before, s, t, centres[k], root)
            if found < least:
                least = found
                predecessors[k, 0], predecessors[k, 1] = s, t
        costs[k] = _total_cost(before, predecessors[k, 0], predecessors[k, 1], centres[k], roots[k], math.inf)
    return costs, predecessors
