"""One step of the Fokker–Planck equation for φ = ln ρ on the nodes of a grid in (x, v).

A step is the flow without noise, ``φ(F(y)) = φ(y) − ln |det F′(y)|``, followed by diffusion in v. Both are exact where
φ is a quadratic form: the flow interpolates with quintics, and the diffusion is a Gaussian integral in closed form. So
densities of e⁻¹⁰⁰⁰ are as exact as those near the maximum, because no density is added to a larger one.

Where φ is not smooth on the scale of the nodes (edges of sets that absorb, ridges where two paths meet) polynomials
would oscillate. There ρ, not ln ρ, is interpolated linearly at jumps, curvatures of ridges are limited as in
essentially non-oscillatory schemes (Harten et al., J. Comput. Phys. 71, 231, 1987), and diffusion is a quadrature of
that interpolation. At jumps it is a sum over nodes, which has no overshoot. Such a sum is wrong on steep slopes if the
spread is below a node spacing: on hertz-0.570 at D = 2e-5, 200² nodes, it made ln of the mean exit time from hammering
too small by 0.5, where the quadrature leaves 0.03. Where the diffusion is wider than a node spacing it is a sum
everywhere.

Most nodes hold no probability that matters at a time: φ has a floor there, and nothing is computed.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

ROUGH_RATIO, ROUGH_CHANGE = 2.0, 1.0
"""φ is smooth if neighbouring second differences differ by at most the ratio times what they have in common, plus the
change.

With 10 and 3 the corners of a grid become unstable on a forced linear scene, where 2 and 1 conserve probability to
rounding.
"""
WIDEST = 0.4  # spread of a part in node spacings: at 0.55 the tails of hertz-0.570 at D = 1e-5 grew without end
SUMMED = 0.7
"""Spread in node spacings from which the diffusion is a sum over nodes.

