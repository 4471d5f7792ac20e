"""Value iteration with continuous predecessors: what one step of time does to a function on a grid.

V_after(y) = min over x of V_before(x) + ½ |R (x − b)|², where b(y) and the triangular R(y) are given for every node y
of the grid after, and x is any point of the grid before. Places are in units of cells, so that nodes are whole numbers;
V is interpolated by quadratic pieces whose curvature is what neighbouring nodes agree on (Min & Gibou, J. Comput. Phys.
225, 300, 2007): exact for quadratic forms, and linear across the ridges where two ways of coming are equally cheap.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

_NEWTON = 6
_HALVINGS = 3
_NEAR = 1e-4  # of a cell: where Newton's method has arrived

Array = NDArray[np.float64]
Flags = NDArray[np.uint8]


@njit(nogil=True, cache=True, error_model="numpy")
def _common(a: float, b: float) -> float:
    """Harmonic mean of two curvatures of one sign, 0 for those of different signs."""
    return 2.0 * a * b / (a + b) if a * b > 0.0 else 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def interpolate(values: Array, s: float, t: float) -> tuple[float, float, float, float, float, float]:
    """Return V, ∂V/∂s, ∂V/∂t, ∂²V/∂s², ∂²V/∂s∂t, ∂²V/∂t² at a point of a grid, at least a cell from its edge."""
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
def paid(s: float, t: float, centre: Array, root: Array) -> float:
    """Return ½ |R (x − b)|², a sum of squares, so that it cannot come out negative however long and thin R is."""
    ds, dt = s - centre[0], t - centre[1]
    first, second = root[0] * ds + root[1] * dt, root[2] * dt
    return 0.5 * (first * first + second * second)


@njit(nogil=True, cache=True, error_model="numpy")
def cost(before: Array, s: float, t: float, centre: Array, root: Array) -> float:
    """Return what it costs to come by a point of the grid before."""
    return interpolate(before, s, t)[0] + paid(s, t, centre, root)


@njit(nogil=True, cache=True, error_model="numpy")
def inside(value: float, count: int) -> float:
    """The nearest place that can be interpolated."""
    return min(max(value, 1.0), count - 2.0)


@njit(nogil=True, cache=True, error_model="numpy")
def descend(before: Array, s: float, t: float, centre: Array, root: Array) -> tuple[float, float, float]:
    """Return the local minimum near a point by Newton's method, as (cost, s, t)."""
    found = math.inf
    a, b, c = root[0] * root[0], root[0] * root[1], root[1] * root[1] + root[2] * root[2]
    for _ in range(_NEWTON):
        value, gs, gt, hss, hst, htt = interpolate(before, s, t)
        found = value + paid(s, t, centre, root)
        ds, dt = s - centre[0], t - centre[1]
        first = root[0] * ds + root[1] * dt
        gs += root[0] * first
        gt += root[1] * first + root[2] * root[2] * dt
        hss, hst, htt = hss + a, hst + b, htt + c
        if not (hss > 0.1 * a and htt > 0.1 * c and hss * htt - hst * hst > 0.01 * a * root[2] * root[2]):
            hss, hst, htt = a, b, c
            det = a * root[2] * root[2]
        else:
            det = hss * htt - hst * hst
        step_s, step_t = (hst * gt - htt * gs) / det, (hst * gs - hss * gt) / det
        if abs(step_s) < _NEAR and abs(step_t) < _NEAR:
            return found, s, t
        moved = False
        for _ in range(_HALVINGS):
            new_s, new_t = inside(s + step_s, before.shape[0]), inside(t + step_t, before.shape[1])
            if cost(before, new_s, new_t, centre, root) < found:
                moved = True
                break
            step_s *= 0.3
            step_t *= 0.3
        if not moved:
            return found, s, t
        s, t = new_s, new_t
    return cost(before, s, t, centre, root), s, t


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
            here = before[i, j] + paid(i, j, centre, root)
            if here < found:
                found, at_i, at_j = here, i, j
    return found, at_i, at_j


