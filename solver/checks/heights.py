"""Heights of a bed that a flow on it may fall from, as potentials, g times a height, m2 s-2."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from solver.arrays import Array
from solver.physics.terrain import SlopeProfile
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.scene import Scene


@lru_cache(maxsize=8)
def elevations(terrain: SlopeProfile, points: Lattice | PointCloud) -> tuple[Array, Array]:
    """Give the elevations of a bed at 501 places along the domain and at points, of their shape, m.

    The runs of a sweep share them.
    """
    return terrain.elevation(np.linspace(*points.extent[0], 501)), terrain.elevation(points.coordinates[0])


def slope_of(scene: Scene) -> SlopeProfile:
    """Give the slope profile of a scene."""
    if not isinstance(scene.terrain, SlopeProfile):
        raise TypeError("the laws need a slope profile")
    return scene.terrain


def half_lengths(points: Lattice | PointCloud) -> tuple[Array, Array]:
    """Give the places of cells along the slope, and half of their lengths, m."""
    if isinstance(points, PointCloud):
        cells = points.control_volumes
        return cells.centroid[:, 0], np.sqrt(3.0 * cells.second_moment[:, 0])
    x = points.x_points
    return x, np.full(x.shape, points.dx / 2)


def beyond(scene: Scene, lowest: float, level: float) -> float:
    """Height above a level of the cells beside those that lie up to it, as a potential, m2 s-2.

    What comes into the first cell of a rising bed counts with the height of its middle.

    Parameters
    ----------
    scene : Scene
        Of a slope profile.
    lowest, level : float
        Potential that is zero, and the level above it.
    """
    terrain, (x, half) = slope_of(scene), half_lengths(scene.points)
    up_to = scene.gravity * terrain.elevation(x) - lowest <= level
    beside = np.maximum(terrain.elevation(x - 2.0 * half), terrain.elevation(x + 2.0 * half))
    return float(np.max(scene.gravity * beside[up_to] - lowest - level, initial=0.0))


def unseen(scene: Scene) -> float:
    """Largest fall of a cell beyond that of the bed below it, as a potential, m2 s-2.

    A cell knows the inclination at its middle alone: on a cliff that is lower than the cell is long it falls
    by its own length.
    """
    terrain, (x, half) = slope_of(scene), half_lengths(scene.points)
    fall = 2.0 * half * np.abs(np.sin(terrain.inclination(x)))
    bed = np.abs(terrain.elevation(x - half) - terrain.elevation(x + half))
    return scene.gravity * float(np.max(fall - bed, initial=0.0))
