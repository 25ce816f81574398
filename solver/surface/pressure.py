"""Earth pressure on a surface: a tensor in the frame of each cell, where the axes are those of the flow."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.earth_pressure import wave_speed
from solver.kernels.flow_axes import pressure_along_axes, strain_along_axes, traction_axes
from solver.kernels.state import Fields, Grid, Material
from solver.surface.metric import EdgeFrames, Metric


class Pressure(NamedTuple):
    """g_n K of each cell, flat arrays of the padded lattice, m s-2.

    xx, yy, xy : in the frame of the cell. over_x, over_y : on its edges to the next cells along x and y, the
    mean of both. wave_x, wave_y : half the speed of the waves of the states over these edges, m s-1.
    tilt_x, tilt_y : those of the metric by K over these edges, m.
    """

    xx: Array
    yy: Array
    xy: Array
    over_x: Array
    over_y: Array
    wave_x: Array
    wave_y: Array
    tilt_x: Array
    tilt_y: Array


def pressure_of(metric: Metric, coefficient: float) -> Pressure:
    """Make the pressure of what is dry: a coefficient that is the same in every direction."""
    same = coefficient * metric.g_n
    nothing = np.zeros_like(same)
    tilts = metric.tilt_x * metric.g_n / same, metric.tilt_y * metric.g_n / same
    waves = nothing.copy(), nothing.copy()
    return Pressure(same, same.copy(), nothing, same.copy(), same.copy(), *waves, *tilts)


@kernel(inline=True)
def over_edges(pressure: Pressure | None, g_n: Array) -> tuple[Array, Array]:
    """Pressure of cells on their edges along x and along y, m s-2."""
    if pressure is None:
        return g_n, g_n
    return pressure.over_x, pressure.over_y


@kernel(inline=True)
def tilts_of(pressure: Pressure | None, metric: Metric) -> tuple[Array, Array]:
    """Depth that a level surface gains from the middle of cells to their high edges along x and y, m."""
    if pressure is None:
        return metric.tilt_x, metric.tilt_y
    return pressure.tilt_x, pressure.tilt_y


@kernel(inline=True)
def pushed(
    pressure: Pressure | None, i: int, g_n: float, rise_x: float, rise_y: float
) -> tuple[float, float]:
    """Multiply a slope of the depth in the frame of cell i by its pressure, m s-2."""
    if pressure is None:
        return g_n * rise_x, g_n * rise_y
    shear = pressure.xy[i]
    return pressure.xx[i] * rise_x + shear * rise_y, shear * rise_x + pressure.yy[i] * rise_y


@kernel(inline=True)
def waves_over_edges(pressure: Pressure | None, i: int, g_n: float, h: float) -> tuple[float, float]:
    """Largest speeds of waves over the edges of cell i along x and y, in the frame of the flow, m s-1."""
    if pressure is None:
        wave = math.sqrt(g_n * h)
        return wave, wave
    return (
        wave_speed(pressure.wave_x[i], pressure.over_x[i], h),
        wave_speed(pressure.wave_y[i], pressure.over_y[i], h),
    )


@kernel(inline=True)
def seen(
    edges: EdgeFrames, edge: int, other_high: bool, velocity: tuple[float, float], other: tuple[float, float]
) -> tuple[float, float]:
    """Difference of the velocity of the cell beyond an edge to that of a cell, in the frame of the cell.

    Parameters
    ----------
    edge : int
        Index of the edge.
    other_high : bool
        Whether the cell beyond is on the high side.
    velocity, other : tuple
        Of the cell, and of the one beyond in its own frame, m s-1.
    """
    c_l, s_l, c_h, s_h = edges.c_low[edge], edges.s_low[edge], edges.c_high[edge], edges.s_high[edge]
    c, s, c_o, s_o = (c_l, s_l, c_h, s_h) if other_high else (c_h, s_h, c_l, s_l)
    u, v = velocity
    u_o, v_o = other
    n = (c_o * u_o + s_o * v_o) - (c * u + s * v)
    t = (c_o * v_o - s_o * u_o) - (c * v - s * u)
    return c * n - s * t, s * n + c * t


@kernel(inline=True)
def on_edge(tensor: tuple[float, float, float], c: float, s: float) -> float:
    """Component of a symmetric tensor normal to an edge."""
    xx, yy, xy = tensor
    return xx * (c * c) + yy * (s * s) + 2.0 * xy * (c * s)


@kernel()
def set_pressure(
    now: Fields,
    pressure: Pressure | None,
    metric: Metric,
    material: Material,
    grid: Grid,
    cell: int,
    count: int,
) -> None:
    """Set the earth pressure of a run of cells; isotropic it is that of the metric."""
    if pressure is not None:
        choose_along_flow(now, pressure, metric, material, grid, cell, count)


@kernel(unaliased=True)
def choose_along_flow(
    now: Fields,
    pressure: Pressure,
    metric: Metric,
    material: Material,
    grid: Grid,
    cell: int,
    count: int,
) -> None:
    """Set the earth pressure of a run of cells by how they are strained along the axes of the flow."""
    h, u, v = now
    dry, one, row = material.dry, np.uint64(1), np.uint64(grid.stride)
    over = 1.0 / grid.dx
    half = 0.5 * over
    x, y = metric.x_edges, metric.y_edges
    for k in range(count):
        i = np.uint64(cell) + np.uint64(k)
        w, e, s, n = i - one, i + one, i - row, i + row
        h_i, g_n, here = h[i], metric.g_n[i], (u[i], v[i])
        wet = h_i > dry
        slope = metric.p[i], metric.r[i], metric.q[i]
        p, r, q = slope
        forth_x, forth_y = seen(x, i, True, here, (u[e], v[e])), seen(y, i, True, here, (u[n], v[n]))
        back_x, back_y = seen(x, w, False, here, (u[w], v[w])), seen(y, s, False, here, (u[s], v[s]))
        # what is dry has no velocity to differ by
        wet_e, wet_w = 1.0 if h[e] > dry else 0.0, 1.0 if h[w] > dry else 0.0
        wet_n, wet_s = 1.0 if h[n] > dry else 0.0, 1.0 if h[s] > dry else 0.0
        e_u, e_v, w_u, w_v = wet_e * forth_x[0], wet_e * forth_x[1], wet_w * back_x[0], wet_w * back_x[1]
        n_u, n_v, s_u, s_v = wet_n * forth_y[0], wet_n * forth_y[1], wet_s * back_y[0], wet_s * back_y[1]
        h_x, h_y = half * (h[e] - h[w]), half * (h[n] - h[s])
        rise = p * h_x, r * h_x + q * h_y
        axes = traction_axes(here, h_i, (metric.g_1[i], metric.g_2[i]), g_n, rise, wet)
        along, across = strain_along_axes(
            axes,
            (half * (e_u - w_u), half * (e_v - w_v)),
            (half * (n_u - s_u), half * (n_v - s_v)),
            (half * (e_u + w_u), half * (e_v + w_v)),
            (half * (n_u + s_u), half * (n_v + s_v)),
            rise,
            slope,
        )
        decrease = material.transition[1] * math.sqrt(h_i / g_n) if wet else 0.0
        b_1, b_2, b_12, wave_1, wave_2 = pressure_along_axes(
            axes, along, across, decrease, g_n, rise, material
        )
        pressure.xx[i], pressure.yy[i], pressure.xy[i] = b_1, b_2, b_12
        tensor = b_1, b_2, b_12
        c_e, s_e, c_w, s_w = x.c_low[i], x.s_low[i], x.c_high[w], x.s_high[w]
        c_n, s_n, c_s, s_s = y.c_low[i], y.s_low[i], y.c_high[s], y.s_high[s]
        pressure.over_x[i] = 0.5 * (on_edge(tensor, c_w, s_w) + on_edge(tensor, c_e, s_e))
        pressure.over_y[i] = 0.5 * (on_edge(tensor, c_s, s_s) + on_edge(tensor, c_n, s_n))
        pressure.tilt_x[i] = metric.tilt_x[i] * g_n / pressure.over_x[i]
        pressure.tilt_y[i] = metric.tilt_y[i] * g_n / pressure.over_y[i]
        pressure.wave_x[i] = 0.5 * (
            (abs(c_w) * wave_1 + abs(s_w) * wave_2) + (abs(c_e) * wave_1 + abs(s_e) * wave_2)
        )
        pressure.wave_y[i] = 0.5 * (
            (abs(c_s) * wave_1 + abs(s_s) * wave_2) + (abs(c_n) * wave_1 + abs(s_n) * wave_2)
        )
