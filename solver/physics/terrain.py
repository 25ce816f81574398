"""Terrain: the shape of the bed, as slope profiles along the arc length x."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


class Terrain(Protocol):
    """What the solver asks of a bed; x and y are broadcast, m, and the results have their common shape."""

    def inclination(self, x: ArrayLike, y: ArrayLike = 0.0) -> Array:
        """Inclination xi along x, rad, positive where the bed falls with x."""
        ...

    def curvature(self, x: ArrayLike, y: ArrayLike = 0.0) -> Array:
        """Curvature kappa = -d xi/dx, 1/m, positive where the slope flattens."""
        ...

    def lateral_slope(self, x: ArrayLike, y: ArrayLike = 0.0) -> Array:
        """Inclination along y, rad, positive where the bed falls with y."""
        ...


def integrate(function: Callable[[Array], Array], start: ArrayLike, stop: ArrayLike) -> Array:
    """Integrate a function over each interval start..stop by 16-point Gauss-Legendre quadrature.

    start, stop : broadcast to one shape, which the result has; function maps arrays of any shape pointwise.
    """
    start, stop = np.broadcast_arrays(np.asarray(start, np.float64), np.asarray(stop, np.float64))
    half = (stop - start) / 2
    nodes = (start + stop)[..., None] / 2 + half[..., None] * _NODES
    return np.asarray(half * (function(nodes) @ _WEIGHTS))


class SlopeProfile:
    """Base of beds that are the same at every y; x is arc length along the bed, m.

    A subclass gives ``_inclination(x)`` and ``_bend(x)`` (its kappa), and ``_breaks``, the places between
    which both are smooth.
    """

    _breaks: tuple[float, ...] = ()

    def _inclination(self, x: Array) -> Array:
        raise NotImplementedError

    def _bend(self, x: Array) -> Array:
        raise NotImplementedError

    def inclination(self, x: ArrayLike, y: ArrayLike = 0.0) -> Array:
        """Inclination xi, rad, positive where the bed falls with x."""
        return _spread(self._inclination, x, y)

    def curvature(self, x: ArrayLike, y: ArrayLike = 0.0) -> Array:
        """Curvature kappa = -d xi/dx, 1/m; zero where the profile was asked to leave it out.

        Where kappa jumps it takes the mean of both sides.
        """
        if not getattr(self, "with_curvature", True):
            return self.lateral_slope(x, y)
        return _spread(self._bend, x, y)

    def lateral_slope(self, x: ArrayLike, y: ArrayLike = 0.0) -> Array:
        """Inclination along y, rad: zero."""
        return np.zeros(np.broadcast(np.asarray(x), np.asarray(y)).shape)

    def elevation(self, x: ArrayLike) -> Array:
        """Elevation z with dz/dx = -sin xi, m; zero at x = 0. Same shape as ``x`` (m)."""
        return -self._integral(np.sin, x)

    def horizontal_distance(self, x: ArrayLike) -> Array:
        """Horizontal distance d with dd/dx = cos xi, m; zero at x = 0. Same shape as ``x`` (m)."""
        return self._integral(np.cos, x)

    def _integral(self, function: np.ufunc, x: ArrayLike) -> Array:
        """Integrate function(xi) from 0 to x by Gauss-Legendre quadrature over each smooth piece."""
        x = np.asarray(x, dtype=np.float64)
        total = np.zeros(x.shape)
        edges = (-np.inf, *self._breaks, np.inf)
        for low, high in pairwise(edges):
            start, stop = np.clip(0.0, low, high), np.clip(x, low, high)
            total += integrate(lambda s: np.asarray(function(self._inclination(s))), start, stop)
        return total


@dataclass(frozen=True)
class Plane(SlopeProfile):
    """A plane inclined by ``angle``, degrees.

    Raises
    ------
    ValueError
        If the angle is not between -90 and 90.
    """

    angle: float

    def __post_init__(self) -> None:
        _check_angles(self.angle)

    def _inclination(self, x: Array) -> Array:
        return np.full(x.shape, np.radians(self.angle))

    def _bend(self, x: Array) -> Array:
        return np.zeros(x.shape)


@dataclass(frozen=True)
class Bend(SlopeProfile):
    """A slope of ``angle`` that bends into one of ``runout_angle`` (degrees) from ``start`` to ``end`` (m).

    With r = (x - start)/(end - start) the inclination falls as r (linear; Wang, Hutter & Pudasaini 2004) or
    as r^2 (quadratic; eq. 26 as printed).
    ``with_curvature=False`` leaves kappa out, as eqs. 4-5 print it.

    Raises
    ------
    ValueError
        If an angle is not between -90 and 90, ``start`` is not below ``end``, or the transition is unknown.
    """

    angle: float
    start: float
    end: float
    runout_angle: float = 0.0
    transition: Literal["linear", "quadratic"] = "linear"
    with_curvature: bool = True

    def __post_init__(self) -> None:
        _check_angles(self.angle, self.runout_angle)
        if not (np.isfinite([self.start, self.end]).all() and self.start < self.end):
            raise ValueError("a bend must start before it ends")
        if self.transition not in ("linear", "quadratic"):
            raise ValueError(f"unknown transition {self.transition!r}")

    @property
    def _breaks(self) -> tuple[float, ...]:  # type: ignore[override]
        return self.start, self.end

    @property
    def _power(self) -> int:
        return 1 if self.transition == "linear" else 2

    def _inclination(self, x: Array) -> Array:
        r = np.clip((x - self.start) / (self.end - self.start), 0.0, 1.0)
        return np.radians(self.angle - (self.angle - self.runout_angle) * r**self._power)

    def _bend(self, x: Array) -> Array:
        r = (x - self.start) / (self.end - self.start)
        inside = np.heaviside(r, 0.5) - np.heaviside(r - 1.0, 0.5)
        rate = np.radians(self.angle - self.runout_angle) / (self.end - self.start)
        return np.asarray(inside * rate * self._power * r ** (self._power - 1))


@dataclass(frozen=True)
class Segments(SlopeProfile):
    """Straight segments; over each joint the inclination passes linearly from one to the next.

    Parameters
    ----------
    starts, angles : sequence of float
        Where each segment begins, m, and its inclination, degrees, from top to bottom; the first also holds
        above its start.
    joint : float
        Length of a joint, centred on the start of each later segment, m.

    Raises
    ------
    ValueError
        If there is no segment, lengths differ, an angle is not between -90 and 90, or joints overlap.
    """

    starts: Sequence[float]
    angles: Sequence[float]
    joint: float
    with_curvature: bool = True

    def __post_init__(self) -> None:
        # beds are compared, and what is known of them kept, by their values
        object.__setattr__(self, "starts", tuple(self.starts))
        object.__setattr__(self, "angles", tuple(self.angles))
        if not 0 < len(self.starts) == len(self.angles):
            raise ValueError("segments need a start and an angle each")
        _check_angles(*self.angles)
        if not (np.isfinite([*self.starts, self.joint]).all() and self.joint > 0):
            raise ValueError("starts must be finite and the joint above 0")
        if np.any(np.diff(self._knots) < 0) or np.any(np.diff(self.starts) <= 0):
            raise ValueError("segments must follow one another without their joints overlapping")

    @cached_property
    def _knots(self) -> Array:
        starts = np.repeat(np.asarray(self.starts[1:], dtype=np.float64), 2)
        return np.asarray(starts + np.resize([-self.joint / 2, self.joint / 2], starts.shape))

    @property
    def _breaks(self) -> tuple[float, ...]:  # type: ignore[override]
        return tuple(self._knots)

    def _inclination(self, x: Array) -> Array:
        angle: Array = np.full(x.shape, float(self.angles[0]))
        for start, step in zip(self.starts[1:], np.diff(self.angles), strict=True):
            angle += step * np.clip((x - start) / self.joint + 0.5, 0.0, 1.0)
        return np.asarray(np.radians(angle))

    def _bend(self, x: Array) -> Array:
        kappa = np.zeros(x.shape)
        for start, step in zip(self.starts[1:], np.diff(np.radians(self.angles)), strict=True):
            half = self.joint / 2
            inside = np.heaviside(x - start + half, 0.5) - np.heaviside(x - start - half, 0.5)
            kappa -= step / self.joint * inside
        return np.asarray(kappa)


def _spread(function: Callable[[Array], Array], x: ArrayLike, y: ArrayLike) -> Array:
    """Evaluate a function of x alone on the common shape of x and y."""
    values = function(np.asarray(x, dtype=np.float64))
    return np.array(np.broadcast_to(values, np.broadcast(values, np.asarray(y)).shape))


def _check_angles(*angles: float) -> None:
    """Refuse angles that are not between -90 and 90 degrees."""
    if not all(-90 < angle < 90 for angle in angles):
        raise ValueError(f"inclinations must lie between -90 and 90 degrees, not {angles}")