The trapezoidal rule is exact to 1e-4 there, and its errors change sign from node to node. The closed form, in parts of
`WIDEST`, takes longer from about the same spread on.
"""
SMOOTH, ROUGH, EMPTY = 0, 1, 2
"""What a quintic would reach: a smooth φ, a rough one, or none above the floor."""
_JUMP = 3.0  # in φ between neighbouring nodes: beyond it ρ, not ln ρ, is interpolated linearly if φ is rough
_NEGLIGIBLE = 40.0  # in the exponent: e⁻⁴⁰ of a sum is less than its rounding errors
_UNDERFLOW = 600.0  # in the exponent: sums over a row are taken relative to its maximum, in floating point
_SMALLEST = 1e-280  # sums below it may have lost terms to underflow
_SERIES = 0.05  # below it, ln(1 − x) is a series of eight terms, whose error is less than 1e-12

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Marks = NDArray[np.uint8]


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _rough(a: float, b: float) -> bool:
    """Whether two neighbouring second differences differ more than those of a smooth function."""
    smaller = abs(a) if abs(a) < abs(b) else abs(b)
    return abs(a - b) > ROUGH_RATIO * (smaller if a * b > 0.0 else 0.0) + ROUGH_CHANGE


@njit(nogil=True, cache=True, error_model="numpy")
def _between(before: float, left: float, right: float, after: float, place: float) -> float:
    """Interpolate φ between two nodes, at a place from 0 to 1, with limits where φ is rough."""
    low, high = before - 2.0 * left + right, left - 2.0 * right + after
    if not _rough(low, high):  # the cubic through the four nodes
        bend = (2.0 - place) * low + (1.0 + place) * high
        return left + place * (right - left) - place * (1.0 - place) / 6.0 * bend
    step = abs(right - left)
    if step > _JUMP and step > 4.0 * min(abs(left - before), abs(after - right)) + 1.0:
        top, bottom = max(left, right), min(left, right)
        weight = place if right > left else 1.0 - place
        return top + math.log(weight + (1.0 - weight) * math.exp(bottom - top)) if weight > 0.0 else bottom
    bend = 0.0
    if low * high > 0.0:
        bend = low if abs(low) < abs(high) else high
    return left + place * (right - left) - 0.5 * place * (1.0 - place) * bend


@njit(nogil=True, cache=True, error_model="numpy")
def _row_value(row: Array, b: int, place: float) -> float:
    """Interpolate along v between the nodes b and b + 1 of a row; beyond the edge φ goes on linearly."""
    left, right = row[b], row[b + 1]
    before = row[b - 1] if b > 0 else 2.0 * left - right
    after = row[b + 2] if b + 2 < len(row) else 2.0 * right - left
    return _between(before, left, right, after, place)


@njit(nogil=True, cache=True, error_model="numpy")
def _mark_row(row: Array, first: int, last: int, rough: Flags) -> None:
    """Mark after which of the nodes from first to last of a row φ is rough; the outermost places count as rough."""
    nv = len(row)
    rough[0] = rough[nv - 2] = rough[nv - 1] = True
    first, last = max(first, 1), min(last, nv - 3)
    part, marked = row[first - 1 : last + 3], rough[first : last + 1]
    for k in range(len(marked)):  # `_rough` without branches, which the processor does for several nodes at once
        a, b = part[k] - 2.0 * part[k + 1] + part[k + 2], part[k + 1] - 2.0 * part[k + 2] + part[k + 3]
        common = 0.5 * (abs(a + b) - abs(a - b))
        marked[k] = abs(a - b) > ROUGH_RATIO * max(common, 0.0) + ROUGH_CHANGE


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _weights(t: float) -> tuple[float, float, float, float, float, float]:
    """Weights of the quintic through the nodes −2 … 3, at a place from 0 to 1."""
    a, b, c, d, e, f = t + 2.0, t + 1.0, t, t - 1.0, t - 2.0, t - 3.0
    cd, ab, ef = c * d, a * b, e * f
    return (
        -b * cd * ef / 120.0,
        a * cd * ef / 24.0,
        -ab * d * ef / 12.0,
        ab * c * ef / 12.0,
        -ab * cd * f / 24.0,
        ab * cd * e / 120.0,
    )


@njit(nogil=True, cache=True, error_model="numpy")
def _transport_row(phi: Array, marks: Marks, feet: Array, growth: Array, floor: float, out: Array) -> None:
    """Apply the flow, for the nodes of one row of `out`: by quintics where φ is smooth, by limited cubics elsewhere."""
    nx, nv = phi.shape
    lines = np.empty(6)
    for j in range(nv):
        s, t = feet[j, 0], feet[j, 1]
        if not (0.0 <= s <= nx - 1.0 and 0.0 <= t <= nv - 1.0):
            out[j] = floor
            continue
        a, b = min(int(s), nx - 2), min(int(t), nv - 2)
        if marks[a, b] == EMPTY and marks[a + 1, b] == EMPTY:
            out[j] = floor
            continue
        smooth = 2 <= a < nx - 3
        if smooth:
            worst = (
                marks[a - 2, b] | marks[a - 1, b] | marks[a, b] | marks[a + 1, b] | marks[a + 2, b] | marks[a + 3, b]
            )
            smooth = worst == SMOOTH
        if smooth:
            u0, u1, u2, u3, u4, u5 = _weights(t - b)
            for k in range(6):
                row = phi[a - 2 + k, b - 2 : b + 4]
                lines[k] = u0 * row[0] + u1 * row[1] + u2 * row[2] + u3 * row[3] + u4 * row[4] + u5 * row[5]
            for k in range(3):
                low = lines[k] - 2.0 * lines[k + 1] + lines[k + 2]
                high = lines[k + 1] - 2.0 * lines[k + 2] + lines[k + 3]
                smooth = smooth and not _rough(low, high)
        if smooth:
            u0, u1, u2, u3, u4, u5 = _weights(s - a)
            found = u0 * lines[0] + u1 * lines[1] + u2 * lines[2] + u3 * lines[3] + u4 * lines[4] + u5 * lines[5]
        else:
            place = t - b
            left, right = _row_value(phi[a], b, place), _row_value(phi[a + 1], b, place)
            first = _row_value(phi[a - 1], b, place) if a > 0 else 2.0 * left - right
            last = _row_value(phi[a + 2], b, place) if a + 2 < nx else 2.0 * right - left
            found = _between(first, left, right, last, s - a)
        out[j] = max(found + growth[j], floor)


@njit(nogil=True, cache=True, error_model="numpy")
def _mark_reach(rough: Flags, first: int, last: int, marks: Marks) -> None:
    """Mark what a quintic between the nodes b and b + 1 would reach; only nodes from first to last exceed the floor."""
    nv = len(rough)
    marks[:] = EMPTY
    if last < first:
        return
    for b in range(max(first - 3, 0), min(last + 3, nv)):
        smooth = 2 <= b < nv - 3 and not (rough[b - 1] | rough[b] | rough[b + 1])
        marks[b] = SMOOTH if smooth else ROUGH


@njit(nogil=True, cache=True, error_model="numpy")
def _matched(spread: float) -> float:
    """The spread of Gaussian weights whose variance, as a sum over nodes, is that of the diffusion.

    It is `spread` from about one node on. Below, the sum over nodes of a Gaussian of that spread is too narrow: its
    variance is 0.08 in place of 0.16 at 0.4.
    """
    found = spread
    for _ in range(40):
        weights, variance = 1.0, 0.0
        for k in range(1, int(6.0 * found) + 3):
            weight = 2.0 * math.exp(-0.5 * (k / found) ** 2)
            weights += weight
            variance += k * k * weight
        # the logarithm of the variance is nearly linear in 1/σ² where they differ
        change = math.log(variance / weights / (spread * spread))
        if abs(change) < 1e-12:
            break
        found = 1.0 / math.sqrt(1.0 / (found * found) + 2.0 * change * min(1.0, 1.0 / (2.0 * found * found)))
    return found


@njit(nogil=True, cache=True, error_model="numpy")
def _summed(row: Array, j: int, spread: float, reach: int) -> float:
    """Diffusion at one node as a sum over nodes in logarithms, with Gaussian weights that add up to 1."""
    top = -math.inf
    low, high = max(-reach, -j), min(reach, len(row) - 1 - j)
    for k in range(low, high + 1):
        top = max(top, row[j + k] - 0.5 * (k / spread) ** 2)
    total = weights = 0.0
    for k in range(-reach, reach + 1):
        exponent = -0.5 * (k / spread) ** 2
        if exponent > -_NEGLIGIBLE:
            weights += math.exp(exponent)
        if low <= k <= high and row[j + k] + exponent - top > -_NEGLIGIBLE:
            total += math.exp(row[j + k] + exponent - top)
    return top + math.log(total / weights)


@njit(nogil=True, cache=True, error_model="numpy")
def _sum_row(
    row: Array,
    spreads: Array,
    wanted: Flags,
    first: int,
    last: int,
    least: float,
    out: Array,
    weights: Array,
    of: Array,
) -> None:
    """Diffusion at the wanted nodes as sums over the nodes from first to last, where φ is `least` or more.

    ρ is 0 elsewhere.
    `weights` are kept between rows; `of` has the spread that they belong to, the matched one and their sum.
    """
    nv = len(row)
    top = row[first : last + 1].max()
    depth = _NEGLIGIBLE + min(top - least, _UNDERFLOW)
    density = np.empty(nv)
    density[:] = -1.0  # not known yet
    for j in range(nv):
        if not wanted[j]:
            continue
        spread = spreads[j]
        if spread != of[0]:
            of[0], of[1], of[2] = spread, _matched(spread), -1.0
            for k in range(min(int(of[1] * math.sqrt(2.0 * (_NEGLIGIBLE + _UNDERFLOW))) + 2, nv)):
                weights[k] = math.exp(-0.5 * (k / of[1]) ** 2)
                of[2] += 2.0 * weights[k]
        reach = min(int(of[1] * math.sqrt(2.0 * depth)) + 1, nv - 1)
        total, low, high = 0.0, max(first, j - reach), min(last, j + reach)
        for k in range(low, high + 1):
            if density[k] < 0.0:
                density[k] = math.exp(row[k] - top)
        for k in range(low, min(j, high + 1)):
            total += density[k] * weights[j - k]
        for k in range(max(low, j), high + 1):
            total += density[k] * weights[k - j]
        if total > 0.0:
            out[j] = top + math.log(total / of[2])
        if total < _SMALLEST and top - least > _UNDERFLOW:
            out[j] = _summed(row, j, of[1], reach)


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _added(a: float, b: float) -> float:
    """The logarithm of e^a + e^b."""
    top = max(a, b)
    return top if top == -math.inf else top + math.log1p(math.exp(min(a, b) - top))


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _jumps(row: Array, j: int) -> bool:
    """Whether φ changes far more than beside it, as at a layer's edge, within two nodes of one."""
    for b in range(j - 2, j + 2):
        if abs(row[b + 1] - row[b]) > 4.0 * min(abs(row[b] - row[b - 1]), abs(row[b + 2] - row[b + 1])) + 1.0:
            return True
    return False


