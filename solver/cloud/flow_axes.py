"""How the cells of a cloud are strained along the axes of the flow, in whatever way these lie."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.cloud.on_surface import in_frame, pull_across
from solver.cloud.reconstruction import LOPSIDED, Gradient, Strain, turned
from solver.compiled import kernel
from solver.kernels.earth_pressure import lean_of
from solver.kernels.flow_axes import Tensor, traction_axes
from solver.kernels.state import CloudBed, Fields, Material
from solver.points.voronoi import ControlVolumes


class Ways(NamedTuple):
    """Ways from the centroid of a cell to those of the neighbours of `Gradient`, each (s, cells), m."""

    x: Array
    y: Array


def ways_of(volumes: ControlVolumes, gradient: Gradient) -> Ways:
    """Lay out the ways to neighbours; where a cell stands for itself they are 0."""
    cells = gradient.neighbours.shape[1]
    x, y = (np.pad(a, (0, cells - len(a)), mode="edge") for a in volumes.centroid.T)
    return Ways(x[gradient.neighbours] - x, y[gradient.neighbours] - y)


@kernel(inline=True)
def axes_at(now: Fields, slopes: Array, bed: CloudBed, dry: float, i: int) -> Tensor:
    """Share of the directions in the basal traction of cell i, as `traction_axes`."""
    rise = in_frame(bed.lift, i, slopes[0, i], slopes[1, i])
    wet = now.h[i] > dry
    pull = bed.along[i], pull_across(bed.lift, i)
    axes: Tensor = traction_axes((now.u[i], now.v[i]), now.h[i], pull, bed.normal[i], rise, wet)
    return axes


@kernel(inline=True)
def direction_of(axes: Tensor) -> tuple[float, float, float]:
    """Principal direction of the basal traction, a unit vector, and the share that it has, 1/2 to 1."""
    xx, yy, xy = axes
    apart, shear = xx - yy, 2.0 * xy
    size = math.sqrt(apart * apart + shear * shear)
    if size == 0.0:
        return 1.0, 0.0, 0.5
    e_x, e_y = math.sqrt(0.5 * (1.0 + abs(apart) / size)), 0.0
    e_y = 0.5 * abs(shear) / (size * e_x)
    if apart < 0.0:
        e_x, e_y = e_y, e_x
    return e_x, math.copysign(e_y, shear), 0.5 * (1.0 + size)


@kernel()
def stretched_along(
    now: Fields,
    gradient: Gradient,
    strain: Strain,
    ways: Ways,
    e_x: float,
    e_y: float,
    rise: float,
    dry: float,
    i: int,
) -> float:
    """Rate of stretching of cell i along a unit vector e, as `strain_at` has it of x and y, s-1.

    Parameters
    ----------
    gradient
        Whose neighbours, and how their velocities are turned.
    rise : float
        Derivative of the depth along e.
    """
    h, u, v = now
    mean = sided = ahead_x = ahead_y = d_x = d_y = all_x = all_y = own = most = 0.0
    for m in range(len(gradient.neighbours)):
        j = np.uint64(gradient.neighbours[m, i])
        a, b, x, y = strain.along[m, i], strain.across[m, i], ways.x[m, i], ways.y[m, i]
        wet = 1.0 if h[j] > dry else 0.0
        u_j, v_j = turned(gradient.cosine, gradient.sine, m, i, u[j], v[j])
        step = wet * (e_x * (u_j - u[i]) + e_y * (v_j - v[i]))
        weight, d = e_x * a + e_y * b, e_x * x + e_y * y
        signed = weight if d > 0.0 else (-weight if d < 0.0 else 0.0)
        mean += weight * step
        sided += signed * step
        ahead_x += a * step
        ahead_y += b * step
        d_x += signed * x
        d_y += signed * y
        all_x += a
        all_y += b
        own += signed
        most += abs(signed)
    # half the difference between both sides, less what it makes of linear velocities
    half = sided - d_x * ahead_x - d_y * ahead_y
    own -= d_x * all_x + d_y * all_y
    return mean + (lean_of(rise) * half if own > LOPSIDED * most else 0.0)


@kernel()
def strain_along_flow(
    now: Fields,
    gradient: Gradient,
    strain: Strain,
    ways: Ways,
    bed: CloudBed,
    material: Material,
    start: int,
    stop: int,
    slopes: Array,
) -> None:
    """Rates of stretching of a run of cells along the flow and across it, s-1.

    Both are sums over the principal directions of the basal traction, each upwind by itself.

    Parameters
    ----------
    now, strain, start, stop, slopes
        As in `solver.cloud.reconstruction.strain_at`; on a surface weights are along the axes of the cells.
    gradient, ways
        Neighbours, and the ways there, in the frames of the cells.
    """
    dry = material.dry
    for i in range(start, stop):
        slopes[6, i] = slopes[7, i] = 0.0
        if now.h[i] <= dry:
            continue
        e_x, e_y, share = direction_of(axes_at(now, slopes, bed, dry, i))
        h_x, h_y = in_frame(bed.lift, i, slopes[0, i], slopes[1, i])
        along = stretched_along(now, gradient, strain, ways, e_x, e_y, e_x * h_x + e_y * h_y, dry, i)
        across = stretched_along(now, gradient, strain, ways, -e_y, e_x, e_x * h_y - e_y * h_x, dry, i)
        slopes[6, i] = share * along + (1.0 - share) * across
        slopes[7, i] = share * across + (1.0 - share) * along
