"""Sine and cosine without branches, for loops over lanes: a call of the mathematics library would keep a loop scalar.

The argument is reduced by π/2 in three parts (Cody & Waite), exactly for |x| below 10⁸. Polynomials of Cephes (Moshier,
Methods and Programs for Mathematical Functions, 1989); the error is below 2 units in the last place of 1.
"""

import numpy as np
from numba import njit

_OPTIONS = {"nogil": True, "cache": True, "error_model": "numpy", "forceinline": True}
_PER_QUARTER = 0.6366197723675814  # 2/π
_HIGH, _MIDDLE, _LOW = 1.57079625129699707031, 7.54978941586159635335e-8, 5.39030285815811905290e-15
_S1, _S2, _S3 = -1.66666666666666307295e-1, 8.33333333332211858878e-3, -1.98412698295895385996e-4
_S4, _S5, _S6 = 2.75573136213857245213e-6, -2.50507477628578072866e-8, 1.58962301576546568060e-10
_C1, _C2, _C3 = 4.16666666666665929218e-2, -1.38888888888730564116e-3, 2.48015872888517045348e-5
_C4, _C5, _C6 = -2.75573141792967388112e-7, 2.08757008419747316778e-9, -1.13585363215876817300e-11


@njit(**_OPTIONS)
def _wave(x: float, ahead: float) -> float:
    """Return sin(x + ahead π/2) for a whole number `ahead`."""
    quarters = np.floor(x * _PER_QUARTER + 0.5)
    r = ((x - quarters * _HIGH) - quarters * _MIDDLE) - quarters * _LOW
    z = r * r
    odd = r + r * z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))))
    even = 1.0 - 0.5 * z + z * z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6)))))
    turned = quarters + ahead
    turn = turned - 4.0 * np.floor(turned * 0.25)
    value = even if turn == 1.0 or turn == 3.0 else odd
    return -value if turn > 1.5 else value


@njit(**_OPTIONS)
def sin(x: float) -> float:
    """Return sin x."""
    return _wave(x, 0.0)


@njit(**_OPTIONS)
def cos(x: float) -> float:
    """Return cos x."""
    return _wave(x, 1.0)
