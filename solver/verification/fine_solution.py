"""The solution of a fine run on a lattice, given to coarser points as what it should come to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial import cKDTree

from solver.arrays import Array
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.scene import Collocation, Scheme


def fine_solution(
    lattice: Lattice, depth: Array, velocity: Array
) -> Callable[[Lattice | PointCloud, Scheme], tuple[Array, Array]]:
    """Make the function that gives depth (m) and momentum (m2 s-1) of a fine solution to points.

    Means over the cells for the weighted-residual form, values at the points for collocation.

    Parameters
    ----------
    lattice : Lattice
        Of the fine solution.
    depth, velocity : (ny, nx) array
        m and m s-1, dry outside the lattice.
    """
    fields = (depth, depth * velocity)

    def expected(points: Lattice | PointCloud, scheme: Scheme) -> tuple[Array, Array]:
        if isinstance(scheme, Collocation):
            h, q = (_values(lattice, field, points) for field in fields)
        elif isinstance(points, Lattice):
            across = overlap(lattice.y_points, lattice.dy, points.y_points, points.dy)
            along = overlap(lattice.x_points, lattice.dx, points.x_points, points.dx)
            h, q = (across @ field @ along.T for field in fields)
        else:
            h, q = _cell_means(lattice, fields, points)
        return h, q

    return expected


def overlap(fine: Array, fine_width: float, coarse: Array, width: float) -> Array:
    """Part of each coarse cell (n,) that lies in each fine one (m,), by centres and widths in m: (n, m)."""
    low = np.maximum(coarse[:, None] - width / 2, fine - fine_width / 2)
    high = np.minimum(coarse[:, None] + width / 2, fine + fine_width / 2)
    return np.asarray(np.maximum(0.0, high - low) / width)


def _cell_means(lattice: Lattice, fields: tuple[Array, ...], cloud: PointCloud) -> list[Array]:
    """Average over the fine cells whose centres lie in each Voronoi cell, shape (n,).

    Raises
    ------
    ValueError
        If a Voronoi cell has none.
    """
    centres = np.stack([a.ravel() for a in lattice.coordinates], axis=1)
    owner = cKDTree(cloud.points).query(centres)[1]
    count = np.bincount(owner, minlength=len(cloud))
    if (count == 0).any():
        raise ValueError("the cloud is as fine as the solution that it is to be compared with")
    return [np.bincount(owner, field.ravel(), len(cloud)) / count for field in fields]


def _values(lattice: Lattice, field: Array, points: Lattice | PointCloud) -> Array:
    """Interpolate linearly at points, of their shape."""
    between = RegularGridInterpolator(
        (lattice.y_points, lattice.x_points), field, bounds_error=False, fill_value=0.0
    )
    x, y = points.coordinates
    return np.asarray(between((y, x)))
