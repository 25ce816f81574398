"""Which cells of each row are wet, move and are stepped, and what is asked of these spans."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.compiled import kernel
from solver.kernels.runge_kutta import less_moving
from solver.kernels.state import DEPTH, DRY, GHOSTS, LANES, Fields, Grid, Sides
from solver.lattice.symmetry import images
from solver.referenced import by_reference


@by_reference
class Spans(NamedTuple):
    """Half-open column ranges of each padded row, shape (2, ny + 4): of wet, of moving, of stepped cells.

    Attributes
    ----------
    rate
        (nx + 4,) array, largest wave rate of each column in this step, s-1.
    """

    wet: Indices
    moving: Indices
    stepped: Indices
    rate: Array


@kernel()
def hull(spans: Indices, first: int, last: int) -> tuple[int, int]:
    """Smallest range that covers spans (2, rows) of rows ``first`` to ``last``; (0, 0) if all are empty."""
    lo, hi = 1 << 60, 0
    for j in range(max(first, 0), min(last, spans.shape[1] - 1) + 1):
        if spans[0, j] < spans[1, j]:
            lo, hi = min(lo, spans[0, j]), max(hi, spans[1, j])
    return (lo, hi) if lo < hi else (0, 0)


@kernel()
def trim(spans: Spans, j: int, static: Array, start: int) -> None:
    """Trim the wet span of row ``j``, which begins at index ``start``, and find the moving one within it.

    Parameters
    ----------
    static : (cells,) array
        Status; 0 where a cell moves.
    """
    lo, hi = spans.wet[0, j], spans.wet[1, j]
    while lo < hi and static[start + lo] == DRY:
        lo += 1
    while lo < hi and static[start + hi - 1] == DRY:
        hi -= 1
    # an empty span is written in one way, whatever it was trimmed from
    lo, hi = (lo, hi) if lo < hi else (0, 0)
    spans.wet[0, j], spans.wet[1, j] = lo, hi
    while lo < hi and static[start + lo] != 0.0:
        lo += 1
    while lo < hi and static[start + hi - 1] != 0.0:
        hi -= 1
    spans.moving[0, j], spans.moving[1, j] = (lo, hi) if lo < hi else (0, 0)


@kernel()
def spread(spans: Spans, static: Array, sides: Sides, grid: Grid) -> tuple[int, int, int]:
    """Set the spans to be stepped: moving cells and their neighbours, within the domain, in whole vectors.

    Returns
    -------
    tuple of int
        First and last row to be stepped (first > last if nothing moves) and the number of cells.
    """
    m, g = grid.stride, GHOSTS
    first, last, cells = grid.rows, -1, 0
    for j in range(g, grid.rows - g):
        lo, hi = m, 0
        if spans.moving[0, j] < spans.moving[1, j]:
            lo, hi = spans.moving[0, j] - 1, spans.moving[1, j] + 1
        # a given depth may drive what is beside it
        if sides.kind[0] == DEPTH and static[j * m + g - 1] == 0.0:
            lo, hi = g, max(hi, g + 1)
        if sides.kind[1] == DEPTH and static[j * m + m - g] == 0.0:
            lo, hi = min(lo, m - g - 1), m - g
        for k in (j - 1, j + 1):
            if g <= k < grid.rows - g:
                if spans.moving[0, k] < spans.moving[1, k]:
                    lo, hi = min(lo, spans.moving[0, k]), max(hi, spans.moving[1, k])
            elif sides.kind[2 if k < g else 3] == DEPTH:
                for i in range(g, m - g):
                    if static[k * m + i] == 0.0:
                        lo, hi = min(lo, i), max(hi, i + 1)
        lo, hi = max(lo, g), min(hi, m - g)
        width = -(-(hi - lo) // LANES) * LANES
        hi = min(lo + width, m - g) if lo < hi else hi
        lo = max(hi - width, g) if lo < hi else lo
        spans.stepped[0, j] = spans.stepped[1, j] = 0
        if lo < hi:
            spans.stepped[0, j], spans.stepped[1, j] = lo, hi
            first, last, cells = min(first, j), j, cells + hi - lo
            if spans.wet[0, j] < spans.wet[1, j]:
                lo, hi = min(lo, spans.wet[0, j]), max(hi, spans.wet[1, j])
            spans.wet[0, j], spans.wet[1, j] = lo, hi
    return first, last, cells


@kernel()
def comes_to(spans: Indices, grid: Grid, sides: NDArray[np.bool_], first: int, last: int) -> bool:
    """Whether the spans of rows ``first`` to ``last`` reach an outermost cell of one of the chosen sides."""
    if (sides[2] and first <= GHOSTS) or (sides[3] and last >= grid.rows - GHOSTS - 1):
        return True
    for j in range(first, last + 1):
        if spans[0, j] < spans[1, j] and (
            (sides[0] and spans[0, j] <= GHOSTS) or (sides[1] and spans[1, j] >= grid.stride - GHOSTS)
        ):
            return True
    return False


@kernel()
def moving_volume_exceeds(
    now: Fields, static: Array, spans: Spans, sides: Sides, grid: Grid, volume: float, started: bool
) -> bool:
    """Whether cells that are not static hold more than a volume, m3, or a given depth drives a side.

    Parameters
    ----------
    volume
        The volume, m3.
    started
        Whether the run has taken a step, after which one of the cells has to move.
    """
    m, depth, moves = grid.stride, volume / (grid.dx * grid.dy), not started
    for j in range(GHOSTS, grid.rows - GHOSTS):
        both = images(sides, j)
        for i in range(j * m + spans.moving[0, j], j * m + spans.moving[1, j]):
            depth, moves = less_moving(depth, moves, static[i], both * now.h[i], now.u[i], now.v[i])
            if moves and depth < 0.0:
                return True
        for k, ghost in ((0, GHOSTS - 1), (1, m - GHOSTS)):
            if sides.kind[k] == DEPTH and static[j * m + ghost] == 0.0:
                return True
    for k, ghost in ((2, GHOSTS - 1), (3, grid.rows - GHOSTS)):
        for i in range(GHOSTS, m - GHOSTS):
            if sides.kind[k] == DEPTH and static[ghost * m + i] == 0.0:
                return True
    return False


@kernel()
def copy_surroundings(
    source: Fields, target: Fields, spans: Indices, grid: Grid, first: int, last: int
) -> None:
    """Copy the cells beside the spans that a stage reads but does not step."""
    m = grid.stride
    for j in range(max(first - GHOSTS, 0), min(last + GHOSTS, grid.rows - 1) + 1):
        a, b = hull(spans, j - GHOSTS, j + GHOSTS)
        lo, hi = max(a - GHOSTS, 0), min(b + GHOSTS, m)
        inner, outer = (spans[0, j], spans[1, j]) if spans[0, j] < spans[1, j] else (hi, hi)
        for start, stop in ((lo, inner), (outer, hi)):
            for i in range(j * m + start, j * m + stop):
                target.h[i], target.u[i], target.v[i] = source.h[i], source.u[i], source.v[i]
