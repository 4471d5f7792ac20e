"""Sparse matrices of dense blocks."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import scipy.sparse
from numpy.typing import ArrayLike, NDArray


def sparse_blocks(
    blocks: Iterable[tuple[NDArray[np.float64], ArrayLike, ArrayLike]], shape: tuple[int, int]
) -> scipy.sparse.csc_array:
    """Return a matrix of blocks (..., rows, columns), each with the row and the column (...) of its first entry."""
    values, places, others = [], [], []
    for block, row, column in blocks:
        rows, columns = np.indices(block.shape[-2:])
        values.append(block.ravel())
        places.append(np.broadcast_to(np.asarray(row)[..., None, None] + rows, block.shape).ravel())
        others.append(np.broadcast_to(np.asarray(column)[..., None, None] + columns, block.shape).ravel())
    table = (np.concatenate(values), (np.concatenate(places), np.concatenate(others)))
    return scipy.sparse.csc_array(table, shape=shape)
