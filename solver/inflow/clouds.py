"""Sections on a cloud: the faces between Voronoi cells that stand for a line."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.inflow.conditions import Line
from solver.inflow.placement import Frame, Point, along_line, heading, nearest_on
from solver.physics.elevation import Surface
from solver.physics.terrain import Terrain

if TYPE_CHECKING:
    # compiled code takes longer to import than a scenario to check
    from solver.points.cloud import PointCloud
    from solver.points.voronoi import ControlVolumes

# Of a cell: what is this near to a point is above it.
_NEARLY = 1e-6
# Places along a line at which the bed is looked at.
_PLACES = 100
# Half cells that a line may be lengthened by at each end until it parts two cells.
_LENGTHENED = 64


@dataclass(frozen=True, eq=False)
class PlacedOnCloud:
    """A section on a cloud, n faces of `solver.points.voronoi.ControlVolumes`.

    Attributes
    ----------
    face
        Number of the face among those between cells, followed by those of the boundary, shape (n,).
    sign
        1 where flow goes from the left cell to the right one, or outward; -1 where it goes back, shape (n,).
    downstream, upstream
        Cells that flow goes to and comes from, shape (n,); -1 outside.
    direction, width, bottom, along, normal
        As of `solver.inflow.placement.Placed`.
    line
        Corners of the line as it is taken, shape (m, 2), m.
    """

    face: Indices
    sign: Indices
    downstream: Indices
    upstream: Indices
    direction: Point
    width: Array
    bottom: Array
    along: float
    normal: float
    line: Array

    def parts(self, first: Array, second: Array) -> NDArray[np.bool_]:
        """Whether it leads between places, each (n, 2), m, and flow goes from the second to the first."""
        crossed = _crossings(self.line, first, second)
        return np.asarray(crossed * self.hand < 0)

    @property
    def hand(self) -> int:
        """1 if flow goes to the right hand of who walks along the line, else -1."""
        way = self.line[-1] - self.line[0]
        return 1 if way[1] * self.direction[0] - way[0] * self.direction[1] > 0 else -1

    @property
    def cells(self) -> tuple[Indices, ...]:
        """Indices of the cells that flow goes to."""
        return (self.downstream,)

    def below(self, values: Array) -> Array:
        """Values (n,) at the cells that flow goes to."""
        return np.asarray(values[self.downstream[self.downstream >= 0]])

    def only(self, good: NDArray[np.bool_]) -> PlacedOnCloud:
        """Give the section with those of its faces that are true, shape (n,)."""
        names = "face", "sign", "downstream", "upstream", "width", "bottom"
        return replace(self, **{name: getattr(self, name)[good] for name in names})

    def meets(self, cells: NDArray[np.bool_]) -> bool:
        """Whether one of the cells that are true, shape (n,), is on a side of a face."""
        beside = np.concatenate([self.downstream, self.upstream])
        return bool(cells[beside[beside >= 0]].any())


def frame_of_bounds(x: Point, y: Point, spacing: float, strip: float) -> Frame:
    """Give the frame of a cloud in bounds, m: what is half its mean spacing from a side is along it.

    Surfaces are looked at on a strip along a line that is as wide as its cells there, m.
    """
    reach, between = 0.5 * spacing, min(x[1] - x[0], y[1] - y[0]) / _PLACES
    return Frame((x, y), (reach, reach), between, strip=strip)


def place_on_cloud(
    line: Line, cloud: PointCloud, terrain: Terrain | Surface, gravity: float
) -> PlacedOnCloud:
    """Find the faces of a cloud that stand for a line, and which way flow goes through it.

    They are those between points, and between a point and its image beyond a side, that the line parts: their
    dual edges are those that it crosses, so that the faces of a straight line lead from end to end. Its ends
    reach half a cell farther, so that each cell that it touches belongs to it.

    On a surface the bed at a face is the mean elevation of the piece of the line beside it.

    Raises
    ------
    ValueError
        If the line lies outside, has no length, or parts no cells.
    """
    volumes, strip = cloud.control_volumes, 0.0
    if isinstance(terrain, Surface):
        places = np.stack(along_line(line, cloud.mean_spacing), axis=1)
        strip = float(np.sqrt(volumes.area[cloud.nearest(1, places)[:, 0]]).mean())
    frame = frame_of_bounds(cloud.x, cloud.y, cloud.mean_spacing, strip)
    corners, way, along, normal, flip = heading(line, frame, terrain, gravity)
    ends = np.array(corners, dtype=np.float64)
    near = cloud.nearest(1, ends)[:, 0]
    sizes = np.sqrt(volumes.area[near])
    first, second = _pairs(cloud)
    for lengthened in range(1, _LENGTHENED + 1):
        # what is as near to two points goes against the flow
        taken = _reaching(ends, sizes, lengthened, cloud) - _NEARLY * sizes.min() * np.array(way)
        crossed = _crossings(taken, first, second)
        face = np.flatnonzero(crossed)
        if len(face):
            break
    else:
        raise ValueError("expected a section that parts two cells, found one that parts none")
    sign = crossed[face] * (-1 if flip else 1)
    outward = volumes.outward[face]
    length = np.concatenate([volumes.length, volumes.side_length])[face]
    left = np.concatenate([volumes.left, volumes.side_cell])[face]
    right = np.concatenate([volumes.right, np.full(len(volumes.side), -1)])[face]
    return PlacedOnCloud(
        face,
        sign,
        np.where(sign > 0, right, left),
        np.where(sign > 0, left, right),
        way,
        np.maximum(0.0, sign * length * (outward @ np.array(way))),
        _bottom(corners, face, volumes, terrain),
        along,
        normal,
        taken,
    )


def _bottom(line: Line, face: Indices, volumes: ControlVolumes, terrain: Terrain | Surface) -> Array:
    """Elevation of the bed on a line beside faces, m; 0 on a slope profile."""
    if not isinstance(terrain, Surface):
        return np.zeros(len(face))
    start, stop = (nearest_on(line, *ends[face].T).T for ends in volumes.edges)
    sizes = np.sqrt(volumes.area[np.concatenate([volumes.left, volumes.side_cell])[face]])
    return np.asarray(terrain.along_edges(start, stop, sizes))


def _pairs(cloud: PointCloud) -> tuple[Array, Array]:
    """Points on both sides of each face, (f, 2), m; beyond a boundary face the image of its point."""
    volumes, points = cloud.control_volumes, cloud.points
    inside, outward = points[volumes.side_cell], volumes.outward[len(volumes.left) :]
    depth = np.einsum("bk,bk->b", volumes.side_midpoint - inside, outward)
    # a point may lie on the side
    away = depth + np.maximum(depth, 0.5 * np.sqrt(volumes.area[volumes.side_cell]))
    images = inside + away[:, None] * outward
    return (
        np.concatenate([points[volumes.left], inside]),
        np.concatenate([points[volumes.right], images]),
    )


def _reaching(ends: Array, sizes: Array, halves: int, cloud: PointCloud) -> Array:
    """Corners of a line (n, 2) whose ends reach some half cells farther, within the domain, m."""
    found = ends.copy()
    low, high = np.array(cloud.extent).T
    for end, after in ((0, 1), (-1, -2)):
        out = ends[end] - ends[after]
        size = float(np.hypot(*out))
        if size > 0:
            out = out / size
            room = np.where(out > 0, high - ends[end], ends[end] - low)
            most = np.divide(room, np.abs(out), out=np.full(2, np.inf), where=out != 0)
            found[end] += out * max(0.0, min((0.5 - _NEARLY) * halves * sizes[end], *most))
    return found


def _crossings(line: Array, first: Array, second: Array) -> Indices:
    """Count how often a line (n, 2) leads between pairs of points, (f, 2), the second at the right hand.

    Passages that leave the second at the left hand count as -1.
    """
    total = np.zeros(len(first), np.int64)
    for start, end in pairwise(line):
        at_first, at_second = (_side(end - start, points - start) for points in (first, second))
        before, after = (_side(second - first, corner - first) for corner in (start, end))
        crosses = ((at_first >= 0) != (at_second >= 0)) & ((before >= 0) != (after >= 0))
        total += np.where(crosses, np.where(at_first >= 0, 1, -1), 0)
    return np.sign(total)


def _side(way: Array, to: Array) -> Array:
    """Component to the left of a way of what lies there, times its length, m2."""
    return np.asarray(way[..., 0] * to[..., 1] - way[..., 1] * to[..., 0])
