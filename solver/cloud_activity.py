"""Which cells of a cloud take part in a step, as `solver.activity` does for a lattice."""

from __future__ import annotations

import math
from typing import NamedTuple

from solver.activity import HOLDS, Material, Status
from solver.boundary import DEPTH, NO_SLIP, WALL, Fields, Sides
from solver.cloud_faces import Faces, fill_ghosts_beyond_faces, slopes_at
from solver.compiled import Array, Indices, kernel


class CloudBed(NamedTuple):
    """At each cell: g sin xi, g cos xi (m s-2) and the curvature kappa (m-1)."""

    along: Array
    normal: Array
    curvature: Array


class Gradient(NamedTuple):
    """LMLS derivative weights of cell means, each (n, s): the cell itself is the first of its neighbours."""

    neighbours: Indices
    along: Array
    across: Array


class Stepped(NamedTuple):
    """Numbers of the cells and faces that take part in a step, and of the cells whose slopes those need."""

    cells: Indices
    faces: Indices
    sloped: Indices


@kernel()
def classify_cells(
    now: Fields,
    slopes: Array,
    status: Status,
    bed: CloudBed,
    material: Material,
    sides: Sides,
    area: Array,
    faces: Faces,
) -> float:
    """Set earth pressure and stillness of all cells; return the largest wave rate of a wet one, s-1.

    A cell is still if it is dry, or if it is at rest with ``|(beta_x h_x - g sin xi, beta_y h_y)|`` at most
    ``g cos xi tan delta`` at each of its faces, with the one-sided difference to the cell beyond and the
    gradient along the face. A wall holds what leans on it, whatever that is.
    """
    h, u, v = now
    x_a, x_p, y_aa, y_ap, y_pa, y_pp = material.pressure
    fastest = 0.0
    for i in range(len(area)):
        if h[i] <= material.dry:
            status.beta_x[i], status.beta_y[i] = bed.normal[i] * x_a, bed.normal[i] * y_aa
            status.still[i] = 1.0
            continue
        extends_x, extends_y = slopes[i, 2] >= 0.0, slopes[i, 5] >= 0.0
        k_active, k_passive = (y_aa if extends_y else y_ap), (y_pa if extends_y else y_pp)
        b_x = bed.normal[i] * (x_a if extends_x else x_p)
        b_y = bed.normal[i] * (k_active if extends_x else k_passive)
        status.beta_x[i], status.beta_y[i] = b_x, b_y
        held = u[i] * u[i] + v[i] * v[i] == 0.0
        limit = bed.normal[i] * material.tangent * HOLDS
        rate = 0.0
        for m in range(faces.first[i], faces.first[i + 1]):
            f, l_x, l_y = faces.face[m], faces.spoke[m, 1], faces.spoke[m, 2]
            rate += abs(l_x * u[i] + l_y * v[i]) + math.sqrt((b_x * l_x * l_x + b_y * l_y * l_y) * h[i])
            walled = f >= faces.inner and sides.kind[faces.side[f]] in (WALL, NO_SLIP)
            if held and not walled:
                sign, j = (1.0, faces.right[f]) if faces.spoke[m, 0] < 0.0 else (-1.0, faces.left[f])
                d_x, d_y = sign * faces.geometry[f, 2], sign * faces.geometry[f, 3]
                more = (h[j] - h[i] - slopes[i, 0] * d_x - slopes[i, 1] * d_y) / (d_x * d_x + d_y * d_y)
                pull_x = b_x * (slopes[i, 0] + more * d_x) - bed.along[i]
                pull_y = b_y * (slopes[i, 1] + more * d_y)
                held = pull_x * pull_x + pull_y * pull_y <= limit * limit
        status.still[i] = 1.0 if held else 0.0
        fastest = max(fastest, 0.5 * rate / area[i])
    return fastest


