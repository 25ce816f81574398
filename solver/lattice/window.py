"""The part of a lattice that a run computes: near the flow, of a symmetric scene no more than it needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.kernels.state import AXIS, EVEN, GHOSTS, MIDLINE, OPEN, WALL, Sides

# A half needs as many rows beside the axis as it has ghosts.
LEAST_ROWS = 2 * GHOSTS + 1


class Window(NamedTuple):
    """The part of a lattice that a run has arrays of: rows and columns, half-open."""

    south: int
    north: int
    west: int
    east: int

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns."""
        return self.north - self.south, self.east - self.west

    @property
    def cut(self) -> tuple[slice, slice]:
        """The window as slices of an array of the lattice."""
        return slice(self.south, self.north), slice(self.west, self.east)

    def grown(self, by: tuple[int, int, int, int], most: Window) -> Window:
        """Move the sides outward by so many rows and columns, within another window."""
        south, north, west, east = by
        return Window(
            max(self.south - south, most.south),
            min(self.north + north, most.north),
            max(self.west - west, most.west),
            min(self.east + east, most.east),
        )


@dataclass(frozen=True)
class Part:
    """What has to be computed of a lattice of a shape (ny, nx).

    Attributes
    ----------
    kind
        The whole; the half of larger y of a scene that is its own mirror image across the slope; one row of a
        scene that does not vary across the slope.
    """

    shape: tuple[int, int]
    kind: Literal["whole", "half", "row"] = "whole"

    @property
    def room(self) -> Window:
        """The rows and columns of the part."""
        ny, nx = self.shape
        return Window(ny // 2 if self.kind == "half" else 0, 1 if self.kind == "row" else ny, 0, nx)

    @property
    def rows(self) -> int:
        """Rows of the lattice that a row stands for in volumes; those of a half are counted by `images`."""
        return self.shape[0] if self.kind == "row" else 1

    def sides(self, kinds: Indices) -> Indices:
        """Kinds of the sides of the part, shape (4,), where those of the lattice are ``kinds``."""
        kinds = kinds.copy()
        if self.kind == "half":
            kinds[2] = AXIS if self.shape[0] % 2 else MIDLINE
        if self.kind == "row":
            kinds[2:] = EVEN
        return kinds

    def expanded(self, values: Array, window: Window, outside: float, image: float = 1.0) -> Array:
        """Give values of a window to the lattice, shape (ny, nx), and times ``image`` to a mirror image."""
        whole = np.full(self.shape, outside)
        # zeros without a sign, so that the same result has the same bytes
        whole[window.cut] = values.reshape(window.shape) + 0.0
        if self.kind == "half":
            half, columns = len(whole) // 2, slice(window.west, window.east)
            whole[:half, columns] = image * whole[-half:, columns][::-1] + 0.0
        if self.kind == "row":
            whole[:] = whole[0]
        return whole


def needed(state: tuple[Array, ...], sides: Sides) -> Part:
    """Find what has to be computed of a scene.

    Parameters
    ----------
    state : tuple of (ny, nx) array
        Initial depth and velocity, and whatever else the flow depends on that has no direction.
    sides : Sides
        What stands at the sides of the lattice.
    """
    h, u, v, *others = state
    ny, nx = h.shape
    same = sides.kind[2] == sides.kind[3] and sides.depth[2] == sides.depth[3]
    if (
        not v.any()
        and np.isin(sides.kind[2:], (OPEN, WALL)).all()
        and (h == h[0]).all()
        and (u == u[0]).all()
        and all((a == a[0]).all() for a in others)
    ):
        return Part((ny, nx), "row")
    if (
        same
        and ny >= LEAST_ROWS
        and all(np.array_equal(a, b[::-1]) for a, b in ((h, h), (u, u), (v, -v), *((a, a) for a in others)))
    ):
        return Part((ny, nx), "half")
    return Part((ny, nx))


def around(filled: NDArray[np.bool_], room: Window, margin: int) -> Window:
    """Give the window around filled cells (ny, nx) and a margin, or around one cell where all is dry."""
    filled = filled[room.cut]
    rows, columns = np.flatnonzero(filled.any(axis=1)), np.flatnonzero(filled.any(axis=0))
    south, west = room.south, room.west
    tight = Window(south, south + 1, west, west + 1)
    if rows.size:
        tight = Window(
            south + int(rows[0]),
            south + int(rows[-1]) + 1,
            west + int(columns[0]),
            west + int(columns[-1]) + 1,
        )
    return tight.grown((margin,) * 4, room)
