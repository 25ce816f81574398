"""Ghost cells: what the flow sees beyond the four sides of a lattice."""

from __future__ import annotations

import numpy as np

from solver.arrays import Array, Indices
from solver.compiled import ONE, kernel
from solver.kernels.boundary import along_at_depth, leaving_at_depth
from solver.kernels.state import (
    AXIS,
    DEPTH,
    EVEN,
    GHOSTS,
    NO_SLIP,
    OPEN,
    WALL,
    Fields,
    Grid,
    Sides,
)
from solver.lattice.spans import hull


@kernel()
def depth_at_wall(h: float, rise: float) -> float:
    """Depth of a ghost beyond a wall that supports its image, m.

    On a slope steeper than friction what lies against a wall is deeper toward it. Ghosts continue the least
    such slope, since the mirror image alone would carry half of the weight and never let it rest. The depth
    is at most twice that of the image, which may be too thin to lie against the wall over its whole cell:
    the wall would push it off otherwise.

    Parameters
    ----------
    h : float
        Depth of the image, m.
    rise : float
        Gain of depth from the image to the ghost, m.
    """
    return min(max(0.0, h + rise), 2.0 * h)


@kernel()
def ghosts_beyond(
    h: Array,
    n: Array,
    t: Array,
    cell: int,
    outward: int,
    kind: int,
    depth: float,
    beta: float,
    rise: float,
    fastest: float,
    forth: float,
    back: float,
) -> None:
    """Fill the ghosts beyond one outermost cell.

    Parameters
    ----------
    h, n, t : flat arrays
        Depth, velocity along the line through the side and across it.
    cell, outward : int
        Index of the cell and distance in memory to the first ghost.
    kind : int
        OPEN continues the velocity, DEPTH the invariant; WALL mirrors the normal, NO_SLIP both velocities.
    depth, beta : float
        Depth outside a DEPTH side, m, and g cos(xi) K of the cell, m s-2.
    rise : float
        Change of depth per spacing outward that gravity needs at a wall, m.
    fastest, forth, back : float
        Of `Sides`, m s-1: that of the side, and ``alongside`` it and against it.
    """
    for k in range(GHOSTS):
        ghost, mirror = cell + (k + 1) * outward, cell - k * outward
        if kind in (WALL, NO_SLIP):
            h[ghost], n[ghost] = depth_at_wall(h[mirror], (2 * k + 1) * rise), -n[mirror]
            t[ghost] = -t[mirror] if kind == NO_SLIP else t[mirror]
        elif kind == OPEN:
            h[ghost], n[ghost], t[ghost] = h[cell], n[cell], t[cell]
        else:
            sign = 1.0 if outward > 0 else -1.0
            h[ghost], t[ghost] = depth, along_at_depth(t[cell], depth, beta, forth, back)
            n[ghost] = sign * leaving_at_depth(sign * n[cell], h[cell], depth, beta, fastest)


@kernel(unaliased=True)
def ghost_row(h: Array, n: Array, t: Array, ghost: int, source: int, count: int, kind: int) -> None:
    """Fill a run of ghosts beyond a side along x with their images, as `ghosts_beyond` without a rise.

    AXIS and MIDLINE mirror as a WALL does, EVEN continues as OPEN does.

    Parameters
    ----------
    ghost, source : int
        Index of the first ghost and of its image.
    count, kind : int
        Number of ghosts, kind of the side.
    """
    sign_n, sign_t = 1.0 if kind in (OPEN, EVEN) else -1.0, -1.0 if kind == NO_SLIP else 1.0
    for k in range(count):
        g, i = np.uint64(ghost) + np.uint64(k), np.uint64(source) + np.uint64(k)
        h[g], n[g], t[g] = h[i], sign_n * n[i], sign_t * t[i]


@kernel()
def fill_ghosts(
    now: Fields,
    beta_x: Array,
    beta_y: Array,
    sides: Sides,
    grid: Grid,
    spans: Indices,
    first: int,
    last: int,
) -> None:
    """Fill the ghosts of rows ``first`` to ``last``, and the ghost rows near them, where spans come near.

    A given depth is seen also by what is dry.

    Parameters
    ----------
    beta_x, beta_y : flat arrays
        g cos(xi) K (eq. 7), m s-2, of the padded lattice.
    spans : (2, ny + 4) array
        Cells whose faces or slopes are asked for.
    """
    h, u, v = now
    m, rows = grid.stride, grid.rows
    kind, depth, excess = sides.kind, sides.depth, sides.excess
    fastest, along = sides.fastest, sides.alongside
    for j in range(max(first - GHOSTS, 0), min(last + GHOSTS, rows - 1) + 1):
        filled = spans[0, j] < spans[1, j]
        if kind[0] == DEPTH or (filled and spans[0, j] < 2 * GHOSTS):
            cell = j * m + GHOSTS
            rise = -excess[0] * grid.dx / beta_x[cell]
            bounds = fastest[0], along[2], along[3]
            ghosts_beyond(h, u, v, cell, -ONE, kind[0], depth[0], beta_x[cell], rise, *bounds)
        if kind[1] == DEPTH or (filled and spans[1, j] > m - 2 * GHOSTS):
            cell = j * m + m - GHOSTS - 1
            rise = excess[1] * grid.dx / beta_x[cell]
            bounds = fastest[1], along[2], along[3]
            ghosts_beyond(h, u, v, cell, ONE, kind[1], depth[1], beta_x[cell], rise, *bounds)
    for k, row, way in ((2, GHOSTS, -1), (3, rows - GHOSTS - 1, 1)):
        if (k == 2 and first >= 2 * GHOSTS) or (k == 3 and last < rows - 2 * GHOSTS):
            continue
        if kind[k] == DEPTH:
            bounds = fastest[k], along[0], along[1]
            for cell in range(row * m, row * m + m):
                ghosts_beyond(h, v, u, cell, way * m, kind[k], depth[k], beta_y[cell], 0.0, *bounds)
            continue
        a, b = hull(spans, min(row, row - way), max(row, row - way))
        for i in range(GHOSTS):
            ghost, image = row + (i + 1) * way, row - (i + 1 if kind[k] == AXIS else i) * way
            source = row if kind[k] in (OPEN, EVEN) else image
            ghost_row(h, v, u, ghost * m + a, source * m + a, b - a, kind[k])
