"""The initial state: releases laid on points as cell averages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solver.points.lattice import Lattice
from solver.release.shapes import Release

if TYPE_CHECKING:
    from solver.points.cloud import PointCloud

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Laid:
    """Releases laid on points.

    Parameters
    ----------
    depth, velocity_x, velocity_y : array
        Of the shape of the points, m and m s-1; velocities of releases that overlap are weighted by their
        depths, and zero where nothing lies.
    volume : float
        What the cells hold, m3.
    volume_asked : float
        Sum of the volumes asked for, or of the shapes' own, m3.
    volume_lost : float
        What lies outside all cells, m3.
    """

    depth: Array
    velocity_x: Array
    velocity_y: Array
    volume: float
    volume_asked: float
    volume_lost: float


def initial_state(releases: Sequence[Release], points: Lattice | PointCloud) -> Laid:
    """Lay releases on points as cell averages; where they overlap depths add up.

    A release with a volume V is scaled by V/(V_cells + V_lost), V_cells what its averages hold and V_lost the
    part of its shape outside all cells: a release inside the domain holds V to round-off, one partly outside
    holds V less the volume lost.

    Parameters
    ----------
    releases : sequence of Release
        Shapes, with their volumes and velocities.
    points : Lattice or PointCloud
        Points whose cells they are averaged over.

    Returns
    -------
    Laid
        Depth (m) and velocity (m s-1) of the shape of the points, and volumes, m3.

    Raises
    ------
    ValueError
        If there is no release, or one lies wholly outside all cells.
    """
    if not releases:
        raise ValueError("there is nothing to release")
    parts = []
    asked = lost = 0.0
    for release in releases:
        averages = _averages(replace(release, volume=None, velocity=(0.0, 0.0)), points)
        held = float((averages * points.cell_area).sum())
        if held <= 0:
            raise ValueError(f"a release lies wholly outside the domain: {release}")
        outside = release.volume_outside(*points.extent)
        scale = 1.0 if release.volume is None else release.volume / (held + outside)
        parts.append(scale * averages)
        asked += release.shape_volume if release.volume is None else release.volume
        lost += scale * outside
    depth = np.sum(parts, axis=0)
    velocity_x, velocity_y = np.zeros((2, *points.shape))
    for part, release in zip(parts, releases, strict=True):
        share = np.divide(part, depth, out=np.zeros(points.shape), where=depth > 0)
        velocity_x += share * release.velocity[0]
        velocity_y += share * release.velocity[1]
    return Laid(depth, velocity_x, velocity_y, float((depth * points.cell_area).sum()), asked, lost)


@lru_cache(maxsize=4)
def _averages(shape: Release, points: Lattice | PointCloud) -> Array:
    """Give the averages of a shape; runs that differ in volume or velocity alone have the same."""
    averages = shape.cell_averages(points)
    averages.flags.writeable = False
    return averages
