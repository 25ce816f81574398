"""Slope profiles from tables of horizontal distance and elevation."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver.parameters import ParameterError, parameter, parametric, shared
from solver.physics.terrain import CURVATURE, SlopeProfile, integrate

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

Array = NDArray[np.float64]
_NEWTON_STEPS = 6


@parametric(eq=False)
class Table(SlopeProfile):
    """A slope through points of horizontal distance and elevation, its corners rounded.

    The points are given by horizontal distance d and elevation z.

    The polyline through the points is convolved in d with the triangle of base length L (``smoothing``) and
    unit area. z'' is then continuous and piecewise linear; straight stretches stay where they are, except
    within L/2 of a corner; beyond its ends the polyline goes on at its last slope. With p = dz/dd the bed has
    xi = -atan p, kappa = z''/(1 + p^2)^(3/2) and arc length dx = sqrt(1 + p^2) dd, x = 0 at the first point.
    Smoothing the elevation, and not the inclination along the polyline, keeps distances and drop heights
    true where the points are rough.

    Parameters
    ----------
    distances, elevations : array, shape (n,)
        Points of the table, m, distances increasing.
    smoothing : float
        Length L, horizontal, m.
    with_curvature : bool
        Whether ``curvature`` is kappa or zero.

    Raises
    ------
    ParameterError
        If there are fewer than two points, one is not finite, distances do not increase, or smoothing is
        not above 0.
    """

    advice: ClassVar[str] = "surveyed slopes"

    distances: Array
    elevations: Array
    smoothing: float = parameter(
        "horizontal length over which corners are rounded",
        "m",
        above=0,
        advice="A few distances between points of the table: less keeps its steps, more flattens bends.",
    )
    with_curvature: bool = shared(CURVATURE, default=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.elevations.shape == self.distances.shape == (self.distances.size,) > (1,)):
            raise ParameterError(
                "expected two or more points, each of a distance and an elevation", "distances"
            )
        if not (np.isfinite(self.distances).all() and np.isfinite(self.elevations).all()):
            raise ParameterError("expected finite points", "distances")
        if np.any(np.diff(self.distances) <= 0):
            raise ParameterError("expected distances that increase", "distances")

    @property
    def length(self) -> float:
        """Arc length of the bed from the first point of the table to the last, m."""
        return float(self._arc_length(self.distances[-1:])[0])

    def horizontal_distance(self, x: ArrayLike) -> Array:
        """Horizontal distance as the table counts it, m, same shape as ``x`` (m)."""
        return self._distance(np.asarray(x, dtype=np.float64))

    def elevation(self, x: ArrayLike) -> Array:
        """Elevation of the smoothed bed in the table's own height, m, same shape as ``x`` (m)."""
        d = self._distance(np.asarray(x, dtype=np.float64))
        straight = self.elevations[0] + self._first_gradient * (d - self.distances[0])
        return np.asarray(straight + self._second_derivative.antiderivative(2)(d))

    def _inclination(self, x: Array) -> Array:
        return np.asarray(-np.arctan(self._gradient(self._distance(x))))

    def _bend(self, x: Array) -> Array:
        d = self._distance(x)
        return np.asarray(self._second_derivative(d) / self._stretch(d) ** 3)

    @cached_property
    def _first_gradient(self) -> float:
        return float(np.diff(self.elevations[:2])[0] / np.diff(self.distances[:2])[0])

    @cached_property
    def _second_derivative(self) -> PPoly:
        """Give z'', the second difference of the polyline over L/2 at the knots and linear between them."""
        # SciPy takes longer to import than a scenario to check
        from scipy.interpolate import PPoly, make_interp_spline

        polyline = make_interp_spline(self.distances, self.elevations, k=1)
        half = self.smoothing / 2
        knots = np.unique(np.add.outer([-half, 0.0, half], self.distances))
        values = (polyline(knots + half) - 2 * polyline(knots) + polyline(knots - half)) / half**2
        # zero pieces outside, so that the polynomials extend as straight lines
        knots = np.concatenate([[knots[0] - half], knots, [knots[-1] + half]])
        values = np.concatenate([[0.0, 0.0], values[1:-1], [0.0, 0.0]])
        return PPoly([np.diff(values) / np.diff(knots), values[:-1]], knots)

    @cached_property
    def _gradient_rise(self) -> PPoly:
        return self._second_derivative.antiderivative()

    def _gradient(self, d: Array) -> Array:
        """Gradient p = dz/dd of the smoothed polyline at horizontal distance d, m."""
        return np.asarray(self._first_gradient + self._gradient_rise(d))

    def _stretch(self, d: Array) -> Array:
        """Stretch dx/dd = sqrt(1 + p^2) at horizontal distance d, m."""
        return np.asarray(np.hypot(1.0, self._gradient(d)))

    @cached_property
    def _arc_length_at_knots(self) -> Array:
        knots = self._second_derivative.x
        lengths = np.concatenate([[0.0], np.cumsum(integrate(self._stretch, knots[:-1], knots[1:]))])
        return np.asarray(lengths - lengths[np.searchsorted(knots, self.distances[0])])

    def _arc_length(self, d: Array) -> Array:
        """Arc length x at horizontal distance d, m."""
        knots = self._second_derivative.x
        piece = np.clip(np.searchsorted(knots, d, side="right") - 1, 0, len(knots) - 2)
        return np.asarray(self._arc_length_at_knots[piece] + integrate(self._stretch, knots[piece], d))

    def _distance(self, x: Array) -> Array:
        """Horizontal distance d at arc length x, m: Newton's method from the linear guess between knots."""
        from scipy.interpolate import make_interp_spline

        knots, lengths = self._second_derivative.x, self._arc_length_at_knots
        d = make_interp_spline(lengths, knots, k=1)(x)
        for _ in range(_NEWTON_STEPS):
            d = d - (self._arc_length(d) - x) / self._stretch(d)
        return np.asarray(d)
