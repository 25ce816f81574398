"""Control volumes of a cloud with buildings: cells without flow, whose faces are walls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Indices
from solver.points.voronoi import BUILDING, ControlVolumes


def with_walls(volumes: ControlVolumes, buildings: NDArray[np.bool_]) -> tuple[ControlVolumes, Indices]:
    """Take the faces of buildings out of control volumes, and close those between them and the flow.

    A face between a cell of a building and one beside it becomes a boundary face of the latter, as at a side
    of the domain. The edges of each cell beside a building still close. A cell of a building has no face.

    Parameters
    ----------
    volumes : ControlVolumes
        Without buildings.
    buildings : (n,) array
        Whether a cell is a building.

    Returns
    -------
    walled : ControlVolumes
        The same cells.
    number : (e,) array
        Number in ``walled`` of each face of ``volumes``, faces between cells first in both; -1 for those that
        are in a building.
    """
    left, right = buildings[volumes.left], buildings[volumes.right]
    inner, kept = ~left & ~right, ~buildings[volumes.side_cell]
    wall = left != right
    # the flow is on the left of a wall
    sign = np.where(left[wall], -1.0, 1.0)
    cell = np.where(left[wall], volumes.right[wall], volumes.left[wall])
    side_cell = np.concatenate([volumes.side_cell[kept], cell])
    order = np.argsort(side_cell, kind="stable")
    number = np.full(len(left) + len(kept), -1)
    number[np.flatnonzero(inner)] = np.arange(inner.sum())
    outer = np.concatenate([len(left) + np.flatnonzero(kept), np.flatnonzero(wall)])
    number[outer[order]] = inner.sum() + np.arange(len(order))
    side = np.concatenate([volumes.side[kept], np.full(len(cell), BUILDING)])
    length = np.concatenate([volumes.side_length[kept], volumes.length[wall]])
    midpoint = np.concatenate([volumes.side_midpoint[kept], volumes.midpoint[wall]])
    normal = np.concatenate([volumes.side_normal[kept], sign[:, None] * volumes.normal[wall]])
    walled = replace(
        volumes,
        left=volumes.left[inner],
        right=volumes.right[inner],
        length=volumes.length[inner],
        normal=volumes.normal[inner],
        midpoint=volumes.midpoint[inner],
        side_cell=side_cell[order],
        side=side[order],
        side_length=length[order],
        side_midpoint=midpoint[order],
        side_normal=normal[order],
    )
    return walled, number
