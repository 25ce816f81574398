"""Dams and basins: changes of an elevation model.

A dam is the fill whose sides have one slope everywhere: at each place it is as high as the highest of the
cones that stand on the crest. On ground that falls along the crest the sides are planes of the side slope, as
earthworks are set out. A basin is a cut.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.parameters import Checked, parameter, parametric
from solver.physics.elevation import ElevationModel

# Sides that have not met the ground at this multiple of their length on level ground will not.
FARTHEST = 6.0


@parametric(eq=False)
class Dam(Checked):
    """A dam along a line, of one height above the ground, with sides of one slope.

    Parameters
    ----------
    lines : tuple of array
        Its crest in plan, each part (n, 2), m.
    height : float
        Of the crest above the ground along the line, m.
    side_slope : float
        Inclination of the sides, degrees.
    crest_width : float
        Width of the crest, m.
    """

    advice: ClassVar[str] = "deflecting and catching dams"

    lines: tuple[Array, ...]
    height: float = parameter(
        "height of the crest above the ground along the line", "m", at_least=0, usual=(0.2, 30)
    )
    side_slope: float = parameter("inclination of the sides", "degrees", above=0, below=90)
    crest_width: float = parameter("width of the crest", "m", default=0.0, at_least=0)

    @property
    def base_width(self) -> float:
        """Width at the foot on level ground, m."""
        return float(self.crest_width + 2 * self.height / np.tan(np.radians(self.side_slope)))


@parametric(eq=False)
class Basin(Checked):
    """A basin of one depth below the ground within a polygon, with sides of one slope.

    Parameters
    ----------
    rings : tuple of array
        Its upper edge in plan, each (n, 2), m; holes are left as they are.
    depth : float
        Below the ground, m.
    side_slope : float
        Inclination of the sides on level ground, degrees; 90 are vertical ones.
    """

    advice: ClassVar[str] = "retention basins and cuts"

    rings: tuple[Array, ...]
    depth: float = parameter(
        "depth below the ground, which the floor follows", "m", at_least=0, usual=(0.2, 20)
    )
    side_slope: float = parameter(
        "inclination of the sides on level ground; 90 are vertical",
        "degree",
        default=90.0,
        above=0,
        at_most=90,
    )


class Earthwork(Protocol):
    """What changes elevations."""

    def apply(self, z: Array, x: Array, y: Array) -> Array:
        """Give elevations at places x, y changed; all of one shape, m."""
        ...

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Where it may change something: lowest and highest x, lowest and highest y, m."""
        ...


@dataclass(frozen=True, eq=False)
class Embankment:
    """A dam on its ground.

    Parameters
    ----------
    pieces : (n, 6) array
        Middle x and y (m), direction, half the length (m), elevation of the crest in the middle (m) and
        its slope.
    slope : float
        Tangent of the sides.
    half_width : float
        Of the crest, m.
    reach : float
        Distance from the crest within which sides have to meet the ground, m.
    """

    pieces: Array
    levels: Array
    slope: float
    half_width: float
    reach: float

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Where it may change something, m."""
        x, y, _, _, half = self.pieces.T
        out = half + self.reach
        return (
            float((x - out).min()),
            float((x + out).max()),
            float((y - out).min()),
            float((y + out).max()),
        )

    def apply(self, z: Array, x: Array, y: Array) -> Array:
        """Give elevations at places x, y with the fill on them.

        Raises
        ------
        ValueError
            If the ground is about as steep as the sides, which do not meet it.
        """
        found = z
        # formulas from the middle of each piece give a line the same dam in either direction, to the bit
        for (x_m, y_m, along_x, along_y, half), (level, fall) in zip(self.pieces, self.levels, strict=True):
            d_x, d_y = x - x_m, y - y_m
            t = d_x * along_x + d_y * along_y
            off = np.maximum(0.0, np.abs(d_x * along_y - d_y * along_x) - self.half_width)
            steeper = self.slope**2 - fall**2
            lead = off * (fall / np.sqrt(steeper)) if steeper > 0 else np.sign(fall) * 2 * half
            at = np.clip(t + lead, -half, half)
            distance = np.hypot(off, t - at)
            raised = (level + fall * at) - self.slope * distance
            raised = np.where(distance <= self.reach, raised, -np.inf)
            if ((distance > 0.9 * self.reach) & (raised > z)).any():
                angle = np.degrees(np.arctan(self.slope))
                raise ValueError(
                    f"expected sides that meet the ground within {self.reach:.3g} m of the crest, found "
                    f"ground nearly as steep as they are ({angle:.3g} degrees)"
                )
            found = np.maximum(found, raised)
        return found


@dataclass(frozen=True, eq=False)
class Cut:
    """A basin on its ground; ``slope`` is the tangent of the sides."""

    rings: tuple[Array, ...]
    depth: float
    slope: float

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Where it may change something, m."""
        corners = np.concatenate(self.rings)
        (x_low, y_low), (x_high, y_high) = corners.min(axis=0), corners.max(axis=0)
        return float(x_low), float(x_high), float(y_low), float(y_high)

    def apply(self, z: Array, x: Array, y: Array) -> Array:
        """Give elevations at places x, y with the cut taken out."""
        inside, edge = holds(self.rings, x, y), distance_to(self.rings, x, y)
        return np.where(inside, z - np.minimum(self.depth, self.slope * edge), z)


