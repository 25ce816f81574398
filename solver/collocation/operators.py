"""What all collocation runs on the same points share: LMLS weights, images beyond sides, exchange pairs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.lmls.shape_functions import Approximation, approximation, diffuse, full
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.scheme import DerivativeName

Numbers = NDArray[np.int32]
DERIVATIVES = {"full": full, "diffuse": diffuse}
# Distances that differ by less are equal: on a lattice a support takes all points of its last distance.
EQUAL = 1 + 1e-9


class Stencils(NamedTuple):
    """LMLS weights and exchange pairs of each of n points.

    Attributes
    ----------
    own
        1 where each point has its own row of weights, 0 where all share one.
    neighbours
        (n, s), numbers of the points and images of each support, nearest first.
    gradient
        (rows, s, 2), weights of the derivatives by x and y, 1/m.
    value
        (rows, s), weights of the value.
    reach
        (rows, 2), sums of the sizes of the derivative weights, 1/m.
    first
        (n + 1,), where each point's pairs begin.
    partners
        (pairs,).
    exchange
        (pairs,), or of one point if shared, ``(V_i S_ij + V_j S_ji) / (2 V_i)`` with S the value weights.
    """

    own: int
    neighbours: Numbers
    gradient: Array
    value: Array
    reach: Array
    first: Indices
    partners: Numbers
    exchange: Array


@dataclass(frozen=True, eq=False)
class CollocationOperators:
    """n points, their mirror images beyond the sides, numbered after them, and what is computed from both.

    Attributes
    ----------
    points
        The lattice or cloud.
    support, degree, weight_shape, derivative
        The choices they were made by.
    coordinates
        (n + images, 2), m.
    area
        (n + images,), of the control volumes, m2.
    source
        (images,), number of each image's point.
    beyond
        (images, 2), along x and y: -1 beyond the lower side, 1 beyond the upper, 0 beyond neither.
    condition
        Largest condition number of a moment matrix in the 2-norm.
    """

    points: Lattice | PointCloud
    support: int
    degree: int
    weight_shape: float
    derivative: DerivativeName
    coordinates: Array
    area: Array
    source: Indices
    beyond: Indices
    stencils: Stencils
    condition: float

    @property
    def count(self) -> int:
        """Number of points without images."""
        return len(self.area) - len(self.source)

    def belong_to(self, points: Lattice | PointCloud) -> bool:
        """Whether they are those of a lattice or a cloud, or of one with the same points and bounds."""
        mine = self.points
        if isinstance(mine, Lattice) or isinstance(points, Lattice):
            return mine == points
        return mine.same_as(points)


def prepare_collocation(
    points: Lattice | PointCloud,
    support: int = 49,
    degree: int = 2,
    weight_shape: float = 9.0,
    derivative: DerivativeName = "full",
) -> CollocationOperators:
    """Make the operators of a lattice or a cloud, once for all runs.

    Supports near a side reach into mirror images of the points, so that they are as round there as inside.

    Parameters
    ----------
    support : int
        Points of a support, the point itself among them; on a lattice the shell it ends in is taken whole.
    degree : int
        Of the LMLS basis, 1 or 2.
    weight_shape : float
        c of eq. 18.
    derivative : str
        "full" (MLS) or "diffuse" (eq. 23 as printed, WLS).

    Raises
    ------
    ValueError
        If a support cannot carry the basis; the message names the points.
    """
    if isinstance(points, Lattice):
        near, coordinates, source, beyond = _lattice_supports(points, support)
        places = coordinates[:1]
        area = np.full(len(coordinates), points.cell_area)
    else:
        near, coordinates, source, beyond = _cloud_supports(points, support)
        places = points.points
        area = points.cell_area[np.concatenate([np.arange(len(points)), source])]
    found = approximation(
        coordinates, places, near[: len(places)], degree, weight_shape, DERIVATIVES[derivative]
    )
    gradient = np.stack([found.along, found.across], axis=-1)
    pairs = _shared_pairs(near, found) if isinstance(points, Lattice) else _pairs(area, found, source, beyond)
    reach = np.abs(gradient).sum(axis=1)
    own = int(len(places) == len(near))
    stencils = Stencils(own, near.astype(np.int32), gradient, found.value, reach, *pairs)
    choices = support, degree, weight_shape, derivative
    condition = float(found.condition.max())
    return CollocationOperators(points, *choices, coordinates, area, source, beyond, stencils, condition)


def _lattice_supports(lattice: Lattice, support: int) -> tuple[Indices, Array, Indices, Indices]:
    """Supports of all points, coordinates with images, the images' sources and sides."""
    far = np.arange(-support, support + 1)
    steps = np.stack(np.meshgrid(far, far), axis=-1).reshape(-1, 2)
    distance = np.hypot(*(steps * [lattice.dx, lattice.dy]).T)
    order = np.argsort(distance, kind="stable")
    steps = steps[order[: int((distance <= distance[order[support - 1]] * EQUAL).sum())]]
    ny, nx = lattice.shape
    room_x, room_y = np.abs(steps).max(axis=0)
    x, y = np.arange(-room_x, nx + room_x), np.arange(-room_y, ny + room_y)
    source_x, beyond_x = _mirrored(x, nx)
    source_y, beyond_y = _mirrored(y, ny)
    source = source_y[:, None] * nx + source_x
    beyond = np.stack(np.meshgrid(beyond_x, beyond_y), axis=-1)
    inside = ((y >= 0) & (y < ny))[:, None] & ((x >= 0) & (x < nx))
    number = np.empty(inside.shape, dtype=np.int64)
    number[inside] = np.arange(nx * ny)
    number[~inside] = nx * ny + np.arange(int((~inside).sum()))
    row, column = np.divmod(np.arange(nx * ny), nx)
    near = number[row[:, None] + room_y + steps[:, 1], column[:, None] + room_x + steps[:, 0]]
    places = np.stack(
        np.meshgrid(lattice.x_points[0] + x * lattice.dx, lattice.y_points[0] + y * lattice.dy), axis=-1
    )
    return near, np.concatenate([places[inside], places[~inside]]), source[~inside], beyond[~inside]


