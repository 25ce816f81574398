"""Terrain as a surface: elevation over plan coordinates, as an elevation model gives it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array

if TYPE_CHECKING:
    from scipy.interpolate import RectBivariateSpline

# Spacings that differ by less than this share are the same, and cells as far apart coincide.
SAME = 1e-3
# Places in a piece of an edge whose mean is exact for cubics.
EDGE_NODES = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3)


class Surface(ABC):
    """What the solver asks of a surface; x are eastings and y northings, m."""

    @abstractmethod
    def corners(self, x: Array, y: Array) -> Array:
        """Elevation at the crossings of the lines x (n + 1,) and y (m + 1,), shape (m + 1, n + 1), m."""

    @abstractmethod
    def hessian(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Give z_xx, z_xy, z_yy by which curvature loads friction, at x (n,) by y (m,), (m, n), m-1."""

    @abstractmethod
    def gaps(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Say where nothing is known of the surface, at the points x (n,) by y (m,), shape (m, n)."""

    @abstractmethod
    def along_edges(self, start: Array, stop: Array, size: Array) -> Array:
        """Mean elevation along straight edges (n, 2), as cells of these sizes (n,) have it, (n,), m."""

    @abstractmethod
    def hessian_at(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Give what `hessian` does at places x, y of one shape."""

    @abstractmethod
    def gaps_at(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Say what `gaps` does at places x, y of one shape."""


@dataclass(frozen=True, eq=False)
class ElevationModel(Surface):
    """A raster of elevations.

    Parameters
    ----------
    x, y : array
        Eastings (n,) and northings (m,) of the cell centres, evenly spaced and increasing, m.
    elevation : array
        Elevations, shape (m, n), m; NaN where there is no data.
    curvature_length : float or None
        Length over which elevations are averaged before their curvature is taken, m: the standard deviation
        of the Gaussian weights is half of it. 0 takes the raw curvature, None leaves curvature out of the
        load.

    Raises
    ------
    ValueError
        If shapes do not agree, coordinates are not even and increasing, cells are not square, or all is gap.
    """

    x: Array
    y: Array
    elevation: Array
    curvature_length: float | None = 0.0

    def __post_init__(self) -> None:
        if self.elevation.shape != (len(self.y), len(self.x)) or min(self.elevation.shape) < 4:
            raise ValueError("an elevation model needs 4 rows and columns or more, one value a cell")
        for axis in (self.x, self.y):
            steps = np.diff(axis)
            if not (steps > 0).all() or np.ptp(steps) > SAME * steps.mean():
                raise ValueError("coordinates of an elevation model must be even and increasing")
        if abs(self.spacing - np.diff(self.y).mean()) > SAME * self.spacing:
            raise ValueError("cells of an elevation model must be square")
        if not np.isfinite(self.elevation).any():
            raise ValueError("the elevation model holds no data")
        if self.curvature_length is not None and not self.curvature_length >= 0:
            raise ValueError("the curvature length must not be negative")

    @property
    def spacing(self) -> float:
        """Side of a cell, m."""
        return float(np.diff(self.x).mean())

    @cached_property
    def filled(self) -> Array:
        """Elevations, shape (m, n), m; where there is no data that of the nearest cell which has some."""
        from scipy.ndimage import distance_transform_edt

        gap = ~np.isfinite(self.elevation)
        if not gap.any():
            return np.asarray(self.elevation, dtype=np.float64)
        nearest = distance_transform_edt(gap, return_distances=False, return_indices=True)
        return np.asarray(self.elevation[tuple(nearest)], dtype=np.float64)

    def _at(self, x: Array, y: Array, values: Array, order: int) -> Array:
        """Interpolate values of the cells at x (n,) by y (m,); beyond the outer cells goes on linearly."""
        columns, rows = (x - self.x[0]) / self.spacing, (y - self.y[0]) / self.spacing
        if all(np.abs(a - np.rint(a)).max() < SAME for a in (columns, rows)):
            # the cells themselves: mirror images agree to the last bit
            return self._cells(np.rint(rows).astype(int), np.rint(columns).astype(int), values)
        return np.asarray(_spline(values, order)(rows, columns))

    def _scattered(self, x: Array, y: Array, values: Array) -> Array:
        """Interpolate values of the cells at places x, y of one shape linearly, as `_at`."""
        return np.asarray(
            _spline(values, 1).ev((y - self.y[0]) / self.spacing, (x - self.x[0]) / self.spacing)
        )

    def corners(self, x: Array, y: Array) -> Array:
        """Elevation at the crossings of x (n + 1,) and y (m + 1,), shape (m + 1, n + 1), m.

        On cells of the same size each is the mean of the four around it, which suits noise best. On smaller
        cells it is interpolated by cubic splines, on larger ones elevations are averaged over a cell first.
        """
        ratio = float(np.diff(x).mean()) / self.spacing
        if ratio < 1 - SAME:
            return self._at(x, y, self.filled, 3)
        if ratio > 1 + SAME:
            return self._at(x, y, self._averaged(ratio / 2), 1)
        half = self.spacing / 2
        south, north = (
            self._at(x - half, at, self.filled, 1) + self._at(x + half, at, self.filled, 1)
            for at in (y - half, y + half)
        )
        return 0.25 * (south + north)

    def at(self, x: Array, y: Array) -> Array:
        """Elevation at the centres x (n,) by y (m,) of cells, shape (m, n), m; NaN where there is no data.

        On larger cells than those of the raster it is averaged over a cell.
        """
        ratio = float(np.diff(x).mean()) / self.spacing
        values = self._averaged(ratio / 2) if ratio > 1 + SAME else self.filled
        return np.where(self.gaps(x, y), np.nan, self._at(x, y, values, 1))

    def _cells(self, rows: NDArray[np.int64], columns: NDArray[np.int64], values: Array) -> Array:
        """Values of whole rows (m,) and columns (n,) of cells, those of the outer ones beyond them."""
        inside = np.ix_(rows.clip(0, len(self.y) - 1), columns.clip(0, len(self.x) - 1))
        return np.asarray(values[inside], dtype=np.float64)

    def _averaged(self, deviation: float) -> Array:
        """Average elevations by Gaussian weights; deviation : in cells."""
        from scipy.ndimage import gaussian_filter

        pad = min(int(4 * deviation) + 1, min(self.filled.shape) - 1)
        padded = np.pad(self.filled, pad, mode="reflect", reflect_type="odd")
        return np.asarray(gaussian_filter(padded, deviation)[pad:-pad, pad:-pad])

    def hessian(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Second derivatives of the averaged elevation, three of shape (m, n), m-1; 0 without curvature."""
        if self.curvature_length is None:
            nothing = np.zeros((len(y), len(x)))
            return nothing, nothing, nothing
        z_xx, z_xy, z_yy = self._second_derivatives(self.curvature_length)
        return self._at(x, y, z_xx, 1), self._at(x, y, z_xy, 1), self._at(x, y, z_yy, 1)

    def hessian_at(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Give what `hessian` does at places x, y of one shape."""
        if self.curvature_length is None:
            return np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
        z_xx, z_xy, z_yy = self._second_derivatives(self.curvature_length)
        return tuple(self._scattered(x, y, z) for z in (z_xx, z_xy, z_yy))  # type: ignore[return-value]

    def _second_derivatives(self, length: float) -> tuple[Array, Array, Array]:
        """Second derivatives at the cells of the raster, of elevations averaged over a length, m-1."""
        deviation = length / 2 / self.spacing
        z = self._averaged(deviation) if deviation > 0 else self.filled
        # slopes as cells between corners have them, the means of four elevations
        z_x, z_y = (np.gradient(_smoothed(z, axis=1 - axis), self.spacing, axis=axis) for axis in (1, 0))
        z_xx, z_yy = np.gradient(z_x, self.spacing, axis=1), np.gradient(z_y, self.spacing, axis=0)
        z_xy = 0.5 * (np.gradient(z_x, self.spacing, axis=0) + np.gradient(z_y, self.spacing, axis=1))
        return np.asarray(z_xx), np.asarray(z_xy), np.asarray(z_yy)

    def gaps(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Say where there is no data, or the raster has ended, at x (n,) by y (m,), shape (m, n)."""
        return self.gaps_at(x[None, :], y[:, None])

    def gaps_at(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Say the same at places x, y, which are broadcast."""
        columns = np.rint((x - self.x[0]) / self.spacing).astype(int)
        rows = np.rint((y - self.y[0]) / self.spacing).astype(int)
        inside = ((rows >= 0) & (rows < len(self.y))) & ((columns >= 0) & (columns < len(self.x)))
        known = np.isfinite(self.elevation)[rows.clip(0, len(self.y) - 1), columns.clip(0, len(self.x) - 1)]
        return np.asarray(~(inside & known))

    def along_edges(self, start: Array, stop: Array, size: Array) -> Array:
        """Mean elevation along straight edges (n, 2), as cells of these sizes (n,) have it, (n,), m.

        By cubic splines, at places as close as the cells of the raster or closer. For cells as large as those
        or larger elevations are averaged over a cell of the raster first, as `corners` does.
        """
        way = stop - start
        pieces = np.ceil(np.hypot(*way.T) / self.spacing).clip(1).astype(int)
        found = np.empty(len(way))
        for smooth in (False, True):
            own = (size >= self.spacing * (1 - SAME)) == smooth
            if not own.any():
                continue
            for count in np.unique(pieces[own]):
                chosen = own & (pieces == count)
                nodes = (np.arange(count)[:, None] + EDGE_NODES).ravel() / count
                x, y = (start[chosen] + nodes[:, None, None] * way[chosen]).transpose(2, 0, 1)
                found[chosen] = self.smoothly_at(x, y, averaged=smooth).mean(axis=0)
        return found

    def smoothly_at(self, x: Array, y: Array, *, averaged: bool) -> Array:
        """Elevation at places x, y of one shape by cubic splines, m, after an average over a cell or not."""
        spline = self._averaged_spline if averaged else self._own_spline
        return np.asarray(spline.ev((y - self.y[0]) / self.spacing, (x - self.x[0]) / self.spacing))

    @cached_property
    def _own_spline(self) -> RectBivariateSpline:
        return _spline(self.filled, 3)

    @cached_property
    def _averaged_spline(self) -> RectBivariateSpline:
        return _spline(self._averaged(0.5), 3)

    def elevation_at(self, x: Array, y: Array) -> Array:
        """Elevation at places x, y of one shape, m; NaN where there is no data."""
        return np.where(self.gaps_at(x, y), np.nan, self._scattered(x, y, self.filled))


def _spline(values: Array, order: int) -> RectBivariateSpline:
    """Interpolate values of cells by their numbers of rows and columns; beyond the outer ones linearly."""
    from scipy.interpolate import RectBivariateSpline

    pad = 3
    padded = np.pad(values, pad, mode="reflect", reflect_type="odd")
    numbers = (np.arange(-pad, n + pad) for n in values.shape)
    return RectBivariateSpline(*numbers, padded, kx=order, ky=order)


def _smoothed(values: Array, axis: int) -> Array:
    """Weigh values along an axis by 1/4, 1/2, 1/4 with their neighbours."""
    low, high = (np.roll(values, step, axis) for step in (1, -1))
    smooth = 0.25 * (low + high) + 0.5 * values
    ends = [slice(None)] * values.ndim
    for end in (0, -1):
        ends[axis] = end  # type: ignore[call-overload]
        smooth[tuple(ends)] = values[tuple(ends)]
    return np.asarray(smooth)


def lifted_area(corners: Array, spacing: float) -> Array:
    """Areas of the cells between corners of shape (m + 1, n + 1), (m, n), m2."""
    b_x, b_y = plan_slopes(corners, spacing)
    return np.asarray(spacing * spacing * np.sqrt(1.0 + (b_x * b_x + b_y * b_y)))


def plan_slopes(corners: Array, spacing: float) -> tuple[Array, Array]:
    """Give the derivatives of elevation in plan, means over the cells, two of shape (m, n)."""
    south_west, south_east, north_west, north_east = (
        corners[:-1, :-1],
        corners[:-1, 1:],
        corners[1:, :-1],
        corners[1:, 1:],
    )
    b_x = ((north_east + south_east) - (north_west + south_west)) / (2 * spacing)
    b_y = ((north_west + north_east) - (south_west + south_east)) / (2 * spacing)
    return b_x, b_y


def frames_of(corners: Array, spacing: float) -> tuple[Array, Array]:
    """Give the unit vectors e1 and e2 of the cells between corners (m + 1, n + 1), two of shape (3, m, n)."""
    return tangents(*plan_slopes(corners, spacing))


def tangents(b_x: Array, b_y: Array) -> tuple[Array, Array]:
    """Give the unit vectors e1 and e2 of cells of such slopes in plan, two of shape (3, ...)."""
    w, level = np.sqrt(1.0 + (b_x * b_x + b_y * b_y)), np.sqrt(1.0 + b_x * b_x)
    e_1 = np.stack([1.0 / level, np.zeros_like(b_x), b_x / level])
    return e_1, np.stack([-b_x * b_y / (w * level), level / w, b_y / (w * level)])


def edges_of(points: Array, spacing: float) -> Array:
    """Edges of the cells around points (n,), shape (n + 1,), m."""
    return np.append(points - spacing / 2, points[-1] + spacing / 2)
