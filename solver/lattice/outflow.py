"""What a row of cells can afford to give: the positivity limiter on a lattice and on a surface.

What a cell has in a stage is its depth in it, and of its depth at the start of the step what the stage keeps.
"""

from __future__ import annotations

import numpy as np

from solver.arrays import Array, Indices
from solver.compiled import kernel
from solver.kernels.limiter import EMPTIED, SMALLEST, TOO_MUCH, afforded, mean_velocity
from solver.kernels.runge_kutta import can_give
from solver.kernels.state import Fields, Fluxes, Grid

# Length of each edge (m), and its conormal in the frame of the cell on its low side and on its high side.
Frames = tuple[Array, Array, Array, Array, Array]


@kernel(unaliased=True)
def outflow_exceeds(
    h: Array,
    per_area: Array | None,
    cell: int,
    count: int,
    x_mass: Array,
    west: int,
    y_mass: Array,
    south: int,
    north: int,
    dt: float,
    grid: Grid,
    lost: Array,
    to: int,
) -> bool:
    """Find the depth that each cell of a row would lose in a time step, and whether some runs dry.

    Parameters
    ----------
    h : flat array
        Depth, m.
    per_area : flat array or None
        One over the areas of cells, m-2, where fluxes are times the lengths of edges; otherwise None.
    cell, count : int
        Index of the first cell, and number of cells.
    x_mass, west, y_mass, south, north
        Mass fluxes (m2 s-1, of edges m3 s-1) and the indices of the first cell's faces.
    dt : float
        Time step, s.
    lost, to
        Filled with depths, m, from index ``to`` on.

    Returns
    -------
    bool
        Whether a cell would lose more than the share EMPTIED of its depth.
    """
    over_x, over_y = dt / grid.dx, dt / grid.dy
    short = 0
    for k in range(count):
        i = np.uint64(k)
        c = np.uint64(cell) + i
        w, e = x_mass[np.uint64(west) + i], x_mass[np.uint64(west + 1) + i]
        s, n = y_mass[np.uint64(south) + i], y_mass[np.uint64(north) + i]
        out_x = (e if e > 0.0 else 0.0) - (w if w < 0.0 else 0.0)
        out_y = (n if n > 0.0 else 0.0) - (s if s < 0.0 else 0.0)
        if per_area is None:  # noqa: SIM108
            loss = out_x * over_x + out_y * over_y
        else:
            loss = (out_x + out_y) * (dt * per_area[c])
        lost[np.uint64(to) + i] = loss
        short |= 1 if loss > EMPTIED * h[c] else 0
    return short != 0


@kernel()
def note_emptied(
    h: Array,
    start: Array,
    start_weight: float,
    cell: int,
    column: int,
    count: int,
    lost: Array,
    row: int,
    emptied: Indices,
) -> None:
    """Note which cells of a row run dry, and the shares that they would lose of what they have.

    Parameters
    ----------
    h, start : flat arrays
        Depth in this stage and at the start of the step, m.
    start_weight : float
        From `solver.kernels.runge_kutta.weight_of_start`.
    cell, column, count : int
        Index of the first cell, its column, number of cells.
    lost : array
        From `outflow_exceeds`; that of the first column of the row has the index ``row``.
    emptied : array
        From the index ``row`` on it is given the number of these cells, and their columns.
    """
    found = 0
    for k in range(count):
        depth = can_give(h[cell + k], start[cell + k], start_weight)
        if lost[row + column + k] > EMPTIED * depth:
            lost[row + column + k] = lost[row + column + k] / depth if depth > SMALLEST else TOO_MUCH
            found += 1
            emptied[row + found] = column + k
    emptied[row] = found


@kernel(inline=True)
def limit_face(fluxes: Fluxes, face: int, share: float, n: float, t: float) -> None:
    """Replace mass and momentum fluxes by what the cell that they leave can afford; pressure stays.

    Parameters
    ----------
    fluxes, face
        Fluxes, changed in place, and the index of the face.
    share : float
        Of what the cell has that it would lose.
    n, t : float
        Its velocity along the direction and across it, m s-1.
    """
    fluxes.mass[face], fluxes.normal[face], fluxes.tangential[face] = afforded(
        (fluxes.mass[face], fluxes.normal[face], fluxes.tangential[face]), share, n, t
    )


@kernel(inline=True)
def through_x(frames: Frames | None, edge: int, high: bool, u: float, v: float) -> tuple[float, float]:
    """Velocity of a cell through a face in x and along it, m s-1, in the order of the fluxes.

    Parameters
    ----------
    frames : Frames or None
        Of the edges of a surface.
    edge : int
        Index of the edge: that of the cell on its low side.
    high : bool
        Whether the velocity is that of the cell on the high side.
    """
    if frames is None:
        return u, v
    _, c_low, s_low, c_high, s_high = frames
    c, s = (c_high[edge], s_high[edge]) if high else (c_low[edge], s_low[edge])
    return c * u + s * v, c * v - s * u


@kernel(inline=True)
def through_y(frames: Frames | None, edge: int, high: bool, u: float, v: float) -> tuple[float, float]:
    """Velocity of a cell through a face in y and along it, as `through_x`."""
    if frames is None:
        return v, u
    n, t = through_x(frames, edge, high, u, v)
    return n, t


@kernel()
def limit_outflow(
    x_fluxes: Fluxes,
    y_fluxes: Fluxes,
    ring: int,
    below: int,
    lost: Array,
    emptied: Indices,
    start: Fields,
    now: Fields,
    start_weight: float,
    x_frames: Frames | None,
    y_frames: Frames | None,
    row: int,
    stride: int,
    lowest: bool,
) -> None:
    """Replace fluxes along a row, and between it and the one before, by what cells can afford.

    A face that carries no mass leaves no cell, and keeps the impulse of a wall or of two flows that meet.

    Parameters
    ----------
    x_fluxes, y_fluxes : Fluxes
        Changed in place.
    ring, below : int
        Where the row, and the one before, begin in buffers.
    lost, emptied : array
        From `note_emptied`.
    start, now, start_weight
        State at the start of the step and of this stage; as for `note_emptied`.
    x_frames, y_frames : Frames or None
        Of the edges of a surface, in each direction.
    row : int
        Index of the row's first cell.
    stride : int
        Distance to the row before.
    lowest : bool
        Whether there is no row before.
    """
    for k in range(emptied[ring]):
        c = emptied[ring + 1 + k]
        i, share = row + c, lost[ring + c]
        u, v = mean_velocity(start, now, start_weight, i)
        if x_fluxes.mass[ring + c] < 0.0:
            n, t = through_x(x_frames, i - 1, True, u, v)
            limit_face(x_fluxes, ring + c, share, n, t)
        if x_fluxes.mass[ring + c + 1] > 0.0:
            n, t = through_x(x_frames, i, False, u, v)
            limit_face(x_fluxes, ring + c + 1, share, n, t)
        if y_fluxes.mass[below + c] < 0.0:
            n, t = through_y(y_frames, i - stride, True, u, v)
            limit_face(y_fluxes, below + c, share, n, t)
    if lowest:
        return
    for k in range(emptied[below]):
        c = emptied[below + 1 + k]
        i, share = row - stride + c, lost[below + c]
        u, v = mean_velocity(start, now, start_weight, i)
        if y_fluxes.mass[below + c] > 0.0:
            n, t = through_y(y_frames, i, False, u, v)
            limit_face(y_fluxes, below + c, share, n, t)
