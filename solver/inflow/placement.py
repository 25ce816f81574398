"""Sections on a lattice: the faces between cells that stand for a line, and the bed along any section."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.inflow.conditions import Line
from solver.physics.elevation import Surface, edges_of, plan_slopes
from solver.physics.terrain import Terrain
from solver.points.lattice import Lattice

Point = tuple[float, float]
# Of a cell: what is this near to the middle between two corners may be taken for either.
_NEARLY = 1e-6
# A mean slope below this is round-off of elevations.
_LEVEL = 1e-9


@dataclass(frozen=True, eq=False)
class Placed:
    """A section on a lattice, n faces, in rows and columns of the whole lattice.

    Attributes
    ----------
    along_x
        Whether flow goes through a face along x, shape (n,).
    row, column
        The cell on the high side of a face, shape (n,); that on the low side is one less along x or y.
    sign
        1 where flow goes toward the high side, -1 where it goes toward the low one, shape (n,).
    direction
        Unit vector of the flow in plan.
    width
        What a face is wide across that direction, shape (n,), m.
    bottom
        Elevation of the bed on the line beside each face, shape (n,), m; 0 on a slope profile.
    along, normal
        Gravity along the flow and normal to the bed, m s-2.
    """

    along_x: NDArray[np.bool_]
    row: Indices
    column: Indices
    sign: Indices
    direction: Point
    width: Array
    bottom: Array
    along: float
    normal: float

    @property
    def downstream(self) -> tuple[Indices, Indices]:
        """Rows and columns of the cells that flow goes to, two of shape (n,)."""
        back = (self.sign < 0).astype(np.int64)
        return self.row - back * (1 - self.along_x), self.column - back * self.along_x

    @property
    def cells(self) -> tuple[Indices, ...]:
        """Indices of the cells that flow goes to: rows and columns."""
        return self.downstream

    def below(self, values: Array) -> Array:
        """Values (ny, nx) at the cells inside the lattice that flow goes to."""
        row, column = self.downstream
        inside = (row >= 0) & (row < values.shape[0]) & (column >= 0) & (column < values.shape[1])
        return np.asarray(values[row[inside], column[inside]])

    def only(self, good: NDArray[np.bool_]) -> Placed:
        """Give the section with those of its faces that are true, shape (n,)."""
        names = "along_x", "row", "column", "sign", "width", "bottom"
        return replace(self, **{name: getattr(self, name)[good] for name in names})

    def meets(self, cells: NDArray[np.bool_]) -> bool:
        """Whether one of the cells that are true, shape (ny, nx), is on a side of a face."""
        for back in (0, 1):
            row, column = self.row - back * (1 - self.along_x), self.column - back * self.along_x
            inside = (row >= 0) & (row < cells.shape[0]) & (column >= 0) & (column < cells.shape[1])
            if cells[row[inside], column[inside]].any():
                return True
        return False


class Frame(NamedTuple):
    """Where cells are, as far as the direction of a section depends on it.

    Parameters
    ----------
    extent : tuple
        Bounds of the cells along x and y, m.
    reach : tuple of float
        What is as near to a side, along x and along y, is along it, m.
    spacing : float
        Distance at which the bed is looked at along a line, m.
    lattice : Lattice, optional
        What a surface is looked at on; None on a cloud.
    strip : float, optional
        How wide a strip along a line a surface is looked at on in place of that, m.
    """

    extent: tuple[Point, Point]
    reach: Point
    spacing: float
    lattice: Lattice | None = None
    strip: float = 0.0


class Heading(NamedTuple):
    """Which way flow goes through a line.

    Parameters
    ----------
    line : tuple of (x, y)
        Its corners, from the lesser end on, m.
    way : tuple of float
        Unit vector of the flow in plan.
    along, normal : float
        Gravity along the flow and normal to the bed, m s-2.
    flip : bool
        Whether flow goes to the left hand of who walks along this line.
    """

    line: Line
    way: Point
    along: float
    normal: float
    flip: bool


def frame_of(lattice: Lattice) -> Frame:
    """Give the frame of a lattice: what is in the outer half of its outermost cells is along a side."""
    near = 0.5 + _NEARLY
    return Frame(lattice.extent, (near * lattice.dx, near * lattice.dy), lattice.spacing, lattice)


def outside(line: Line, extent: tuple[Point, Point], slack: float) -> Point | None:
    """Give a corner of a line that is more than ``slack`` outside bounds, m; None where all are inside."""
    for place in line:
        for at, (low, high) in zip(place, extent, strict=True):
            if not low - slack <= at <= high + slack:
                return place
    return None


def heading(line: Line, frame: Frame, terrain: Terrain | Surface, gravity: float) -> Heading:
    """Find which way flow goes through a line.

    It is inward where all of the line lies along one side, else down the bed, and where that is level to the
    right hand of who walks along the line.

    Raises
    ------
    ValueError
        If the line lies outside, or has no length.
    """
    if (off := outside(line, frame.extent, _NEARLY * frame.spacing)) is not None:
        (x0, x1), (y0, y1) = frame.extent
        bounds = f"x [{x0:g}, {x1:g}] and y [{y0:g}, {y1:g}]"
        raise ValueError(f"expected a section inside the domain, {bounds}, found [{off[0]:g}, {off[1]:g}]")
    # the faces do not depend on the end that a line was drawn from
    backward = line[0] > line[-1]
    line = line[::-1] if backward else line
    (a, b), (c, d) = line[0], line[-1]
    length = float(np.hypot(c - a, d - b))
    if not length > 0:
        raise ValueError("expected a section with two ends, found one whose ends coincide")
    way = (d - b) / length, -(c - a) / length
    along, normal = _gravity(line, frame, terrain, gravity, way)
    inward = _inward(line, frame, way)
    flip = inward < 0 if inward else along < 0 or (along == 0 and backward)
    if flip:
        way, along = (-way[0], -way[1]), -along
    return Heading(line, way, along, normal, flip)


def place(line: Line, lattice: Lattice, terrain: Terrain | Surface, gravity: float) -> Placed:
    """Find the faces of a lattice that stand for a line, and which way flow goes through it.

    The direction is that of `heading`. Corners of the line are moved to corners of
    cells, its ends outward: each cell that it touches belongs to it. On a surface it stays off the outermost
    cells, which are drains.

    Raises
    ------
    ValueError
        If the line lies outside the lattice, or has no length.
    """
    line, way, along, normal, flip = heading(line, frame_of(lattice), terrain, gravity)
    corners = _corners(line, lattice, way, 1 if isinstance(terrain, Surface) else 0)
    faces = [face for start, end in pairwise(corners) for face in _steps(start, end)]
    row, column, right = (np.array([face[k] for face in faces], np.int64) for k in (1, 2, 3))
    along_x = np.array([bool(face[0]) for face in faces])
    sign = -right if flip else right
    facing = sign * np.where(along_x, way[0] * lattice.dy, way[1] * lattice.dx)
    return Placed(
        along_x,
        row,
        column,
        sign,
        way,
        np.maximum(0.0, facing),
        _bottom(line, lattice, terrain, along_x, row, column),
        along,
        normal,
    )


def _gravity(
    line: Line, frame: Frame, terrain: Terrain | Surface, gravity: float, way: Point
) -> tuple[float, float]:
    """Gravity along a direction in plan and normal to the bed, means over a line, m s-2."""
    x, y = along_line(line, frame.spacing)
    if isinstance(terrain, Surface):
        lattice = frame.lattice
        if lattice is None:
            slope = np.arctan(_fall(line, frame, terrain, way))
            return gravity * float(np.sin(slope)), gravity * float(np.cos(slope))
        edges = [edges_of(a, lattice.dx) for a in (lattice.x_points, lattice.y_points)]
        b_x, b_y = plan_slopes(terrain.corners(*edges), lattice.dx)
        i, j = (
            np.clip((np.asarray(a) - edge[0]) / lattice.dx, 1, len(edge) - 3).astype(int)
            for a, edge in zip((x, y), edges, strict=True)
        )
        slope = np.arctan(-(b_x[j, i] * way[0] + b_y[j, i] * way[1]).mean())
        return gravity * float(np.sin(slope)), gravity * float(np.cos(slope))
    inclination = terrain.inclination(x, y)
    return (
        gravity * float(np.sin(inclination).mean()) * way[0],
        gravity * float(np.cos(inclination).mean()),
    )


def _fall(line: Line, frame: Frame, surface: Surface, way: Point) -> float:
    """Mean slope of a surface down a direction, over the strip along a line that lies within the bounds."""
    corners, low, high = np.array(line, np.float64), *np.array(frame.extent).T
    length = np.hypot(*np.diff(corners, axis=0).T)
    # of a strip that would reach outside the part inside counts
    sides = [np.clip(corners + shift * frame.strip * np.array(way), low, high) for shift in (-0.5, 0.5)]
    before, after = (surface.along_edges(a[:-1], a[1:], np.full(len(length), frame.strip)) for a in sides)
    apart = (sides[1] - sides[0]) @ np.array(way)
    fall = float(((before - after) * length).sum() / (0.5 * (apart[:-1] + apart[1:]) * length).sum())
    return fall if abs(fall) > _LEVEL else 0.0


def along_line(line: Line, spacing: float) -> tuple[Array, Array]:
    """Places along a line, at most half a spacing apart, m."""
    pieces = []
    for (a, b), (c, d) in pairwise(line):
        count = max(1, int(np.ceil(2 * np.hypot(c - a, d - b) / spacing)))
        share = (np.arange(count) + 0.5) / count
        pieces.append(np.stack([a + share * (c - a), b + share * (d - b)]))
    x, y = np.concatenate(pieces, axis=1)
    return x, y


def _inward(line: Line, frame: Frame, way: Point) -> float:
    """Component inward of a direction if a line lies along one side; 0 if it does not."""
    for axis, (low, high) in enumerate(frame.extent):
        places = [corner[axis] for corner in line]
        if all(at <= low + frame.reach[axis] for at in places):
            return way[axis]
        if all(at >= high - frame.reach[axis] for at in places):
            return -way[axis]
    return 0.0


def _corners(line: Line, lattice: Lattice, way: Point, rim: int) -> list[tuple[int, int]]:
    """Corners of cells, column and row, that the corners of a line are moved to; ``rim`` are left out."""
    along = -way[1], way[0]
    (a, b), (c, d) = line[0], line[-1]
    if (c - a) * along[0] + (d - b) * along[1] < 0:
        along = way[1], -way[0]
    found = []
    for k, corner in enumerate(line):
        # ends go outward, and what is as near to two corners goes against the flow
        end = {0: -1, len(line) - 1: 1}.get(k, 0)
        at = []
        for axis, (low, high) in enumerate(lattice.extent):
            size = (lattice.dx, lattice.dy)[axis]
            count = round((high - low) / size)
            shift = (0.5 - _NEARLY) * end * along[axis] - _NEARLY * way[axis]
            at.append(int(np.clip(np.rint((corner[axis] - low) / size + shift), rim, count - rim)))
        found.append((at[0], at[1]))
    return found


def _steps(start: tuple[int, int], end: tuple[int, int]) -> Iterator[tuple[bool, int, int, int]]:
    """Faces on the way from a corner of cells to another one that stays nearest to the straight line.

    Yields whether flow goes through along x, row and column of the cell on the high side, and on which side
    of it the right hand is: 1 for the high one.
    """
    (i, j), (i_end, j_end) = start, end
    across, up = abs(i_end - i), abs(j_end - j)
    step_i, step_j = (1 if i_end > i else -1), (1 if j_end > j else -1)
    done_i = done_j = 0
    while done_i < across or done_j < up:
        # the one of both that is less far on its way
        if done_j == up or (done_i < across and (2 * done_i + 1) * up < (2 * done_j + 1) * across):
            yield False, j, i if step_i > 0 else i - 1, -step_i
            i, done_i = i + step_i, done_i + 1
        else:
            yield True, j if step_j > 0 else j - 1, i, step_j
            j, done_j = j + step_j, done_j + 1


def _bottom(
    line: Line,
    lattice: Lattice,
    terrain: Terrain | Surface,
    along_x: NDArray[np.bool_],
    row: Indices,
    column: Indices,
) -> Array:
    """Elevation of the bed at the places of a line nearest to faces, m; 0 on a slope profile."""
    if not isinstance(terrain, Surface):
        return np.zeros(len(row))
    from scipy.interpolate import RegularGridInterpolator

    edges = [edges_of(a, lattice.dx) for a in (lattice.x_points, lattice.y_points)]
    x, y = edges[0][column] + np.where(along_x, 0.0, 0.5 * lattice.dx), edges[1][row]
    y = y + np.where(along_x, 0.5 * lattice.dy, 0.0)
    found = nearest_on(line, x, y)
    at = RegularGridInterpolator((edges[1], edges[0]), terrain.corners(*edges))
    p, q = (np.clip(a, edge[0], edge[-1]) for a, edge in zip(found, edges, strict=True))
    return np.asarray(at(np.stack([q, p], axis=1)))


def nearest_on(line: Line, x: Array, y: Array) -> Array:
    """Places of a line nearest to places x and y, each (n,), shape (2, n), m."""
    nearest, found = np.full(len(x), np.inf), np.stack([x, y])
    for (a, b), (c, d) in pairwise(line):
        square = (c - a) ** 2 + (d - b) ** 2
        share = np.clip(((x - a) * (c - a) + (y - b) * (d - b)) / square, 0.0, 1.0) if square else 0.0 * x
        p, q = a + share * (c - a), b + share * (d - b)
        distance = np.hypot(x - p, y - q)
        found = np.where(distance < nearest, np.stack([p, q]), found)
        nearest = np.minimum(nearest, distance)
    return found
