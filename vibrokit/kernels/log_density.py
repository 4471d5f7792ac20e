"""One step of the Fokker–Planck equation for φ = ln p on the nodes of a grid in (x, v).

A step is the flow without noise, φ(F(y)) = φ(y) − ln |det F′(y)|, followed by diffusion in v. Both are exact where φ is
a quadratic form: the flow interpolates with quintics, and the diffusion is a Gaussian integral in closed form. So
densities of e⁻¹⁰⁰⁰ are as exact as those near the maximum, because no density is added to a larger one.

Where φ is not smooth on the scale of the nodes (edges of sets that absorb, ridges where two paths meet) polynomials
would oscillate. There p, not ln p, is interpolated linearly at jumps, curvatures of ridges are limited as in
essentially non-oscillatory schemes (Harten et al., J. Comput. Phys. 71, 231, 1987), and the diffusion is a sum over
nodes, which has no overshoot.
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
WIDEST = 0.55  # spread of a part of the diffusion in node spacings: the closed form is unstable from about 0.7 on
_JUMP = 3.0  # in φ between neighbouring nodes: beyond it p, not ln p, is interpolated linearly if φ is rough
_REACH = 6  # nodes on each side in the sum that replaces the closed form; ten spreads at the widest
_SERIES = 0.05  # below it, ln(1 − x) is a series of eight terms, whose error is less than 1e-12

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _rough(a: float, b: float) -> bool:
    """Whether two neighbouring second differences differ more than those of a smooth function."""
    smaller = abs(a) if abs(a) < abs(b) else abs(b)
    return abs(a - b) > ROUGH_RATIO * (smaller if a * b > 0.0 else 0.0) + ROUGH_CHANGE


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _cubic(before: float, left: float, right: float, after: float, place: float) -> float:
    """The cubic through four nodes, at a place from 0 to 1 between the two in the middle."""
    low, high = before - 2.0 * left + right, left - 2.0 * right + after
    bend = (2.0 - place) * low + (1.0 + place) * high
    return left + place * (right - left) - place * (1.0 - place) / 6.0 * bend


@njit(nogil=True, cache=True, error_model="numpy")
def _between(before: float, left: float, right: float, after: float, place: float) -> float:
    """Interpolate φ between two nodes, at a place from 0 to 1, with limits where φ is rough."""
    low, high = before - 2.0 * left + right, left - 2.0 * right + after
    if not _rough(low, high):
        return _cubic(before, left, right, after, place)
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
def _mark_row(row: Array, rough: Flags) -> None:
    """Mark between which nodes of a row φ is rough; the outermost places count as rough."""
    last = len(row) - 2
    rough[0] = rough[last] = rough[last + 1] = True
    for b in range(1, last):
        rough[b] = _rough(row[b - 1] - 2.0 * row[b] + row[b + 1], row[b] - 2.0 * row[b + 1] + row[b + 2])


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
def _transport_row(phi: Array, rough: Flags, feet: Array, growth: Array, floor: float, out: Array) -> None:
    """Apply the flow, for the nodes of one row of `out`: by quintics where φ is smooth, by limited cubics elsewhere."""
    nx, nv = phi.shape
    lines = np.empty(6)
    for j in range(nv):
        s, t = feet[j, 0], feet[j, 1]
        if not (0.0 <= s <= nx - 1.0 and 0.0 <= t <= nv - 1.0):
            out[j] = floor
            continue
        a, b = min(int(s), nx - 2), min(int(t), nv - 2)
        smooth = 2 <= a < nx - 3
        if smooth:
            for k in range(6):
                smooth = smooth and not rough[a - 2 + k, b]
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
def _widen(marks: Flags, rough: Flags) -> None:
    """Mark where a quintic would reach across a place where φ is rough, or over the edge."""
    last = len(marks) - 1
    for b in range(1, last):
        rough[b] = marks[b - 1] | marks[b] | marks[b + 1]
    rough[0] = rough[1] = rough[last - 2] = rough[last - 1] = rough[last] = True


@njit(nogil=True, cache=True, error_model="numpy")
def _summed(row: Array, j: int, spread: float) -> float:
    """Diffusion as a sum over nodes, with Gaussian weights that add up to 1."""
    top = -math.inf
    low, high = max(-_REACH, -j), min(_REACH, len(row) - 1 - j)
    for k in range(low, high + 1):
        top = max(top, row[j + k] - 0.5 * (k / spread) ** 2)
    total = weights = 0.0
    for k in range(-_REACH, _REACH + 1):
        exponent = -0.5 * (k / spread) ** 2
        if exponent > -40.0:
            weights += math.exp(exponent)
        if low <= k <= high and row[j + k] + exponent - top > -40.0:
            total += math.exp(row[j + k] + exponent - top)
    return top + math.log(total / weights)


@njit(nogil=True, cache=True, error_model="numpy")
def _diffuse_row(row: Array, spreads: Array, out: Array, rough: Flags, summed: Flags) -> None:
    """Apply a part of the diffusion to a row that is marked; `summed` is a workspace."""
    nv = len(row)
    summed[:2] = summed[nv - 2 :] = True
    for j in range(2, nv - 2):
        below = row[j - 2] - 2.0 * row[j - 1] + row[j]
        here = row[j - 1] - 2.0 * row[j] + row[j + 1]
        above = row[j] - 2.0 * row[j + 1] + row[j + 2]
        slope = 0.5 * (row[j + 1] - row[j - 1]) - (above - below) / 12.0
        variance = spreads[j] * spreads[j]
        x = variance * (here - (above - 2.0 * here + below) / 12.0)
        tail = 1.0 / 3.0 + x * (0.25 + x * (0.2 + x * (1.0 / 6.0 + x * (1.0 / 7.0 + x * 0.125))))
        logarithm = x * (1.0 + x * (0.5 + x * tail))  # −ln(1 − x)
        out[j] = row[j] + 0.5 * (variance * slope * slope / (1.0 - x) + logarithm)
        summed[j] = rough[j - 1] | rough[j] | (abs(x) > _SERIES)
    for j in range(nv):
        if summed[j]:
            out[j] = _where_rough(row, j, spreads[j], rough)


@njit(nogil=True, cache=True, error_model="numpy")
def _where_rough(row: Array, j: int, spread: float, rough: Flags) -> float:
    """Diffusion at one node, where the series does not apply."""
    if spread == 0.0:
        return row[j]
    if 2 <= j < len(row) - 2 and not (rough[j - 1] or rough[j]):
        below = row[j - 2] - 2.0 * row[j - 1] + row[j]
        here = row[j - 1] - 2.0 * row[j] + row[j + 1]
        above = row[j] - 2.0 * row[j + 1] + row[j + 2]
        slope = 0.5 * (row[j + 1] - row[j - 1]) - (above - below) / 12.0
        narrowing = 1.0 - spread * spread * (here - (above - 2.0 * here + below) / 12.0)
        if narrowing > 0.3:  # it is less only where p has a cusp below the spread
            return row[j] + 0.5 * ((spread * slope) ** 2 / narrowing - math.log(narrowing))
    return _summed(row, j, spread)


@njit(nogil=True, cache=True, error_model="numpy")
def step_rows(
    phi: Array,
    rough: Flags,
    feet: Array,
    growth: Array,
    weight: Array,
    spreads: Array,
    parts: int,
    floor: float,
    out: Array,
    out_rough: Flags,
    first: int,
    last: int,
) -> None:
    """Apply the flow, if there are feet, and then diffusion to rows of φ.

    Parameters
    ----------
    phi : array (nx, nv)
    rough : bool array (nx, nv)
        Where φ is not smooth enough for quintics, as an earlier call left it in `out_rough`; used with feet only.
    feet : array (nx, nv, 2) or (0, 0, 2)
        Where the motion that ends at each node comes from, in node spacings; NaN if it diverges.
    growth : array (nx, nv)
        ln of the factor by which the flow compresses areas there.
    weight : array (nx, nv) or (0, 0)
        Added to φ while it diffuses.
    spreads : array (nx, nv)
        Standard deviation of the velocity that noise adds in each part, in node spacings, at most `WIDEST`.
    parts : int
        How often that diffusion is applied.
    floor : float
        φ outside the grid, and the least φ inside.
    out, out_rough : arrays (last - first, nv)
        φ in the rows from `first` to `last`, and where it is not smooth.
    first, last : int
    """
    nv = phi.shape[1]
    row, other = np.empty(nv), np.empty(nv)
    marks, summed = np.empty(nv, dtype=np.bool_), np.empty(nv, dtype=np.bool_)
    for i in range(first, last):
        if len(feet) > 0:
            _transport_row(phi, rough, feet[i], growth[i], floor, row)
        else:
            row[:] = phi[i]
        if len(weight) > 0:
            row += weight[i]
        for _ in range(parts):
            _mark_row(row, marks)
            _diffuse_row(row, spreads[i], other, marks, summed)
            row, other = other, row
        for j in range(nv):
            lighter = weight[i, j] if len(weight) > 0 else 0.0
            out[i - first, j] = max(row[j] - lighter, floor)
        _mark_row(out[i - first], marks)
        _widen(marks, out_rough[i - first])
