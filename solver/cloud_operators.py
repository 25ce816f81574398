"""What all runs on a cloud share, made once: the faces of its cells, and the LMLS slopes of cell means."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.cloud_faces import Faces, connect
from solver.moving_least_squares import Approximation, approximation
from solver.point_cloud import PointCloud


@dataclass(frozen=True, eq=False)
class CloudOperators:
    """Operators of a cloud, and the choices they were made by, as `prepare` takes them."""

    cloud: PointCloud
    degree: int
    weight_shape: float
    faces: Faces
    slope: Approximation

    @property
    def support(self) -> int:
        """Cells that a slope is taken from."""
        return int(self.slope.neighbours.shape[1])

    def belong_to(self, cloud: PointCloud) -> bool:
        """Whether they are those of a cloud, or of one with the same points and bounds."""
        mine = self.cloud
        return mine is cloud or (
            (mine.x, mine.y) == (cloud.x, cloud.y) and np.array_equal(mine.points, cloud.points)
        )


def prepare(
    cloud: PointCloud, support: int = 9, degree: int = 1, weight_shape: float = 4.0
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
    return CloudOperators(cloud, degree, weight_shape, connect(cells), slope)
