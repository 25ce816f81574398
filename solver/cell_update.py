"""What fluxes, gravity and friction make of a cell in one Runge-Kutta stage."""

from __future__ import annotations

import math

import numpy as np

from solver.activity import HOLDS, Bed, Material, Status
from solver.boundary import Fields, Grid
from solver.compiled import kernel
from solver.riemann import HELD, Fluxes


@kernel()
def braked(
    hu: float,
    hv: float,
    h: float,
    u_before: float,
    h_before: float,
    normal: float,
    curvature: float,
    braking: float,
    dry: float,
) -> float:
    """Velocity that dry friction leaves, per unit of momentum, m-1; 0 for what it stops and what is dry.

    Parameters
    ----------
    hu, hv, h : float
        Momentum (m2 s-1) and depth (m) without friction.
    u_before, h_before : float
        Velocity along the bed (m s-1) and depth (m) that load the friction.
    normal, curvature : float
        g cos(xi), m s-2, and kappa, m-1.
    braking : float
        tan(delta) times the time that friction acts, s.
    dry : float
        Depth up to which a cell counts as dry, m.
    """
    load = normal + curvature * (u_before * u_before)
    load = load if load > 0.0 else 0.0
    size, brake = math.sqrt(hu * hu + hv * hv), braking * load * h_before
    per_depth = (size - brake) / (size * h + 1e-300)
    return per_depth if (size > brake * HOLDS) & (h > dry) else 0.0


@kernel()
def loaded(before: float, after: float) -> float:
    """Depth that gravity and friction act on in a stage, m, by the depths before and after it.

    It is the one before, but at most twice the one after: what is left of a cell that runs dry would
    otherwise be given the momentum of all that has left it.
    """
    left = 2.0 * after if after > 0.0 else 0.0
    return before if before < left else left


@kernel()
def dragged(speed: float, h: float, drag: float) -> float:
    """Share of a speed (m s-1) that turbulent drag leaves at depth h (m); drag as in `drag_row`."""
    resistance = 4.0 * drag * speed / (h if h > 0.0 else 1.0)
    return 2.0 / (1.0 + math.sqrt(1.0 + resistance))


@kernel()
def update_row(
    start: Fields,
    now: Fields,
    out: Fields,
    status: Status,
    bed: Bed,
    material: Material,
    cell: int,
    column: int,
    count: int,
    x_fluxes: Fluxes,
    west: int,
    y_fluxes: Fluxes,
    south: int,
    north: int,
    part: float,
    dt: float,
    grid: Grid,
) -> None:
    """Update a run of cells: ``U = U_0 + part (U_1 - U_0 + dt L(U_1))``, then friction over ``part dt``.

    The convex combination comes first, then friction as a force of at most
    ``h tan(delta) max(0, g cos xi + kappa u^2)`` against the motion, so that it stops a cell exactly. It acts
    on the depth that gravity acts on: with the new depth instead, a front would feel friction before gravity
    and lag.

    Parameters
    ----------
    start, now, out : Fields
        U_0, U_1 and the result; ``out`` may be ``start``.
    cell, column, count : int
        Index of the first cell, its column, number of cells.
    x_fluxes, west, y_fluxes, south, north
        Fluxes and the indices of the first cell's faces.
    """
    over_x, over_y = 1.0 / grid.dx, 1.0 / grid.dy
    dry, braking = material.dry, part * dt * material.tangent
    one = np.uint64(1)
    for k in range(count):
        k_ = np.uint64(k)
        i, c = np.uint64(cell) + k_, np.uint64(column) + k_
        w, s, n = np.uint64(west) + k_, np.uint64(south) + k_, np.uint64(north) + k_
        e = w + one
        h_0, h_1 = start.h[i], now.h[i]
        gain = (x_fluxes.mass[w] - x_fluxes.mass[e]) * over_x + (y_fluxes.mass[s] - y_fluxes.mass[n]) * over_y
        gain_u = (x_fluxes.normal[w] - x_fluxes.normal[e]) * over_x
        gain_u += (y_fluxes.tangential[s] - y_fluxes.tangential[n]) * over_y
        free = 0.0 if status.still[i] == HELD else 1.0
        load = loaded(h_1, h_1 + dt * gain)
        drive_u = (
            status.beta_x[i] * (x_fluxes.pressure[w] - x_fluxes.pressure[e]) * over_x + bed.along[c] * load
        )
        gain_u += free * drive_u
        gain_v = (x_fluxes.tangential[w] - x_fluxes.tangential[e]) * over_x
        gain_v += (y_fluxes.normal[s] - y_fluxes.normal[n]) * over_y
        gain_v += free * (status.beta_y[i] * (y_fluxes.pressure[s] - y_fluxes.pressure[n]) * over_y)
        hu, hv = h_0 * start.u[i], h_0 * start.v[i]
        h = h_0 + part * ((h_1 - h_0) + dt * gain)
        hu += part * ((h_1 * now.u[i] - hu) + dt * gain_u)
        hv += part * ((h_1 * now.v[i] - hv) + dt * gain_v)
        per_depth = braked(hu, hv, h, now.u[i], load, bed.normal[c], bed.curvature[c], braking, dry)
        out.h[i], out.u[i], out.v[i] = h, hu * per_depth, hv * per_depth


@kernel()
def drag_row(out: Fields, cell: int, count: int, drag: float) -> None:
    """Slow a run of cells by turbulent drag, implicitly, which makes the terminal velocity exact.

    drag : g / turbulent friction times the step, s.
    """
    for k in range(count):
        i = np.uint64(cell) + np.uint64(k)
        u, v, h = out.u[i], out.v[i], out.h[i]
        slowed = dragged(math.sqrt(u * u + v * v), h, drag)
        out.u[i], out.v[i] = u * slowed, v * slowed
