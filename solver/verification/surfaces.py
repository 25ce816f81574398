"""Surfaces in closed form, on which runs are compared with what is known of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.physics.elevation import EDGE_NODES, Surface
from solver.physics.terrain import SlopeProfile
from solver.points.lattice import Lattice


class ClosedForm(Surface):
    """A surface of which elevation and second derivatives are known at every place."""

    def at(self, x: Array, y: Array) -> Array:
        """Elevation at places of one shape, m."""
        raise NotImplementedError

    def hessian_at(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Second derivatives at places of one shape, m-1."""
        raise NotImplementedError

    def corners(self, x: Array, y: Array) -> Array:
        """Elevation at the crossings of x (n,) and y (m,), shape (m, n), m."""
        return self.at(*np.meshgrid(x, y))

    def hessian(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Second derivatives at x (n,) by y (m,), three of shape (m, n), m-1."""
        return self.hessian_at(*np.meshgrid(x, y))

    def gaps(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Nothing is unknown."""
        return np.zeros((len(y), len(x)), dtype=bool)

    def gaps_at(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Nothing is unknown."""
        return np.zeros(np.broadcast(x, y).shape, dtype=bool)

    def along_edges(self, start: Array, stop: Array, size: Array) -> Array:
        """Mean elevation along straight edges (n, 2), exact for cubics, (n,), m; size does not matter."""
        places = [start + node * (stop - start) for node in EDGE_NODES]
        return np.asarray(np.mean([self.at(*place.T) for place in places], axis=0))


@dataclass(frozen=True)
class Cylindrical(ClosedForm):
    """A surface that falls in one direction of the compass, and does not vary across it.

    Parameters
    ----------
    azimuth : float
        Direction in which it falls, degrees from x toward y.
    """

    azimuth: float

    @property
    def direction(self) -> tuple[float, float]:
        """Unit vector in plan along which it falls."""
        # exact where the direction is an axis: mirror images must agree to the last bit
        quarter, rest = divmod(self.azimuth, 90.0)
        c, s = np.cos(np.radians(rest)), np.sin(np.radians(rest))
        for _ in range(int(quarter) % 4):
            c, s = -s, c
        return float(c), float(s)

    def heights(self, s: Array) -> Array:
        """Elevation at horizontal distances s along the direction, m."""
        raise NotImplementedError

    def bends(self, s: Array) -> Array:
        """Second derivative of the elevation at s, m-1."""
        raise NotImplementedError

    def along(self, x: Array, y: Array) -> Array:
        """Horizontal distance along the direction at points of the same shape, m."""
        c, s = self.direction
        return np.asarray(c * x + s * y)

    def across(self, x: Array, y: Array) -> Array:
        """Distance across the direction at points of the same shape, m."""
        c, s = self.direction
        return np.asarray(c * y - s * x)

    def at(self, x: Array, y: Array) -> Array:
        """Elevation at places of one shape, m."""
        return self.heights(self.along(x, y))

    def hessian_at(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Second derivatives at places of one shape, m-1."""
        bend, (c, s) = self.bends(self.along(x, y)), self.direction
        return bend * c * c, bend * c * s, bend * s * s


@dataclass(frozen=True)
class Inclined(Cylindrical):
    """A plane of ``slope`` degrees."""

    slope: float

    def heights(self, s: Array) -> Array:
        """Elevation at s, m."""
        return np.asarray(-np.tan(np.radians(self.slope)) * s)

    def bends(self, s: Array) -> Array:
        """Zero."""
        return np.zeros_like(s)


@dataclass(frozen=True)
class Trough(Cylindrical):
    """The lower part of a cylinder of ``radius`` m, whose axis lies across the direction.

    Farther from the lowest line than 0.95 radii it goes on with the slope it has there.
    """

    radius: float

    def heights(self, s: Array) -> Array:
        """Elevation above the axis at s, m."""
        near = np.clip(s, -0.95 * self.radius, 0.95 * self.radius)
        height = np.sqrt(self.radius**2 - near**2)
        return np.asarray(-height + near / height * (s - near))

    def bends(self, s: Array) -> Array:
        """Second derivative at s, m-1."""
        near = np.clip(s, -0.95 * self.radius, 0.95 * self.radius)
        return np.asarray(np.where(near == s, self.radius**2 / (self.radius**2 - near**2) ** 1.5, 0.0))


@dataclass(frozen=True)
class Profiled(Cylindrical):
    """A slope profile laid in a direction; its arc length begins at the origin of the plan."""

    profile: SlopeProfile
    longest: float

    def arcs(self, s: Array) -> Array:
        """Arc length at horizontal distances s, m."""
        table = np.linspace(-self.longest, self.longest, 20001)
        return np.asarray(np.interp(s, self.profile.horizontal_distance(table), table))

    def heights(self, s: Array) -> Array:
        """Elevation at s, m."""
        return self.profile.elevation(self.arcs(s))

    def bends(self, s: Array) -> Array:
        """Second derivative at s, m-1."""
        x = self.arcs(s)
        return np.asarray(self.profile.curvature(x) / np.cos(self.profile.inclination(x)) ** 3)


@dataclass(frozen=True)
class Bowl(ClosedForm):
    """The lower part of a sphere of ``radius`` m around the origin, flat beyond 0.95 radii."""

    radius: float

    def _below_centre(self, x: Array, y: Array) -> Array:
        return np.asarray(np.sqrt(self.radius**2 - np.minimum(x**2 + y**2, (0.95 * self.radius) ** 2)))

    def at(self, x: Array, y: Array) -> Array:
        """Elevation above the centre at places of one shape, m."""
        return -self._below_centre(x, y)

    def hessian_at(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Second derivatives at places of one shape, m-1."""
        z = self._below_centre(x, y)
        return (z**2 + x**2) / z**3, x * y / z**3, (z**2 + y**2) / z**3


@dataclass(frozen=True)
class Basin(ClosedForm):
    """A level floor of ``radius`` m around the origin, within a bank that rises by ``bank`` a metre."""

    radius: float
    bank: float

    def at(self, x: Array, y: Array) -> Array:
        """Elevation at places of one shape, m."""
        return np.asarray(self.bank * np.maximum(0.0, np.hypot(x, y) - self.radius))

    def hessian_at(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Zero: the crease at the foot of the bank turns a flow and does not load it."""
        nothing = np.zeros(np.broadcast(x, y).shape)
        return nothing, nothing, nothing


@dataclass(frozen=True)
class Gully(Cylindrical):
    """A channel that falls in a direction, steeper before the origin than behind it, between two banks.

    Parameters
    ----------
    half_width : float
        Of its level bottom, m.
    bank, steep, gentle : float
        Rise of the banks, and falls of the bottom before and behind the origin, by a metre.
    """

    half_width: float
    bank: float
    steep: float
    gentle: float

    def heights(self, s: Array) -> Array:
        """Elevation of the bottom at s, m."""
        return np.asarray(-self.steep * np.minimum(s, 0.0) - self.gentle * np.maximum(s, 0.0))

    def bends(self, s: Array) -> Array:
        """Zero: creases turn a flow and do not load it."""
        return np.zeros_like(s)

    def at(self, x: Array, y: Array) -> Array:
        """Elevation at places of one shape, m."""
        banks = self.bank * np.maximum(0.0, np.abs(self.across(x, y)) - self.half_width)
        return np.asarray(super().at(x, y) + banks)


def cell_means(function: Callable[[Array, Array], Array], lattice: Lattice, number: int = 8) -> Array:
    """Mean of a function of x and y over each cell, from ``number`` squared places in it."""
    shifts = ((np.arange(number) + 0.5) / number - 0.5) * lattice.dx
    x, y = lattice.coordinates
    return np.asarray(sum(function(x + a, y + b) for a in shifts for b in shifts) / number**2)
