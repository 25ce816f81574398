"""Exact solutions that the scheme is measured on, as functions of place and time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from solver.physics.constants import GRAVITY
from solver.physics.friction import friction_coefficient

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FrictionlessCap:
    """Parabolic cap on a frictionless plane with K = 1 (Hutter et al. 1993 with delta = 0).

    The round cap stays round: p = q = sqrt(1 + 2 B t*^2).

    Parameters
    ----------
    angle : float
        Inclination, degrees.
    height, radius : float
        Depth at the centre and radius of the base, m.
    gravity : float
        m s-2.
    """

    angle: float = 35.0
    height: float = 4.0
    radius: float = 80.0
    gravity: float = GRAVITY

    def __call__(self, x: ArrayLike, y: ArrayLike, time: float) -> tuple[Array, Array, Array]:
        """Depth (m) and velocity (m s-1) at points x, y (m) and a time (s); velocity 0 where dry."""
        along, across = np.asarray(x, float), np.asarray(y, float)
        rate = np.sqrt(self.gravity / self.radius)
        b = 2 * self.height / self.radius * np.cos(np.radians(self.angle))
        p = np.sqrt(1 + b * (time * rate) ** 2)
        growth = b * time * rate**2 / p**2
        pull = self.gravity * np.sin(np.radians(self.angle))
        along = along - pull * time**2 / 2
        depth = np.maximum(0, self.height / p**2 * (1 - (along**2 + across**2) / (self.radius * p) ** 2))
        wet = depth > 0
        return depth, wet * (pull * time + growth * along), wet * growth * across


@dataclass(frozen=True)
class DamBreak:
    """Granular dam break on a plane, K = 1, delta <= xi (Mangeney et al. 2000); Ritter's where both are 0.

    Parameters
    ----------
    angle, bed_friction : float
        Inclination and friction angle, degrees.
    depth : float
        Depth behind the dam, which stands at x = 0, m.
    gravity : float
        m s-2.
    """

    angle: float = 22.0
    bed_friction: float = 21.0
    depth: float = 1.0
    gravity: float = GRAVITY

    def __call__(self, x: ArrayLike, time: float) -> tuple[Array, Array]:
        """Depth (m) and velocity (m s-1) at x (m) and a time (s) above 0; velocity 0 where dry."""
        x = np.asarray(x, float)
        xi = np.radians(self.angle)
        pull = self.gravity * (np.sin(xi) - np.cos(xi) * friction_coefficient(self.bed_friction))
        c = np.sqrt(self.gravity * np.cos(xi) * self.depth)
        place = np.clip(x - pull * time**2 / 2, -c * time, 2 * c * time)
        depth = (2 * c - place / time) ** 2 / (9 * self.gravity * np.cos(xi))
        return depth, np.where(depth > 0, 2 / 3 * (c + place / time) + pull * time, 0.0)


@dataclass(frozen=True)
class WetDamBreak:
    """Stoker's dam break onto a layer at rest, flat and frictionless, K = 1.

    Parameters
    ----------
    depth, ahead : float
        Depth behind the dam at x = 0 and ahead of it, m.
    gravity : float
        m s-2.
    """

    depth: float = 1.0
    ahead: float = 0.2
    gravity: float = GRAVITY

    def __call__(self, x: ArrayLike, time: float) -> tuple[Array, Array]:
        """Depth (m) and velocity (m s-1) at x (m) and a time (s) above 0."""
        x = np.asarray(x, float)
        g, c = self.gravity, np.sqrt(self.gravity * self.depth)

        def mismatch(middle: float) -> float:
            behind_shock = (middle - self.ahead) * np.sqrt(
                g * (middle + self.ahead) / (2 * middle * self.ahead)
            )
            return float(2 * (c - np.sqrt(g * middle)) - behind_shock)

        middle = brentq(mismatch, self.ahead, self.depth, xtol=1e-15)
        u = 2 * (c - np.sqrt(g * middle))
        shock = u * middle / (middle - self.ahead)
        s = x / time
        fan = s < u - np.sqrt(g * middle)
        depth = np.where(
            fan, (2 * c - np.maximum(s, -c)) ** 2 / (9 * g), np.where(s < shock, middle, self.ahead)
        )
        return depth, np.where(fan, 2 / 3 * (c + np.maximum(s, -c)), np.where(s < shock, u, 0.0))


@dataclass(frozen=True)
class ParabolicCap:
    """Parabolic cap that does not vary across the bed, sliding with friction (Savage & Hutter 1989).

    Exact while the rear moves down: ``pull > 2 beta height / half_length`` with K = 1.

    Parameters
    ----------
    angle, bed_friction : float
        Degrees.
    height, half_length : float
        m.
    gravity : float
        m s-2.
    """

    angle: float = 35.0
    bed_friction: float = 20.0
    height: float = 1.0
    half_length: float = 20.0
    gravity: float = GRAVITY

    def __call__(self, x: ArrayLike, time: float) -> tuple[Array, Array]:
        """Depth (m) and velocity (m s-1) at x (m from the first centre) and a time (s)."""
        place = np.asarray(x, float)
        xi = np.radians(self.angle)
        pull = self.gravity * (np.sin(xi) - np.cos(xi) * friction_coefficient(self.bed_friction))
        spread = 2 * self.gravity * np.cos(xi) * self.height / self.half_length**2
        stretch, rate = 1.0, 0.0
        if time > 0:
            path = solve_ivp(
                lambda _, s: (s[1], spread / s[0] ** 2), (0, time), (1, 0), rtol=1e-11, atol=1e-12
            )
            stretch, rate = path.y[:, -1]
        place = place - pull * time**2 / 2
        depth = np.maximum(0, self.height / stretch * (1 - (place / (self.half_length * stretch)) ** 2))
        return depth, np.where(depth > 0, pull * time + place * rate / stretch, 0.0)


@dataclass(frozen=True)
class TravellingShock:
    """Granular shock moving up a slope at the friction angle (Gray, Tai & Noelle 2003), K = 1.

    Parameters
    ----------
    upstream, downstream : float
        Depth of the layer that arrives and of the one at rest, m.
    angle : float
        Inclination and friction angle, degrees.
    gravity : float
        m s-2.
    """

    upstream: float = 0.3
    downstream: float = 1.0
    angle: float = 30.0
    gravity: float = GRAVITY

    @property
    def arriving(self) -> float:
        """Velocity of the upstream layer, m s-1."""
        h1, h2 = self.upstream, self.downstream
        beta = self.gravity * np.cos(np.radians(self.angle))
        return float((h2 - h1) * np.sqrt(beta * (h1 + h2) / (2 * h1 * h2)))

    @property
    def speed(self) -> float:
        """Velocity of the shock, m s-1; negative is upslope."""
        return -self.upstream * self.arriving / (self.downstream - self.upstream)

    def __call__(self, x: ArrayLike, time: float) -> tuple[Array, Array]:
        """Depth (m) and velocity (m s-1) at x (m from the initial shock) and a time (s)."""
        behind = np.asarray(x, float) < self.speed * time
        return np.where(behind, self.upstream, self.downstream), np.where(behind, self.arriving, 0.0)


def cell_means(function: object, points: Array, width: float, time: float, samples: int = 32) -> Array:
    """Mean of ``function(x, time)[0]`` over cells of a width (m) at points (n,), by the midpoint rule."""
    offsets = ((np.arange(samples) + 0.5) / samples - 0.5) * width
    values = function(points[:, None] + offsets, time)[0]  # type: ignore[operator]
    return np.asarray(values.mean(axis=1), dtype=np.float64)
