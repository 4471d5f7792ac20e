"""One random stream per trajectory, drawn side by side for a whole block of lanes.

A stream is a xoshiro256++ generator (Blackman & Vigna 2021): 256 bits of state, period 2^256 - 1, and
nothing but additions, rotations and exclusive ors, so neighbouring lanes fill one SIMD register. The
state comes from the key (seed, index) alone. Normals are made by the Box-Muller method, which has no
rejection and so no branch; logarithm, sine and cosine are polynomials, because calls to the mathematics
library would keep the loop scalar.

The bits of a stream are exact, not merely close: every multiply-add is written as one fused operation,
no function here allows the compiler to rearrange, and the rest (+, *, /, sqrt) is correctly rounded. They
do not depend on the lane, on the number of lanes, on the neighbours, on the flags of the kernel that
calls, or on the width of the machine's registers. Processors without fused multiply-add (before about
2013) give the same bits slowly.
"""

import math
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

# Numba turns uint64 combined with a plain integer into float64, hence typed constants throughout.
_U = np.uint64
_Word = np.uint64
_Words = NDArray[np.uint64]

_GOLDEN = _U(0x9E3779B97F4A7C15)  # SplitMix64's increment, 2^64 over the golden ratio
_MIX_1 = _U(0xBF58476D1CE4E5B9)
_MIX_2 = _U(0x94D049BB133111EB)
_ROUND_1 = _U(0x3C6EF372FE94F82A)  # its multiples, one per round of seeding
_ROUND_2 = _U(0xDAA66D2C7DDF743F)
_ROUND_3 = _U(0x78DDE6E5FD29F054)
_ROUND_4 = _U(0x1715609F7C746C69)

_ONE = _U(1)
_SIGN = _U(1 << 63)
_SWAP = _U(1 << 61)
_MANTISSA = _U((1 << 52) - 1)
_ROOT_HALF = _U(0x3FE6A09E667F3BCD)  # bits of sqrt(1/2)
_UNIT = _U(0x3FF0000000000000)  # bits of 1.0

# Minimax polynomials (Remez, relative error) in the square of the argument, below 4e-18 before rounding.
_LOG = (  # -4 atanh(s)/s, |s| <= (sqrt(2) - 1)/(sqrt(2) + 1)
    -4.0, -1.333333333333353, -0.7999999999859776, -0.5714285752269515,
    -0.4444439397629381, -0.3636727019964061, -0.30624887212619234, -0.29621062820291516,
)  # fmt: skip
_SIN = (  # sin(pi t/4)/t, 0 <= t <= 1
    0.7853981633974483, -0.08074551218828054, 0.0024903945701887364, -3.6576204158456407e-05,
    3.133616216634068e-07, -1.7571492941832207e-09, 6.877100850200482e-12,
)  # fmt: skip
_COS = (  # cos(pi t/4), 0 <= t <= 1
    1.0, -0.30842513753404244, 0.01585434424381541, -0.00032599188692668756,
    3.5908604458858205e-06, -2.46113638263708e-08, 1.1500497024290597e-10, -3.8577620375901655e-13,
)  # fmt: skip
_TWO_LN_2 = 1.3862943611198906


@intrinsic
def _fused(_context: Any, a: Any, b: Any, c: Any) -> Any:
    """a*b + c, rounded once."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(a, b, c), generate


@intrinsic
def _as_float(_context: Any, word: Any) -> Any:
    """The float64 that has these 64 bits."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))

    return types.float64(word), generate


@intrinsic
def _as_bits(_context: Any, number: Any) -> Any:
    """The 64 bits of a float64."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))

    return types.uint64(number), generate


@njit(nogil=True, cache=True)
def _mix(z: _Word) -> _Word:
    """SplitMix64's finaliser: a bijection of 64-bit words under which all bits mix; 0 -> 0."""
    z = (z ^ (z >> _U(30))) * _MIX_1
    z = (z ^ (z >> _U(27))) * _MIX_2
    return z ^ (z >> _U(31))


