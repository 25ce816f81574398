"""Releases: shapes of material, at rest or moving, and their averages over control volumes."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver.parameters import Checked, Parameter, ParameterError, parameter, parametric, shared
from solver.points.lattice import Lattice
from solver.release.integrals import NODES, SLIVER, WEIGHTS, box_integral, covered, round_integral

if TYPE_CHECKING:
    # compiled code takes longer to import than a scenario to check
    from solver.points.cloud import PointCloud

Array = NDArray[np.float64]


CENTRE = Parameter(meaning="centre", unit="m")
RADIUS = Parameter(meaning="radius", unit="m", above=0)
HEIGHT = Parameter(meaning="depth", unit="m", above=0)


@parametric(kw_only=True)
class Release(Checked):
    """What every release has.

    Raises
    ------
    ParameterError
        If a length or the volume is not above 0, or a number is not finite.
    """

    volume: float | None = parameter(
        "volume; the depth is scaled so that the cells hold it. Default: that of the shape",
        "m3",
        default=None,
        above=0,
    )
    velocity: tuple[float, float] = parameter(
        "initial velocity along and across the bed", "m s-1", default=(0.0, 0.0)
    )

    @property
    def shape_volume(self) -> float:
        """Volume of the shape before it is scaled, m3, in closed form."""
        raise NotImplementedError

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Bounding box (lowest x, highest x, lowest y, highest y), m."""
        raise NotImplementedError

    def depth(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Depth of the shape before it is scaled, m, at points x, y, m; the shape of both together."""
        raise NotImplementedError

    def cell_averages(self, points: Lattice | PointCloud) -> Array:
        """Depth of the shape averaged over each control volume, of the shape of the points, m."""
        if isinstance(points, Lattice):
            return self._lattice_averages(points)
        cells = points.control_volumes
        averages = cells.around(self._between(*cells.edges)) / cells.area
        # what is left of a cell outside the shape is round-off
        return np.where(averages > SLIVER * averages.max(), averages, 0.0)

    def _lattice_averages(self, lattice: Lattice) -> Array:
        raise NotImplementedError

    def _between(self, start: Array, end: Array) -> Array:
        """Volume between edges (e, 2), m, and one fixed place or line, m3; around a polygon it adds up."""
        raise NotImplementedError

    def volume_outside(self, x: tuple[float, float], y: tuple[float, float]) -> float:
        """Volume of the shape outside a rectangle, m3; exactly zero where it lies inside."""
        x_low, x_high, y_low, y_high = self.extent
        if x[0] <= x_low and x_high <= x[1] and y[0] <= y_low and y_high <= y[1]:
            return 0.0
        corners = np.array([(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])])
        inside = float(self._between(corners, np.roll(corners, -1, axis=0)).sum())
        whole = self.shape_volume
        return whole if inside <= SLIVER * whole else max(0.0, whole - inside)


@parametric
class Round(Release):
    """A release on a round or elliptic base around ``centre``, m."""

    centre: tuple[float, float] = shared(CENTRE)

    @property
    def half_axes(self) -> tuple[float, float]:
        """Half axes of the base along and across the bed, m."""
        raise NotImplementedError

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Bounding box (lowest x, highest x, lowest y, highest y), m."""
        (x, y), (rx, ry) = self.centre, self.half_axes
        return x - rx, x + rx, y - ry, y + ry

    def depth(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Depth of the shape before it is scaled, m, at points x, y, m; the shape of both together."""
        (rx, ry), (x0, y0) = self.half_axes, self.centre
        squared = ((np.asarray(x) - x0) / rx) ** 2 + ((np.asarray(y) - y0) / ry) ** 2
        return np.where(squared < 1.0, self._profile(np.minimum(squared, 1.0)), 0.0)

    def _profile(self, squared: Array) -> Array:
        """Depth, m, at the square of the distance from the centre in half axes."""
        raise NotImplementedError

    def _mean(self, squared: Array) -> Array:
        """``int_0^r h(t^2) t dt / r^2`` as a function of r^2 in half axes, m."""
        raise NotImplementedError

    def _between(self, start: Array, end: Array) -> Array:
        centre, axes = np.array(self.centre), np.array(self.half_axes)
        return float(axes.prod()) * round_integral(self._mean, (start - centre) / axes, (end - centre) / axes)

    def _lattice_averages(self, lattice: Lattice) -> Array:
        """Depth averaged over each control volume by Gauss-Legendre quadrature within the base, (ny, nx), m.

        The points of a cell are summed in pairs mirrored in y, so that the mirror image of a release has the
        mirrored averages to the last bit.
        """
        (rx, ry), (x0, y0) = self.half_axes, self.centre
        below, above = lattice.y_points - y0 - lattice.dy / 2, lattice.y_points - y0 + lattice.dy / 2
        rows = (below < ry) & (above > -ry)
        averages = np.zeros(lattice.shape)
        for column, x in enumerate(lattice.x_points - x0):
            low, high = max(x - lattice.dx / 2, -rx), min(x + lattice.dx / 2, rx)
            if low >= high:
                continue
            along = (low + high) / 2 + (high - low) / 2 * NODES[:, None]
            width = ry * np.sqrt(np.maximum(0.0, 1.0 - (along / rx) ** 2))
            start, stop = np.clip(below[rows], -width, width), np.clip(above[rows], -width, width)
            across = (start + stop) / 2 + (stop - start) / 2 * NODES[:, None, None]
            values = WEIGHTS[:, None, None] * self._profile(
                np.minimum((along / rx) ** 2 + (across / ry) ** 2, 1.0)
            )
            strips = (values + values[::-1]).sum(axis=0) / 2 * (stop - start) / 2
            averages[rows, column] = (WEIGHTS[:, None] * strips).sum(axis=0) * (high - low) / 2
        return averages / lattice.cell_area


@parametric
class Cap(Round):
    """A spherical cap."""

    advice: ClassVar[str] = "a heap of known base and height"

    radius: float = shared(RADIUS, meaning="radius of the base")
    height: float = shared(HEIGHT, meaning="depth at the centre, at most the radius")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.height > self.radius:
            found = f"expected at most radius ({self.radius:g}), found {self.height:g}"
            raise ParameterError(found, "height", "radius")

    @property
    def half_axes(self) -> tuple[float, float]:
        """Half axes of the base along and across the bed, m."""
        return self.radius, self.radius

    @property
    def shape_volume(self) -> float:
        """Volume pi H (3 R^2 + H^2)/6, m3."""
        return float(np.pi * self.height * (3 * np.square(self.radius) + np.square(self.height)) / 6)

    def _profile(self, squared: Array) -> Array:
        ball = (np.square(self.radius) + np.square(self.height)) / (2 * self.height)
        inside = np.square(self.radius) * (1.0 - squared)
        sunk = ball - self.height
        # sqrt(ball^2 - r^2) - sunk, without the cancellation of a flat cap
        total = np.sqrt(inside + np.square(sunk)) + sunk
        return np.asarray(np.divide(inside, total, out=np.zeros_like(total), where=total > 0))

    def _mean(self, squared: Array) -> Array:
        ball = (np.square(self.radius) + np.square(self.height)) / (2 * self.height)
        sunk, top, depth = ball - self.height, self.height, self._profile(squared)
        # a form of (ball^3 - (sunk + depth)^3)/(3 radius^2) - sunk squared/2 without cancellation
        size = 3 * sunk * (top + depth) + 2 * (np.square(top) + top * depth + depth**2)
        return np.asarray(size / (6 * (ball + sunk + depth)))


@parametric
class Hemisphere(Cap):
    """A half ball."""

    advice: ClassVar[str] = "laboratory chutes"

    radius: float = shared(RADIUS)
    height: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "height", self.radius)
        super().__post_init__()


@parametric
class Paraboloid(Round):
    """An elliptic paraboloid."""

    advice: ClassVar[str] = "a heap on an elliptic base"

    radii: tuple[float, float] = parameter("half axes of the base along and across the bed", "m", above=0)
    height: float = shared(HEIGHT, meaning="depth at the centre")

    @property
    def half_axes(self) -> tuple[float, float]:
        """Half axes of the base along and across the bed, m."""
        return self.radii

    @property
    def shape_volume(self) -> float:
        """Volume pi rx ry H/2, m3."""
        return float(np.pi * self.radii[0] * self.radii[1] * self.height / 2)

    def _profile(self, squared: Array) -> Array:
        return self.height * (1.0 - squared)

    def _mean(self, squared: Array) -> Array:
        return self.height * (0.5 - 0.25 * squared)


@parametric
class Cylinder(Round):
    """A round column of constant depth."""

    advice: ClassVar[str] = "a column that collapses"

    radius: float = shared(RADIUS)
    height: float = shared(HEIGHT)

    @property
    def half_axes(self) -> tuple[float, float]:
        """Half axes of the base along and across the bed, m."""
        return self.radius, self.radius

    @property
    def shape_volume(self) -> float:
        """Volume pi R^2 H, m3."""
        return float(np.pi * np.square(self.radius) * self.height)

    def _profile(self, squared: Array) -> Array:
        return np.full(squared.shape, self.height)

    def _mean(self, squared: Array) -> Array:
        return np.full(squared.shape, 0.5 * self.height)


@parametric
class Box(Release):
    """A box of constant depth."""

    advice: ClassVar[str] = "a source area of a known mean depth, and dam breaks"

    x: tuple[float, float] = parameter("extent along the bed", "m", ordered=True)
    y: tuple[float, float] = parameter("extent across the bed", "m", ordered=True)
    height: float = shared(HEIGHT)

    @property
    def shape_volume(self) -> float:
        """Volume, m3."""
        return (self.x[1] - self.x[0]) * (self.y[1] - self.y[0]) * self.height

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Bounding box (lowest x, highest x, lowest y, highest y), m."""
        return *self.x, *self.y

    def depth(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Depth, m, at points x, y, m; its sides belong to the box."""
        x, y = np.asarray(x), np.asarray(y)
        inside = (self.x[0] <= x) & (x <= self.x[1]) & (self.y[0] <= y) & (y <= self.y[1])
        return np.where(inside, self.height, 0.0)

    def _between(self, start: Array, end: Array) -> Array:
        return self.height * box_integral(self.x, self.y, start, end)

    def _lattice_averages(self, lattice: Lattice) -> Array:
        """Depth averaged over each control volume, exactly, shape (ny, nx), m.

        A side that reaches an outer point is moved to the edge of that point's cell.
        """
        along = covered(self.x, lattice.x_points, lattice.dx)
        across = covered(self.y, lattice.y_points, lattice.dy)
        return self.height * np.multiply.outer(across, along)


SHAPES: tuple[type[Release], ...] = (Hemisphere, Cap, Paraboloid, Box, Cylinder)
"""All shapes. A shape that is named here can be released by a scenario file."""
