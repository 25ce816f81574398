"""The lattice: points from bound to bound, each owning a control volume of dx by dy."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lattice:
    """Regular points on ``x[0]..x[1]`` by ``y[0]..y[1]``, both bounds included.

    The spacing asked for is met exactly where it divides the extent; otherwise each direction takes the
    nearest spacing that does. Control volumes are dx by dy, so walls stand half a spacing outside.

    Parameters
    ----------
    x, y : tuple of float
        Bounds along and across the bed, m.
    spacing : float
        Distance between neighbouring points, m.

    Raises
    ------
    ValueError
        If a bound is not finite, bounds are not increasing, or spacing is not positive.
    """

    x: tuple[float, float]
    y: tuple[float, float]
    spacing: float

    def __post_init__(self) -> None:
        if not np.isfinite([*self.x, *self.y, self.spacing]).all():
            raise ValueError("lattice bounds and spacing must be finite")
        if not (self.x[0] < self.x[1] and self.y[0] < self.y[1]):
            raise ValueError("lattice bounds must increase")
        if self.spacing <= 0:
            raise ValueError("lattice spacing must be above 0")

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Number of points (ny, nx)."""
        return len(self.y_points), len(self.x_points)

    @cached_property
    def x_points(self) -> Array:
        """Arc length of the points along the bed, shape (nx,), m."""
        return _points(self.x, self.spacing)

    @cached_property
    def y_points(self) -> Array:
        """Position of the points across the bed, shape (ny,), m."""
        return _points(self.y, self.spacing)

    @property
    def dx(self) -> float:
        """Spacing along the bed, m."""
        return (self.x[1] - self.x[0]) / (len(self.x_points) - 1)

    @property
    def dy(self) -> float:
        """Spacing across the bed, m."""
        return (self.y[1] - self.y[0]) / (len(self.y_points) - 1)

    @property
    def coordinates(self) -> tuple[Array, Array]:
        """Both coordinates of every point, x and y, each of shape (ny, nx), m."""
        x, y = np.meshgrid(self.x_points, self.y_points)
        return x, y

    @property
    def extent(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Outer edges of the outer control volumes along x and y, half a spacing beyond the points, m."""
        return (
            (self.x[0] - self.dx / 2, self.x[1] + self.dx / 2),
            (self.y[0] - self.dy / 2, self.y[1] + self.dy / 2),
        )

    @property
    def cell_area(self) -> float:
        """Area of one control volume, m2."""
        return self.dx * self.dy


def _points(bounds: tuple[float, float], spacing: float) -> Array:
    """Evenly spaced points, weighted from both bounds: symmetric bounds give bitwise symmetric points."""
    intervals = max(1, round((bounds[1] - bounds[0]) / spacing))
    k = np.arange(intervals + 1)
    return np.asarray((bounds[0] * (intervals - k) + bounds[1] * k) / intervals, dtype=np.float64)
