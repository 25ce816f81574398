"""Buildings on a surface: what flows beside one sees its mirror image in the frame of the edge between."""

from __future__ import annotations

import numpy as np

from solver.arrays import Array
from solver.compiled import ONE, kernel
from solver.kernels.state import GHOSTS, FaceValues, Fields, Grid, Material
from solver.lattice.ghosts import depth_at_wall
from solver.lattice.spans import Spans, trim
from solver.lattice.walls import EAST, NORTH, SOUTH, WEST, Walls
from solver.surface.metric import EdgeFrames, Metric
from solver.surface.pressure import Pressure, over_edges
from solver.surface.reconstruction import Levels, edge_values
from solver.surface.status import classify_row

# copies, as in `solver.lattice.walls`
reconstruct = kernel(as_source=True, cached=False)(edge_values.py_func)
classify_cell = kernel(as_source=True, cached=False)(classify_row.py_func)


def set_walls(
    walls: Walls, metric: Metric, pressure: Pressure | None, stride: int, spacing: float, tangent: float
) -> None:
    """Fill ``lean``, and give the far sides of edges at buildings the frame of the edge itself.

    There an image is written as its velocity along and across the edge. What stands for a building has no
    tilt: a level surface goes as far as the wall.

    Parameters
    ----------
    walls, metric, pressure
        Changed in place.
    stride, spacing
        Length of a padded row, and side of a cell in plan, m.
    tangent : float
        tan(delta).
    """
    x, y, i = metric.x_edges, metric.y_edges, walls.cell
    sides = (
        (WEST, -1.0, (x.c_high, x.s_high, i - 1), (x.c_low, x.s_low), i - 1),
        (EAST, 1.0, (x.c_low, x.s_low, i), (x.c_high, x.s_high), i + 1),
        (SOUTH, -1.0, (y.c_high, y.s_high, i - stride), (y.c_low, y.s_low), i - stride),
        (NORTH, 1.0, (y.c_low, y.s_low, i), (y.c_high, y.s_high), i + stride),
    )
    tilts = [metric.tilt_x, metric.tilt_y, *(() if pressure is None else (pressure.tilt_x, pressure.tilt_y))]
    for side, outward, (c, s, edge), (far_c, far_s), beyond in sides:
        pull = outward * (c[edge] * metric.g_1[i] + s[edge] * metric.g_2[i])
        over = np.sign(pull) * np.maximum(0.0, np.abs(pull) - metric.g_n[i] * tangent)
        # the slope of depth along the bed that a slope in plan is
        steepness = np.hypot(metric.p[i], metric.r[i]) if side < SOUTH else metric.q[i]
        walls.lean[:, side] = over * spacing / steepness
        at = edge[walls.blocked[:, side]]
        far_c[at], far_s[at] = 1.0, 0.0
        for tilt in tilts:
            tilt[beyond[walls.blocked[:, side]]] = 0.0


@kernel()
def mirror_at_edges(now: Fields, walls: Walls, beta: Array, edges: EdgeFrames, n: int, step: int) -> None:
    """Write a cell and its two neighbours across edges of one direction to the images, as `mirror` does.

    Parameters
    ----------
    beta : flat array
        Pressure on these edges, g_n K, m s-2.
    edges, step
        Of the direction, and the distance in memory to the neighbour ahead.
    n : int
        Number of the cell among ``walls``.
    """
    i, images = walls.cell[n], walls.images
    h, u, v = now.h[i], now.u[i], now.v[i]
    images.h[i], images.u[i], images.v[i] = h, u, v
    low, high = (WEST, EAST) if step == 1 else (SOUTH, NORTH)
    k = i - step
    images.h[k], images.u[k], images.v[k] = now.h[k], now.u[k], now.v[k]
    if walls.blocked[n, low]:
        c, s = edges.c_high[k], edges.s_high[k]
        images.h[k] = depth_at_wall(h, walls.lean[n, low] / beta[i])
        images.u[k], images.v[k] = -(c * u + s * v), c * v - s * u
    k = i + step
    images.h[k], images.u[k], images.v[k] = now.h[k], now.u[k], now.v[k]
    if walls.blocked[n, high]:
        c, s = edges.c_low[i], edges.s_low[i]
        images.h[k] = depth_at_wall(h, walls.lean[n, high] / beta[i])
        images.u[k], images.v[k] = -(c * u + s * v), c * v - s * u


@kernel()
def edges_beside(
    now: Fields, walls: Walls | None, beta: Array, tilt: Array, edges: EdgeFrames, row: int, stride: int,
    step: int, dry: float, levels: Levels, out: FaceValues, to: int,
) -> None:  # fmt: skip
    """Reconstruct the cells of a row that are beside buildings along one direction, with their images.

    Parameters
    ----------
    step : int
        Distance in memory to the neighbour ahead: 1 along x, ``stride`` along y.
    out, to
        As of `solver.surface.reconstruction.edge_values`, by column.
    """
    if walls is None:
        return
    low, high = (WEST, EAST) if step == 1 else (SOUTH, NORTH)
    for n in range(walls.first[row], walls.first[row + 1]):
        if walls.blocked[n, low] or walls.blocked[n, high]:
            i = walls.cell[n]
            mirror_at_edges(now, walls, beta, edges, n, step)
            h, u, v = walls.images
            reconstruct(h, u, v, beta, tilt, edges, i, step, ONE, dry, levels, out, to + i - row * stride)


@kernel()
def classify_edges_beside(
    now: Fields,
    static: Array,
    pressure: Pressure | None,
    metric: Metric,
    material: Material,
    grid: Grid,
    walls: Walls | None,
    spans: Spans,
) -> float:
    """Set the status of the cells beside buildings again, with their images.

    Returns
    -------
    float
        Largest wave rate of them, s-1; 0 without buildings.
    """
    if walls is None:
        return 0.0
    m, fastest = grid.stride, 0.0
    beta_x, beta_y = over_edges(pressure, metric.g_n)
    for j in range(GHOSTS, grid.rows - GHOSTS):
        lo, hi = spans.wet[0, j], spans.wet[1, j]
        if lo >= hi or walls.first[j] == walls.first[j + 1]:
            continue
        for n in range(walls.first[j], walls.first[j + 1]):
            i = walls.cell[n]
            if not lo <= i - j * m < hi:
                continue
            mirror_at_edges(now, walls, beta_x, metric.x_edges, n, ONE)
            mirror_at_edges(now, walls, beta_y, metric.y_edges, n, m)
            classify_cell(
                walls.images, static, pressure, metric, material, grid, spans.rate, i, i - j * m, ONE
            )
            fastest = max(fastest, spans.rate[i - j * m])
        trim(spans, j, static, j * m)
    return fastest
