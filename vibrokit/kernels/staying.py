"""Whether trajectories stay near an attractor that meets the section in a curve or a cloud."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vibrokit.kernels.stopping import cell_of


@njit(nogil=True, cache=True, error_model="numpy")
def staying(
    visits: NDArray[np.float64],  # (count, sections, n): states at consecutive sections
    passed: NDArray[np.int64],  # (count,): how many of these sections each trajectory passed
    frame: NDArray[np.float64],  # (2, 2): bounds of x and of v that the cells fill
    entered: NDArray[np.bool_],  # (attractors, nx, nv): cells in which a trajectory begins to stay
    near: NDArray[np.bool_],  # (attractors, nx, nv): cells in which it goes on
    most: int,  # sections that it must stay
    misses: int,  # of these that may be elsewhere
    stayed: NDArray[np.int64],  # (count, attractors): sections since it began to stay, 0 before; kept between calls
    missed: NDArray[np.int64],  # (count, attractors): how many of these were elsewhere; kept between calls
) -> NDArray[np.int64]:
    """Return for each trajectory the number of the attractor that it has stayed near, −1 if there is none."""
    found = np.full(len(visits), -1, dtype=np.int64)
    for k in range(len(visits)):
        for section in range(passed[k]):
            x, v = visits[k, section, 0], visits[k, section, 1]
            inside = frame[0, 0] <= x <= frame[0, 1] and frame[1, 0] <= v <= frame[1, 1]
            i = cell_of(x, frame[0, 0], frame[0, 1], near.shape[1]) if inside else 0
            j = cell_of(v, frame[1, 0], frame[1, 1], near.shape[2]) if inside else 0
            for a in range(len(near)):
                if stayed[k, a] == 0:
                    stayed[k, a] = 1 if inside and entered[a, i, j] else 0
                    continue
                stayed[k, a] += 1
                missed[k, a] += 0 if inside and near[a, i, j] else 1
                if missed[k, a] > misses:
                    stayed[k, a], missed[k, a] = 0, 0
                elif stayed[k, a] > most and found[k] < 0:
                    found[k] = a
    return found
