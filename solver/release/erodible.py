"""Erodible depth laid on points, as means over the cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from solver.arrays import Array
from solver.physics.elevation import ElevationModel, Surface
from solver.physics.terrain import Terrain
from solver.points.lattice import Lattice
from solver.points.on_surface import area_on_bed, known
from solver.release.polygons import in_polygon
from solver.release.shapes import Box

if TYPE_CHECKING:
    from solver.points.cloud import PointCloud

Rings = Sequence[Array]


def erodible_on_profile(
    depth: float,
    points: Lattice | PointCloud,
    terrain: Terrain,
    region: tuple[tuple[float, float], tuple[float, float]] | None = None,
    *,
    vertical: bool = False,
) -> Array:
    """Erodible depth normal to the bed of a slope profile, of the shape of the points, m.

    Parameters
    ----------
    depth : float
        Depth, m.
    points : Lattice or PointCloud
        The points.
    terrain : Terrain
        The bed.
    region : tuple, optional
        Bounds along and across the bed of what is erodible, m; all of it without.
    vertical : bool
        Whether the depth is measured vertically.
    """
    laid = np.full(points.shape, float(depth))
    if region is not None and depth > 0:
        laid = Box(*region, float(depth)).cell_averages(points)
    return laid * np.cos(terrain.inclination(*points.coordinates)) if vertical else laid


def erodible_on_surface(
    depth: float | ElevationModel | None,
    points: Lattice | PointCloud,
    surface: Surface,
    polygons: Sequence[tuple[Rings, float]] | None = None,
    *,
    vertical: bool = False,
) -> Array:
    """Erodible depth normal to the bed of a surface, of the shape of the points, m.

    Parameters
    ----------
    depth : float, ElevationModel or None
        Depth, m, or a raster of depths, which is 0 where it has no data; None with polygons that have their
        own.
    points : Lattice or PointCloud
        Whose cells.
    surface : Surface
        The bed; where nothing is known of it there is nothing to erode.
    polygons : sequence of (rings, depth), optional
        Outlines of what is erodible, each with its depth, m, which counts where ``depth`` is None; everything
        without. Where they overlap depths add up.
    vertical : bool
        Whether depths are measured vertically.
    """
    if isinstance(depth, ElevationModel):
        found = (
            depth.at(points.x_points, points.y_points)
            if isinstance(points, Lattice)
            else depth.elevation_at(*points.control_volumes.centroid.T)
        )
        laid = np.maximum(np.nan_to_num(found), 0.0)
    else:
        laid = np.full(points.shape, 1.0 if depth is None else float(depth))
    if polygons is not None:
        held = [in_polygon(rings, points) * (own if depth is None else 1.0) for rings, own in polygons]
        laid = laid * np.sum(held, axis=0)
    laid = laid * known(surface, points)
    if vertical:
        laid = laid * (points.cell_area / area_on_bed(surface, points))
    return laid
