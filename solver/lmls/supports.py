"""Supports of the slopes on a cloud with buildings: what lies behind a wall is no neighbour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Indices
from solver.lmls.shape_functions import conditions
from solver.points.cloud import PointCloud
from solver.points.voronoi import ControlVolumes

# Rings of cells around a cell that its support is taken from at least; more until there are enough.
RINGS = 2
# A support that is all but a line, as in an alley one cell wide, has no slope across it.
WORST = 1e4


def supports(
    cloud: PointCloud,
    walled: ControlVolumes,
    buildings: NDArray[np.bool_],
    count: int,
    degree: int,
    shape: float,
) -> tuple[Indices, NDArray[np.bool_]]:
    """Give the support of each cell, nearest first, and say which cells have none.

    The segment between two points crosses the cells of no points farther away than they are from each other.
    So a support with no cell of a building in it lies on one side of all walls, and stays as it is. The
    others are taken anew from the cells that a way leads to that passes no wall.

    Parameters
    ----------
    cloud, walled
        Points, and their control volumes from `solver.points.walls.with_walls`.
    buildings : (n,) array
        Whether a cell is a building.
    count, degree, shape
        Cells in a support, degree of the basis, and shape of the weight, as `solver.cloud.operators.prepare`
        takes them.

    Returns
    -------
    near : (n, count) array
        Of cells without a support those that there are, filled up; of buildings themselves.
    alone : (n,) array
        Whether a cell has no support that carries the basis: there are too few cells, or it is a building.
    """
    near = cloud.nearest(count).copy()
    alone = buildings.copy()
    near[buildings] = np.flatnonzero(buildings)[:, None]
    inner = len(walled.left)
    owner = np.concatenate([walled.left, walled.right])
    order = np.argsort(owner, kind="stable")
    beyond = np.concatenate([walled.right, walled.left])[order]
    first = np.searchsorted(owner[order], np.arange(len(buildings) + 1))
    assert len(beyond) == 2 * inner
    anew = np.flatnonzero(buildings[near].any(axis=1) & ~buildings)
    for i in anew:
        found, ring, rings = {int(i)}, [int(i)], 0
        while ring and (rings < RINGS or len(found) < count):
            ring = list({int(k) for j in ring for k in beyond[first[j] : first[j + 1]]} - found)
            found.update(ring)
            rings += 1
        reached = np.array(sorted(found))
        way = cloud.points[reached] - cloud.points[i]
        chosen = reached[np.argsort(np.einsum("nk,nk->n", way, way), kind="stable")][:count]
        near[i, : len(chosen)], near[i, len(chosen) :] = chosen, chosen[min(1, len(chosen) - 1)]
        alone[i] = len(chosen) < count
    held = anew[~alone[anew]]
    condition = conditions(
        walled.centroid, walled.centroid[held], near[held], degree, shape, second_moment=walled.second_moment
    )
    alone[held[~(condition <= WORST)]] = True
    return near, alone
