"""Types of the arrays that kernels take."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
# numbers of cells and faces in the large tables of a cloud, whose size is what reading them costs
Numbers = NDArray[np.uint32]


# Values of a page of memory, and by how many more the arrays of a block are apart: at one place in a page all
# would be at the same places of the nearest cache.
_PAGE, _APART = 512, 104


def in_one_block(arrays: list[Array]) -> list[Array]:
    """Copy flat arrays of one length into one block of memory.

    A system that has large pages gives them to large blocks. Many arrays that are read in step then need few
    entries of the table of pages.
    """
    size = len(arrays[0])
    block = np.empty((len(arrays), -(-size // _PAGE) * _PAGE + _APART))
    for place, values in zip(block, arrays, strict=True):
        place[:size] = values
    return [place[:size] for place in block]


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
