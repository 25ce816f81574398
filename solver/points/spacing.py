"""The spacing of points as a function of place: coarse, closer in refinements, changing smoothly between."""

from __future__ import annotations

import math
from dataclasses import dataclass

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
class Spacing:
    """Distance between neighbouring points as a function of place: a cell's area is its square.

    ``min(coarsest, spacing_k + growth * distance to refinement k)``, which changes by at most ``growth`` per
    length.

    Parameters
    ----------
    coarsest : float
        Away from refinements, m.
    refinements : tuple of Refinement
        Where points stand closer.
    growth : float
        Lipschitz constant of the spacing, dimensionless, above 0 and at most 0.5.

    Raises
    ------
    ValueError
        If a number is out of range.
    """

    coarsest: float
    refinements: tuple[Refinement, ...] = ()
    growth: float = 0.1

    def __post_init__(self) -> None:
        if not 0 < self.coarsest < np.inf:
            raise ValueError("spacing must be above 0")
        if not 0 < self.growth <= 0.5:
            raise ValueError("the growth of the spacing must be above 0 and at most 0.5")

    @property
    def table(self) -> Array:
        """Bounds and spacing of the refinements, shape (k, 5), m."""
        rows = [(*r.x, *r.y, r.spacing) for r in self.refinements]
        return np.array(rows, dtype=np.float64).reshape(-1, 5)

    @property
    def finest(self) -> float:
        """Smallest spacing anywhere, m."""
        return min([self.coarsest, *(r.spacing for r in self.refinements)])


@kernel(fastmath=False)
def spacing_at(x: float, y: float, coarsest: float, table: Array, growth: float) -> float:
    """Spacing (m) at a place (m)."""
    spacing = coarsest
    for k in range(len(table)):
        dx = max(table[k, 0] - x, x - table[k, 1], 0.0)
        dy = max(table[k, 2] - y, y - table[k, 3], 0.0)
        spacing = min(spacing, table[k, 4] + growth * math.sqrt(dx * dx + dy * dy))
    return spacing


@kernel(fastmath=False)
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
