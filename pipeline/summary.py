"""What a run comes down to: extent and reach of its deposit, and its peaks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solver.lattice import Lattice

Array = NDArray[np.float64]


def summarise(
    lattice: Lattice,
    elevation: Array,
    horizontal_distance: Array,
    release_depth: Array,
    deposit_depth: Array,
    max_depth: Array,
    max_speed: Array,
    threshold: float,
) -> dict[str, float]:
    """Summaries of a run, by name of variable.

    The deposit is where its depth is above the threshold; its places are those of the points. The crown is
    the highest point the release covers, the toe the deposit's point of largest arc length.

    Parameters
    ----------
    lattice : Lattice
        The points.
    elevation, horizontal_distance : array, shape (nx,)
        Profile of the bed at the points along it, m.
    release_depth, deposit_depth, max_depth : array, shape (ny, nx)
        Depth at the start, in the last state, and the largest over all time steps, m.
    max_speed : array, shape (ny, nx)
        Largest speed over all time steps, m s-1.
    threshold : float
        Depth above which a cell belongs to the deposit, m.

    Returns
    -------
    dict of str to float
        The summaries of ``pipeline.variables``; those of a deposit that is not there are NaN, its area and
        volume 0.
    """
    x, y = lattice.x_points, lattice.y_points
    peaks = {"peak_depth": float(np.max(max_depth)), "peak_speed": float(np.max(max_speed))}
    covered = deposit_depth > threshold
    depth = np.where(covered, deposit_depth, 0.0)
    volume = float(depth.sum()) * lattice.cell_area
    extent = {"deposit_area": float(covered.sum()) * lattice.cell_area, "deposit_volume": volume}
    columns, rows = np.flatnonzero(covered.any(axis=0)), np.flatnonzero(covered.any(axis=1))
    if not columns.size:
        return extent | peaks
    tail, toe = columns[0], columns[-1]
    extent |= {
        "front_x": float(x[toe]),
        "tail_x": float(x[tail]),
        "deposit_length": float(x[toe] - x[tail]),
        "deposit_width": float(y[rows[-1]] - y[rows[0]]),
        "deposit_max_depth": float(depth.max()),
        "deposit_centroid_x": float((depth.sum(axis=0) * x).sum()) * lattice.cell_area / volume,
    }
    release = np.flatnonzero((release_depth > 0).any(axis=0))
    if not release.size:
        return extent | peaks
    crown = release[np.argmax(elevation[release])]
    runout = float(horizontal_distance[toe] - horizontal_distance[crown])
    drop = float(elevation[crown] - elevation[toe])
    reach = {
        "runout_distance": runout,
        "drop_height": drop,
        "reach_angle": float(np.degrees(np.arctan2(drop, runout))),
    }
    return extent | reach | peaks