def holds(rings: Sequence[Array], x: Array, y: Array) -> NDArray[np.bool_]:
    """Whether outlines hold places x, y: a ray from each crosses an odd number of sides."""
    odd = np.zeros(np.shape(x), dtype=bool)
    for ring in rings:
        for (x_0, y_0), (x_1, y_1) in pairwise((*ring, ring[0])):
            if y_0 != y_1:
                odd ^= ((y_0 > y) != (y_1 > y)) & (x < x_0 + (y - y_0) * (x_1 - x_0) / (y_1 - y_0))
    return odd


def distance_to(rings: Sequence[Array], x: Array, y: Array) -> Array:
    """Distance of places x, y from the nearest side of outlines, m."""
    nearest = np.full(np.shape(x), np.inf)
    for ring in rings:
        for start, stop in pairwise(np.array([*ring, ring[0]])):
            length = float(np.hypot(*(stop - start)))
            if length == 0:
                continue
            (x_m, y_m), (a, b) = 0.5 * (start + stop), (stop - start) / length
            t = (x - x_m) * a + (y - y_m) * b
            at = np.clip(t, -length / 2, length / 2)
            nearest = np.minimum(nearest, np.hypot((x - x_m) * b - (y - y_m) * a, t - at))
    return nearest


@dataclass(frozen=True, eq=False)
class ReshapedModel(ElevationModel):
    """An elevation model with earthworks.

    Elevations of the raster hold them, for the curvature. On the corners of cells they are added to the
    natural ground, where a raster that is interpolated would have cut off the crests.

    Parameters
    ----------
    natural : ElevationModel
        The ground without them.
    works : tuple of Earthwork
        In the order in which they are made.
    """

    natural: ElevationModel | None = None
    works: tuple[Earthwork, ...] = ()

    def corners(self, x: Array, y: Array) -> Array:
        """Elevation at the crossings of x (n + 1,) and y (m + 1,), shape (m + 1, n + 1), m."""
        assert self.natural is not None
        return _worked(self.natural.corners(x, y), x, y, self.works)

    def at(self, x: Array, y: Array) -> Array:
        """Elevation at the centres x (n,) by y (m,) of cells, shape (m, n), m; NaN where there is no data."""
        assert self.natural is not None
        return _worked(self.natural.at(x, y), x, y, self.works)

    def smoothly_at(self, x: Array, y: Array, *, averaged: bool) -> Array:
        """Elevation at places x, y of one shape, m, the natural ground by cubic splines."""
        assert self.natural is not None
        return _worked_at(self.natural.smoothly_at(x, y, averaged=averaged), x, y, self.works)

    def elevation_at(self, x: Array, y: Array) -> Array:
        """Elevation at places x, y of one shape, m; NaN where there is no data."""
        assert self.natural is not None
        return _worked_at(self.natural.elevation_at(x, y), x, y, self.works)


def reshaped(natural: ElevationModel, asked: Sequence[Dam | Basin]) -> ElevationModel:
    """Build dams and basins on an elevation model, each on the ground that those before it have left.

    Raises
    ------
    ValueError
        If a line has no length, or the sides of a dam do not meet the ground.
    """
    works: list[Earthwork] = []
    for each in asked:
        if isinstance(each, Dam) and each.height > 0:
            works.append(_embankment(each, natural, works))
        elif isinstance(each, Basin) and each.depth > 0:
            works.append(Cut(each.rings, each.depth, float(np.tan(np.radians(each.side_slope)))))
    if not works:
        return natural
    x, y = natural.x, natural.y
    elevation = _worked(natural.elevation, x, y, works)
    return ReshapedModel(x, y, elevation, natural.curvature_length, natural, tuple(works))