@njit(nogil=True, cache=True, error_model="numpy")
def _averaged(row: Array, j: int, spread: float) -> float:
    """Diffusion at one node by Gauss-Hermite quadrature of what `_between` gives, which is exact on any slope."""
    far, farther = 1.3556261799742659 * spread, 2.8569700138728056 * spread
    found = row[j] + math.log(8.0 / 15.0)
    for shift, weight in ((far, 0.2220759220056126), (farther, 0.011257411327720689)):
        for place in (j - shift, j + shift):
            b = int(place)
            found = _added(found, _row_value(row, b, place - b) + math.log(weight))
    return found


@njit(nogil=True, cache=True, error_model="numpy")
def _closed_row(
    row: Array, spreads: Array, first: int, last: int, out: Array, rough: Flags, summed: Flags, curvatures: Array
) -> bool:
    """Apply diffusion in closed form to the nodes from first to last of a row that is marked.

    Nodes that need a sum are marked in `summed`; `curvatures` is a workspace. Returns whether there are any.
    """
    nv, some = len(row), False
    out[:] = row
    summed[:] = False
    summed[first : last + 1] = True
    low, high = max(first, 2), min(last, nv - 3)
    part, closed, own = row[low - 2 : high + 3], out[low : high + 1], spreads[low : high + 1]
    bent = curvatures[low : high + 1]
    for k in range(len(closed)):  # without branches, which the processor does for several nodes at once
        a, b, c, d, e = part[k], part[k + 1], part[k + 2], part[k + 3], part[k + 4]
        slope = (8.0 * (d - b) - (e - a)) / 12.0
        variance = own[k] * own[k]
        x = variance * (16.0 * (b + d) - (a + e) - 30.0 * c) / 12.0
        tail = 1.0 / 3.0 + x * (0.25 + x * (0.2 + x * (1.0 / 6.0 + x * (1.0 / 7.0 + x * 0.125))))
        logarithm = x * (1.0 + x * (0.5 + x * tail))  # −ln(1 − x)
        closed[k] = c + 0.5 * (variance * slope * slope / (1.0 - x) + logarithm)
        bent[k] = x
    for j in range(first, last + 1):
        spread = spreads[j]
        if spread == 0.0:
            out[j] = row[j]
            summed[j] = False
        elif low <= j <= high and spread <= WIDEST and not (rough[j - 1] or rough[j]):
            narrowing = 1.0 - curvatures[j]  # less than this only where ρ has a cusp below the spread
            summed[j] = narrowing < 0.3
            if abs(curvatures[j]) > _SERIES and not summed[j]:
                slope = (8.0 * (row[j + 1] - row[j - 1]) - (row[j + 2] - row[j - 2])) / 12.0
                out[j] = row[j] + 0.5 * ((spread * slope) ** 2 / narrowing - math.log(narrowing))
        elif low < j < high and spread <= WIDEST and not _jumps(row, j):
            out[j] = _averaged(row, j, spread)
            summed[j] = False
        some |= summed[j]
    return some


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _above(row: Array, floor: float) -> tuple[int, int]:
    """The first and the last node of a row above the floor; if no node is, the last is less than the first."""
    first, last = 0, len(row) - 1
    while first <= last and not row[first] > floor:
        first += 1
    while last > first and not row[last] > floor:
        last -= 1
    return first, last


