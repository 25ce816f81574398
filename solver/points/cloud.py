"""Point clouds: scattered points in a rectangle, in an order that keeps neighbours together in memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from solver.arrays import Array, Indices
from solver.points.fitted import fitted
from solver.points.poisson_disc import poisson_disc
from solver.points.spacing import Corridor, Refinement, Spacing
from solver.points.voronoi import ControlVolumes, control_volumes

# Points closer than this part of the mean spacing coincide; a cloud this much thinner than long is a line.
COINCIDENT = 1e-6
THIN = 1e-9
# Levels of the Hilbert curve: 2^16 steps along each direction.
HILBERT_LEVELS = 16
NAMED = 5


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points in ``x[0]..x[1]`` by ``y[0]..y[1]``, or on its sides, each owning its clipped Voronoi cell.

    Parameters
    ----------
    points : (n, 2) array
        Coordinates along and across the bed, m; at least three that are not on one line.
    x, y : tuple of float
        Bounds of the domain, m.

    Raises
    ------
    ValueError
        If bounds are not finite and increasing, or points are too few, not finite, outside the domain,
        coincident or collinear; the message names them by number and place.
    """

    points: Array
    x: tuple[float, float]
    y: tuple[float, float]

    def __post_init__(self) -> None:
        points = self.points
        if not np.isfinite([*self.x, *self.y]).all() or self.x[0] >= self.x[1] or self.y[0] >= self.y[1]:
            raise ValueError("the bounds of the domain must be finite and increase")
        if points.ndim != 2 or points.shape[1] != 2:
            raise ValueError(f"points must have shape (n, 2), not {points.shape}")
        if len(points) < 3:
            raise ValueError(f"a cloud needs at least 3 points, not {len(points)}")
        _refuse(points, np.asarray(~np.isfinite(points).all(axis=1)), "not finite")
        low, high = np.array([self.x, self.y]).T
        beyond = (points < low) | (points > high)
        _refuse(points, np.asarray(beyond.any(axis=1)), "outside the domain")
        distance, nearest = scipy.spatial.cKDTree(points).query(points, 2)
        close = distance[:, 1] <= COINCIDENT * self.mean_spacing
        if close.any():
            first = np.flatnonzero(close)[0]
            raise ValueError(
                f"points coincide: {named(points, np.array([first, nearest[first].max()]))}"
                f" and {max(int(close.sum()) - 2, 0)} more"
            )
        stretch = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if stretch[1] <= THIN * stretch[0]:
            ends = np.lexsort(points.T)[[0, -1]]
            raise ValueError(f"all {len(points)} points lie on one line, from {named(points, ends)}")

    def __len__(self) -> int:
        return len(self.points)

    def same_as(self, other: PointCloud) -> bool:
        """Whether another cloud has the same points and bounds."""
        return self is other or (
            (self.x, self.y) == (other.x, other.y) and np.array_equal(self.points, other.points)
        )

    @property
    def shape(self) -> tuple[int]:
        """Number of points, (n,)."""
        return (len(self.points),)

    @property
    def coordinates(self) -> tuple[Array, Array]:
        """Both coordinates of every point, x and y, each of shape (n,), m."""
        return self.points[:, 0], self.points[:, 1]

    @property
    def extent(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Outer edges of the outer control volumes along x and y: the domain's bounds, m."""
        return self.x, self.y

    @property
    def cell_area(self) -> Array:
        """Area of each control volume, shape (n,), m2."""
        return self.control_volumes.area

    @property
    def domain_area(self) -> float:
        """Area of the domain, m2."""
        return (self.x[1] - self.x[0]) * (self.y[1] - self.y[0])

    @property
    def mean_spacing(self) -> float:
        """Root of the domain's area per point, m."""
        return float(np.sqrt(self.domain_area / len(self.points)))

    @cached_property
    def control_volumes(self) -> ControlVolumes:
        """The Voronoi cells and their faces, made once."""
        return control_volumes(self.points, self.x, self.y)

    def nearest(self, count: int, places: Array | None = None) -> Indices:
        """Numbers of the ``count`` points nearest to each place, nearest first.

        Parameters
        ----------
        count : int
            Points wanted.
        places : (m, 2) array, optional
            m; by default the points themselves, each of which is then its own first neighbour.

        Returns
        -------
        (m, count) array

        Raises
        ------
        ValueError
            If the cloud has fewer points.
        """
        if not 1 <= count <= len(self.points):
            raise ValueError(f"a cloud of {len(self.points)} points has no supports of {count}")
        _, near = self._tree.query(self.points if places is None else places, count)
        return np.asarray(near, dtype=np.int64).reshape(-1, count)

    @cached_property
    def _tree(self) -> scipy.spatial.cKDTree:
        return scipy.spatial.cKDTree(self.points)


def given_points(points: ArrayLike, x: tuple[float, float], y: tuple[float, float]) -> PointCloud:
    """Cloud of given points, put in order; messages name points by their given numbers.

    Parameters
    ----------
    points : (n, 2) array_like
        Coordinates, m.
    x, y : tuple of float
        Bounds of the domain, m.

    Returns
    -------
    PointCloud
        Along a Hilbert curve.

    Raises
    ------
    ValueError
        As `PointCloud`.
    """
    cloud = PointCloud(np.array(points, dtype=np.float64), x, y)
    return PointCloud(cloud.points[hilbert_order(cloud.points, x, y)], x, y)


def random_points(
    x: tuple[float, float],
    y: tuple[float, float],
    count: int,
    seed: int = 0,
    outlines: Sequence[Array] = (),
) -> PointCloud:
    """Cloud of points placed at random and evenly, by Poisson-disc sampling.

    Parameters
    ----------
    x, y : tuple of float
        Bounds of the domain, m.
    count : int
        Number of points, met within 1 % but for what outlines change.
    seed : int
        Gives the same points everywhere.
    outlines : sequence of array
        At which cells end, as `solver.points.fitted.fitted` takes them.

    Returns
    -------
    PointCloud
        Along a Hilbert curve.

    Raises
    ------
    ValueError
        As `PointCloud`, and if the count cannot be met.
    """
    if count < 3:
        raise ValueError(f"a cloud needs at least 3 points, not {count}")
    area = (x[1] - x[0]) * (y[1] - y[0])
    return _placed(x, y, Spacing(float(np.sqrt(area / count))), seed, count, outlines)


def graded_points(
    x: tuple[float, float],
    y: tuple[float, float],
    spacing: float,
    refinements: Sequence[Refinement | Corridor] = (),
    growth: float = 0.1,
    seed: int = 0,
    outlines: Sequence[Array] = (),
) -> PointCloud:
    """Cloud that is denser in and around refinements.

    Parameters
    ----------
    x, y : tuple of float
        Bounds of the domain, m.
    spacing : float
        Away from refinements, m: a point per ``spacing**2``, within 1 % in number.
    refinements : sequence of Refinement or Corridor
        Where points stand closer.
    growth : float
        Growth of the spacing per distance from a refinement, dimensionless.
    seed : int
        Gives the same points everywhere.
    outlines : sequence of array
        At which cells end, as `solver.points.fitted.fitted` takes them.

    Returns
    -------
    PointCloud
        Along a Hilbert curve.

    Raises
    ------
    ValueError
        As `PointCloud` and `Spacing`, and if the number of points cannot be met.
    """
    return _placed(x, y, Spacing(spacing, tuple(refinements), growth), seed, None, outlines)


def hilbert_order(points: Array, x: tuple[float, float], y: tuple[float, float]) -> Indices:
    """Order of points (n, 2) along a Hilbert curve through the smallest square around the domain."""
    side = 1 << HILBERT_LEVELS
    extent = max(x[1] - x[0], y[1] - y[0])
    place = ((points - [x[0], y[0]]) / extent * side).astype(np.int64)
    i, j = np.clip(place, 0, side - 1).T
    distance = np.zeros(len(points), dtype=np.int64)
    half = side >> 1
    while half:
        east, north = (i & half) > 0, (j & half) > 0
        distance = 4 * distance + (3 * east ^ north)
        # turn the quarter so that the curve enters and leaves where the next one begins
        flipped = east & ~north
        i, j = np.where(flipped, side - 1 - i, i), np.where(flipped, side - 1 - j, j)
        i, j = np.where(north, i, j), np.where(north, j, i)
        half >>= 1
    return np.argsort(distance, kind="stable")


def named(points: Array, chosen: Indices) -> str:
    """Name some points by number and place, in m; of many the first few."""
    words = [f"{i} at ({points[i, 0]:.6g}, {points[i, 1]:.6g})" for i in chosen[:NAMED]]
    return ", ".join(words) + (f" and {len(chosen) - NAMED} more" if len(chosen) > NAMED else "")


def _placed(
    x: tuple[float, float],
    y: tuple[float, float],
    spacing: Spacing,
    seed: int,
    count: int | None,
    outlines: Sequence[Array],
) -> PointCloud:
    points = poisson_disc(x, y, spacing, seed, count)
    if outlines:
        points = fitted(points, x, y, spacing, outlines)
    return PointCloud(points[hilbert_order(points, x, y)], x, y)


def _refuse(points: Array, wrong: NDArray[np.bool_], what: str) -> None:
    """Raise a ValueError that names the points that are wrong."""
    if wrong.any():
        raise ValueError(f"points {what}: {named(points, np.flatnonzero(wrong))}")
