"""What the laws ask of a bed: areas, gravity, and heights that a flow may fall from.

Heights are given as potentials, g times a height, m2 s-2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from solver.arrays import Array
from solver.checks.static_cells import neighbours_of
from solver.physics.elevation import Surface, edges_of, lifted_area, plan_slopes
from solver.physics.terrain import SlopeProfile
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.points.on_surface import area_on_bed, mean_slopes
from solver.scene import Scene


@dataclass(frozen=True)
class Ground:
    """The bed of a scene, as the laws see it.

    Arrays are of the shape of the points, potentials are above the lowest place.

    Attributes
    ----------
    area
        Of the cells on the bed, m2.
    along, normal
        Gravity along the bed and normal to it, m s-2; on a profile the first has a sign.
    potential
        At the points.
    at_sides
        Least potential with which something leaves through each side, (4,).
    range
        Potential of the highest place.
    plane
        Whether the bed is a plane.
    up, beside
        Potential of cells, and of the higher one of those beside each, of one shape.
    unseen
        Largest fall of a cell beyond that of the bed below it, a potential.
    """

    area: Array
    along: Array
    normal: Array
    potential: Array
    at_sides: Array
    range: float
    plane: bool
    up: Array
    beside: Array
    unseen: float

    def beyond(self, level: float) -> float:
        """Height above a level of the cells beside those that lie up to it, as a potential, m2 s-2.

        What comes into the first cell of a rising bed counts with the height of its middle.
        """
        return float(np.max(self.beside[self.up <= level] - level, initial=0.0))


def ground_of(scene: Scene) -> Ground:
    """Find what the laws ask of the bed of a scene.

    Raises
    ------
    TypeError
        If the terrain is neither a slope profile nor a surface.
    """
    if isinstance(scene.terrain, SlopeProfile):
        return _of_profile(scene, scene.terrain)
    if not isinstance(scene.terrain, Surface):
        raise TypeError("the laws need a slope profile or a surface")
    if isinstance(scene.points, Lattice):
        return _of_surface(scene, scene.terrain, scene.points)
    return _of_lifted_cells(scene, scene.terrain, scene.points)


def _of_profile(scene: Scene, terrain: SlopeProfile) -> Ground:
    points, gravity = scene.points, scene.gravity
    along = _along(points)
    inclination = scene.profile.inclination(along)
    curved = scene.profile.curvature(along).any()
    heights, beds = (gravity * z for z in elevations(terrain, points))
    lowest = float(heights.min())
    x, half = half_lengths(points)

    def everywhere(values: Array) -> Array:
        return np.ascontiguousarray(np.broadcast_to(values, points.shape))

    beside = np.maximum(terrain.elevation(x - 2.0 * half), terrain.elevation(x + 2.0 * half))
    return Ground(
        area=np.broadcast_to(points.cell_area, points.shape),
        along=everywhere(gravity * np.sin(inclination)),
        normal=everywhere(gravity * np.cos(inclination)),
        potential=everywhere(beds - lowest),
        # what leaves through a side in y leaves from no less than the lowest place
        at_sides=np.array([heights[0] - lowest, heights[-1] - lowest, 0.0, 0.0]),
        range=float(np.ptp(heights)),
        plane=not curved and float(np.ptp(inclination)) == 0.0,
        up=gravity * terrain.elevation(x) - lowest,
        beside=gravity * beside - lowest,
        unseen=unseen(scene, terrain),
    )


def _of_surface(scene: Scene, surface: Surface, points: Lattice) -> Ground:
    # a cell falls along the plane through its corners, beyond the middles of those beside it
    d, gravity, corners = points.dx, scene.gravity, _corners(surface, points)
    area, (b_x, b_y) = lifted_area(corners, d), plan_slopes(corners, d)
    potential = gravity * (_middle(corners) - corners.min())
    steep, normal = np.hypot(b_x, b_y), gravity * d * d / area
    around = np.pad(potential, 1, mode="edge")
    (m, n), near = potential.shape, range(3)
    return Ground(
        area=area,
        along=steep * normal,
        normal=normal,
        potential=potential,
        at_sides=np.zeros(4),
        range=float(gravity * np.ptp(corners)),
        plane=False,
        up=potential,
        beside=np.max([around[j : j + m, i : i + n] for j in near for i in near], axis=0),
        unseen=float(gravity * d * steep.max()),
    )


def _of_lifted_cells(scene: Scene, surface: Surface, cloud: PointCloud) -> Ground:
    # a cell falls along a plane of the mean slope of the bed above it
    cells, gravity = cloud.control_volumes, scene.gravity
    b_x, b_y = mean_slopes(surface, cells)
    steep, w = np.hypot(b_x, b_y), np.sqrt(1.0 + (b_x * b_x + b_y * b_y))
    heights = gravity * _at_cells(surface, cloud)
    potential = heights - heights.min()
    length = 2.0 * np.sqrt(3.0 * (cells.second_moment[:, 0] + cells.second_moment[:, 2]))
    fall = gravity * float((length * steep).max())
    return Ground(
        area=cells.area * w,
        along=steep * gravity / w,
        normal=gravity / w,
        potential=potential,
        at_sides=np.full(4, -fall),
        range=float(np.ptp(potential)) + fall,
        plane=False,
        up=potential,
        beside=neighbours_of(cloud).largest(potential),
        unseen=fall,
    )


def area_and_height(surface: Surface, points: Lattice | PointCloud) -> tuple[Array, Array]:
    """Give areas on the bed, m2, and elevations, m, of cells, of the shape of the points.

    The elevation of a cell of a lattice is the mean of its corners.
    """
    if isinstance(points, Lattice):
        corners = _corners(surface, points)
        return lifted_area(corners, points.dx), _middle(corners)
    return area_on_bed(surface, points), _at_cells(surface, points)


def _corners(surface: Surface, points: Lattice) -> Array:
    return surface.corners(*(edges_of(a, points.dx) for a in (points.x_points, points.y_points)))


def _middle(corners: Array) -> Array:
    """Mean of the four corners of each cell."""
    return np.asarray(0.25 * (corners[:-1, :-1] + corners[:-1, 1:] + corners[1:, :-1] + corners[1:, 1:]))


def _at_cells(surface: Surface, cloud: PointCloud) -> Array:
    """Elevation at the centroids of cells, as cells of their sizes have it: along an edge of no length."""
    centre = cloud.control_volumes.centroid
    return surface.along_edges(centre, centre, np.sqrt(cloud.cell_area))


@lru_cache(maxsize=8)
def elevations(terrain: SlopeProfile, points: Lattice | PointCloud) -> tuple[Array, Array]:
    """Give the elevations of a bed at 501 places along the domain, and at the points along it, m.

    Those of a lattice are of one row, as all rows have them. The runs of a sweep share them.
    """
    return terrain.elevation(np.linspace(*points.extent[0], 501)), terrain.elevation(_along(points))


def _along(points: Lattice | PointCloud) -> Array:
    """Places of points along the slope, of one row of a lattice, m."""
    return points.x_points if isinstance(points, Lattice) else points.coordinates[0]


def half_lengths(points: Lattice | PointCloud) -> tuple[Array, Array]:
    """Give the places of cells along the slope, and half of their lengths, m."""
    if isinstance(points, PointCloud):
        cells = points.control_volumes
        return cells.centroid[:, 0], np.sqrt(3.0 * cells.second_moment[:, 0])
    x = points.x_points
    return x, np.full(x.shape, points.dx / 2)


def unseen(scene: Scene, terrain: SlopeProfile) -> float:
    """Largest fall of a cell beyond that of the bed below it, as a potential, m2 s-2.

    A cell knows the inclination at its middle alone: on a cliff that is lower than the cell is long it falls
    by its own length.
    """
    x, half = half_lengths(scene.points)
    fall = 2.0 * half * np.abs(np.sin(terrain.inclination(x)))
    bed = np.abs(terrain.elevation(x - half) - terrain.elevation(x + half))
    return scene.gravity * float(np.max(fall - bed, initial=0.0))
