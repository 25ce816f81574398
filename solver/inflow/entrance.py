"""Inflows on a lattice: their faces, and the depth that a discharge has there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver.arrays import Array
from solver.inflow.conditions import Inflow, Rating, rating_of
from solver.inflow.placement import Placed, place
from solver.physics.elevation import Surface
from solver.physics.friction import Friction
from solver.physics.terrain import Terrain
from solver.points.lattice import Lattice

_HALVINGS = 100


@dataclass(frozen=True, eq=False)
class Entrance:
    """An inflow, the faces that it comes in through, and depth by discharge there.

    Parameters
    ----------
    slant : float
        Depth normal to the bed per vertical depth.
    """

    inflow: Inflow
    placed: Placed
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


def entrance(
    inflow: Inflow, lattice: Lattice, terrain: Terrain | Surface, friction: Friction, gravity: float
) -> Entrance:
    """Place an inflow on a lattice.

    Raises
    ------
    ValueError
        If the section lies outside, on no data, or beside them, or has no normal depth where that is asked.
    """
    placed = place(inflow.line, lattice, terrain, gravity)
    row, column = placed.downstream
    ny, nx = lattice.shape
    good = (row >= 0) & (row < ny) & (column >= 0) & (column < nx)
    slant = 1.0
    if isinstance(terrain, Surface):
        gaps = terrain.gaps(lattice.x_points, lattice.y_points)
        good &= ~gaps[row.clip(0, ny - 1), column.clip(0, nx - 1)]
        slant = placed.normal / gravity
    good &= placed.width > 0
    if not good.any():
        raise ValueError("expected a section with the domain below it, found one that nothing comes in from")
    placed = replace(
        placed,
        **{
            name: getattr(placed, name)[good]
            for name in ("along_x", "row", "column", "sign", "width", "bottom")
        },
    )
    return Entrance(inflow, placed, rating_of(inflow, friction, placed.along, placed.normal, gravity), slant)


def largest_depth(
    inflows: Sequence[Inflow],
    lattice: Lattice,
    terrain: Terrain | Surface,
    friction: Friction,
    gravity: float,
    until: float,
) -> float:
    """Largest depth that flow comes in with up to a time, m; 0 without any inflow."""
    found = [entrance(each, lattice, terrain, friction, gravity).largest_depth(until) for each in inflows]
    return max(found, default=0.0)


def depth_at_start(
    depth: Array,
    inflows: Sequence[Inflow],
    lattice: Lattice,
    terrain: Terrain | Surface,
    friction: Friction,
    gravity: float,
    until: float,
) -> Array:
    """Give an initial depth (ny, nx), m, with the largest depths of what comes in where it does.

    It says where a flow is from; nothing lies there at the start.
    """
    found = np.array(depth, dtype=np.float64)
    for each in inflows:
        made = entrance(each, lattice, terrain, friction, gravity)
        peak = each.hydrograph.peak_until(until)
        if peak > 0:
            np.maximum.at(found, made.placed.downstream, made.depths(peak))
    return found
