"""The faces of a cloud's control volumes, laid out for loops over whole vectors of cells and faces."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices, Numbers
from solver.compiled import kernel
from solver.kernels.boundary import along_at_depth, leaving_at_depth
from solver.kernels.flow_axes import normal_pressure
from solver.kernels.state import DEPTH, LANES, NO_SLIP, WALL, Fields, Sides, Status
from solver.points.voronoi import ControlVolumes

# Faces that every cell has room for in a table; those of the few cells with more are in a list.
ROOM = 8


class Faces(NamedTuple):
    """Faces between cells in the order of their left cells, then the boundary faces.

    Cells are numbered as the points and filled up by dry ones to whole blocks of LANES; the ghost of the b-th
    boundary face is cell ``cells + b``. Faces are read and written in whole vectors, for which LANES spare
    ones follow both kinds. Each face has two halves, that of its left cell with the number of the face and
    that of its right cell ``faces`` higher; half ``2 faces`` is no face.

    Attributes
    ----------
    left, right
        (faces,), cells.
    geometry
        (7, faces). Unit normal from left to right (0, 1); way from the left centroid to the right one, m (2,
        3); the part of that way at which the face stands, 0 to 1 (4); from there to its midpoint, in ways
        turned by a right angle to the left (5); length, m (6).
    side
        (ghosts,), 0 to 3 for x_min, x_max, y_min, y_max, 4 for walls of buildings.
    lean
        (ghosts,), what gravity has over dry friction toward a wall, times the way to the ghost, m2 s-2: over
        the pressure it is the gain of depth by which something leans on the wall. 0 until a run sets it.
    around
        (ROOM, cells), halves of each cell.
    number
        (cells,), how many it has.
    more
        (cells + 1,), where those beyond ROOM begin in ``rest``.
    first, first_side
        (blocks + 1,), first face and first boundary face of each block's left cells.
    cells, faces, outer
        Numbers of cells, of faces, and of the first boundary face.
    far
        (6, faces) on a surface, None elsewhere. There (0, 1) of ``geometry`` are in the frame of the left
        cell, and here are the same normal in that of the right one (0, 1), and how long the face is in the
        planes of both cells, times its normal there, as part of its length: left (2, 3), right (4, 5).
    """

    left: Numbers
    right: Numbers
    geometry: Array
    side: Indices
    lean: Array
    around: Numbers
    number: Indices
    more: Indices
    rest: Indices
    first: Indices
    first_side: Indices
    cells: int
    faces: int
    outer: int
    far: Array | None = None


# Bytes of a line of the cache: a vector that straddles two is read and written at half the speed.
LINE = 64
Arrays = TypeVar("Arrays", bound=tuple[Any, ...])


def aligned(values: NDArray[Any]) -> NDArray[Any]:
    """Copy an array to where a line of the cache begins."""
    room = np.empty(values.nbytes + LINE, np.uint8)
    start = -room.ctypes.data % LINE
    copy = room[start : start + values.nbytes].view(values.dtype).reshape(values.shape)
    copy[...] = values
    return copy


def all_aligned(arrays: Arrays) -> Arrays:
    """Align the arrays in a named tuple, or in one of such tuples."""
    return type(arrays)(
        *(
            aligned(a) if isinstance(a, np.ndarray) else all_aligned(a) if isinstance(a, tuple) else a
            for a in arrays
        )
    )


def whole_blocks(n: int) -> int:
    """Round a number of cells up to whole blocks."""
    return -(-n // LANES) * LANES


def connect(volumes: ControlVolumes) -> Faces:
    """Lay out the faces of control volumes; ghosts are mirrored at the sides."""
    n, ghosts, inner = len(volumes.area), len(volumes.side), len(volumes.left)
    cells, outer = whole_blocks(n), whole_blocks(inner) + LANES
    faces = outer + whole_blocks(ghosts) + LANES
    left = np.concatenate([volumes.left, volumes.side_cell])
    right = np.concatenate([volumes.right, cells + np.arange(ghosts)])
    length = np.concatenate([volumes.length, volumes.side_length])
    outward, normal = volumes.side_normal, volumes.outward
    midpoint = np.concatenate([volumes.midpoint, volumes.side_midpoint])
    inside = volumes.centroid[volumes.side_cell]
    depth = np.einsum("bk,bk->b", volumes.side_midpoint - inside, outward)
    start = volumes.centroid[left]
    way = np.concatenate([volumes.centroid[volumes.right] - start[:inner], 2 * depth[:, None] * outward])
    turned = np.stack([-way[:, 1], way[:, 0]], axis=1)
    square = np.einsum("fk,fk->f", way, way)
    part, shift = (np.einsum("fk,fk->f", midpoint - start, to) / square for to in (way, turned))
    # a face of a slanting pair may stand behind one of the two, where no limited step leads
    part = np.clip(part, 0.0, 1.0)
    place = np.concatenate([np.arange(inner), outer + np.arange(ghosts)])
    left_of, right_of = np.zeros((2, faces), np.uint32)
    left_of[place], right_of[place] = left, right
    geometry = np.zeros((7, faces))
    geometry[:, place] = np.stack([*normal.T, *way.T, part, shift, length])
    owner = np.concatenate([left, volumes.right])
    half = np.concatenate([place, faces + np.arange(inner)])
    order = np.argsort(owner, kind="stable")
    owner, half = owner[order], half[order]
    number = np.bincount(owner, minlength=cells)
    row = np.arange(len(owner)) - np.repeat(np.cumsum(number) - number, number)
    around = np.full((ROOM, cells), 2 * faces)
    has_room = row < ROOM
    around[row[has_room], owner[has_room]] = half[has_room]
    beyond = np.maximum(number - ROOM, 0)
    bounds = np.arange(0, cells + 1, LANES)
    return Faces(
        left_of,
        right_of,
        geometry,
        volumes.side,
        np.zeros(ghosts),
        around.astype(np.uint32),
        number,
        np.concatenate([[0], np.cumsum(beyond)]),
        half[~has_room],
        np.searchsorted(volumes.left, bounds),
        np.searchsorted(volumes.side_cell, bounds),
        cells,
        faces,
        outer,
    )


@kernel()
def half_of(faces: Faces, i: int, m: int) -> int:
    """Give the m-th half-face of cell i."""
    return int(faces.around[m, i]) if m < ROOM else faces.rest[faces.more[i] + m - ROOM]


@kernel()
def beyond(faces: Faces, half: int) -> tuple[int, int, float]:
    """Give the face of a half, the cell beyond it, and the sign of the way there along the face's way."""
    if half < faces.faces:
        return half, int(faces.right[half]), 1.0
    return half - faces.faces, int(faces.left[half - faces.faces]), -1.0


