"""Terrain: the shape of the bed, as slope profiles along the arc length x."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from itertools import pairwise
from typing import ClassVar, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver.parameters import Checked, Parameter, ParameterError, parameter, parametric, shared

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

    Parameters
    ----------
    start, stop : ArrayLike
        Broadcast to one shape, which the result has; function maps arrays of any shape pointwise.
    """
    start, stop = np.broadcast_arrays(np.asarray(start, np.float64), np.asarray(stop, np.float64))
    half = (stop - start) / 2
    nodes = (start + stop)[..., None] / 2 + half[..., None] * _NODES
    return np.asarray(half * (function(nodes) @ _WEIGHTS))


class SlopeProfile(Checked):
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


INCLINATION = Parameter(meaning="inclination, positive downslope", unit="degrees", above=-90, below=90)
CURVATURE = Parameter(
    meaning="whether bed curvature adds to the normal load in the friction",
    key="curvature",
    advice="Leave it on; eqs. 4-5 are printed without it.",
)


@parametric
class Plane(SlopeProfile):
    """A plane slope.

    Raises
    ------
    ParameterError
        If the angle is not between -90 and 90.
    """

    advice: ClassVar[str] = "tests and exact solutions"

    angle: float = shared(INCLINATION)

    def _inclination(self, x: Array) -> Array:
        return np.full(x.shape, np.radians(self.angle))

    def _bend(self, x: Array) -> Array:
        return np.zeros(x.shape)


@parametric
class Bend(SlopeProfile):
    """A slope that bends into a run-out.

    With r = (x - start)/(end - start) the inclination falls as r (linear; Wang, Hutter & Pudasaini 2004) or
    as r^2 (quadratic; eq. 26 as printed).
    ``with_curvature=False`` leaves kappa out, as eqs. 4-5 print it.

    Raises
    ------
    ParameterError
        If an angle is not between -90 and 90, ``start`` is not below ``end``, or the transition is unknown.
    """

    advice: ClassVar[str] = "laboratory chutes"

    angle: float = shared(INCLINATION, meaning="inclination above the bend")
    start: float = parameter("where the bend begins", "m")
    end: float = parameter("where the bend ends, above `start`", "m")
    runout_angle: float = shared(INCLINATION, meaning="inclination below the bend", default=0.0)
    transition: Literal["linear", "quadratic"] = parameter(
        "law of the inclination in the bend",
        default="linear",
        choices={"linear": "constant curvature", "quadratic": "eq. 26 as printed"},
    )
    with_curvature: bool = shared(CURVATURE, default=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.start < self.end:
            found = f"expected a number above start ({self.start:g}), found {self.end:g}"
            raise ParameterError(found, "end", "start")

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


@parametric
class Segment(Checked):
    """One straight piece of a slope of segments."""

    start: float = parameter("where the segment begins", "m")
    angle: float = shared(INCLINATION, meaning="inclination of the segment")


@parametric
class Segments(SlopeProfile):
    """A slope of straight segments, the inclination linear over each joint.

    Raises
    ------
    ParameterError
        If there is no segment, an angle is not between -90 and 90, or joints overlap.
    """

    advice: ClassVar[str] = "slopes known by a few breaks; a joint should span several points"

    segments: tuple[Segment, ...] = parameter(
        "segments from top to bottom; the first also holds above its start", min_items=1
    )
    joint: float = parameter("length of a joint, centred on the start of each later segment", "m", above=0)
    with_curvature: bool = shared(CURVATURE, default=True)

    def __post_init__(self) -> None:
        # beds are compared, and what is known of them kept, by their values
        object.__setattr__(self, "segments", tuple(self.segments))
        super().__post_init__()
        for i, (above, below) in enumerate(pairwise(self.segments), 1):
            least = above.start + (self.joint if i > 1 else self.joint / 2)
            if not (below.start > above.start and below.start >= least):
                found = f"expected at least {least:g} (clear of the joint before), found {below.start:g}"
                raise ParameterError(found, f"segments.{i}.start", "joint")

    @property
    def starts(self) -> tuple[float, ...]:
        """Where each segment begins, m."""
        return tuple(segment.start for segment in self.segments)

    @property
    def angles(self) -> tuple[float, ...]:
        """Inclination of each segment, degrees."""
        return tuple(segment.angle for segment in self.segments)

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


PROFILES: tuple[type[SlopeProfile], ...] = (Plane, Bend, Segments)
"""Profiles given by numbers. A profile that is named here can be chosen in a scenario file."""
