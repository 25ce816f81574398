"""Cells that friction holds beyond doubt."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.checks.states import State
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice

# What friction holds beyond doubt: slopes so many times as steep would stay below this share of its limit.
STEEPER, SURELY = 3.0, 0.95
# Rings of neighbours that have to be held too: what a reconstruction and its slopes may see.
RINGS = 3


class Edges(NamedTuple):
    """Pairs of neighbours: their numbers, and their distance, m, each of shape (e,)."""

    left: Indices
    right: Indices
    distance: Array


def edges_of(points: Lattice | PointCloud) -> Edges:
    """List the pairs of neighbours of a lattice, numbered row after row, or of a cloud."""
    if isinstance(points, PointCloud):
        cells = points.control_volumes
        way = cells.centroid[cells.right] - cells.centroid[cells.left]
        return Edges(cells.left, cells.right, np.hypot(*way.T))
    number = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape)
    left = np.concatenate([number[:, :-1].ravel(), number[:-1].ravel()])
    right = np.concatenate([number[:, 1:].ravel(), number[1:].ravel()])
    return Edges(left, right, np.repeat([points.dx, points.dy], [number[:, 1:].size, number[1:].size]))


def surely_held(state: State, edges: Edges, pressure: float, pull: Array, hold: Array) -> NDArray[np.bool_]:
    """Find the wet cells at rest that friction holds beyond doubt, and all around them, shape (n,).

    Parameters
    ----------
    pressure : float
        Largest earth-pressure coefficient times g, m s-2.
    pull, hold : (n,) arrays
        Pull of gravity along the bed and what friction can hold, m s-2.
    """
    h = state.h.ravel()
    slope = np.abs(h[edges.right] - h[edges.left]) / edges.distance
    steepest = np.zeros(h.size)
    np.maximum.at(steepest, edges.left, slope)
    np.maximum.at(steepest, edges.right, slope)
    holds = (state.u.ravel() == 0) & (state.v.ravel() == 0)
    holds &= (STEEPER * pressure * steepest + np.abs(pull) <= SURELY * hold) | (h == 0)
    for _ in range(RINGS):
        loose = ~holds
        holds &= np.bincount(edges.left, loose[edges.right], h.size) == 0
        holds &= np.bincount(edges.right, loose[edges.left], h.size) == 0
    return np.asarray(holds & (h > 0))
