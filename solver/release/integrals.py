"""Integrals of a release's depth over cells; over polygons edge by edge, so that volume adds up exactly."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
# Parts this small are round-off of a side on a cell edge, or of a cell outside.
SLIVER = 1e-12


def round_integral(mean: Callable[[Array], Array], start: Array, end: Array) -> Array:
    """Integrate a round depth over the triangles between the centre and edges, positive anticlockwise.

    With the integral ``G(q) = q mean(q)`` of depth over the distance, q its square, an edge at the distance d
    from the centre gives ``d int mean(d^2 + s^2) ds`` along itself within the unit circle, and ``G(1)`` times
    the angle outside it.

    Parameters
    ----------
    mean : function
        ``int_0^r h(t^2) t dt / r^2`` as a function of r^2 in 0..1, m.
    start, end : (e, 2) array
        Ends of the edges, in units in which the base is the unit circle around the origin.

    Returns
    -------
    (e,) array
        Volumes in those units, m.
    """
    way = end - start
    length = np.hypot(*way.T)
    unit = way / np.where(length > 0, length, 1.0)[:, None]
    distance = start[:, 0] * unit[:, 1] - start[:, 1] * unit[:, 0]
    foot = start - (start * unit).sum(axis=1)[:, None] * unit
    low, high = (start * unit).sum(axis=1), (end * unit).sum(axis=1)
    half_chord = np.sqrt(np.maximum(0.0, 1.0 - distance**2))
    enters, leaves = (np.clip(s, -half_chord, half_chord) for s in (low, high))
    total = np.zeros(len(start))
    for outer, inner, sign in ((low, enters, 1.0), (high, leaves, -1.0)):
        a, b = foot + outer[:, None] * unit, foot + inner[:, None] * unit
        turned = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))
        total += sign * np.where(outer != inner, turned, 0.0)
    total *= mean(np.ones(1))[0]
    # in the angle whose sine is the place on the chord a depth that ends like a root is smooth
    chord = np.where(half_chord > 0, half_chord, 1.0)
    first, last = (np.arcsin(np.clip(s / chord, -1.0, 1.0)) for s in (enters, leaves))
    angle = ((first + last) + (last - first) * NODES[:, None]) / 2
    square = np.minimum(1.0, distance**2 + (chord * np.sin(angle)) ** 2)
    inside = WEIGHTS @ (mean(square) * np.cos(angle)) * chord * (last - first) / 2
    return np.asarray(total + distance * inside)


def box_integral(x: tuple[float, float], y: tuple[float, float], start: Array, end: Array) -> Array:
    """Integrate 1 over the part of the box ``x`` by ``y`` between edges (e, 2) and its left side, m2.

    An edge that rises in y counts positive, so that the edges around a polygon, anticlockwise, give the area
    that it shares with the box.
    """
    rise = end[:, 1] - start[:, 1]
    steep = np.where(rise != 0, rise, 1.0)
    t = np.clip([(bound - start[:, 1]) / steep for bound in y], 0.0, 1.0)
    t = np.where(rise != 0, np.sort(t, axis=0), 0.0)
    run = end[:, 0] - start[:, 0]
    slanted = np.where(run != 0, run, 1.0)
    breaks = np.where(run != 0, [(bound - start[:, 0]) / slanted for bound in x], 0.0)
    places = np.array([t[0], *np.clip(np.sort(breaks, axis=0), *t), t[1]])
    widths = np.clip(start[:, 0] + places * run, *x) - x[0]
    return np.asarray(((widths[1:] + widths[:-1]) / 2 * np.diff(places, axis=0)).sum(axis=0) * rise)


def covered(sides: tuple[float, float], points: Array, spacing: float) -> Array:
    """Part of each cell of one direction that lies between two sides, shape of ``points``."""
    below, above = points - spacing / 2, points + spacing / 2
    low = min(sides[0], below[0]) if sides[0] <= points[0] else sides[0]
    high = max(sides[1], above[-1]) if sides[1] >= points[-1] else sides[1]
    bare = (np.maximum(0.0, low - below) + np.maximum(0.0, above - high)) / spacing
    bare = np.where(bare < SLIVER, 0.0, np.where(bare > 1.0 - SLIVER, 1.0, bare))
    return np.asarray(1.0 - bare)
