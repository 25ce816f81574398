"""Buildings: which cells of a lattice they take."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.points.lattice import Lattice
from solver.release.polygons import polygon_shares

# Of the plan area of a cell, from which on it is a building; just below one half, which round-off may miss.
SHARE = 0.5 - 1e-9


def building_cells(rings: Sequence[Array], lattice: Lattice) -> NDArray[np.bool_]:
    """Whether a building covers half of a cell or more, (ny, nx).

    Parameters
    ----------
    rings : sequence of array
        Outlines, each (n, 2), m: outer ones counter-clockwise, holes clockwise.
    lattice : Lattice
        The cells.
    """
    return np.asarray(polygon_shares(rings, lattice) >= SHARE)
