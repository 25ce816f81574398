"""Control volumes of scattered points: their Voronoi cells, clipped to the domain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from solver.arrays import Array, Indices
from solver.compiled import kernel

# Neighbours that a cell is cut by at first; the few that need more get twice as many until they are done.
NEIGHBOURS = 24
# A face this much shorter than its cell is wide is round-off, where four cells meet at one corner.
SHORTEST_FACE = 1e-13


@dataclass(frozen=True)
class ControlVolumes:
    """Voronoi cells clipped to a rectangle, and the faces between them.

    Parameters
    ----------
    area : (n,) array
        In m2.
    centroid : (n, 2) array
        In m.
    second_moment : (n, 3) array
        Means of ``X^2, X Y, Y^2`` over each cell about its centroid, m2.
    left, right : (f,) array
        Cells on both sides of each face, left < right.
    length : (f,) array
        In m.
    normal : (f, 2) array
        Unit vector from left to right.
    midpoint : (f, 2) array
        In m.
    side_cell : (b,) array
        Cell of each boundary face.
    side : (b,) array
        0 to 3 for x_min, x_max, y_min, y_max, and `BUILDING` for a wall of a building.
    side_length : (b,) array
        In m.
    side_midpoint : (b, 2) array
        In m.
    side_normal : (b, 2) array
        Outward unit vector.
    """

    area: Array
    centroid: Array
    second_moment: Array
    left: Indices
    right: Indices
    length: Array
    normal: Array
    midpoint: Array
    side_cell: Indices
    side: Indices
    side_length: Array
    side_midpoint: Array
    side_normal: Array

    @property
    def outward(self) -> Array:
        """Unit vectors from the left cells of all faces to what is beyond, boundary faces last, (e, 2)."""
        return np.concatenate([self.normal, self.side_normal])

    @property
    def edges(self) -> tuple[Array, Array]:
        """Start and end of all faces, anticlockwise around the left cell, boundary faces last, (e, 2), m."""
        outward = self.outward
        half = np.concatenate([self.length, self.side_length])[:, None] / 2
        middle = np.concatenate([self.midpoint, self.side_midpoint])
        along = half * np.stack([-outward[:, 1], outward[:, 0]], axis=1)
        return middle - along, middle + along

    def around(self, values: Array) -> Array:
        """Add up around each cell what its edges have, as `edges`, (e,); the sum has shape (n,)."""
        n, inner = len(self.area), len(self.left)
        cells = np.concatenate([self.left, self.side_cell])
        total: Array = np.bincount(cells, values, n).astype(np.float64)
        return total - np.bincount(self.right, values[:inner], n)


# outward unit normals of the sides x_min, x_max, y_min, y_max
SIDE_NORMALS = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
# the number after theirs is that of all walls of buildings
BUILDING = len(SIDE_NORMALS)


@kernel(fastmath=False, from_python=True)
def cut_cells(
    points: Array,
    bounds: Array,
    cells: Indices,
    neighbours: Indices,
    corner: Array,
    label: Indices,
    corners: Indices,
    done: Indices,
    scratch: tuple[Array, Indices, Array],
) -> None:
    """Cut the domain down to the Voronoi cells of some points by the bisectors to their neighbours.

    Coordinates are relative to each point, so that precision does not depend on where the domain lies.

    Parameters
    ----------
    points : (n, 2) array
        Coordinates, m.
    bounds : (4,) array
        x_min, x_max, y_min, y_max, m.
    cells : (m,) array
        Points whose cells are wanted.
    neighbours : (m, k) array
        Points near each, nearest first.
    corner : (m, k + 4, 2) array
        Filled with the corners of each cell, anticlockwise, relative to its point, m.
    label : (m, k + 4) array
        Filled with the cell beyond the face that begins at each corner; -1 to -4 at the domain's sides.
    corners : (m,) array
        Filled with the number of corners.
    done : (m,) array
        Filled with 1 where points beyond the given neighbours cannot cut the cell, else 0.
    scratch
        Three arrays of shapes (k + 4, 2), (k + 4,) and (k + 4,).
    """
    new_corner, new_label, beyond = scratch
    for m in range(len(cells)):
        i = cells[m]
        x, y = points[i, 0], points[i, 1]
        west, east, south, north = bounds[0] - x, bounds[1] - x, bounds[2] - y, bounds[3] - y
        polygon, edge = corner[m], label[m]
        polygon[0, 0], polygon[0, 1], edge[0] = west, south, -3
        polygon[1, 0], polygon[1, 1], edge[1] = east, south, -2
        polygon[2, 0], polygon[2, 1], edge[2] = east, north, -4
        polygon[3, 0], polygon[3, 1], edge[3] = west, north, -1
        count = 4
        reach = max(west * west, east * east) + max(south * south, north * north)
        done[m] = 0
        for n in range(neighbours.shape[1]):
            j = neighbours[m, n]
            if j == i:
                continue
            dx, dy = points[j, 0] - x, points[j, 1] - y
            half = 0.5 * (dx * dx + dy * dy)
            # a bisector farther away than every corner cuts nothing, nor do those after it
            if half > 2.0 * reach:
                done[m] = 1
                break
            cut = False
            for k in range(count):
                beyond[k] = dx * polygon[k, 0] + dy * polygon[k, 1] - half
                cut |= beyond[k] > 0.0
            if not cut:
                continue
            kept = 0
            for k in range(count):
                after = k + 1 if k + 1 < count else 0
                inside, leaves = beyond[k] <= 0.0, beyond[after] > 0.0
                if inside:
                    new_corner[kept, 0], new_corner[kept, 1] = polygon[k, 0], polygon[k, 1]
                    new_label[kept] = edge[k]
                    kept += 1
                if inside == leaves:
                    t = beyond[k] / (beyond[k] - beyond[after])
                    new_corner[kept, 0] = polygon[k, 0] + t * (polygon[after, 0] - polygon[k, 0])
                    new_corner[kept, 1] = polygon[k, 1] + t * (polygon[after, 1] - polygon[k, 1])
                    new_label[kept] = j if inside else edge[k]
                    kept += 1
            count, reach = kept, 0.0
            for k in range(count):
                polygon[k, 0], polygon[k, 1] = new_corner[k, 0], new_corner[k, 1]
                edge[k] = new_label[k]
                square = polygon[k, 0] * polygon[k, 0] + polygon[k, 1] * polygon[k, 1]
                reach = max(reach, square)
        corners[m] = count


@kernel(fastmath=False, from_python=True)
def measure_cells(
    points: Array,
    cells: Indices,
    corner: Array,
    corners: Indices,
    area: Array,
    centroid: Array,
    second_moment: Array,
) -> None:
    """Set area (n,), centroid (n, 2) and second moments (n, 3) of some cells from their corners."""
    for m in range(len(cells)):
        i, polygon = cells[m], corner[m]
        twice, first_x, first_y, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(corners[m]):
            a_x, a_y = polygon[k]
            b_x, b_y = polygon[k + 1 if k + 1 < corners[m] else 0]
            cross = a_x * b_y - a_y * b_x
            twice += cross
            first_x += cross * (a_x + b_x)
            first_y += cross * (a_y + b_y)
            xx += cross * (a_x * a_x + a_x * b_x + b_x * b_x)
            yy += cross * (a_y * a_y + a_y * b_y + b_y * b_y)
            xy += cross * (a_x * a_y + b_x * b_y + 0.5 * (a_x * b_y + b_x * a_y))
        x, y = first_x / (3.0 * twice), first_y / (3.0 * twice)
        area[i] = 0.5 * twice
        centroid[i, 0], centroid[i, 1] = points[i, 0] + x, points[i, 1] + y
        second_moment[i, 0] = xx / (6.0 * twice) - x * x
        second_moment[i, 1] = xy / (6.0 * twice) - x * y
        second_moment[i, 2] = yy / (6.0 * twice) - y * y


def control_volumes(points: Array, x: tuple[float, float], y: tuple[float, float]) -> ControlVolumes:
    """Voronoi cells of points, clipped to a domain.

    Areas add up to the domain's to round-off, and so do ``length * normal`` around each cell to zero.

    Parameters
    ----------
    points : (n, 2) array
        Distinct points inside the domain or on its sides, m.
    x, y : tuple of float
        Bounds of the domain, m.
    """
    n = len(points)
    tree, bounds = scipy.spatial.cKDTree(points), np.array([*x, *y], dtype=np.float64)
    area, centroid, second_moment = np.empty(n), np.empty((n, 2)), np.empty((n, 3))
    cells, count = np.arange(n), min(NEIGHBOURS, n)
    found = []
    while len(cells):
        _, near = tree.query(points[cells], count)
        near = near.reshape(len(cells), count)
        corner = np.empty((len(cells), count + 4, 2))
        label = np.empty(corner.shape[:2], dtype=np.int64)
        corners, done = np.empty((2, len(cells)), dtype=np.int64)
        scratch = np.empty_like(corner[0]), np.empty_like(label[0]), np.empty(count + 4)
        cut_cells(points, bounds, cells, near, corner, label, corners, done, scratch)
        complete = (done == 1) | (count == n)
        chosen = cells[complete], corner[complete], label[complete], corners[complete]
        measure_cells(points, chosen[0], chosen[1], chosen[3], area, centroid, second_moment)
        found.append(_edges(points, *chosen))
        cells, count = cells[~complete], min(2 * count, n)
    cell, beyond, start, end = (np.concatenate(parts) for parts in zip(*found, strict=True))
    length = np.hypot(*(end - start).T)
    real = length > SHORTEST_FACE * np.sqrt(area[cell])
    inner, outer = real & (beyond > cell), real & (beyond < 0)
    inner, outer = np.flatnonzero(inner), np.flatnonzero(outer)
    inner = inner[np.argsort(cell[inner], kind="stable")]
    outer = outer[np.argsort(cell[outer], kind="stable")]
    left, right = cell[inner], beyond[inner]
    across = points[right] - points[left]
    middle = points[cell] + (start + end) / 2
    return ControlVolumes(
        area,
        centroid,
        second_moment,
        left,
        right,
        length[inner],
        across / np.hypot(*across.T)[:, None],
        middle[inner],
        cell[outer],
        -1 - beyond[outer],
        length[outer],
        middle[outer],
        SIDE_NORMALS[-1 - beyond[outer]],
    )


def _edges(
    points: Array, cells: Indices, corner: Array, label: Indices, corners: Indices
) -> tuple[Indices, Indices, Array, Array]:
    """Flatten edges: cell, cell or side beyond, start and end relative to the cell's point."""
    place = np.arange(corner.shape[1])
    used = place < corners[:, None]
    after = np.where(place + 1 < corners[:, None], place + 1, 0)
    ends = np.take_along_axis(corner, after[..., None], axis=1)
    return np.repeat(cells, corners), label[used], corner[used], ends[used]
