"""Releases outlined by polygons on a surface: exact shares of cells, and the initial state made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from solver.arrays import Array
from solver.physics.elevation import Surface
from solver.points.lattice import Lattice
from solver.points.on_surface import area_on_bed, known
from solver.release.initial_state import Laid

if TYPE_CHECKING:
    from solver.points.cloud import PointCloud

# What is left of a cell outside a polygon is round-off.
SLIVER = 1e-12


@dataclass(frozen=True, eq=False)
class PolygonRelease:
    """Material of one depth within a polygon.

    Parameters
    ----------
    rings : sequence of array
        Outlines in plan, each (n, 2), m: outer ones counter-clockwise, holes clockwise.
    depth : float or None
        Depth, m; None where the volume is given.
    volume : float or None
        Volume, m3, which scales the depth; None where the depth is given.
    measured : str
        Whether depth is measured ``normal`` to the bed or ``vertical``.

    Raises
    ------
    ValueError
        Unless just one of depth and volume is given, above 0, or if there is no ring.
    """

    rings: Sequence[Array]
    depth: float | None = None
    volume: float | None = None
    measured: Literal["normal", "vertical"] = "normal"

    def __post_init__(self) -> None:
        if (self.depth is None) == (self.volume is None):
            raise ValueError("a polygon release takes either a depth or a volume")
        if not (self.depth if self.volume is None else self.volume) > 0:  # type: ignore[operator]
            raise ValueError("depth and volume of a release must be above 0")
        if not self.rings:
            raise ValueError("a polygon release needs an outline")


def polygon_shares(rings: Sequence[Array], lattice: Lattice) -> Array:
    """Share of the plan area of each cell that lies in a polygon, exact to round-off, (ny, nx).

    Edges are cut at the lines of the lattice; each piece covers the part of its cell to its right, and all
    cells of the row beyond (the trapezoidal rule of scan conversion, exact for straight edges).

    Parameters
    ----------
    rings : sequence of array
        Closed outlines, each (n, 2), m; areas count by their orientation, so that holes are taken off.
    lattice : Lattice
        The cells.
    """
    (x_low, _), (y_low, _) = lattice.extent
    ny, nx = lattice.shape
    cover, part = np.zeros((2, ny, nx + 1))
    for ring in rings:
        corners = (np.asarray(ring, dtype=np.float64) - (x_low, y_low)) / (lattice.dx, lattice.dy)
        for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            _add_edge(start, stop, cover, part)
    shares = part + np.cumsum(cover, axis=1) - cover
    shares = shares[:, :nx]
    return np.where(shares > SLIVER, np.minimum(shares, 1.0), 0.0)


def in_polygon(rings: Sequence[Array], points: Lattice | PointCloud) -> Array:
    """Share of the plan area of each cell that lies in a polygon, of the shape of the points.

    Parameters
    ----------
    rings : sequence of array
        As of `polygon_shares`.
    points : Lattice or PointCloud
        Whose cells.
    """
    if isinstance(points, Lattice):
        return polygon_shares(rings, points)
    from solver.release.shares import shares

    return shares(rings, points)


def _add_edge(start: Array, stop: Array, cover: Array, part: Array) -> None:
    """Add what an edge covers, in units of cells; upward edges count negative: inside is on their left."""
    ny, columns = cover.shape
    along = stop - start
    cuts = [np.array([0.0, 1.0])]
    for axis, n in ((0, columns - 1), (1, ny)):
        low, high = sorted((start[axis], stop[axis]))
        lines = np.arange(max(np.ceil(low), 0), min(np.floor(high), n) + 1)
        if along[axis] != 0:
            cuts.append((lines - start[axis]) / along[axis])
    t = np.unique(np.clip(np.concatenate(cuts), 0.0, 1.0))
    x, y = (start[axis] + t * along[axis] for axis in (0, 1))
    if t[-1] == 1.0:
        x[-1], y[-1] = stop
    middle_x, middle_y, rise = (x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2, np.diff(y)
    row = np.floor(middle_y).astype(int)
    inside = (row >= 0) & (row < ny) & (rise != 0)
    row, rise, middle_x = row[inside], rise[inside], np.clip(middle_x[inside], 0.0, columns - 1)
    column = np.minimum(np.floor(middle_x).astype(int), columns - 1)
    np.add.at(cover, (row, column), -rise)
    np.add.at(part, (row, column), -rise * (1.0 - (middle_x - column)))


def ring_area(ring: Array) -> float:
    """Area within an outline (n, 2), m2, positive where it runs counter-clockwise."""
    ring = np.asarray(ring, dtype=np.float64)
    # products of coordinates of a map lose the digits that an area has
    x, y = (ring - ring[0]).T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def surface_state(releases: Sequence[PolygonRelease], points: Lattice | PointCloud, surface: Surface) -> Laid:
    """Lay polygon releases on a surface, at rest; where they overlap depths add up.

    Volumes are by the area of the cells on the bed. What lies outside all cells is lost; its volume is that
    of its plan area times the mean of bed area over plan area within.

    Raises
    ------
    ValueError
        If there is no release, or one lies wholly outside all cells or on no data.
    """
    if not releases:
        raise ValueError("there is nothing to release")
    # cells of a lattice are alike
    each, plan = (points.dx * points.dx, 1.0) if isinstance(points, Lattice) else (1.0, points.cell_area)
    area, seen = area_on_bed(surface, points), known(surface, points)
    depth, asked, lost = np.zeros(points.shape), 0.0, 0.0
    for number, release in enumerate(releases):
        shares = in_polygon(release.rings, points) * seen
        inside = float((shares * plan).sum()) * each
        if inside <= 0:
            raise ValueError(f"release {number} lies wholly outside the domain or where there is no data")
        factor = plan * each / area if release.measured == "vertical" else 1.0
        layer = shares * factor
        held = float((layer * area).sum())
        whole = held * max(1.0, sum(map(ring_area, release.rings)) / inside)
        scale = release.depth if release.volume is None else release.volume / whole
        assert scale is not None
        depth += scale * layer
        asked += scale * whole
        lost += scale * (whole - held)
    nothing = np.zeros(points.shape)
    return Laid(depth, nothing, nothing.copy(), float((depth * area).sum()), asked, lost)
