"""The record of maxima over all time steps."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.runge_kutta import Progress
from solver.kernels.state import Fields


class Record(NamedTuple):
    """Over all time steps, flat arrays of the lattice without ghosts.

    Attributes
    ----------
    depth
        Largest, m.
    speed_squared
        Largest |u|^2, m2 s-2.
    momentum_flux
        Largest h |u|^2, m3 s-2.
    arrival
        First time with depth above the arrival depth, s, NaN before.
    """

    depth: Array
    speed_squared: Array
    momentum_flux: Array
    arrival: Array


@kernel(fastmath=False, unaliased=True)
def record_run(
    now: Fields, cell: int, count: int, dry: float, threshold: float, time: float, record: Record, to: int
) -> bool:
    """Update the maxima of a run of cells; say whether all values are finite. A dry cell has no speed.

    Parameters
    ----------
    cell, count : int
        Index of the first cell, and number of cells.
    dry, threshold : float
        Depths up to which a cell counts as dry and as not reached, m.
    time : float
        Time reached, s.
    to : int
        Index of the first cell in the record.
    """
    bad = 0
    for k in range(count):
        i, o = np.uint64(cell) + np.uint64(k), np.uint64(to) + np.uint64(k)
        h = now.h[i]
        square = now.u[i] * now.u[i] + now.v[i] * now.v[i]
        flux = h * square
        bad |= 1 if flux - flux != 0.0 else 0
        square, flux = square if h > dry else 0.0, flux if h > dry else 0.0
        record.depth[o] = h if h > record.depth[o] else record.depth[o]
        record.speed_squared[o] = square if square > record.speed_squared[o] else record.speed_squared[o]
        record.momentum_flux[o] = flux if flux > record.momentum_flux[o] else record.momentum_flux[o]
        record.arrival[o] = (
            time if (h > threshold) & (record.arrival[o] != record.arrival[o]) else record.arrival[o]
        )
    return bad == 0


@kernel(fastmath=False, from_python=True)
def record_cells(
    now: Fields,
    start: int,
    stop: int,
    dry: float,
    threshold: float,
    record: Record,
    progress: Progress,
) -> bool:
    """Update the maxima of a run of cells; say whether all values are finite, or note the cell of one.

    Parameters
    ----------
    start, stop : int
        The cells.
    dry, threshold : float
        As of `record_run`.
    """
    if record_run(now, start, stop - start, dry, threshold, progress.time[0], record, start):
        return True
    for i in range(start, stop):
        if not math.isfinite(now.h[i] * (now.u[i] ** 2 + now.v[i] ** 2)):
            progress.place[0] = i
            break
    return False
