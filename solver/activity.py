"""Which cells take part in a step: what is dry, what friction holds, what its neighbours can reach."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.boundary import AXIS, DEPTH, GHOSTS, Fields, Grid, Sides, fill_ghosts
from solver.compiled import Array, kernel
from solver.spans import Spans

# Round-off allowed where a drive exactly at the friction limit must count as held (slope = friction angle).
HOLDS = 1.0 + 1e-12


class Bed(NamedTuple):
    """Along x, padded shape (nx + 4,): g sin xi, g cos xi (m s-2), the curvature kappa (m-1).

    falling : wave rate (s-1) that gives the longest step from rest, from `falling_rate`.
    """

    along: Array
    normal: Array
    curvature: Array
    falling: Array


class Material(NamedTuple):
    """Friction and its limits.

    tangent : tan(delta). drag : g / turbulent friction, 0 for dry friction, dimensionless.
    pressure : the six earth-pressure coefficients, in the order of `PressureCoefficients`.
    dry : depth up to which a cell counts as dry and does not move, m.
    """

    tangent: float
    drag: float
    pressure: tuple[float, float, float, float, float, float]
    dry: float


class Status(NamedTuple):
    """What each cell is in this step, flat arrays of the padded lattice.

    beta_x, beta_y : g cos(xi) K (eq. 7), m s-2. still : 1 where dry or held by friction, else 0.
    """

    beta_x: Array
    beta_y: Array
    still: Array


@kernel()
def classify_run(
    now: Fields,
    status: Status,
    bed: Bed,
    material: Material,
    grid: Grid,
    rate: Array,
    cell: int,
    column: int,
    count: int,
) -> None:
    """Set earth pressure and stillness of a run of cells, and raise the wave rate of their columns.

    A cell is still if it is dry, or at rest with ``|(beta_x h_x - g sin xi, beta_y h_y)|`` at most
    ``g cos xi tan delta`` at each of its faces: were it asked of the whole cell alone, a spike one cell wide
    would hold. A dry neighbour has no velocity of its own and does not make a velocity gradient.
    """
    x_a, x_p, y_aa, y_ap, y_pa, y_pp = material.pressure
    h, u, v = now
    dry, one, row = material.dry, np.uint64(1), np.uint64(grid.stride)
    over_x, over_y = 1.0 / grid.dx, 1.0 / grid.dy
    limit_per_load = material.tangent * HOLDS
    for k in range(count):
        i, c = np.uint64(cell) + np.uint64(k), np.uint64(column) + np.uint64(k)
        w, e, s, n = i - one, i + one, i - row, i + row
        wet = h[i] > dry
        # loaded before they are chosen from: a choice of address would be gathered
        u_i, u_e, u_w, v_i, v_n, v_s = u[i], u[e], u[w], v[i], v[n], v[s]
        u_e, u_w = u_e if h[e] > dry else u_i, u_w if h[w] > dry else u_i
        v_n, v_s = v_n if h[n] > dry else v_i, v_s if h[s] > dry else v_i
        extends_x, extends_y = (u_e >= u_w) | (not wet), (v_n >= v_s) | (not wet)
        k_x = x_a if extends_x else x_p
        k_active, k_passive = y_aa if extends_y else y_ap, y_pa if extends_y else y_pp
        b_x, b_y = bed.normal[c] * k_x, bed.normal[c] * (k_active if extends_x else k_passive)
        status.beta_x[i], status.beta_y[i] = b_x, b_y
        # the slope at each face, with that of the whole cell in the other direction
        pull = bed.along[c]
        back_x, forth_x = b_x * (h[i] - h[w]) * over_x - pull, b_x * (h[e] - h[i]) * over_x - pull
        back_y, forth_y = b_y * (h[i] - h[s]) * over_y, b_y * (h[n] - h[i]) * over_y
        mean_x, mean_y = 0.5 * (back_x + forth_x), 0.5 * (back_y + forth_y)
        steep_x = back_x * back_x if abs(back_x) > abs(forth_x) else forth_x * forth_x
        steep_y = back_y * back_y if abs(back_y) > abs(forth_y) else forth_y * forth_y
        limit = bed.normal[c] * limit_per_load
        limit *= limit
        square = u[i] * u[i] + v[i] * v[i]
        held = (steep_x + mean_y * mean_y <= limit) & (mean_x * mean_x + steep_y <= limit) & (square == 0.0)
        status.still[i] = 1.0 if held | (not wet) else 0.0
        this = (abs(u[i]) + math.sqrt(b_x * h[i])) * over_x + (abs(v[i]) + math.sqrt(b_y * h[i])) * over_y
        this = this if wet else 0.0
        rate[c] = this if this > rate[c] else rate[c]


@kernel()
def classify(
    now: Fields, status: Status, bed: Bed, material: Material, sides: Sides, grid: Grid, spans: Spans
) -> float:
    """Set the status of every cell that may be wet, trim the wet spans, find the moving ones.

    Returns
    -------
    float
        Largest ``(|u| + c_x)/dx + (|v| + c_y)/dy`` of a wet cell, or what gravity needs there, s-1.
    """
    m, still = grid.stride, status.still
    fill_ghosts(now, status.beta_x, status.beta_y, sides, grid, GHOSTS, grid.rows - GHOSTS - 1)
    spans.rate[:] = 0.0
    for j in range(GHOSTS, grid.rows - GHOSTS):
        lo, hi = spans.wet[0, j], spans.wet[1, j]
        spans.moving[0, j] = spans.moving[1, j] = 0
        if lo >= hi:
            continue
        classify_run(now, status, bed, material, grid, spans.rate, j * m + lo, lo, hi - lo)
        while lo < hi and now.h[j * m + lo] <= material.dry:
            lo += 1
        while lo < hi and now.h[j * m + hi - 1] <= material.dry:
            hi -= 1
        spans.wet[0, j], spans.wet[1, j] = lo, hi
        while lo < hi and still[j * m + lo] == 1.0:
            lo += 1
        while lo < hi and still[j * m + hi - 1] == 1.0:
            hi -= 1
        spans.moving[0, j], spans.moving[1, j] = lo, hi
    rate = 0.0
    for k in range(2):
        cell, step = (GHOSTS, -1) if k == 0 else (m - GHOSTS - 1, 1)
        for j in range(GHOSTS, grid.rows - GHOSTS):
            i = j * m + cell
            pull, hold = step * bed.along[cell], bed.normal[cell] * material.tangent * HOLDS
            rate = max(
                rate,
                status_outside(
                    now.h, status, status.beta_x, i, step, grid.dx, pull, hold, sides.kind[k], material.dry
                ),
            )
        row, step = (GHOSTS, -m) if k == 0 else (grid.rows - GHOSTS - 1, m)
        for cell in range(GHOSTS, m - GHOSTS):
            i = row * m + cell
            hold = bed.normal[cell] * material.tangent * HOLDS
            rate = max(
                rate,
                status_outside(
                    now.h, status, status.beta_y, i, step, grid.dy, 0.0, hold, sides.kind[2 + k], material.dry
                ),
            )
    for c in range(m):
        if spans.rate[c] > 0.0:
            rate = max(rate, spans.rate[c], bed.falling[c])
    return rate


@kernel()
def status_outside(
    h: Array,
    status: Status,
    beta: Array,
    cell: int,
    step: int,
    d: float,
    pull: float,
    hold: float,
    kind: int,
    dry: float,
) -> float:
    """Give the ghost ``step`` from a cell the cell's status, but let a given depth drive it.

    Returns the wave rate of what is driven, s-1.
    """
    ghost, image = cell + step, cell - step if kind == AXIS else cell
    status.beta_x[ghost], status.beta_y[ghost] = status.beta_x[image], status.beta_y[image]
    status.still[ghost] = status.still[image]
    if kind == DEPTH and h[ghost] > dry and abs(beta[cell] * (h[ghost] - h[cell]) / d - pull) > hold:
        status.still[ghost] = 0.0
        return 2.0 * math.sqrt(beta[cell] * h[ghost]) / d
    return 0.0