def _embankment(dam: Dam, natural: ElevationModel, before: Sequence[Earthwork]) -> Embankment:
    """Put a dam on the ground along its crest, in pieces no longer than the cells of the raster."""
    pieces, levels = [], []
    for line in dam.lines:
        nodes = _split(np.asarray(line, np.float64), natural.spacing)
        ground = _interpolated(natural, *nodes.T)
        for work in before:
            ground = work.apply(ground, *nodes.T)
        for (start, stop), (low, high) in zip(pairwise(nodes), pairwise(ground), strict=True):
            length = float(np.hypot(*(stop - start)))
            pieces.append([*(0.5 * (start + stop)), *((stop - start) / length), length / 2])
            levels.append([0.5 * (low + high) + dam.height, (high - low) / length])
    if not pieces:
        raise ValueError("expected a line of two places or more")
    slope = float(np.tan(np.radians(dam.side_slope)))
    reach = FARTHEST * dam.height / slope
    return Embankment(np.array(pieces), np.array(levels), slope, dam.crest_width / 2, reach)


def _split(line: Array, longest: float) -> Array:
    """Cut a line (n, 2) into pieces of a length or less, the same ones in either direction."""
    nodes = [line[:1]]
    for start, stop in pairwise(line):
        length = float(np.hypot(*(stop - start)))
        if length == 0:
            continue
        count = int(np.ceil(length / longest * (1 - 1e-9)))
        steps = (2 * np.arange(1, count) - count) / (2 * count)
        nodes += [0.5 * (start + stop) + steps[:, None] * (stop - start), stop[None]]
    return np.concatenate(nodes)


def _interpolated(model: ElevationModel, x: Array, y: Array) -> Array:
    """Elevation of the raster at places x, y, linear between the centres of its cells, m."""
    z, (rows, columns), d = model.filled, model.elevation.shape, model.spacing
    i = np.clip(np.floor((x - model.x[0]) / d).astype(int), 0, columns - 2)
    j = np.clip(np.floor((y - model.y[0]) / d).astype(int), 0, rows - 2)
    # weights from either side, so that mirror images agree to the last bit
    east, west = (np.clip(a, 0.0, 1.0) for a in ((x - model.x[i]) / d, (model.x[i + 1] - x) / d))
    north, south = (np.clip(a, 0.0, 1.0) for a in ((y - model.y[j]) / d, (model.y[j + 1] - y) / d))
    below = west * z[j, i] + east * z[j, i + 1]
    above = west * z[j + 1, i] + east * z[j + 1, i + 1]
    return np.asarray(south * below + north * above)


def _worked(z: Array, x: Array, y: Array, works: Sequence[Earthwork]) -> Array:
    """Change elevations (m, n) on the grid of x (n,) by y (m,), near the works alone."""
    found = np.array(z, dtype=np.float64)
    for work in works:
        x_low, x_high, y_low, y_high = work.bounds
        columns = slice(*np.searchsorted(x, [x_low, x_high]) + np.array([0, 1]))
        rows = slice(*np.searchsorted(y, [y_low, y_high]) + np.array([0, 1]))
        there = np.meshgrid(x[columns], y[rows])
        found[rows, columns] = work.apply(found[rows, columns], *there)
    return found


def _worked_at(z: Array, x: Array, y: Array, works: Sequence[Earthwork]) -> Array:
    """Change elevations at places x, y, all of one shape, near the works alone."""
    found = np.array(z, dtype=np.float64)
    for work in works:
        x_low, x_high, y_low, y_high = work.bounds
        near = (x >= x_low) & (x <= x_high) & (y >= y_low) & (y <= y_high)
        found[near] = work.apply(found[near], x[near], y[near])
    return found


def crest_left(dam: Dam, model: ElevationModel, natural: ElevationModel, x: Array, y: Array) -> float:
    """Share of the height of a dam that is left on cells between corners at x (n,) by y (m,).

    Between corners the bed is bilinear. The mean along the crest counts, where it lies on the cells.
    """
    corners, under = model.corners(x, y), natural.corners(x, y)
    spacing = float(np.diff(x).mean())
    nodes = np.concatenate([_split(np.asarray(line, np.float64), spacing / 4) for line in dam.lines])
    inside = (nodes[:, 0] >= x[0]) & (nodes[:, 0] <= x[-1]) & (nodes[:, 1] >= y[0]) & (nodes[:, 1] <= y[-1])
    if not inside.any() or dam.height == 0:
        return 1.0
    across, up = (nodes[inside, 0] - x[0]) / spacing, (nodes[inside, 1] - y[0]) / spacing
    i = np.clip(across.astype(int), 0, len(x) - 2)
    j = np.clip(up.astype(int), 0, len(y) - 2)
    s, t, gain = across - i, up - j, corners - under
    south = (1 - s) * gain[j, i] + s * gain[j, i + 1]
    north = (1 - s) * gain[j + 1, i] + s * gain[j + 1, i + 1]
    return float(np.mean((1 - t) * south + t * north) / dam.height)
