"""Arrays that users give: real numbers, and nothing that NumPy would make such by leaving out a part of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.units import is_of_pint


def real_array(values: Any) -> NDArray[np.float64]:
    """Return an array of real numbers; raises TypeError or ValueError, in words, for units, masks, dates and others."""
    if is_of_pint(values):
        raise TypeError(
            "an array with units; give its numbers in SI base units, as .to_base_units().magnitude has them"
        )
    if np.ma.isMaskedArray(values):
        raise TypeError("a masked array; leave out what is masked")
    array = np.asarray(values)
    if array.dtype.kind not in "iufO":
        raise TypeError(f"an array of type {array.dtype}; give real numbers")
    return np.asarray(array, dtype=np.float64)