@kernel()
def classify_cloud(
    now: Fields,
    status: Status,
    bed: CloudBed,
    material: Material,
    sides: Sides,
    area: Array,
    faces: Faces,
    gradient: Gradient,
    slopes: Array,
    ring: Indices,
    lists: Indices,
) -> tuple[float, int, int, int]:
    """Set the status of all cells and the slopes near wet ones, and list what takes part in the step.

    Parameters
    ----------
    area : (n,) array
        Of the control volumes, m2.
    slopes : (cells, 8) array
        Filled as by `slopes_at`.
    ring : (cells,) array
        Scratch.
    lists : (3, n + f) array
        Its rows are filled with the numbers of cells, of faces, and of cells that need slopes.

    Returns
    -------
    tuple of float and three int
        Largest wave rate, s-1: half the sum over its faces of length times speed, per area. The three counts.
    """
    h = now.h
    dry, n = material.dry, len(area)
    left, right, inner = faces.left, faces.right, faces.inner
    fill_ghosts_beyond_faces(now, status.beta_x, faces, sides)
    for i in range(n):
        ring[i] = 3 if h[i] > dry else 0
    for f in range(inner, len(left)):
        if sides.kind[faces.side[f]] == DEPTH and h[right[f]] > dry:
            ring[left[f]] = 3
    # slopes are asked for two cells away from what is wet
    for near in (2, 1):
        for f in range(inner):
            i, j = left[f], right[f]
            if ring[i] == near + 1 and ring[j] < near:
                ring[j] = near
            elif ring[j] == near + 1 and ring[i] < near:
                ring[i] = near
    count = 0
    for i in range(n):
        if ring[i] > 0:
            lists[2, count] = i
            count += 1
    slopes_at(now, lists[2, :count], gradient.neighbours, gradient.along, gradient.across, dry, slopes)
    fastest = classify_cells(now, slopes, status, bed, material, sides, area, faces)
    for f in range(inner, len(left)):
        i, ghost = left[f], right[f]
        b_x, b_y = status.beta_x[i], status.beta_y[i]
        status.beta_x[ghost], status.beta_y[ghost], status.still[ghost] = b_x, b_y, status.still[i]
        if sides.kind[faces.side[f]] == DEPTH and h[ghost] > dry:
            n_x, n_y = faces.geometry[f, 0], faces.geometry[f, 1]
            way = faces.geometry[f, 2] * n_x + faces.geometry[f, 3] * n_y
            b_n = b_x * n_x * n_x + b_y * n_y * n_y
            push = abs(b_n * (h[ghost] - h[i]) / way - n_x * bed.along[i])
            if push > bed.normal[i] * material.tangent * HOLDS:
                status.still[ghost] = 0.0
                fastest = max(fastest, 2.0 * math.sqrt(b_n * h[ghost]) * faces.geometry[f, 10] / area[i])
    ring[:] = 0
    for f in range(len(left)):
        if status.still[left[f]] == 0.0 or status.still[right[f]] == 0.0:
            ring[left[f]] = ring[right[f]] = 2
    ring[n:] = 0
    cells = stepped_faces = sloped = 0
    for f in range(len(left)):
        i, j = left[f], right[f]
        if ring[i] == 2 or ring[j] == 2:
            lists[1, stepped_faces] = f
            stepped_faces += 1
            ring[i], ring[j] = max(ring[i], 1), max(ring[j], 1)
    for i in range(n):
        if ring[i] == 2:
            lists[0, cells] = i
            cells += 1
        if ring[i] > 0:
            lists[2, sloped] = i
            sloped += 1
    return fastest, cells, stepped_faces, sloped


@kernel()
def moving_volume_exceeds(
    h: Array, still: Array, area: Array, sides: Sides, faces: Faces, volume: float
) -> bool:
    """Whether cells that are not still hold more than a volume, m3, or a given depth drives a side."""
    for i in range(len(area)):
        if still[i] == 0.0:
            volume -= h[i] * area[i]
            if volume < 0.0:
                return True
    for f in range(faces.inner, len(faces.left)):
        if sides.kind[faces.side[f]] == DEPTH and still[faces.right[f]] == 0.0:
            return True
    return False
