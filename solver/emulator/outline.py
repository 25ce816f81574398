"""Measures of an outline: a few numbers that say how far, how wide and where."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

Array = NDArray[np.float64]
MEASURES = ("area", "centroid_x", "centroid_y", "spread_x", "spread_y", "first_x", "last_x", "width")


def measures(covered: NDArray[np.bool_], y: Array, x: Array) -> dict[str, Array]:
    """Measure outlines on a lattice.

    Parameters
    ----------
    covered : array of bool, shape (runs, ny, nx)
        Cells within each outline.
    y, x : array, shapes (ny,) and (nx,)
        Coordinates of the points, m.

    Returns
    -------
    dict of str to array
        By name of `MEASURES`, shape (runs,): area, m2; centre, standard deviation about it, first and last
        covered point along x and extent along y, m. NaN of an outline that holds no cell.
    """
    along, across = (covered.sum(axis=axis).astype(np.float64) for axis in (1, 2))
    count = along.sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        centres = along @ x / count, across @ y / count
        squares = along @ x**2 / count, across @ y**2 / count
    spreads = (
        np.sqrt(np.maximum(square - centre**2, 0)) for square, centre in zip(squares, centres, strict=True)
    )
    spread_x, spread_y = spreads
    held_x, held_y = along > 0, across > 0
    some = count > 0
    ends = [
        np.where(some, axis[np.where(some, pick, 0)], np.nan)
        for axis, pick in (
            (x, held_x.argmax(axis=1)),
            (x[::-1], held_x[:, ::-1].argmax(axis=1)),
            (y, held_y.argmax(axis=1)),
            (y[::-1], held_y[:, ::-1].argmax(axis=1)),
        )
    ]
    cell = float(np.diff(x).mean() * np.diff(y).mean())
    values = (
        *(np.where(some, count * cell, np.nan), *centres, spread_x, spread_y),
        *(ends[0], ends[1], ends[3] - ends[2]),
    )
    return dict(zip(MEASURES, values, strict=True))


def moved(covered: NDArray[np.bool_], y: Array, x: Array, by: float) -> NDArray[np.bool_]:
    """Move an outline outward by a distance, m, or inward where it is negative, shape (ny, nx)."""
    spacing = float(np.diff(y).mean()), float(np.diff(x).mean())
    if by >= 0:
        found: NDArray[np.bool_] = distance_transform_edt(~covered, sampling=spacing) <= by
        return found
    return np.asarray(distance_transform_edt(covered, sampling=spacing) > -by)