@njit(nogil=True, cache=True, error_model="numpy")
def sweep_rows(
    before: Array,
    after: Array,
    centres: Array,
    roots: Array,
    places: Array,
    anchors: Array,
    still: Flags,
    awake: Flags,
    changed: Flags,
    first: int,
    last: int,
    order: int,
    reach: int,
    ceilings: Array,
    tolerance: float,
) -> int:
    """Improve some rows of nodes of the grid after, in place; return how many were looked at.

    Parameters
    ----------
    before, after : array (n, m)
        V on the two grids.
    centres : array (n, m, 2)
        b of each node of the grid after, in cells of the grid before; NaN where there is none.
    roots : array (n, m, 3)
        R as (ss, st, tt), for displacements in cells.
    places : array (n, m, 2)
        Best x known of each node; improved.
    anchors : array (n, m, 2)
        Places that are always tried.
    still : uint8 array (n, m)
        Nodes whose V is given.
    awake : uint8 array (n, m)
        Nodes of the grid before near which V has changed; others need not be looked at.
    changed : uint8 array (n, m)
        Set for nodes of the grid after whose V changed by more than the tolerance, else cleared.
    first, last : int
        Rows to do: first ≤ i < last. Neighbours' places are taken from these only, so that the result does not depend
        on who does the others.
    order : int
        1 from the first row and column to the last, −1 the other way round; the places of neighbours done are tried.
    reach : int
        Nodes (cells to each side) among which a cheaper one is looked for; 0 to follow known places only.
    ceilings : array (n, m)
        No V is kept above these.
    tolerance : float
        Relative.
    """
    n, m = before.shape
    looked = 0
    for row in range(last - first):
        i = first + row if order > 0 else last - 1 - row
        for column in range(m):
            j = column if order > 0 else m - 1 - column
            changed[i, j] = 0
            if still[i, j] or math.isnan(centres[i, j, 0]):
                continue
            s, t = places[i, j, 0], places[i, j, 1]
            if reach == 0 and not awake[int(s + 0.5), int(t + 0.5)]:
                continue
            looked += 1
            ceiling = ceilings[i, j]
            centre, root = centres[i, j], roots[i, j]
            found = cost(before, s, t, centre, root)
            for tried in range(2):
                if tried == 0:
                    ns, nt = inside(centre[0], n), inside(centre[1], m)
                else:
                    ns, nt = anchors[i, j, 0], anchors[i, j, 1]
                here = cost(before, ns, nt, centre, root)
                if here < found:
                    found, s, t = here, ns, nt
            for near in range(2):
                ni, nj = (i, j - order) if near == 0 else (i - order, j)
                if not (first <= ni < last and 0 <= nj < m) or math.isnan(centres[ni, nj, 0]):
                    continue
                ns, nt = places[ni, nj, 0], places[ni, nj, 1]
                here = cost(before, ns, nt, centre, root)
                if here < found:
                    found, s, t = here, ns, nt
            if reach > 0:
                here, ni, nj = best_node(before, centre, root, min(found, ceiling), reach)
                if ni >= 0 and here < found:
                    found, s, t = here, float(ni), float(nj)
            if found < ceiling:
                found, s, t = descend(before, s, t, centre, root)
            places[i, j, 0], places[i, j, 1] = s, t
            found = min(found, ceiling)
            if abs(found - after[i, j]) > tolerance * after[i, j]:
                changed[i, j] = 1
            after[i, j] = found
    return looked


@njit(nogil=True, cache=True, error_model="numpy")
def interpolate_all(values: Array, places: Array) -> Array:
    """Return V at places (count, 2) of a grid; NaN where a place is NaN."""
    found = np.empty(len(places))
    for k in range(len(places)):
        if math.isnan(places[k, 0]):
            found[k] = math.nan
        else:
            found[k] = interpolate(values, places[k, 0], places[k, 1])[0]
    return found


@njit(nogil=True, cache=True, error_model="numpy")
def descend_all(before: Array, starts: Array, centres: Array, roots: Array, weight: float) -> tuple[Array, Array]:
    """Return the least cost to come to some points, and the places come from.

    Parameters
    ----------
    before : array (n, m)
    starts : array (count, tries, 2)
        Places from which each descent begins; the best is kept.
    centres : array (count, 2)
    roots : array (count, 3)
    weight : float
        Of V against the cost of the step; above 1, ways along which V falls faster are preferred.

    Returns
    -------
    costs : array (count,)
        Not weighted.
    places : array (count, 2)
    """
    n, m = before.shape
    costs, places = np.full(len(starts), math.inf), np.ones((len(starts), 2))
    for k in range(len(starts)):
        if math.isnan(centres[k, 0]):
            continue
        root = roots[k] / math.sqrt(weight)
        least = math.inf
        for start in range(starts.shape[1]):
            s, t = inside(starts[k, start, 0], n), inside(starts[k, start, 1], m)
            found, s, t = descend(before, s, t, centres[k], root)
            if found < least:
                least = found
                places[k, 0], places[k, 1] = s, t
        costs[k] = cost(before, places[k, 0], places[k, 1], centres[k], roots[k])
    return costs, places
