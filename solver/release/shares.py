"""Shares of the cells of a lattice or a cloud that lie in a polygon, exact to round-off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solver.arrays import Array
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.points.voronoi import ControlVolumes
from solver.release.polygons import SLIVER, polygon_shares

# digits of a share on a lattice; the others are round-off
DIGITS = 12


def shares(rings: Sequence[Array], points: Lattice | PointCloud) -> Array:
    """Share of the area of each cell that lies in a polygon, of the shape of the points.

    Parameters
    ----------
    rings : sequence of array
        Closed outlines, each (n, 2), m; areas count by their orientation, so that holes are taken off.
    points : Lattice or PointCloud
        Whose cells.
    """
    if isinstance(points, Lattice):
        # a zone and its mirror image have the same shares
        return np.round(polygon_shares(rings, points), DIGITS)
    cells = points.control_volumes
    inside = sum(
        (_clipped_areas(np.asarray(ring, np.float64), cells) for ring in rings), np.zeros(points.shape)
    )
    found = inside / cells.area
    found[found > 1.0 - SLIVER] = 1.0
    return np.where(found > SLIVER, found, 0.0)


def _clipped_areas(ring: Array, cells: ControlVolumes) -> Array:
    """Area of each cell within an outline, by its orientation, (n,), m2."""
    faces = np.argsort(owners := np.concatenate([cells.left, cells.right, cells.side_cell]), kind="stable")
    normals = np.concatenate([cells.normal, -cells.normal, cells.side_normal])[faces]
    places = np.concatenate([cells.midpoint, cells.midpoint, cells.side_midpoint])[faces]
    length = np.concatenate([cells.length, cells.length, cells.side_length])[faces]
    first = np.searchsorted(owners[faces], np.arange(len(cells.area) + 1))
    # no cell reaches farther than its faces do
    reach = np.hypot(*(places - cells.centroid[owners[faces]]).T) + length
    far = np.maximum.reduceat(reach, first[:-1])[:, None]
    low, high = ring.min(axis=0), ring.max(axis=0)
    near = ((cells.centroid + far >= low) & (cells.centroid - far <= high)).all(axis=1)
    area = np.zeros(len(cells.area))
    for i in np.flatnonzero(near):
        own = slice(first[i], first[i + 1])
        left = ring
        for normal, place in zip(normals[own], places[own], strict=True):
            left = _cut(left, normal, place)
            if not len(left):
                break
        if len(left):
            x, y = (left - cells.centroid[i]).T
            area[i] = 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    return area


def _cut(ring: Array, normal: Array, place: Array) -> Array:
    """Cut off what of an outline lies beyond a line (Sutherland & Hodgman 1974).

    Pieces stay connected along the line, by edges that go to and fro and hold no area.
    """
    beyond = (ring - place) @ normal
    after, beyond_after = np.roll(ring, -1, axis=0), np.roll(beyond, -1)
    crosses = (beyond > 0) != (beyond_after > 0)
    kept: list[Array] = []
    for k in range(len(ring)):
        if beyond[k] <= 0:
            kept.append(ring[k])
        if crosses[k]:
            kept.append(ring[k] + beyond[k] / (beyond[k] - beyond_after[k]) * (after[k] - ring[k]))
    return np.array(kept).reshape(-1, 2)
