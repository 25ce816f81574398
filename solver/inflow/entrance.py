"""Inflows on a lattice or a cloud: their faces, and the depth that a discharge has there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from solver.arrays import Array
from solver.inflow.clouds import PlacedOnCloud, place_on_cloud
from solver.inflow.conditions import Inflow, Line, Rating, rating_of
from solver.inflow.placement import Frame, Placed, along_line, heading, place
from solver.physics.elevation import Surface
from solver.physics.friction import Friction
from solver.physics.terrain import Terrain
from solver.points.lattice import Lattice
from solver.points.on_surface import known

if TYPE_CHECKING:
    # compiled code takes longer to import than a scenario to check
    from solver.points.cloud import PointCloud

_HALVINGS = 100
_NOTHING_BELOW = "expected a section with the domain below it, found one that nothing comes in from"


@dataclass(frozen=True, eq=False)
class Entrance:
    """An inflow, the faces that it comes in through, and depth by discharge there.

    Parameters
    ----------
    slant : float
        Depth normal to the bed per vertical depth.
    """

    inflow: Inflow
    placed: Placed | PlacedOnCloud
    rating: Rating
    slant: float

    def depths(self, discharge: float) -> Array:
        """Depths at the faces of a discharge (m3 s-1) under a level surface, shape (n,), m."""
        bottom, width = self.placed.bottom, self.placed.width
        wide = width > 0
        mean = self.rating.depth(discharge / float(width.sum()))
        if self.rating.fixed > 0:
            level = float(bottom[wide].min()) + self.rating.fixed / self.slant
        else:
            low, high = float(bottom[wide].min()), float(bottom[wide].max()) + mean / self.slant
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                through = self.rating.unit_discharge(np.maximum(0.0, middle - bottom) * self.slant) @ width
                low, high = (middle, high) if through < discharge else (low, middle)
            level = high
        return np.where(wide, np.maximum(0.0, level - bottom) * self.slant, 0.0)

    def speeds(self, discharge: float) -> Array:
        """Speeds at the faces of a discharge (m3 s-1), shape (n,), m s-1; 0 where nothing comes in."""
        depths = self.depths(discharge)
        unit = self.rating.unit_discharge(depths)
        unit = unit * discharge / float(unit @ self.placed.width)
        return np.divide(unit, depths, out=np.zeros(len(depths)), where=depths > 0)

    def largest_depth(self, until: float) -> float:
        """Largest depth that flow comes in with up to a time, m; the time in s."""
        peak = self.inflow.hydrograph.peak_until(until)
        return float(self.depths(peak).max()) if peak > 0 else 0.0


def placed_on(
    line: Line, points: Lattice | PointCloud, terrain: Terrain | Surface, gravity: float
) -> Placed | PlacedOnCloud:
    """Place a section on points.

    Raises
    ------
    ValueError
        If it lies outside, has no length, or parts no cells.
    """
    if isinstance(points, Lattice):
        return place(line, points, terrain, gravity)
    return place_on_cloud(line, points, terrain, gravity)


def entrance(
    inflow: Inflow,
    points: Lattice | PointCloud,
    terrain: Terrain | Surface,
    friction: Friction,
    gravity: float,
) -> Entrance:
    """Place an inflow on points.

    Raises
    ------
    ValueError
        If the section lies outside, on no data, or beside them, or has no normal depth where that is asked.
    """
    placed = placed_on(inflow.line, points, terrain, gravity)
    slant = placed.normal / gravity if isinstance(terrain, Surface) else 1.0
    if isinstance(placed, PlacedOnCloud):
        good = placed.downstream >= 0
        if isinstance(terrain, Surface):
            good &= known(terrain, points)[placed.downstream]
    else:
        assert isinstance(points, Lattice)
        row, column = placed.downstream
        ny, nx = points.shape
        good = (row >= 0) & (row < ny) & (column >= 0) & (column < nx)
        if isinstance(terrain, Surface):
            gaps = terrain.gaps(points.x_points, points.y_points)
            good &= ~gaps[row.clip(0, ny - 1), column.clip(0, nx - 1)]
            # the outermost cells are drains: what goes on from them is in no ledger
            good &= (row > 0) & (row < ny - 1) & (column > 0) & (column < nx - 1)
    good &= placed.width > 0
    if not good.any():
        raise ValueError(_NOTHING_BELOW)
    placed = placed.only(good)
    return Entrance(inflow, placed, rating_of(inflow, friction, placed.along, placed.normal, gravity), slant)


def check_on_cloud(
    inflow: Inflow, frame: Frame, terrain: Terrain | Surface, friction: Friction, gravity: float
) -> None:
    """Look at what can be known of an inflow on a cloud in a frame before its points are placed.

    Raises
    ------
    ValueError
        If the section lies outside, on no data, or has no normal depth where that is asked.
    """
    found = heading(inflow.line, frame, terrain, gravity)
    if isinstance(terrain, Surface):
        x, y = along_line(inflow.line, frame.strip)
        below_x, below_y = x + 0.5 * frame.strip * found.way[0], y + 0.5 * frame.strip * found.way[1]
        if terrain.gaps_at(below_x, below_y).all():
            raise ValueError(_NOTHING_BELOW)
    rating_of(inflow, friction, found.along, found.normal, gravity)


def largest_depth(
    inflows: Sequence[Inflow],
    points: Lattice | PointCloud,
    terrain: Terrain | Surface,
    friction: Friction,
    gravity: float,
    until: float,
) -> float:
    """Largest depth that flow comes in with up to a time, m; 0 without any inflow."""
    found = [entrance(each, points, terrain, friction, gravity).largest_depth(until) for each in inflows]
    return max(found, default=0.0)


def depth_at_start(
    depth: Array,
    inflows: Sequence[Inflow],
    points: Lattice | PointCloud,
    terrain: Terrain | Surface,
    friction: Friction,
    gravity: float,
    until: float,
) -> Array:
    """Give an initial depth, of the shape of the points, m, with the largest depths of what comes in.

    It says where a flow is from; nothing lies there at the start.
    """
    found = np.array(depth, dtype=np.float64)
    for each in inflows:
        made = entrance(each, points, terrain, friction, gravity)
        peak = each.hydrograph.peak_until(until)
        if peak > 0:
            np.maximum.at(found, made.placed.downstream, made.depths(peak))
    return found
