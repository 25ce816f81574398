"""Cells lifted on to a surface: their frames, areas and gravity, and the frames of the edges between them.

A cell of the lattice in plan becomes a quadrilateral through its four corners. Its velocity is a tangent
vector with two components in the frame of the cell: ``e1`` lies over the direction x, and ``e2 = n x e1``.
At an edge both cells show their velocity along and across the common edge, each in its own plane. That is
what one finds by unfolding the two planes about the edge, which is parallel transport: the momentum balance
needs no curvature, and transport makes no energy.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, in_one_block, with_beside
from solver.physics.elevation import Surface, plan_slopes, tangents


class EdgeFrames(NamedTuple):
    """Edges between a cell and the next one, each array flat, at the index of the cell on the low side.

    Parameters
    ----------
    length : array
        In m.
    c_low, s_low, c_high, s_high : array
        Components of the unit conormal, which points to the high side, in the frame of the cell on either
        side. The tangent has the components (-s, c).
    """

    length: Array
    c_low: Array
    s_low: Array
    c_high: Array
    s_high: Array


class Metric(NamedTuple):
    """What the kernels know of the surface, flat arrays of the padded lattice.

    Parameters
    ----------
    per_area : array
        In m-2.
    g_1, g_2, g_n : array
        Gravity along e1 and e2 and normal to the bed, m s-2.
    k_11, k_12, k_22 : array
        Normal curvature, m-1, positive in hollows.
    p, r, q : array
        The slope of depth in the cell's frame is ``(p h_x, r h_x + q h_y)`` with the derivatives in plan.
    falling : array
        Wave rate that gives the longest step from rest, s-1.
    tilt_x, tilt_y : array
        Depth that a level surface gains from the middle of a cell to its high edge, along x and y, m.
    drain : array
        1 + number of the side that takes what reaches the cell, 0 for none.
    x_edges, y_edges : EdgeFrames
        Edges to the next cell along x and y.
    """

    per_area: Array
    g_1: Array
    g_2: Array
    g_n: Array
    k_11: Array
    k_12: Array
    k_22: Array
    p: Array
    r: Array
    q: Array
    falling: Array
    tilt_x: Array
    tilt_y: Array
    drain: NDArray[np.int8]
    x_edges: EdgeFrames
    y_edges: EdgeFrames


def metric_of(
    surface: Surface,
    corners: Array,
    x: Array,
    y: Array,
    spacing: float,
    drain: NDArray[np.int8],
    gravity: float,
    tangent: float,
    cfl: float,
) -> Metric:
    """Lift the cells around the points x (n,) by y (m,), ghosts included, on to a surface.

    Parameters
    ----------
    surface : Surface
        The bed.
    corners : (m + 1, n + 1) array
        Its elevation at the corners of the cells, m.
    x, y : array
        Points of the lattice in plan, m.
    spacing : float
        Side of a cell in plan, m.
    drain : (m, n) array
        1 + number of the side that takes what reaches a cell, 0 for none.
    gravity : float
        Gravitational acceleration, m s-2.
    tangent, cfl : float
        tan(delta), and the Courant number: what bounds the first step from rest.
    """
    b_x, b_y = plan_slopes(corners, spacing)
    w = np.sqrt(1.0 + (b_x * b_x + b_y * b_y))
    level = np.sqrt(1.0 + b_x * b_x)
    normal = np.stack([-b_x / w, -b_y / w, 1.0 / w])
    e_1, e_2 = tangents(b_x, b_y)
    area = spacing * spacing * w
    g_1, g_2, g_n = -gravity * e_1[2], -gravity * e_2[2], gravity / w
    z_xx, z_xy, z_yy = surface.hessian(x, y)

    def bend(a: Array, b: Array) -> Array:
        return np.asarray((a[0] * (z_xx * b[0] + z_xy * b[1]) + a[1] * (z_xy * b[0] + z_yy * b[1])) / w)

    excess = np.maximum(0.0, np.hypot(g_1, g_2) - g_n * tangent)
    falling = with_beside(np.sqrt(cfl * excess / spacing)).ravel()
    drop = corners[1:, 1:-1] - corners[:-1, 1:-1]
    along_y = np.stack([np.zeros_like(drop), np.full_like(drop, spacing), drop])
    drop = corners[1:-1, :-1] - corners[1:-1, 1:]
    along_x = np.stack([np.full_like(drop, -spacing), np.zeros_like(drop), drop])
    frames = normal, e_1, e_2
    x_edges = _edge_frames(along_y, *([f[:, :, k] for f in frames] for k in (slice(-1), slice(1, None))))
    y_edges = _edge_frames(along_x, *([f[:, k] for f in frames] for k in (slice(-1), slice(1, None))))
    shape = b_x.shape
    metric = Metric(
        per_area=_flat(1.0 / area),
        g_1=_flat(g_1),
        g_2=_flat(g_2),
        g_n=_flat(g_n),
        k_11=_flat(bend(e_1, e_1)),
        k_12=_flat(bend(e_1, e_2)),
        k_22=_flat(bend(e_2, e_2)),
        p=_flat(1.0 / level),
        r=_flat(e_2[0]),
        q=_flat(level / w),
        falling=falling,
        tilt_x=_flat(-0.5 * spacing * w * b_x),
        tilt_y=_flat(-0.5 * spacing * w * b_y),
        drain=drain.ravel(),
        x_edges=_padded(x_edges, (spacing, 1, 0, 1, 0), shape),
        y_edges=_padded(y_edges, (spacing, 0, 1, 0, 1), shape),
    )
    return _in_one_block(metric)


def _in_one_block(metric: Metric) -> Metric:
    *cells, drain, x, y = metric
    placed = in_one_block([*cells, *x, *y])
    n, m = len(cells), len(cells) + len(x)
    return Metric._make([*placed[:n], drain, EdgeFrames(*placed[n:m]), EdgeFrames(*placed[m:])])


def _flat(values: Array) -> Array:
    return np.ascontiguousarray(values).ravel()


def _edge_frames(edge: Array, low: list[Array], high: list[Array]) -> list[Array]:
    """Lengths of edges (3, m, n), and their conormals in the frames of the cells on both sides."""
    length = np.sqrt((edge * edge).sum(0))
    found = [length]
    for normal, e_1, e_2 in (low, high):
        along = edge / length
        along = along - (along * normal).sum(0) * normal
        along = along / np.sqrt((along * along).sum(0))
        found += [(along * e_2).sum(0), -(along * e_1).sum(0)]
    return found


def _padded(edges: list[Array], fills: tuple[float, ...], shape: tuple[int, int]) -> EdgeFrames:
    """Give edges between cells the number of the cell on their low side; ``fills`` where there is none."""
    laid = [np.full(shape, float(fill)) for fill in fills]
    for full, values in zip(laid, edges, strict=True):
        full[: values.shape[0], : values.shape[1]] = values
    return EdgeFrames(*(full.ravel() for full in laid))
