"""Buildings: cells without flow, whose faces are walls.

What flows beside a building sees its own mirror image there, as at a `wall` side of the domain: nothing
passes a face, and nothing drags along it. A cell may have buildings on several sides, and a building may be
one cell wide, so that images cannot stand in the cells of the building. They are made for one cell at a time,
and the kernels that know nothing of buildings are called on that cell alone.

A run without buildings has None for its walls. The kernels that are given walls are then compiled to nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.compiled import ONE, kernel
from solver.kernels.boundary import wall_flux
from solver.kernels.state import GHOSTS, Bed, FaceValues, Fields, Fluxes, Grid, Material, Status
from solver.lattice.ghosts import depth_at_wall
from solver.lattice.reconstruction import face_values
from solver.lattice.spans import Spans, trim
from solver.lattice.status import classify_run, copy_status
from solver.referenced import by_reference

WEST, EAST, SOUTH, NORTH = range(4)
# copies, since LLVM makes less of kernels over rows that are called from other places, too
reconstruct = kernel(as_source=True, cached=False)(face_values.py_func)
classify_cell = kernel(as_source=True, cached=False)(classify_run.py_func)


@by_reference
class Walls(NamedTuple):
    """Cells beside buildings, in the order of the padded lattice.

    Attributes
    ----------
    first
        (rows + 1,), where the cells of each padded row begin among these, and where the last ones end.
    cell
        (n,), their indices.
    blocked
        (n, 4), whether a building stands to the west, east, south and north.
    lean
        (n, 4), what gravity has over dry friction toward each side, times the distance to the next cell,
        m2 s-2: over ``beta`` it is the gain of depth by which something leans on a wall.
    images
        Flat arrays of the padded lattice for a cell and its neighbours.
    """

    first: Indices
    cell: Indices
    blocked: NDArray[np.bool_]
    lean: Array
    images: Fields


def walls_of(buildings: NDArray[np.bool_]) -> Walls:
    """Find the cells beside buildings; ``lean`` is for the caller to fill.

    Parameters
    ----------
    buildings : (rows, columns) array
        Whether a cell of the padded lattice is a building.
    """
    rows, columns = buildings.shape
    beside = np.zeros((rows, columns, 4), bool)
    beside[:, 1:, WEST] = buildings[:, :-1]
    beside[:, :-1, EAST] = buildings[:, 1:]
    beside[1:, :, SOUTH] = buildings[:-1]
    beside[:-1, :, NORTH] = buildings[1:]
    flows = beside.any(axis=2) & ~buildings
    flows[:GHOSTS] = flows[-GHOSTS:] = flows[:, :GHOSTS] = flows[:, -GHOSTS:] = False
    first = np.concatenate([[0], np.cumsum(flows.sum(axis=1))]).astype(np.int64)
    cell = np.flatnonzero(flows).astype(np.int64)
    blocked = np.ascontiguousarray(beside.reshape(-1, 4)[cell])
    images = Fields(*(np.zeros(rows * columns) for _ in range(3)))
    return Walls(first, cell, blocked, np.zeros(blocked.shape), images)


@kernel()
def close_x(walls: Walls | None, row: int, stride: int, along: FaceValues, fluxes: Fluxes, at: int) -> None:
    """Close the faces along x between a row and buildings.

    Parameters
    ----------
    walls, row, stride
        Cells beside buildings, the padded row and its length.
    along : FaceValues
        Of the row, by column.
    fluxes, at
        Changed in place; ``at`` is the index of the face before the first column.
    """
    if walls is None:
        return
    for n in range(walls.first[row], walls.first[row + 1]):
        c = walls.cell[n] - row * stride
        if walls.blocked[n, WEST]:
            push, pressed = wall_flux(along.h_low[c], -along.n_low[c], along.c[c])
            close_face(fluxes, at + c, push, pressed)
        if walls.blocked[n, EAST]:
            push, pressed = wall_flux(along.h_high[c], along.n_high[c], along.c[c])
            close_face(fluxes, at + c + 1, push, pressed)


@kernel()
def close_y(
    walls: Walls | None, row: int, stride: int, across: FaceValues, even: int, room: int,
    fluxes: Fluxes, at: int,
) -> None:  # fmt: skip
    """Close the faces along y between a row and the next one where one of both cells is a building.

    Parameters
    ----------
    across, even, room
        Face values of two rows, index of column 0 of the even one, which is first, and the length of each.
    fluxes, at
        Changed in place; ``at`` is the index of the face after the first column.
    """
    if walls is None:
        return
    for n in range(walls.first[row], walls.first[row + 1]):
        if walls.blocked[n, NORTH]:
            c = walls.cell[n] - row * stride
            k = even + (row % 2) * room + c
            push, pressed = wall_flux(across.h_high[k], across.n_high[k], across.c[k])
            close_face(fluxes, at + c, push, pressed)
    for n in range(walls.first[row + 1], walls.first[min(row + 2, len(walls.first) - 1)]):
        if walls.blocked[n, SOUTH]:
            c = walls.cell[n] - (row + 1) * stride
            k = even + ((row + 1) % 2) * room + c
            push, pressed = wall_flux(across.h_low[k], -across.n_low[k], across.c[k])
            close_face(fluxes, at + c, push, pressed)


@kernel()
def close_face(fluxes: Fluxes, face: int, push: float, pressed: float) -> None:
    """Let nothing but momentum through a face."""
    fluxes.mass[face] = fluxes.tangential[face] = 0.0
    fluxes.normal[face], fluxes.pressure[face] = push, pressed


@kernel()
def mirror(now: Fields, walls: Walls, n: int, stride: int, beta_x: float, beta_y: float) -> None:
    """Write a cell and its neighbours to the images, with its mirror images in place of buildings.

    Parameters
    ----------
    now : Fields
        State.
    n : int
        Number of the cell among ``walls``.
    beta_x, beta_y : float
        g cos(xi) K of the cell, m s-2.
    """
    i, images, steps = walls.cell[n], walls.images, (-1, 1, -stride, stride)
    images.h[i], images.u[i], images.v[i] = now.h[i], now.u[i], now.v[i]
    for side in range(4):
        k = i + steps[side]
        images.h[k], images.u[k], images.v[k] = now.h[k], now.u[k], now.v[k]
        if walls.blocked[n, side]:
            along = side < SOUTH
            images.h[k] = depth_at_wall(now.h[i], walls.lean[n, side] / (beta_x if along else beta_y))
            images.u[k], images.v[k] = -now.u[i] if along else now.u[i], now.v[i] if along else -now.v[i]


@kernel()
def faces_beside(
    now: Fields, walls: Walls | None, status: Status, row: int, stride: int, dry: float, along: bool,
    out: FaceValues, to: int,
) -> None:  # fmt: skip
    """Reconstruct the cells of a row that are beside buildings along one direction, with their images.

    Parameters
    ----------
    along : bool
        Whether the direction is x.
    out, to
        As of `solver.lattice.reconstruction.face_values`, by column.
    """
    if walls is None:
        return
    for n in range(walls.first[row], walls.first[row + 1]):
        one, other = (WEST, EAST) if along else (SOUTH, NORTH)
        if not (walls.blocked[n, one] or walls.blocked[n, other]):
            continue
        i = walls.cell[n]
        mirror(now, walls, n, stride, status.beta_x[i], status.beta_y[i])
        h, u, v = walls.images
        if along:
            reconstruct(h, u, v, status.beta_x, i, ONE, ONE, dry, out, to + i - row * stride)
        else:
            reconstruct(h, v, u, status.beta_y, i, stride, ONE, dry, out, to + i - row * stride)


@kernel()
def classify_beside(
    now: Fields, status: Status, bed: Bed, material: Material, grid: Grid, walls: Walls | None, spans: Spans
) -> float:
    """Set earth pressure and status of the cells beside buildings again, with their images.

    Returns
    -------
    float
        Largest wave rate of them, s-1; 0 without buildings.
    """
    if walls is None:
        return 0.0
    m, fastest = grid.stride, 0.0
    for j in range(GHOSTS, grid.rows - GHOSTS):
        lo, hi = spans.wet[0, j], spans.wet[1, j]
        if lo >= hi or walls.first[j] == walls.first[j + 1]:
            continue
        for n in range(walls.first[j], walls.first[j + 1]):
            i = walls.cell[n]
            c = i - j * m
            if not lo <= c < hi:
                continue
            mirror(now, walls, n, m, status.beta_x[i], status.beta_y[i])
            classify_cell(walls.images, status, bed, material, grid, spans.rate, i, c, ONE)
            fastest = max(fastest, spans.rate[c])
            if c == GHOSTS:
                copy_status(status, i - 1, i, ONE)
            if c == m - GHOSTS - 1:
                copy_status(status, i + 1, i, ONE)
            if j == GHOSTS:
                copy_status(status, i - m, i, ONE)
            if j == grid.rows - GHOSTS - 1:
                copy_status(status, i + m, i, ONE)
        trim(spans, j, status.static, j * m)
    return fastest