@kernel(inline=True)
def normal_beyond(far: Array | None, f: int, n_x: float, n_y: float) -> tuple[float, float]:
    """Give the normal of face f in the frame of its right cell; n_x, n_y in that of the left one."""
    if far is None:
        return n_x, n_y
    return far[0, f], far[1, f]


@kernel(inline=True)
def own_normals(
    far: Array | None, f: int, n_x: float, n_y: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Give what pressure on face f acts along, in the frames of its left and right cell."""
    if far is None:
        return (n_x, n_y), (n_x, n_y)
    return (far[2, f], far[3, f]), (far[4, f], far[5, f])


@kernel(inline=True)
def carried_over(
    far: Array | None, f: int, normal: tuple[float, float], to_left: bool, x: float, y: float
) -> tuple[float, float]:
    """Turn a vector from the frame of the cell on one side of face f into that of the other one.

    Parameters
    ----------
    normal : tuple
        Of the face, in the frame of its left cell.
    to_left : bool
        Whether into the frame of that.
    """
    if far is None:
        return x, y
    c, s, c_to, s_to = normal[0], normal[1], far[0, f], far[1, f]
    if to_left:
        c, s, c_to, s_to = c_to, s_to, c, s
    n, t = c * x + s * y, c * y - s * x
    return c_to * n - s_to * t, s_to * n + c_to * t


@kernel()
def fill_ghosts_beyond(
    now: Fields, status: Status, faces: Faces, sides: Sides, start: int, stop: int
) -> None:
    """Fill some ghosts, as `ghosts_beyond` does on a lattice but for the bound at walls.

    Parameters
    ----------
    status
        Whose pressures are read.
    start, stop : int
        Numbers of the boundary faces.
    """
    h, u, v = now
    for b in range(start, stop):
        f, side = faces.outer + b, faces.side[b]
        i, ghost, kind = int(faces.left[f]), int(faces.right[f]), sides.kind[side]
        b_x, b_y = status.beta_x[i], status.beta_y[i]
        n_x, n_y = faces.geometry[0, f], faces.geometry[1, f]
        if kind in (WALL, NO_SLIP):
            beta = normal_pressure(status.beta_xy, i, b_x, b_y, n_x, n_y)
            h[ghost] = max(0.0, h[i] + faces.lean[b] / beta)
            back = 2.0 * (n_x * u[i] + n_y * v[i])
            u[ghost] = -u[i] if kind == NO_SLIP else u[i] - back * n_x
            v[ghost] = -v[i] if kind == NO_SLIP else v[i] - back * n_y
            continue
        h[ghost] = sides.depth[side] if kind == DEPTH else h[i]
        u[ghost], v[ghost] = u[i], v[i]
        if kind == DEPTH:
            sign = 1.0 if side % 2 == 1 else -1.0
            depth, fastest, along = sides.depth[side], sides.fastest[side], sides.alongside
            if side < 2:
                u[ghost] = sign * leaving_at_depth(sign * u[i], h[i], depth, b_x, fastest)
                v[ghost] = along_at_depth(v[i], depth, b_x, along[2], along[3])
            else:
                v[ghost] = sign * leaving_at_depth(sign * v[i], h[i], depth, b_y, fastest)
                u[ghost] = along_at_depth(u[i], depth, b_y, along[0], along[1])
