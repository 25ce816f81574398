"""Inflows and measured sections in the arrays of a window."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.inflow.entrance import Entrance
from solver.inflow.hydrograph_kernels import graphs_of
from solver.inflow.placement import Placed
from solver.kernels.sections.inflow import HIGH_X, HIGH_Y, LOW_X, LOW_Y, Inflows
from solver.kernels.sections.measured import Sections, begun
from solver.kernels.state import GHOSTS
from solver.lattice.window import Window


class Doors(NamedTuple):
    """The faces of all inflows in a window, each array of shape (n,), sorted by cell.

    Parameters
    ----------
    row, column, cell : array
        Padded row and column and index of the cell that flow comes into.
    side : array
        Of the cell.
    section : array
        Number of the inflow.
    sign : array
        1 where flow comes in toward the high side, else -1.
    direction : array
        Components of it in plan, (2, n).
    width, bottom, slant : array
        As in `Inflows`.
    """

    row: Indices
    column: Indices
    cell: Indices
    side: Indices
    section: Indices
    sign: Array
    direction: Array
    width: Array
    bottom: Array
    slant: Array

    @property
    def along_x(self) -> NDArray[np.bool_]:
        """Whether flow comes in along x, shape (n,)."""
        return np.asarray(self.side <= HIGH_X)


class Geometry(NamedTuple):
    """What fluxes and velocities are at doors; see `Inflows`."""

    along: Array
    across: Array
    own: Array
    length: Array
    edge: Array
    room: Array
    beta: Array
    rate: Array
    falling: Array


def doors_of(entrances: Sequence[Entrance], window: Window, stride: int) -> Doors:
    """Find the doors of a window, which holds all of them; ``stride`` is the length of its padded rows."""
    found = []
    for k, each in enumerate(entrances):
        placed = each.placed
        assert isinstance(placed, Placed)
        row, column = placed.downstream
        side = np.where(
            placed.along_x,
            np.where(placed.sign > 0, LOW_X, HIGH_X),
            np.where(placed.sign > 0, LOW_Y, HIGH_Y),
        )
        j, i = row - window.south + GHOSTS, column - window.west + GHOSTS
        ones = np.ones(len(row))
        found.append(
            (
                *(j, i, j * stride + i, side, np.full(len(row), k), placed.sign),
                *(placed.direction[0] * ones, placed.direction[1] * ones),
                *(placed.width, placed.bottom, each.slant * ones),
            )
        )
    columns = [np.concatenate(each) for each in zip(*found, strict=True)]
    order = np.lexsort((columns[3], columns[2]))
    row, column, cell, side, section, sign, x, y, *rest = (each[order] for each in columns)
    width, bottom, slant = rest
    direction = np.stack([x, y])
    return Doors(row, column, cell, side, section, sign.astype(float), direction, width, bottom, slant)


def inflows_of(entrances: Sequence[Entrance], doors: Doors, rows: int, geometry: Geometry) -> Inflows:
    """Give inflows to the kernels; ``rows`` is the number of padded rows."""
    n = len(doors.cell)
    flux_row = doors.row - (doors.side == LOW_Y)
    order = np.argsort(flux_row, kind="stable")
    return Inflows(
        first=np.searchsorted(doors.row, np.arange(rows + 1)),
        closed=np.searchsorted(flux_row[order], np.arange(rows + 1)),
        order=order,
        cell=doors.cell,
        column=doors.column,
        side=doors.side,
        section=doors.section,
        sign=doors.sign,
        width=doors.width,
        bottom=doors.bottom,
        slant=doors.slant,
        **geometry._asdict(),
        mass=np.zeros(n),
        depth=np.zeros(n),
        speed=np.zeros(n),
        **graphs_of(entrances),
        before=np.zeros((4, n)),
    )


def sections_of(
    gauges: Sequence[Placed],
    times: Array,
    window: Window,
    sizes: tuple[float, float],
    before: Sections,
) -> Sections:
    """Give sections to the kernels.

    Parameters
    ----------
    times : (n,) array
        Times of samples, s.
    window : Window
        The part of the lattice that there are arrays of; nothing passes faces outside of it.
    sizes : tuple of float
        What a flux of mass along x and along y is multiplied by for a discharge.
    before : Sections
        What has been measured so far; without sections on the first call.
    """
    along_x, row, column, sign, section = (
        np.concatenate([getattr(each, name) for each in gauges])
        if name
        else np.repeat(np.arange(len(gauges)), [len(each.row) for each in gauges])
        for name in ("along_x", "row", "column", "sign", "")
    )
    # fluxes between a row and the next are found with the lower one
    row = row - window.south + GHOSTS - 1 * ~along_x
    column = column - window.west + GHOSTS
    rows, columns = (stop - start + 2 * GHOSTS for start, stop in (window[:2], window[2:]))
    inside = (row >= GHOSTS - 1 * ~along_x) & (row < rows - GHOSTS)
    inside &= (column >= GHOSTS) & (column < columns - GHOSTS + along_x)
    order = np.flatnonzero(inside)
    order = order[np.argsort(row[order], kind="stable")]
    weight = sign * np.where(along_x, *sizes)
    held = before if len(before.volume) == len(gauges) else begun(len(gauges), times)
    return held._replace(
        first=np.searchsorted(row[order], np.arange(rows + 1)),
        along_x=along_x[order].astype(np.int64),
        column=column[order],
        section=section[order].astype(np.int64),
        weight=weight[order].astype(float),
    )
