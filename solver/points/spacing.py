"""The spacing of points as a function of place: coarse, closer in refinements, changing smoothly between."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel


@dataclass(frozen=True)
class Refinement:
    """A rectangle in which points stand closer.

    Parameters
    ----------
    x, y : tuple of float
        Its bounds, m.
    spacing : float
        Distance of the points in it, m.

    Raises
    ------
    ValueError
        If a bound is not finite, bounds do not increase, or spacing is not above 0.
    """

    x: tuple[float, float]
    y: tuple[float, float]
    spacing: float

    def __post_init__(self) -> None:
        if not np.isfinite([*self.x, *self.y]).all() or self.x[0] > self.x[1] or self.y[0] > self.y[1]:
            raise ValueError("the bounds of a refinement must be finite and increase")
        if not 0 < self.spacing < np.inf:
            raise ValueError("the spacing of a refinement must be above 0")


@dataclass(frozen=True)
class Corridor:
    """A line along which points stand closer, as the bottom of a channel.

    Parameters
    ----------
    line : tuple of pair
        Its corners, two or more, m.
    spacing : float
        Distance of the points along it, m.
    margin : float
        Distance from the line within which they stand so, m.

    Raises
    ------
    ValueError
        If a corner is not finite, there are less than two, spacing is not above 0, or the margin is below it.
    """

    line: tuple[tuple[float, float], ...]
    spacing: float
    margin: float = 0.0

    def __post_init__(self) -> None:
        if len(self.line) < 2 or not np.isfinite(np.array(self.line)).all():
            raise ValueError("the line of a refinement needs two corners or more, all finite")
        if not 0 < self.spacing < np.inf or not 0 <= self.margin < np.inf:
            raise ValueError("the spacing of a refinement must be above 0, its margin at least 0")


@dataclass(frozen=True)
class Spacing:
    """Distance between neighbouring points as a function of place: a cell's area is its square.

    ``min(coarsest, spacing_k + growth * distance to refinement k)``, which changes by at most ``growth`` per
    length.

    Parameters
    ----------
    coarsest : float
        Away from refinements, m.
    refinements : tuple of Refinement or Corridor
        Where points stand closer.
    growth : float
        Lipschitz constant of the spacing, dimensionless, above 0 and at most 0.5.

    Raises
    ------
    ValueError
        If a number is out of range.
    """

    coarsest: float
    refinements: tuple[Refinement | Corridor, ...] = ()
    growth: float = 0.1

    def __post_init__(self) -> None:
        if not 0 < self.coarsest < np.inf:
            raise ValueError("spacing must be above 0")
        if not 0 < self.growth <= 0.5:
            raise ValueError("the growth of the spacing must be above 0 and at most 0.5")

    @property
    def table(self) -> Array:
        """Refinements for the kernels, shape (k, 7), m.

        Bounds along x and y, spacing, and 0; or ends of a piece of a line along x and y, spacing, 1, and the
        margin.
        """
        rows: list[tuple[float, ...]] = []
        for r in self.refinements:
            if isinstance(r, Refinement):
                rows.append((*r.x, *r.y, r.spacing, 0.0, 0.0))
            else:
                pieces = pairwise(r.line)
                rows += [(x0, x1, y0, y1, r.spacing, 1.0, r.margin) for (x0, y0), (x1, y1) in pieces]
        return np.array(rows, dtype=np.float64).reshape(-1, 7)

    def at(self, places: Array) -> Array:
        """Spacing at places, (n, 2) to (n,), m."""
        found = np.empty(len(places))
        spacings_at(places, self.coarsest, self.table, self.growth, found)
        return found

    @property
    def finest(self) -> float:
        """Smallest spacing anywhere, m."""
        return min([self.coarsest, *(r.spacing for r in self.refinements)])


@kernel(fastmath=False)
def spacing_at(x: float, y: float, coarsest: float, table: Array, growth: float) -> float:
    """Spacing (m) at a place (m)."""
    spacing = coarsest
    for k in range(len(table)):
        if table[k, 5] == 0.0:
            dx = max(table[k, 0] - x, x - table[k, 1], 0.0)
            dy = max(table[k, 2] - y, y - table[k, 3], 0.0)
            away = math.sqrt(dx * dx + dy * dy)
        else:
            along_x, along_y = table[k, 1] - table[k, 0], table[k, 3] - table[k, 2]
            dx, dy = x - table[k, 0], y - table[k, 2]
            square = along_x * along_x + along_y * along_y
            part = 0.0 if square == 0.0 else (dx * along_x + dy * along_y) / square
            part = min(max(part, 0.0), 1.0)
            dx, dy = dx - part * along_x, dy - part * along_y
            away = max(math.sqrt(dx * dx + dy * dy) - table[k, 6], 0.0)
        spacing = min(spacing, table[k, 4] + growth * away)
    return spacing


@kernel(fastmath=False, from_python=True)
def spacings_at(places: Array, coarsest: float, table: Array, growth: float, found: Array) -> None:
    """Fill the spacing (m), (n,), at places (n, 2) (m)."""
    for k in range(len(places)):
        found[k] = spacing_at(places[k, 0], places[k, 1], coarsest, table, growth)


@kernel(fastmath=False, from_python=True)
def points_per_domain(
    bounds: Array, coarsest: float, table: Array, growth: float, columns: int, rows: int
) -> float:
    """Integral of ``1 / spacing^2`` over the domain by the midpoint rule, in order.

    Parameters
    ----------
    bounds : (4,) array
        X_min, x_max, y_min, y_max, m.
    """
    dx, dy = (bounds[1] - bounds[0]) / columns, (bounds[3] - bounds[2]) / rows
    total = 0.0
    for j in range(rows):
        for i in range(columns):
            x, y = bounds[0] + (i + 0.5) * dx, bounds[2] + (j + 0.5) * dy
            s = spacing_at(x, y, coarsest, table, growth)
            total += dx * dy / (s * s)
    return total
