"""Types of the arrays that kernels take."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
# numbers of cells and faces in the large tables of a cloud, whose size is what reading them costs
Numbers = NDArray[np.uint32]


def with_beside(values: Array) -> Array:
    """Give the largest of each value and of those beside it along every axis; NaN counts as none.

    What moves in a cell may come to a dry one beside it within the step, and falls there.
    """
    found = values.copy()
    for axis in range(values.ndim):
        low, high = np.moveaxis(found, axis, 0), np.moveaxis(values, axis, 0)
        np.fmax(low[1:], high[:-1], out=low[1:])
        np.fmax(low[:-1], high[1:], out=low[:-1])
    return found
