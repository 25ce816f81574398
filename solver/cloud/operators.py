"""What all runs on a cloud share, made once: the faces of its cells, and the LMLS slopes of cell means."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from solver.arrays import Array
from solver.cloud.blocks import Blocks, blocks_near
from solver.cloud.faces import Faces, all_aligned, connect
from solver.cloud.reconstruction import Gradient, Strain, gradient_of, strain_of
from solver.cloud.status import widths_of
from solver.lmls.shape_functions import approximation
from solver.points.cloud import PointCloud


class Tables(NamedTuple):
    """What the kernels read: faces, derivative weights, blocks near each other, and widths of cells."""

    faces: Faces
    gradient: Gradient
    strain: Strain
    blocks: Blocks
    widths: Array


@dataclass(frozen=True, eq=False)
class CloudOperators:
    """Operators of a cloud, and the choices they were made by, as `prepare` takes them."""

    cloud: PointCloud
    support: int
    degree: int
    weight_shape: float
    tables: Tables

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Align what comes from another process anew."""
        self.__dict__.update(state | {"tables": all_aligned(state["tables"])})


def prepare(
    cloud: PointCloud, support: int = 9, degree: int = 1, weight_shape: float = 6.0
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

    Raises
    ------
    ValueError
        If a support cannot carry the basis; the message names the points.
    """
    cells = cloud.control_volumes
    # the support of a cell is that of its point, so that the cell itself comes first
    slope = approximation(
        cells.centroid,
        cells.centroid,
        cloud.nearest(support),
        degree,
        weight_shape,
        second_moment=cells.second_moment,
    )
    faces, gradient = connect(cells), gradient_of(slope)
    near, widths = blocks_near(faces, gradient), widths_of(cells, faces)
    tables = Tables(faces, gradient, strain_of(slope, cells.centroid), near, widths)
    return CloudOperators(cloud, support, degree, weight_shape, all_aligned(tables))
