"""Buildings: which cells of a lattice or a cloud they take."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.points.lattice import Lattice
from solver.release.polygons import in_polygon, polygon_shares

if TYPE_CHECKING:
    # compiled code takes longer to import than a scenario to check
    from solver.points.cloud import PointCloud

# Of the plan area of a cell, from which on it is a building; just below one half, which round-off may miss.
SHARE = 0.5 - 1e-9


def building_cells(rings: Sequence[Array], points: Lattice | PointCloud) -> NDArray[np.bool_]:
    """Whether a building covers half of a cell or more, of the shape of the points.

    Parameters
    ----------
    rings : sequence of array
        Outlines, each (n, 2), m: outer ones counter-clockwise, holes clockwise.
    points : Lattice or PointCloud
        Whose cells.
    """
    shares = polygon_shares(rings, points) if isinstance(points, Lattice) else in_polygon(rings, points)
    return np.asarray(shares >= SHARE)
