"""Fields of a cloud on the points of a lattice, by LMLS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.arrays import Array, Indices
from solver.lmls.shape_functions import approximation
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice

SUPPORT, DEGREE, WEIGHT_SHAPE = 9, 1, 4.0


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


def gridding(cloud: PointCloud, lattice: Lattice) -> Gridding:
    """Prepare the approximation of a cloud's cell means at the points of a lattice (eqs. 16-23).

    Raises
    ------
    ValueError
        If the cloud is too small for a support.
    """
    cells = cloud.control_volumes
    places = np.stack([a.ravel() for a in lattice.coordinates], axis=1)
    found = approximation(
        cells.centroid,
        places,
        cloud.nearest(SUPPORT, places),
        DEGREE,
        WEIGHT_SHAPE,
        second_moment=cells.second_moment,
    )
    return Gridding(lattice, found.neighbours, found.value, cells.area)
