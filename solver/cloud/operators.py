"""What all runs on a cloud share, made once: the faces of its cells, and the LMLS slopes of cell means."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.cloud.blocks import Blocks, blocks_near
from solver.cloud.faces import Faces, all_aligned, connect
from solver.cloud.reconstruction import Gradient, Strain, gradient_of, strain_of
from solver.cloud.status import widths_of
from solver.lmls.shape_functions import approximation
from solver.lmls.supports import supports
from solver.points.cloud import PointCloud
from solver.points.voronoi import ControlVolumes
from solver.points.walls import with_walls


class Tables(NamedTuple):
    """What the kernels read: faces, derivative weights, blocks near each other, and widths of cells."""

    faces: Faces
    gradient: Gradient
    strain: Strain
    blocks: Blocks
    widths: Array


@dataclass(frozen=True, eq=False)
class CloudOperators:
    """Operators of a cloud, and the choices they were made by, as `prepare` takes them.

    Attributes
    ----------
    volumes
        Control volumes, whose faces at buildings are walls.
    number
        Number among their faces of each face of the cloud, as `solver.points.walls.with_walls` gives it; None
        without buildings.
    """

    cloud: PointCloud
    support: int
    degree: int
    weight_shape: float
    tables: Tables
    volumes: ControlVolumes
    buildings: NDArray[np.bool_] | None = None
    number: Indices | None = None

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Align what comes from another process anew."""
        self.__dict__.update(state | {"tables": all_aligned(state["tables"])})


def prepare(
    cloud: PointCloud,
    support: int = 9,
    degree: int = 1,
    weight_shape: float = 6.0,
    buildings: NDArray[np.bool_] | None = None,
) -> CloudOperators:
    """Make the operators of a cloud, once for all runs.

    Parameters
    ----------
    support : int
        Cells that a slope is taken from.
    degree : int
        Degree of the LMLS basis.
    weight_shape : float
        c of eq. 18.
    buildings : (n,) array, optional
        Whether a cell is a building, which nothing flows through.

    Raises
    ------
    ValueError
        If a support cannot carry the basis; the message names the points.
    """
    cells, number = cloud.control_volumes, None
    # the support of a cell is that of its point, so that the cell itself comes first
    near = carried = cloud.nearest(support)
    alone = np.zeros(len(cloud), bool)
    if buildings is not None:
        cells, number = with_walls(cells, buildings)
        near, alone = supports(cloud, cells, buildings, support, degree, weight_shape)
        carried = np.where(alone[:, None], carried, near)
    slope = approximation(
        cells.centroid, cells.centroid, carried, degree, weight_shape, second_moment=cells.second_moment
    )
    if buildings is not None:
        # without a support a cell is of first order
        along, across = (np.where(alone[:, None], 0.0, d) for d in (slope.along, slope.across))
        slope = replace(slope, neighbours=near, along=along, across=across)
    faces, gradient = connect(cells), gradient_of(slope)
    blocks, widths = blocks_near(faces, gradient), widths_of(cells, faces)
    tables = all_aligned(Tables(faces, gradient, strain_of(slope, cells.centroid), blocks, widths))
    return CloudOperators(cloud, support, degree, weight_shape, tables, cells, buildings, number)