@njit(nogil=True, cache=True)
def seed_lane(state: _Words, lane: int, seed: int | _Word, index: int | _Word) -> None:
    """Start the stream (seed, index) in one lane.

    Distinct keys give distinct states: each round below is invertible, so the first two words determine
    the key, and so do the last two. The state is never all zero, which xoshiro could not leave. Two of N
    streams of n draws each overlap with probability about N^2 n / 2^256.

    Of the block's states, uint64[4, LANES], the column `lane` is overwritten. The key has twice 64 bits; signed numbers
    are read as their bits.
    """
    a = _mix(_U(seed) + _GOLDEN)
    b = _mix(_U(index) ^ a)
    a += _mix(b + _ROUND_1)
    b += _mix(a + _ROUND_2)
    state[0, lane] = a
    state[1, lane] = b
    a += _mix(b + _ROUND_3)
    b += _mix(a + _ROUND_4)
    state[2, lane] = a
    state[3, lane] = b


@njit(nogil=True, cache=True)
def streams_of(seed: int, indices: NDArray[np.int64]) -> _Words:
    """Return the states at which the streams (seed, index) start, uint64[count, 4]."""
    lanes = np.empty((4, indices.size), dtype=np.uint64)
    for lane in range(indices.size):
        seed_lane(lanes, lane, seed, indices[lane])
    return lanes.T.copy()


@njit(nogil=True, cache=True)
def _rotate(word: _Word, count: _Word) -> _Word:
    return (word << count) | (word >> (_U(64) - count))


@njit(nogil=True, cache=True)
def _draw(s0: _Word, s1: _Word, s2: _Word, s3: _Word) -> tuple[_Word, _Word, _Word, _Word, _Word]:
    """xoshiro256++: 64 random bits and the next state."""
    word = _rotate(s0 + s3, _U(23)) + s0
    t = s1 << _U(17)
    s2 ^= s0
    s3 ^= s1
    s1 ^= s2
    s0 ^= s3
    s2 ^= t
    s3 = _rotate(s3, _U(45))
    return word, s0, s1, s2, s3


@njit(nogil=True, cache=True, error_model="numpy")
def _minus_two_log(word: _Word) -> float:
    """-2 ln(u) with u = word/2^64 rounded to float64: 0 at u = 1, 88.7 at u = 2^-64 (words 0 and 1)."""
    bits = _as_bits(float(word | _ONE)) - _ROOT_HALF
    halvings = float(_U(64) - (bits >> _U(52)))
    m = _as_float((bits & _MANTISSA) + _ROOT_HALF)  # u = m / 2^halvings, sqrt(1/2) <= m < sqrt(2)
    s = (m - 1.0) / (m + 1.0)
    y = s * s
    p = _LOG[7]
    for k in range(6, -1, -1):
        p = _fused(p, y, _LOG[k])
    return _fused(halvings, _TWO_LN_2, p * s)


@njit(nogil=True, cache=True)
def _sine_cosine(t: float) -> tuple[float, float]:
    """sin and cos of pi t/4 for 0 <= t <= 1."""
    y = t * t
    s = _SIN[6]
    for k in range(5, -1, -1):
        s = _fused(s, y, _SIN[k])
    c = _COS[7]
    for k in range(6, -1, -1):
        c = _fused(c, y, _COS[k])
    return s * t, c


@njit(nogil=True, cache=True)
def _normals(radius_word: _Word, angle_word: _Word) -> tuple[float, float]:
    """Two standard normals from two words: 52 bits for the angle within an octant, three for the octant."""
    r = _as_bits(math.sqrt(_minus_two_log(radius_word)))
    t = _as_float(((angle_word >> _U(9)) & _MANTISSA) | _UNIT) - 1.0
    s, c = _sine_cosine(t)
    swapped = (angle_word & _SWAP) != _U(0)
    x, y = (s, c) if swapped else (c, s)
    first = _as_float(r ^ (angle_word & _SIGN)) * x
    second = _as_float(r ^ ((angle_word << _ONE) & _SIGN)) * y
    return first, second


@njit(nogil=True, cache=True)
def normal_pair(state: _Words, lane: int) -> tuple[float, float]:
    """Draw two independent standard normals for one lane.

    Of the block's states, uint64[4, LANES], the column `lane` advances by two draws. Normals reach |z| = 9.4, beyond
    which one falls with probability 5e-21.
    """
    s0, s1, s2, s3 = state[0, lane], state[1, lane], state[2, lane], state[3, lane]
    radius_word, s0, s1, s2, s3 = _draw(s0, s1, s2, s3)
    angle_word, s0, s1, s2, s3 = _draw(s0, s1, s2, s3)
    state[0, lane] = s0
    state[1, lane] = s1
    state[2, lane] = s2
    state[3, lane] = s3
    return _normals(radius_word, angle_word)
