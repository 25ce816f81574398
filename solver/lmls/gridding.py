"""Fields of a cloud on the points of a lattice, by LMLS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.lmls.shape_functions import approximation
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice

SUPPORT, DEGREE, WEIGHT_SHAPE = 9, 1, 4.0
# What is nearer than another by less than this part is as near.
TIE = 1e-9


@dataclass(frozen=True, eq=False)
class Gridding:
    """How fields of a cloud come to the points of a lattice; made by `gridding`.

    Parameters
    ----------
    neighbours : (m, s) array
        Cells that each point is approximated from, nearest first.
    value : (m, s) array
        Their weights.
    area : (n,) array
        Of the cloud's cells, m2.
    """

    lattice: Lattice
    neighbours: Indices
    value: Array
    area: Array

    def nearest(self, values: Array) -> Array:
        """Give each lattice point the value of the nearest cell: (n,) to (ny, nx)."""
        return values[self.neighbours[:, 0]].reshape(self.lattice.shape)

    def unlimited(self, values: Array) -> Array:
        """Approximate values (n,) at the lattice's points, also beyond those of the support: (ny, nx)."""
        found = np.einsum("ms,ms->m", self.value, values[self.neighbours])
        return np.asarray(found.reshape(self.lattice.shape))

    def within_range(self, values: Array) -> Array:
        """Approximate values (n,) at the lattice's points, within the range of each support: (ny, nx)."""
        near = values[self.neighbours]
        found = np.clip(np.einsum("ms,ms->m", self.value, near), near.min(axis=1), near.max(axis=1))
        return np.asarray(found.reshape(self.lattice.shape))

    def keeping_integral(self, depth: Array) -> Array:
        """Approximate a depth (n,), m, scaled so that the lattice holds as much: (ny, nx)."""
        found = self.within_range(depth)
        held = found.sum() * self.lattice.cell_area
        return found * ((depth @ self.area) / held) if held > 0 else found

    def velocity(self, depth: Array, velocity: Array) -> Array:
        """Approximate a velocity (n,), m s-1, weighted by depth (n,), m; 0 where nothing flows: (ny, nx)."""
        near, weight = velocity[self.neighbours], self.value * depth[self.neighbours]
        total = weight.sum(axis=1)
        mean = np.divide((weight * near).sum(axis=1), total, out=np.zeros_like(total), where=total > 0)
        # a missing depth makes a missing velocity
        mean[np.isnan(total)] = np.nan
        limited = np.clip(mean, near.min(axis=1), near.max(axis=1))
        return np.asarray(limited.reshape(self.lattice.shape))


def gridding(cloud: PointCloud, lattice: Lattice, buildings: NDArray[np.bool_] | None = None) -> Gridding:
    """Prepare the approximation of a cloud's cell means at the points of a lattice (eqs. 16-23).

    Parameters
    ----------
    buildings : (n,) array, optional
        Whether a cell is a building. Its values are those of the lattice points in it, and of no others.

    Raises
    ------
    ValueError
        If the cloud has too few cells for a support.
    """
    cells = cloud.control_volumes
    places = np.stack([a.ravel() for a in lattice.coordinates], axis=1)
    near = cloud.nearest(SUPPORT, places)
    inside = np.zeros(len(places), bool)
    if buildings is not None and buildings.any():
        stands, flows = np.flatnonzero(buildings), np.flatnonzero(~buildings)
        distance, own = scipy.spatial.cKDTree(cloud.points[stands]).query(places)
        far, other = scipy.spatial.cKDTree(cloud.points[flows]).query(places, SUPPORT)
        # what is on the edge of a building counts as in it, as half a cell of a lattice does
        inside = distance <= (1.0 + TIE) * far[:, 0]
        near = np.where(inside[:, None], near, flows[other])
    found = approximation(
        cells.centroid, places, near, DEGREE, WEIGHT_SHAPE, second_moment=cells.second_moment
    )
    if inside.any():
        near[inside] = stands[own[inside], None]
    return Gridding(lattice, near, found.value, cells.area)
