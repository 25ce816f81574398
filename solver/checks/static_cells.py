"""Cells that friction holds beyond doubt."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, Protocol

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


class Neighbours(Protocol):
    """What the laws ask of the neighbours of cells; arrays are flat, (n,)."""

    def steepest(self, h: Array) -> Array:
        """Largest slope of a depth, m, to a neighbour, dimensionless."""
        ...

    def largest(self, q: Array) -> Array:
        """Largest value of a cell and its neighbours."""
        ...

    def held_around(self, holds: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Find the cells that hold and whose neighbours all do."""
        ...


class Edges(NamedTuple):
    """Pairs of neighbours: their numbers, and their distance, m, each of shape (e,)."""

    left: Indices
    right: Indices
    distance: Array

    def steepest(self, h: Array) -> Array:
        """Largest slope of a depth, m, to a neighbour, dimensionless."""
        slope = np.abs(h[self.right] - h[self.left]) / self.distance
        found = np.zeros(h.size)
        np.maximum.at(found, self.left, slope)
        np.maximum.at(found, self.right, slope)
        return found

    def largest(self, q: Array) -> Array:
        """Largest value of a cell and its neighbours."""
        found = q.copy()
        np.maximum.at(found, self.left, q[self.right])
        np.maximum.at(found, self.right, q[self.left])
        return found

    def held_around(self, holds: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Find the cells that hold and whose neighbours all do."""
        loose = ~holds
        beside = np.bincount(self.left, loose[self.right], loose.size)
        beside += np.bincount(self.right, loose[self.left], loose.size)
        return np.asarray(holds & (beside == 0))


class Rows(NamedTuple):
    """Neighbours on a lattice: its shape and its spacings, m; as `Edges`, without a list of them."""

    shape: tuple[int, int]
    dx: float
    dy: float

    def steepest(self, h: Array) -> Array:
        """Largest slope of a depth, m, to a neighbour, dimensionless."""
        depth, found = h.reshape(self.shape), np.zeros(self.shape)
        along, across = (np.abs(np.diff(depth, axis=k)) / d for k, d in ((1, self.dx), (0, self.dy)))
        for place, slope in (
            (np.s_[:, :-1], along),
            (np.s_[:, 1:], along),
            (np.s_[:-1], across),
            (np.s_[1:], across),
        ):
            np.maximum(found[place], slope, out=found[place])
        return found.ravel()

    def largest(self, q: Array) -> Array:
        """Largest value of a cell and its neighbours."""
        values, found = q.reshape(self.shape), q.reshape(self.shape).copy()
        for here, there in _pairs():
            np.maximum(found[here], values[there], out=found[here])
        return found.ravel()

    def held_around(self, holds: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Find the cells that hold and whose neighbours all do."""
        before, found = holds.reshape(self.shape), holds.reshape(self.shape).copy()
        for here, there in _pairs():
            found[here] &= before[there]
        return found.ravel()


def _pairs() -> Iterator[tuple[Any, Any]]:
    """Go through the places of cells with a neighbour to one side, and those of these neighbours."""
    for low, high in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        yield low, high
        yield high, low


def neighbours_of(points: Lattice | PointCloud) -> Neighbours:
    """Give the neighbours of the cells of a lattice, numbered row after row, or of a cloud."""
    if isinstance(points, PointCloud):
        cells = points.control_volumes
        way = cells.centroid[cells.right] - cells.centroid[cells.left]
        return Edges(cells.left, cells.right, np.hypot(*way.T))
    return Rows(points.shape, points.dx, points.dy)


def surely_held(
    state: State, neighbours: Neighbours, pressure: float, pull: Array, hold: Array
) -> NDArray[np.bool_]:
    """Find the wet cells at rest that friction holds beyond doubt, and all around them, shape (n,).

    Parameters
    ----------
    pressure : float
        Largest earth-pressure coefficient times g, m s-2.
    pull, hold : (n,) arrays
        Pull of gravity along the bed and what friction can hold, m s-2.
    """
    h = state.h.ravel()
    steepest = neighbours.steepest(h)
    holds = (state.u.ravel() == 0) & (state.v.ravel() == 0)
    holds &= (STEEPER * pressure * steepest + np.abs(pull) <= SURELY * hold) | (h == 0)
    for _ in range(RINGS):
        holds = neighbours.held_around(holds)
    return np.asarray(holds & (h > 0))