@njit(nogil=True, cache=True, error_model="numpy")
def _absorb_row(row: Array, share: Array, value: float, floor: float) -> float:
    """Take up a share of each node of a row, which then has a value in its place; returns ln of the sum taken up."""
    taken = -math.inf
    for j in range(len(row)):
        if share[j] > 0.0:
            taken = _added(taken, row[j] + math.log(share[j]))
            left = row[j] + math.log1p(-share[j])
            row[j] = max(_added(left, value + math.log(share[j])), floor)
    return taken


@njit(nogil=True, cache=True, error_model="numpy")
def mark_rows(phi: Array, floor: float, marks: Marks) -> None:
    """Mark what a quintic between the nodes would reach, in each row of φ."""
    rough = np.empty(phi.shape[1], dtype=np.bool_)
    for i in range(len(phi)):
        low, high = _above(phi[i], floor)
        if high >= low:
            _mark_row(phi[i], low - 5, high + 5, rough)
        _mark_reach(rough, low, high, marks[i])


def parts_of(widest: float) -> int:
    """Return the number of parts of a diffusion with a largest spread (node spacings); 0 if it is a sum over nodes."""
    return 0 if widest > SUMMED else max(1, math.ceil((widest / WIDEST) ** 2))


@njit(nogil=True, cache=True, error_model="numpy")
def step_rows(
    phi: Array,  # (nx, nv)
    marks: Marks,  # (nx, nv): what a quintic would reach, as an earlier call left it in `out_marks`, or `mark_rows`
    feet: Array,  # (nx, nv, 2): where φ is taken from for each node, in node spacings; NaN if it is nowhere
    growth: Array,  # (nx, nv): added to it
    share: Array,  # (nx, nv) or (0, 0): how much an exit takes up after the flow, from 0 to below 1
    value: float,  # φ of what it takes up, after that: −∞ for a density, 0 for an expected value that is 1 at the exit
    weight: Array,  # (nx, nv) or (0, 0): added to φ while it diffuses
    spreads: Array,  # (nx, nv): spread of the velocity by the noise in each part, in node spacings
    parts: int,  # how often that diffusion is applied, see `parts_of`
    floor: float,  # φ outside the grid, and the least φ inside
    out: Array,  # (last - first, nv): φ in the rows from first to last
    out_marks: Marks,  # (last - first, nv): what a quintic would reach there
    taken: Array,  # (last - first,): ln of the sum of e^φ over each row that the exit takes up
    first: int,
    last: int,
) -> None:
    """Apply the flow and then diffusion to rows of φ."""
    nv = phi.shape[1]
    row, other, curvatures = np.empty(nv), np.empty(nv), np.empty(nv)
    weights, of = np.empty(nv), np.zeros(3)
    rough, summed = np.empty(nv, dtype=np.bool_), np.empty(nv, dtype=np.bool_)
    for i in range(first, last):
        _transport_row(phi, marks, feet[i], growth[i], floor, row)
        taken[i - first] = _absorb_row(row, share[i], value, floor) if len(share) > 0 else -math.inf
        low, high = _above(row, floor)
        if high < low:
            out[i - first] = floor
            continue
        if len(weight) > 0:
            row += weight[i]
        # spreads on each side of a density that diffusion may reach
        reach = int(10.0 * max(spreads[i].max(), 0.5)) + 1
        for _ in range(max(parts, 1)):
            from_node, to_node = max(low - reach, 0), min(high + reach, nv - 1)
            _mark_row(row, from_node - 1, to_node, rough)
            if _closed_row(row, spreads[i], from_node, to_node, other, rough, summed, curvatures):
                _sum_row(row, spreads[i], summed, low, high, row[low : high + 1].min(), other, weights, of)
            low, high = from_node, to_node
            row, other = other, row
        for j in range(nv):
            lighter = weight[i, j] if len(weight) > 0 else 0.0
            left = row[j] - lighter
            # The flow compresses areas by less than e in a step, so that what is at the floor stays there.
            out[i - first, j] = left if left > floor + 1.0 else floor
    mark_rows(out, floor, out_marks)
