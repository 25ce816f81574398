"""Cells of lattices and clouds on a surface: slopes, areas, and where something is known of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.physics.elevation import Surface, edges_of, lifted_area
from solver.points.lattice import Lattice

if TYPE_CHECKING:
    # compiled code takes longer to import than a scenario to check
    from solver.points.cloud import PointCloud
    from solver.points.voronoi import ControlVolumes


def mean_slopes(surface: Surface, volumes: ControlVolumes) -> tuple[Array, Array]:
    """Give the means over a cloud's cells of the derivatives of elevation in plan, two of shape (n,).

    They are the integrals of the elevation along the edges, times their normals, over the area.
    """
    start, stop = volumes.edges
    inner, area = len(volumes.left), volumes.area
    size = np.sqrt(area)
    own = np.concatenate([volumes.left, volumes.side_cell])
    height = surface.along_edges(start, stop, size[own])
    base = height.mean()
    there = surface.along_edges(start[:inner], stop[:inner], size[volumes.right])
    way = stop - start
    found = []
    for run in (way[:, 1], -way[:, 0]):
        total = np.bincount(own, (height - base) * run, len(area))
        total -= np.bincount(volumes.right, (there - base) * run[:inner], len(area))
        found.append(total / area)
    return found[0], found[1]


def area_on_bed(surface: Surface, points: Lattice | PointCloud) -> Array:
    """Areas of the cells on the bed, of the shape of the points, m2; those of a lattice are square."""
    if isinstance(points, Lattice):
        corners = surface.corners(*(edges_of(a, points.dx) for a in (points.x_points, points.y_points)))
        return lifted_area(corners, points.dx)
    b_x, b_y = mean_slopes(surface, points.control_volumes)
    return np.asarray(points.cell_area * np.sqrt(1.0 + (b_x * b_x + b_y * b_y)))


def known(surface: Surface, points: Lattice | PointCloud) -> NDArray[np.bool_]:
    """Say of which cells something is known of the surface, of the shape of the points."""
    if isinstance(points, Lattice):
        return ~surface.gaps(points.x_points, points.y_points)
    return ~surface.gaps_at(*points.control_volumes.centroid.T)
