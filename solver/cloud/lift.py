"""The cells of a cloud lifted on to a surface: their frames, areas and gravity, and those of their faces.

A cell is a plane whose slope is the mean slope of the surface above it, so that its area vector is that of
the surface itself. Two such planes do not meet in the face between them. Momentum crosses along the unit
vector ``tau`` over the face whose slope is the mean of both planes, projected on to each. That is parallel
transport but for a turn of second order, and makes no energy. Pressure acts along the edges of the cell's own
plane, which close, so that an even pressure pushes nowhere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.cloud.faces import Faces
from solver.cloud.flow_axes import Ways
from solver.cloud.reconstruction import Gradient, Strain
from solver.cloud.status import widths_between
from solver.kernels.state import CloudBed, Lift
from solver.physics.elevation import Surface, tangents
from solver.points.cloud import PointCloud
from solver.points.on_surface import known, mean_slopes
from solver.points.voronoi import ControlVolumes


class Lifted(NamedTuple):
    """The cells of a cloud on a surface.

    Attributes
    ----------
    area
        (n,), m2.
    bed, faces, gradient, widths
        In the frames of the cells, as the kernels take them.
    """

    area: Array
    bed: CloudBed
    faces: Faces
    gradient: Gradient
    widths: Array


def lifted(
    surface: Surface,
    cloud: PointCloud,
    volumes: ControlVolumes,
    faces: Faces,
    gradient: Gradient,
    gravity: float,
    tangent: float,
    cfl: float,
) -> Lifted:
    """Lift the cells of a cloud on to a surface.

    Parameters
    ----------
    surface : Surface
        The bed.
    cloud : PointCloud
        In plan.
    volumes, faces, gradient
        Of its operators.
    gravity : float
        Gravitational acceleration, m s-2.
    tangent, cfl : float
        tan(delta), and the Courant number: what bounds the first step from rest.
    """
    x, y = volumes.centroid.T
    b_x, b_y = mean_slopes(surface, cloud.control_volumes)
    w, level = np.sqrt(1.0 + (b_x * b_x + b_y * b_y)), np.sqrt(1.0 + b_x * b_x)
    e_1, e_2 = tangents(b_x, b_y)
    normal = np.stack([-b_x, -b_y, np.ones_like(w)]) / w
    area = volumes.area * w
    g_1, g_2, g_n = -gravity * e_1[2], -gravity * e_2[2], gravity / w
    z_xx, z_xy, z_yy = surface.hessian_at(x, y)

    def bend(a: Array, b: Array) -> Array:
        return np.asarray((a[0] * (z_xx * b[0] + z_xy * b[1]) + a[1] * (z_xy * b[0] + z_yy * b[1])) / w)

    frames = np.stack([e_1, e_2, normal])
    over, own, length = _edges(volumes, b_x, b_y, frames)
    inner = len(volumes.left)
    cells = np.concatenate([volumes.left, volumes.right, volumes.side_cell])
    conormals = np.concatenate([over[:2, :inner], over[2:4, :inner], over[:2, inner:]], axis=1)
    shown = np.concatenate([length[:inner], length])
    spare = faces.cells - len(area)
    widths = widths_between(volumes, area, cells, shown / 2, conormals, faces.cells)
    pull = np.hypot(g_1, g_2)
    reach = np.hypot(widths[0, : len(area)] * g_1, widths[1, : len(area)] * g_2) / np.where(pull > 0, pull, 1)
    falling = np.sqrt(cfl * np.maximum(0.0, pull - g_n * tangent) * reach)

    def padded(values: Array) -> Array:
        return np.pad(values, (0, spare), mode="edge")

    drain = np.pad(_drains(surface, cloud), (0, spare))
    k_11, k_12, k_22 = bend(e_1, e_1), bend(e_1, e_2), bend(e_2, e_2)
    lift = Lift(
        across=padded(g_2),
        k_12=padded(k_12),
        k_22=padded(k_22),
        p=padded(1.0 / level),
        r=padded(e_2[0]),
        q=padded(level / w),
        drain=drain,
    )
    bed = CloudBed(padded(g_1), padded(g_n), padded(k_11), padded(falling), lift)
    return Lifted(
        area,
        bed,
        _with_frames(faces, volumes, over, own, length),
        _with_turns(gradient, frames),
        widths,
    )


def along_axes(strain: Strain, ways: Ways, bed: CloudBed) -> tuple[Strain, Ways]:
    """Turn weights of derivatives, and ways to the neighbours, into the frames of the cells."""
    lift = bed.lift
    assert lift is not None
    x, y = ways
    b = y / lift.q
    over = strain._replace(along=lift.p * strain.along, across=lift.r * strain.along + lift.q * strain.across)
    return over, Ways((x - lift.r * b) / lift.p, b)


def _edges(volumes: ControlVolumes, b_x: Array, b_y: Array, frames: Array) -> tuple[Array, Array, Array]:
    """Give faces, boundary faces last, the normals on both sides, and how long they are.

    Returns
    -------
    over : (4, e) array
        Normal in the frame of the left cell and in that of the right one.
    own : (4, e) array
        Edges of the planes of both cells times their normals, as part of the length.
    length : (e,) array
        In m.
    """
    outward = volumes.outward.T
    length = np.concatenate([volumes.length, volumes.side_length])
    along = np.stack([-outward[1], outward[0]])
    sides = (
        np.concatenate([volumes.left, volumes.side_cell]),
        np.concatenate([volumes.right, volumes.side_cell]),
    )
    rises = [b_x[cell] * along[0] + b_y[cell] * along[1] for cell in sides]
    rise = 0.5 * (rises[0] + rises[1])
    steep = np.sqrt(1.0 + rise * rise)
    tau = np.stack([along[0], along[1], rise]) / steep
    over, own = [], []
    for cell, climb in zip(sides, rises, strict=True):
        e_1, e_2, normal = frames[:, :, cell]
        flat = tau - (tau * normal).sum(0) * normal
        flat = flat / np.sqrt((flat * flat).sum(0))
        over += [(flat * e_2).sum(0), -(flat * e_1).sum(0)]
        edge = np.stack([along[0], along[1], climb]) / steep
        own += [(edge * e_2).sum(0), -(edge * e_1).sum(0)]
    return np.stack(over), np.stack(own), length * steep


def _with_frames(faces: Faces, volumes: ControlVolumes, over: Array, own: Array, length: Array) -> Faces:
    """Lay out the normals of faces in the frames of their cells, and how long they are on the bed."""
    inner, ghosts = len(volumes.left), len(volumes.side)
    place = np.concatenate([np.arange(inner), faces.outer + np.arange(ghosts)])
    geometry, far = faces.geometry.copy(), np.zeros((6, faces.faces))
    geometry[:2, place], geometry[6, place] = over[:2], length
    far[:2, place], far[2:, place] = over[2:], own
    return faces._replace(geometry=geometry, far=far)


def _with_turns(gradient: Gradient, frames: Array) -> Gradient:
    """Say how velocities of the neighbours are turned into the frames of cells.

    A plane is tilted into another one about the line in which they meet, the shortest way.
    """
    count, cells = frames.shape[2], gradient.neighbours.shape[1]
    e_1, _, normal = frames
    cosine, sine = np.ones((2, len(gradient.neighbours), cells))
    sine[:] = 0.0
    for m, row in enumerate(gradient.neighbours[:, :count]):
        f_1, f_2, other = frames[:, :, row]
        tilt = 1.0 + (normal * other).sum(0)
        lean = (e_1 * other).sum(0) / tilt
        cosine[m, :count] = (e_1 * f_1).sum(0) - (f_1 * normal).sum(0) * lean
        sine[m, :count] = (f_2 * normal).sum(0) * lean - (e_1 * f_2).sum(0)
    return gradient._replace(cosine=cosine, sine=sine)


def _drains(surface: Surface, cloud: PointCloud) -> NDArray[np.int8]:
    """Give the numbers, from 1, of the sides that take what reaches gaps: the nearest one."""
    x, y = cloud.control_volumes.centroid.T
    distances = np.stack([x - cloud.x[0], cloud.x[1] - x, y - cloud.y[0], cloud.y[1] - y])
    return np.where(known(surface, cloud), 0, distances.argmin(axis=0) + 1).astype(np.int8)