def _mirrored(numbers: Indices, count: int) -> tuple[Indices, Indices]:
    """Fold numbers beyond ``0..count - 1`` back, as often as it takes; say beyond which end, 0 where even."""
    folds, rest = np.divmod(numbers, count)
    odd = folds % 2 != 0
    return np.where(odd, count - 1 - rest, rest), np.where(odd, np.where(folds > 0, 1, -1), 0)


def _cloud_supports(cloud: PointCloud, support: int) -> tuple[Indices, Array, Indices, Indices]:
    """Give what `_lattice_supports` gives of a lattice."""
    n, bounds = len(cloud), np.array([cloud.x, cloud.y])
    # no support grows where images come in addition, so this width holds all that any reaches
    farthest = cloud.points[cloud.nearest(support)[:, -1]] - cloud.points
    width = float(np.hypot(*farthest.T).max()) * EQUAL
    places, sources, sides = [cloud.points], [np.arange(n)], [np.zeros((n, 2), dtype=np.int64)]
    for x, y in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)]:
        place, close = cloud.points.copy(), np.ones(n, dtype=bool)
        for k, side in enumerate((x, y)):
            if side:
                wall = bounds[k, (side + 1) // 2]
                close &= np.abs(place[:, k] - wall) <= width
                place[:, k] = 2 * wall - place[:, k]
        places.append(place[close])
        sources.append(np.flatnonzero(close))
        sides.append(np.tile(np.array([x, y]), (int(close.sum()), 1)))
    points = np.concatenate(places)
    _, near = scipy.spatial.cKDTree(points).query(cloud.points, support)
    near = np.asarray(near, dtype=np.int64).reshape(n, -1)
    # a point on a side coincides with its image
    for i in np.flatnonzero(near[:, 0] != np.arange(n)):
        near[i, np.flatnonzero(near[i] == i)[0]], near[i, 0] = near[i, 0], i
    return near, points, np.concatenate(sources[1:]), np.concatenate(sides[1:])


def _shared_pairs(near: Indices, found: Approximation) -> tuple[Indices, Numbers, Array]:
    """Exchange between the points of a lattice, whose value weights are even."""
    n, size = near.shape
    first = (size - 1) * np.arange(n + 1)
    return first, near[:, 1:].ravel().astype(np.int32), found.value[0, 1:].copy()


def _pairs(
    area: Array, found: Approximation, source: Indices, beyond: Indices
) -> tuple[Indices, Numbers, Array]:
    """Exchange of each point with what supports it and what it supports: where pairs begin, partners, sizes.

    The image of j is to i what the image of i is to j, so that what i gains from one j loses to the other.
    Points and each of the eight kinds of images are taken in turn.
    """
    n, size = found.neighbours.shape
    source = np.concatenate([np.arange(n), source])
    kind = np.concatenate([np.zeros(n, dtype=np.int64), 3 * beyond[:, 0] + beyond[:, 1]])
    asked = scipy.sparse.csr_array(
        ((area[:n, None] * found.value).ravel(), found.neighbours.ravel(), np.arange(0, n * size + 1, size)),
        (n, len(source)),
    ).tocsc()
    rows, columns, values = [], [], []
    for k in np.unique(kind):
        members = np.flatnonzero(kind == k)
        part = asked[:, members].tocoo()
        place = part.coords[0], source[members][part.coords[1]]
        folded = scipy.sparse.csr_array((part.data, place), (n, n))
        mean = (0.5 * (folded + folded.T)).tocoo()
        number = np.zeros(n, dtype=np.int64)
        number[source[members]] = members
        rows.append(mean.coords[0])
        columns.append(number[mean.coords[1]])
        values.append(mean.data / area[mean.coords[0]])
    i, j, exchange = np.concatenate(rows), np.concatenate(columns), np.concatenate(values)
    order = np.argsort(i, kind="stable")
    order = order[i[order] != j[order]]
    first = np.searchsorted(i[order], np.arange(n + 1))
    return first, j[order].astype(np.int32), exchange[order]
