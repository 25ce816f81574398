"""The faces of a cloud's control volumes, and the LMLS reconstruction at their midpoints."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.boundary import DEPTH, NO_SLIP, WALL, Fields, Sides
from solver.compiled import Array, Indices, kernel
from solver.reconstruction import AHEAD, FRONT
from solver.voronoi import SIDE_NORMALS, ControlVolumes

# Faces taken at a time: gathered one by one into buffers that stay in the first cache, then vectorised.
CHUNK = 64


class Faces(NamedTuple):
    """Faces between cells, then the boundary faces, each with a ghost cell of its own on the right.

    Cells are numbered as the points, the ghost of the b-th boundary face is cell n + b.

    left, right : (f,), cells. side : (f,), 0 to 3 for x_min, x_max, y_min, y_max, -1 inside.
    geometry : (f, 11). Unit normal from left to right (0, 1); way from the left centroid to the right one, m
    (2, 3); the part of that way at which the face stands, seen from the left and from the right (4, 5); from
    there to the midpoint of the face, m, seen from the left (6, 7) and from the right (8, 9); length, m (10).
    first : (n + 1,), face, spoke : the faces of cell i are ``face[first[i]:first[i + 1]]``, and ``spoke`` has
    the length and both components of length times normal of each, m, negated where the cell is the left one.
    inner : number of the first boundary face.
    """

    left: Indices
    right: Indices
    side: Indices
    geometry: Array
    first: Indices
    face: Indices
    spoke: Array
    inner: int


class Gathered(NamedTuple):
    """State left and right of a chunk of faces in the frames of the faces, arrays of shape (2, CHUNK).

    h, n, t : means of depth (m), normal and tangential velocity (m s-1). h_gap, n_gap, t_gap : what the
    gradient makes of the way to the cell beyond. h_off, n_off, t_off : what it makes of the rest, to the
    midpoint. low, high : least and largest depth around, m. part : of the way, as in `Faces`.
    n_ahead, t_ahead : differences to the cell beyond, zero where one of the two is dry.
    """

    h: Array
    n: Array
    t: Array
    h_gap: Array
    n_gap: Array
    t_gap: Array
    h_off: Array
    n_off: Array
    t_off: Array
    low: Array
    high: Array
    part: Array
    n_ahead: Array
    t_ahead: Array


def connect(volumes: ControlVolumes) -> Faces:
    """Arrange the faces of control volumes for the kernels; ghosts are mirrored at the sides."""
    n, b, inner = len(volumes.area), len(volumes.side), len(volumes.left)
    left = np.concatenate([volumes.left, volumes.side_cell])
    right = np.concatenate([volumes.right, n + np.arange(b)])
    length = np.concatenate([volumes.length, volumes.side_length])
    outward = SIDE_NORMALS[volumes.side]
    normal = np.concatenate([volumes.normal, outward])
    midpoint = np.concatenate([volumes.midpoint, volumes.side_midpoint])
    inside = volumes.centroid[volumes.side_cell]
    depth = np.einsum("bk,bk->b", volumes.side_midpoint - inside, outward)
    centres = np.concatenate([volumes.centroid, inside + 2 * depth[:, None] * outward])
    way = centres[right] - centres[left]
    parts, offsets = [], []
    for start, sign in ((left, 1), (right, -1)):
        to = midpoint - centres[start]
        part = np.einsum("fk,fk->f", to, sign * way) / np.einsum("fk,fk->f", way, way)
        parts.append(part[:, None])
        offsets.append(to - sign * part[:, None] * way)
    cell = np.concatenate([left, volumes.right])
    face = np.concatenate([np.arange(len(left)), np.arange(inner)])
    direction = np.repeat([-1.0, 1.0], [len(left), inner])
    order = np.argsort(cell, kind="stable")
    around, direction = face[order], direction[order]
    return Faces(
        left,
        right,
        np.concatenate([np.full(inner, -1), volumes.side]),
        np.concatenate([normal, way, *parts, *offsets, length[:, None]], axis=1),
        np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=n))]),
        around,
        np.concatenate([np.ones((len(around), 1)), normal[around]], axis=1)
        * (direction * length[around])[:, None],
        inner,
    )


@kernel()
def fill_ghosts_beyond_faces(now: Fields, beta_x: Array, faces: Faces, sides: Sides) -> None:
    """Fill the ghosts; WALL mirrors the normal, NO_SLIP both velocities, DEPTH gives the depth outside.

    Beyond a wall that leans they continue the least slope of depth that gravity needs, as
    `solver.boundary.ghosts_beyond`. beta_x : g cos(xi) K_x (eq. 7), m s-2, of the cells.
    """
    h, u, v = now
    for f in range(faces.inner, len(faces.left)):
        i, ghost, kind = faces.left[f], faces.right[f], sides.kind[faces.side[f]]
        if kind in (WALL, NO_SLIP):
            h[ghost] = max(0.0, h[i] + faces.geometry[f, 2] * sides.lean[faces.side[f]] / beta_x[i])
        else:
            h[ghost] = sides.depth[faces.side[f]] if kind == DEPTH else h[i]
        along = faces.side[f] < 2
        u[ghost] = -u[i] if kind == NO_SLIP or (kind == WALL and along) else u[i]
        v[ghost] = -v[i] if kind == NO_SLIP or (kind == WALL and not along) else v[i]


@kernel()
def slopes_at(
    now: Fields, chosen: Indices, neighbours: Indices, along: Array, across: Array, dry: float, out: Array
) -> None:
    """LMLS derivatives of depth and velocity at some cells; a dry cell has no velocity to take part in them.

    Parameters
    ----------
    now : Fields
        Means over the cells.
    chosen : array
        Numbers of the cells.
    neighbours, along, across : (n, s) arrays
        Supports, each cell first in its own, and derivative weights, 1/m.
    out : (cells, 8) array
        Filled with h_x, h_y, u_x, u_y (s-1), v_x, v_y (s-1), least and largest depth of the support (m).
    """
    h, u, v = now
    for k in range(len(chosen)):
        i = np.uint64(chosen[np.uint64(k)])
        h_i, u_i, v_i = h[i], u[i], v[i]
        h_x = h_y = u_x = u_y = v_x = v_y = 0.0
        low = high = h_i
        wet_i = h_i > dry
        for m in range(1, neighbours.shape[1]):
            m_ = np.uint64(m)
            j = np.uint64(neighbours[i, m_])
            a, b, h_j = along[i, m_], across[i, m_], h[j]
            low, high = min(low, h_j), max(high, h_j)
            step = h_j - h_i
            h_x += a * step
            h_y += b * step
            moves = 1.0 if (h_j > dry) & wet_i else 0.0
            step = moves * (u[j] - u_i)
            u_x += a * step
            u_y += b * step
            step = moves * (v[j] - v_i)
            v_x += a * step
            v_y += b * step
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = h_x, h_y, u_x, u_y
        out[i, 4], out[i, 5], out[i, 6], out[i, 7] = v_x, v_y, low, high


@kernel()
def gather(
    now: Fields,
    slopes: Array,
    faces: Faces,
    chosen: Indices,
    start: int,
    count: int,
    dry: float,
    out: Gathered,
) -> None:
    """Collect the state on both sides of ``count`` faces from ``chosen[start]`` on, in their frames."""
    h, u, v = now
    g = faces.geometry
    for k in range(count):
        k_ = np.uint64(k)
        f = np.uint64(chosen[np.uint64(start) + k_])
        n_x, n_y, d_x, d_y = g[f, 0], g[f, 1], g[f, 2], g[f, 3]
        i, j = np.uint64(faces.left[f]), np.uint64(faces.right[f])
        out.h[0, k_], out.h[1, k_] = h[i], h[j]
        n_i, n_j = n_x * u[i] + n_y * v[i], n_x * u[j] + n_y * v[j]
        t_i, t_j = n_x * v[i] - n_y * u[i], n_x * v[j] - n_y * u[j]
        wet = 1.0 if (h[i] > dry) & (h[j] > dry) else 0.0
        out.n[0, k_], out.n[1, k_], out.t[0, k_], out.t[1, k_] = n_i, n_j, t_i, t_j
        out.n_ahead[0, k_], out.n_ahead[1, k_] = wet * (n_j - n_i), wet * (n_i - n_j)
        out.t_ahead[0, k_], out.t_ahead[1, k_] = wet * (t_j - t_i), wet * (t_i - t_j)
        out.part[0, k_], out.part[1, k_] = g[f, 4], g[f, 5]
        for side in range(2):
            c = i if side == 0 else j
            w_x, w_y = (d_x, d_y) if side == 0 else (-d_x, -d_y)
            o_x, o_y = (g[f, 6], g[f, 7]) if side == 0 else (g[f, 8], g[f, 9])
            out.h_gap[side, k_], out.h_off[side, k_] = (
                slopes[c, 0] * w_x + slopes[c, 1] * w_y,
                slopes[c, 0] * o_x + slopes[c, 1] * o_y,
            )
            u_gap, v_gap = slopes[c, 2] * w_x + slopes[c, 3] * w_y, slopes[c, 4] * w_x + slopes[c, 5] * w_y
            u_off, v_off = slopes[c, 2] * o_x + slopes[c, 3] * o_y, slopes[c, 4] * o_x + slopes[c, 5] * o_y
            out.n_gap[side, k_], out.t_gap[side, k_] = n_x * u_gap + n_y * v_gap, n_x * v_gap - n_y * u_gap
            out.n_off[side, k_], out.t_off[side, k_] = n_x * u_off + n_y * v_off, n_x * v_off - n_y * u_off
            out.low[side, k_], out.high[side, k_] = slopes[c, 6], slopes[c, 7]


@kernel()
def limited_step(gap: float, ahead: float, part: float, steepness: float) -> float:
    """Step from a cell's mean toward the cell beyond a face, to where the face stands.

    With ``2 gap - ahead`` for the difference to the cell behind it is `solver.reconstruction.limited`.

    Parameters
    ----------
    gap, ahead : float
        Difference to the cell beyond by the gradient, and the true one.
    part : float
        Part of the way to the cell beyond.
    steepness : float
        Largest multiple of half a neighbour's difference.
    """
    behind = 2.0 * gap - ahead
    near, far = abs(behind), abs(ahead)
    most = 0.5 * steepness * (near if near < far else far)
    wanted = part * abs(gap + AHEAD * (ahead - gap))
    size = wanted if wanted < most else most
    return math.copysign(size, ahead) if behind * ahead > 0.0 else 0.0


@kernel()
def reconstruct(values: Gathered, side: int, count: int, dry: float, h: Array, n: Array, t: Array) -> None:
    """Depth, normal and tangential velocity at the midpoints of a chunk of faces, seen from one side.

    Along the way to the cell beyond it is the reconstruction on a lattice, with its limiter, its minmod where
    the flow is being stopped and its rule at fronts; the rest follows the gradient. Depth stays within
    that of the support, and below twice the mean, as it does on a lattice.

    h, n, t : (CHUNK,) arrays
        Filled.
    """
    other, sign = 1 - side, 1.0 - 2.0 * side
    for k in range(count):
        k_ = np.uint64(k)
        mean, ahead = values.n[side, k_], values.n_ahead[side, k_]
        gap, part = values.n_gap[side, k_], values.part[side, k_]
        beyond = mean + ahead
        behind = beyond - 2.0 * gap
        slower = min(abs(beyond), abs(behind))
        steepness = 1.0 if slower < sign * (behind - beyond) else 2.0
        n[k_] = mean + limited_step(gap, ahead, part, steepness) + values.n_off[side, k_]
        step = values.h[other, k_] - values.h[side, k_]
        depth = values.h[side, k_] + limited_step(values.h_gap[side, k_], step, part, steepness)
        depth += values.h_off[side, k_]
        depth = depth if depth > values.low[side, k_] else values.low[side, k_]
        most = min(values.high[side, k_], 2.0 * values.h[side, k_])
        depth = depth if depth < most else most
        upstream = values.h[other, k_] - 2.0 * values.h_gap[side, k_]
        hidden = (values.h[other, k_] <= dry) & (values.h[side, k_] < FRONT * upstream)
        h[k_] = 0.0 if hidden else depth
        step = limited_step(values.t_gap[side, k_], values.t_ahead[side, k_], part, 2.0)
        t[k_] = values.t[side, k_] + step + values.t_off[side, k_]
